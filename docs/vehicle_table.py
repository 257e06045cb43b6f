"""The tables of docs/vehicles.md, computed from data/vehicles; run as `python docs/vehicle_table.py` to renew them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

from energy.units import JOULE_PER_M_PER_KWH_PER_100KM, KMH_PER_MPS
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import AnyVehicle, load_published, load_vehicles
from energy.vehicle.self_check import BAND, CycleCheck, CycleName, SelfCheck, self_check
from energy.vehicle.vehicle import Powertrain

DOCS: Final = Path(__file__).resolve().parent
VEHICLES: Final = DOCS.parent / "data" / "vehicles"
SPEEDS_KMH: Final = (50, 90, 110, 130)
CYCLES: Final[tuple[CycleName, ...]] = ("udds", "hwfet")
ABSENT: Final = "–"


def steady_kwh_per_100km(vehicle: AnyVehicle, speed_kmh: float) -> float:
    """Consumption at constant speed on the flat [kWh/100 km], equations (1), (4) and (5) with a = θ = 0."""
    v = speed_kmh / KMH_PER_MPS
    if isinstance(vehicle, ConsumptionTableVehicle):
        j_per_m = float(vehicle.consumption_at(np.array([v]))[0]) + vehicle.aux_power_w / v
        return j_per_m / JOULE_PER_M_PER_KWH_PER_100KM
    force_n = vehicle.road_load_a_n + vehicle.road_load_b_n_per_mps * v + vehicle.road_load_c_n_per_mps2 * v * v
    power_w = force_n * v / vehicle.drive_eff + vehicle.aux_power_w / vehicle.aux_move_eff
    return power_w / v / JOULE_PER_M_PER_KWH_PER_100KM


def steady_table(vehicles: dict[str, AnyVehicle]) -> str:
    """Markdown table of consumption and range at constant speed, with the rated range where it is known."""
    lines = [
        "| vehicle | usable kWh | "
        + " | ".join(f"{speed} km/h" for speed in SPEEDS_KMH)
        + " | km at 90 km/h | rated km |",
        "|---|--:|" + "--:|" * len(SPEEDS_KMH) + "--:|---|",
    ]
    for vehicle in vehicles.values():
        capacity_kwh = vehicle.usable_capacity_wh / 1000.0
        steady = [f"{steady_kwh_per_100km(vehicle, speed):.1f}" for speed in SPEEDS_KMH]
        range_km = 100.0 * capacity_kwh / steady_kwh_per_100km(vehicle, 90.0)
        cells = [f"`{vehicle.id}`", f"{capacity_kwh:.1f}", *steady, f"{range_km:.0f}", _rated_range(vehicle)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _rated_range(vehicle: AnyVehicle) -> str:
    published = load_published(VEHICLES / f"{vehicle.id}.toml")
    if published is None:
        return ABSENT
    ranges = ((published.epa_range_km, "EPA"), (published.wltp_range_km, "WLTP"))
    return ", ".join(f"{km:.0f} {by}" for km, by in ranges if km is not None) or ABSENT


def cycle_table(checks: dict[str, SelfCheck]) -> str:
    """Markdown table of the model's consumption over EPA's cycles beside what EPA lists."""
    lines = [
        "| vehicle | UDDS model | UDDS EPA | ratio | HWFET model | HWFET EPA | ratio | within the band |",
        "|---|--:|--:|--:|--:|--:|--:|---|",
    ]
    for vehicle_id, checked in checks.items():
        cells = [f"`{vehicle_id}`"]
        for cycle in CYCLES:
            cells += _figures(next((check for check in checked.checks if check.cycle == cycle), None))
        cells.append({True: "yes", False: f"no: {_misses(checked)}", None: ABSENT}[checked.met])
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _figures(check: CycleCheck | None) -> list[str]:
    if check is None:
        return [ABSENT] * 3
    return [f"{check.model_kwh_per_100km:.1f}", f"{check.published_kwh_per_100km:.1f}", f"{check.ratio:.2f}"]


def _misses(checked: SelfCheck) -> str:
    return " and ".join(
        f"{check.cycle.upper()} {'low' if check.ratio < check.band[0] else 'high'}"
        for check in checked.checks
        if not check.met
    )


def summary(vehicles: dict[str, AnyVehicle], checks: dict[str, SelfCheck]) -> str:
    """One sentence with the counts and the medians of the ratios of electric cars."""
    cars = [
        v for v in vehicles.values() if v.powertrain is Powertrain.BEV and not isinstance(v, ConsumptionTableVehicle)
    ]
    checked = [checks[car.id] for car in cars if checks[car.id].met is not None]
    medians = []
    for cycle in CYCLES:
        ratios = sorted(check.ratio for check in checked for check in check.checks if check.cycle == cycle)
        middle = len(ratios) // 2
        median = ratios[middle] if len(ratios) % 2 else 0.5 * (ratios[middle - 1] + ratios[middle])
        inside = sum(BAND[0] <= ratio <= BAND[1] for ratio in ratios)
        medians.append(f"{median:.2f} on {cycle.upper()} ({inside} of {len(ratios)} within the band)")
    met = sum(check.met is True for check in checked)
    return (
        f"{len(cars)} electric cars; {len(checked)} have figures to compare with, and {met} of these are within the\n"
        f"band on every cycle measured. The median ratio is {' and '.join(medians)}."
    )


def with_tables(text: str) -> str:
    """The page with tables and counts renewed between their markers."""
    vehicles = load_vehicles(VEHICLES)
    checks = {
        vehicle_id: self_check(vehicle, load_published(VEHICLES / f"{vehicle_id}.toml"))
        for vehicle_id, vehicle in vehicles.items()
        if not isinstance(vehicle, ConsumptionTableVehicle)
    }
    tables = (
        ("steady", steady_table(vehicles)),
        ("cycles", cycle_table(checks)),
        ("summary", summary(vehicles, checks)),
    )
    for name, table in tables:
        pattern = re.compile(f"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.DOTALL)
        text, count = pattern.subn(lambda match, table=table: f"{match[1]}{table}\n{match[2]}", text)
        if count != 1:
            raise ValueError(f"docs/vehicles.md has {count} places for {name!r}, needs one")
    return text


if __name__ == "__main__":
    page = DOCS / "vehicles.md"
    page.write_text(with_tables(page.read_text(encoding="utf-8")), encoding="utf-8")
