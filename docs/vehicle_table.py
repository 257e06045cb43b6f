"""The tables of docs/vehicles.md, computed from data/vehicles; run as `python docs/vehicle_table.py` to renew them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

from docs.vehicle_estimates import estimate_errors, listed_ratios, sister_errors
from energy.units import JOULE_PER_M_PER_KWH_PER_100KM, KMH_PER_MPS
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import AnyVehicle, load_published, load_vehicles
from energy.vehicle.self_check import BAND, CycleCheck, Driven, SelfCheck, self_check
from energy.vehicle.vehicle import Powertrain

DOCS: Final = Path(__file__).resolve().parent
VEHICLES: Final = DOCS.parent / "data" / "vehicles"
SPEEDS_KMH: Final = (50, 90, 110, 130)
CYCLES: Final[tuple[Driven, ...]] = ("udds", "hwfet", "mixed")
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


def road_load_origin(vehicle: AnyVehicle) -> str:
    """Where a road load is from: `EPA`, the id of the sister, or `estimated`."""
    source = vehicle.sources.get("road_load_a_n", "")
    sister = re.match(r"estimated: of the sister (\S+) ", source)
    if sister is not None:
        return f"as `{sister[1]}`"
    return "estimated" if source.startswith(("estimated: ", "assumed: ")) else "EPA"


def cycle_table(vehicles: dict[str, AnyVehicle], checks: dict[str, SelfCheck]) -> str:
    """Markdown table of the model's consumption beside what EPA or a database lists."""
    lines = [
        "| vehicle | road load | UDDS model | UDDS EPA | ratio | HWFET model | HWFET EPA | ratio "
        "| mixed model | listed | ratio | within the band |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|",
    ]
    for vehicle_id, checked in checks.items():
        cells = [f"`{vehicle_id}`", road_load_origin(vehicles[vehicle_id])]
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
    """Sentences with the counts of electric cars and the medians of their ratios."""
    cars = [
        v for v in vehicles.values() if v.powertrain is Powertrain.BEV and not isinstance(v, ConsumptionTableVehicle)
    ]
    origins = [road_load_origin(car) for car in cars]
    tested = [checks[car.id] for car in cars if any(check.cycle != "mixed" for check in checks[car.id].checks)]
    listed = [check for car in cars for check in checks[car.id].checks if check.cycle == "mixed"]
    medians = []
    for cycle in CYCLES[:2]:
        ratios = [check.ratio for checked in tested for check in checked.checks if check.cycle == cycle]
        inside = sum(BAND[0] <= ratio <= BAND[1] for ratio in ratios)
        medians.append(f"{np.median(ratios):.2f} on {cycle.upper()} ({inside} of {len(ratios)} within the band)")
    ratios = [check.ratio for check in listed]
    return (
        f"{len(cars)} electric cars: the road load of {origins.count('EPA')} is EPA's, that of "
        f"{sum(origin.startswith('as ') for origin in origins)} a sister's, that of\n"
        f"{origins.count('estimated')} estimated. {len(tested)} have figures of EPA; "
        f"{sum(checked.met is True for checked in tested)} of these are within the band on every cycle measured.\n"
        f"The median ratio is {' and '.join(medians)}.\n"
        f"{len(listed)} have a listed figure: {sum(check.met for check in listed)} are within the wide band, the "
        f"median ratio is {np.median(ratios):.2f} and the standard deviation {np.std(ratios):.2f}."
    )


def error_table() -> str:
    """Markdown table of the errors of estimated road loads on cars that took no part in the fit."""
    lines = ["| road load | vehicles or pairs | families | A | C | UDDS | HWFET |", "|---|--:|--:|--:|--:|--:|--:|"]
    for name, errors in (
        ("a sister's", sister_errors()),
        ("estimated with Cd", estimate_errors(with_cd=True)),
        ("estimated by kind of body", estimate_errors(with_cd=False)),
    ):
        parts = (errors.a, errors.c, errors.udds, errors.hwfet)
        cells = [name, str(errors.vehicles), str(errors.families), *(f"{100 * part:.0f} %" for part in parts)]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def curve_counts(vehicles: dict[str, AnyVehicle]) -> str:
    """A sentence with how many charging curves are of which origin."""
    curves = [v.charging for v in vehicles.values() if v.charging is not None]
    sources = [charging.sources.get("dc", "") for charging in curves]
    sister = sum(source.startswith("assumed: the curve of") for source in sources)
    middle = sum(source.startswith("assumed: the middle shape") for source in sources)
    none = sum(charging.dc is None for charging in curves)
    return (
        f"Of {len(curves)} cars {len(curves) - sister - middle - none} have a curve of their own, {sister} a sister's, "
        f"{middle} the middle shape;\n{none} take no direct current."
    )


def listed_sentence() -> str:
    """A sentence with the model's share of the listed consumption of cars that EPA has tested."""
    ratios = listed_ratios()
    return (
        f"Of {ratios.size} cars that EPA has tested the model takes {np.median(ratios):.2f} of the listed figure\n"
        f"(median; standard deviation {100 * np.std(ratios) / np.mean(ratios):.0f} %)."
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
        ("cycles", cycle_table(vehicles, checks)),
        ("summary", summary(vehicles, checks)),
        ("errors", error_table()),
        ("listed", listed_sentence()),
        ("curves", curve_counts(vehicles)),
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
