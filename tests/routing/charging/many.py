"""Many drawn worlds and station graphs: `python -m tests.routing.charging.many [WORLDS] [PLANS] [SEED]`.

Prints what differs from the best of everything tried, and which plans break a rule; ends with 1 where any does.
"""

from __future__ import annotations

import math
import sys
import time

from tests.routing.charging.networks import unmet_properties
from tests.routing.charging.worlds import drawn_world, least_cost

EQUAL_FRAC = 1e-6


def differing_worlds(count: int, seed: int) -> tuple[dict[str, int], float, list[int]]:
    """Worlds by the number of stops of their best plan, the greatest difference, and the seeds of those that differ."""
    stops: dict[str, int] = {}
    greatest, differ = 0.0, []
    for at in range(seed, seed + count):
        world = drawn_world(at)
        answer = world.planner().plan(world.query, world.charging, world.vehicle_charging, world.stations, world.places)
        least = least_cost(world)
        if not answer.plans:
            kind, off = "no plan", 0.0 if least == math.inf else math.inf
        else:
            plan = answer.plans[0]
            kind = f"{sum(stop.station is not None for stop in plan.stops)} stops"
            off = abs(plan.objective - least) / abs(least) if math.isfinite(least) else math.inf
            if plan.short_by != 0.0:
                kind += ", not proven"
        stops[kind] = stops.get(kind, 0) + 1
        greatest = max(greatest, off)
        if off > EQUAL_FRAC:
            differ.append(at)
    return stops, greatest, differ


def broken_plans(count: int, seed: int) -> tuple[int, list[str]]:
    """At least so many plans over drawn station graphs, and the rules that they break."""
    plans, found = 0, []
    while plans < count:
        made, unmet = unmet_properties(seed)
        plans += made
        found += [f"{seed}: {text}" for text in unmet]
        seed += 1
    return plans, found


def main(arguments: list[str]) -> int:
    worlds, plans, seed = ([int(argument) for argument in arguments] + [200, 5000, 0][len(arguments) :])[:3]
    began = time.perf_counter()
    stops, greatest, differ = differing_worlds(worlds, seed)
    print(f"{worlds} worlds in {time.perf_counter() - began:.0f} s: {dict(sorted(stops.items()))}")
    print(f"greatest difference from everything tried: {greatest:.2e}; differing seeds: {differ or 'none'}")
    began = time.perf_counter()
    made, broken = broken_plans(plans, seed)
    print(f"{made} plans over station graphs in {time.perf_counter() - began:.0f} s: {len(broken)} broken rules")
    print("\n".join(broken[:20]))
    return 1 if differ or broken else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
