"""Plans driven by vehicles and residuals that are drawn anew, each of them along every link."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from energy.chain.chain import DriveSettings
from energy.chain.sampling import STANDARD_SAMPLING, residual_fracs, sampled_vehicles, sampling_of
from energy.chain.uncertainty import driven_by
from energy.units import JOULE_PER_WH
from routing.charging.plan import ChargingQuery, Plan
from routing.graph.road_graph import RoadGraph
from routing.links.spans import ChainMaker
from routing.queries import RouteQuery


def kept_drives(
    graph: RoadGraph,
    query: RouteQuery,
    charging: ChargingQuery,
    plan: Plan,
    drives: int,
    seed: int,
    *,
    halts: bool = False,
) -> NDArray[np.bool_]:
    """Whether each drive arrives with what was asked and is never below the reserve, (legs, drives).

    Every drive is that of a vehicle of its own, drawn by the seed, and of one residual. Stations charge up to what the
    plan says; who arrives with more leaves with more. A fixed stay charges the same whatever the charge on arrival.
    halts: whether each drive halts at each crossing or does not, by its probability, instead of by expectation, on top
    of the residual, which holds that already.
    """
    vehicles = sampled_vehicles(query.vehicle, drives, seed)
    residual = residual_fracs(drives, seed, sampling_of(query.vehicle, STANDARD_SAMPLING).residual_sd_frac)
    capacity_j = np.array([vehicle.usable_capacity_wh for vehicle in vehicles]) * JOULE_PER_WH
    spans = [span for leg in plan.legs for span in leg.spans]
    spans[-1] = replace(spans[-1], rest=False)
    sizes = [len(leg.spans) for leg in plan.legs]
    caps = [leg.speed_cap_mps for leg in plan.legs]
    energy_j = np.empty((drives, len(spans)))
    for cap in dict.fromkeys(caps):
        conditions = query.conditions if cap is None else replace(query.conditions, top_speed_mps=cap)
        chain = ChainMaker(graph).chain(tuple(spans), query.stop_settings, conditions)
        drive = DriveSettings(conditions, query.link_model, query.stop_rule)
        if halts:
            rng = np.random.default_rng(seed)
            p = chain.stop_probability_frac
            chains = [replace(chain, stop_probability_frac=(rng.random(p.size) < p).astype(float)) for _ in vehicles]
            rows = [row for of, own in zip(vehicles, chains, strict=True) for row in driven_by((of,), own, drive)]
        else:
            rows = list(driven_by(vehicles, chain, drive))
        under = np.concatenate([row[1] for row in rows])
        under += residual[:, None] * np.concatenate([row[2] for row in rows])
        capped = np.repeat([other == cap for other in caps], sizes)
        energy_j[:, capped] = under[:, capped]
    kept = np.empty((len(plan.legs), drives), np.bool_)
    soc = np.zeros(drives)
    link = 0
    for k, leg in enumerate(plan.legs):
        stop = plan.stops[k - 1] if k > 0 else None
        if stop is not None and stop.station is None:
            soc = np.minimum(soc + stop.mean_power_w * (stop.depart_s - stop.arrive_s) / capacity_j, 1.0)
        else:
            soc = np.maximum(soc, leg.soc_start_frac)
        lowest = soc.copy()
        for _ in leg.spans:
            soc = np.minimum(soc - energy_j[:, link] / capacity_j, 1.0)
            lowest = np.minimum(lowest, soc)
            link += 1
        asked = charging.goal_soc_frac
        if k < len(plan.stops):
            charges = plan.stops[k].station is not None or plan.stops[k].mean_power_w > 0.0
            asked = charging.arrive_soc_frac if charges else query.reserve_soc_frac
        kept[k] = (soc >= asked - 1e-9) & (lowest >= query.reserve_soc_frac - 1e-9)
    return kept


def promised(plan: Plan) -> list[float]:
    """What a plan promises of each of its legs."""
    found = [stop.kept_probability_frac for stop in plan.stops] + [plan.goal_kept_probability_frac]
    assert all(share is not None for share in found)
    return [share for share in found if share is not None]
