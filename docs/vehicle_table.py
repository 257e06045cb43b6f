"""The tables of docs/vehicles.md, computed from data/vehicles; run as `python docs/vehicle_table.py` to renew them."""

from __future__ import annotations

import csv
import re
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

from energy.vehicle import KMH_PER_MPS, Vehicle
from energy.vehicle_files import MPS_PER_MPH, load_vehicles

DOCS: Final = Path(__file__).resolve().parent
VEHICLES: Final = DOCS.parent / "data" / "vehicles"
SPEEDS_KMH: Final = (50, 90, 110, 130)
KM_PER_MILE: Final = 1.609344
KWH_PER_GALLON: Final = 33.7  # EPA's petrol equivalent
J_PER_M_PER_KWH_PER_100KM: Final = 36.0


class Published(NamedTuple):
    """Measured on EPA's dynamometer with the tested car [kWh/100 km], and the rated range [km], with its name."""

    udds: float | None
    hwfet: float | None
    rated_range: str


def _from_mpge(*mpge: float) -> float:
    return KWH_PER_GALLON / KM_PER_MILE * 100.0 / (sum(mpge) / len(mpge))


# EPA test car list 2022, column RND_ADJ_FE of the rows of the test vehicles that the files name.
PUBLISHED: Final = {
    "bmw-i3-60ah": Published(None, None, "–"),
    # The list says MPG, but 17.2 and 21.7 can only be kWh a 100 miles.
    "hyundai-kona-64": Published(17.2 / KM_PER_MILE, 21.7 / KM_PER_MILE, "415 EPA"),
    # 129 and 132, 109 and 109 have already the label's factor 0.7 in them: they repeat the label's ratings.
    "chevrolet-bolt": Published(_from_mpge(129.0, 132.0) * 0.7, _from_mpge(109.0, 109.0) * 0.7, "417 EPA"),
    "nissan-leaf": Published(_from_mpge(174.0, 177.1), _from_mpge(141.1, 141.3), "240 EPA, 270 WLTP"),
    "tesla-model-3": Published(_from_mpge(184.5), _from_mpge(173.4), "576 EPA"),
    "toyota-corolla-petrol": Published(_from_mpge(40.5), _from_mpge(56.8), "–"),
    "vw-id4": Published(_from_mpge(168.2, 170.9), _from_mpge(142.7, 142.8), "442 EPA, 520 WLTP"),
}


def steady_kwh_per_100km(vehicle: Vehicle, speed_kmh: float) -> float:
    """Consumption at constant speed on the flat [kWh/100 km], equations (1), (4) and (5) with a = θ = 0."""
    v = speed_kmh / KMH_PER_MPS
    power_w = _wheel_force_n(vehicle, v, 0.0) * v / vehicle.drive_eff + vehicle.aux_power_w / vehicle.aux_move_eff
    return power_w / v / J_PER_M_PER_KWH_PER_100KM


def cycle_kwh_per_100km(vehicle: Vehicle, cycle: str) -> float:
    """Consumption over a driving cycle in docs/data [kWh/100 km], equations (1) to (5) second by second."""
    with (DOCS / "data" / f"{cycle}.csv").open(encoding="utf-8", newline="") as file:
        speeds_mps = [float(row["speed_mph"]) * MPS_PER_MPH for row in csv.DictReader(file)]
    energy_j = distance_m = 0.0
    for before, after in pairwise(speeds_mps):
        v = 0.5 * (before + after)
        wheel_w = _wheel_force_n(vehicle, v, after - before) * v
        energy_j += wheel_w / vehicle.drive_eff if wheel_w > 0.0 else wheel_w * vehicle.recuperation_eff
        energy_j += vehicle.aux_power_w / (vehicle.aux_move_eff if v > 0.0 else vehicle.aux_idle_eff)
        distance_m += v
    return energy_j / distance_m / J_PER_M_PER_KWH_PER_100KM


def _wheel_force_n(vehicle: Vehicle, v: float, a: float) -> float:
    road_load_n = vehicle.road_load_a_n + vehicle.road_load_b_n_per_mps * v + vehicle.road_load_c_n_per_mps2 * v * v
    return road_load_n + vehicle.mass_kg * vehicle.rotating_mass_coef * a


def steady_table(vehicles: dict[str, Vehicle]) -> str:
    """Markdown table of consumption and range at constant speed."""
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
        rated = PUBLISHED[vehicle.id].rated_range
        cells = [f"`{vehicle.id}`", f"{capacity_kwh:.1f}", *steady, f"{range_km:.0f}", rated]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def cycle_table(vehicles: dict[str, Vehicle]) -> str:
    """Markdown table of the model's consumption over EPA's cycles beside what EPA lists."""
    lines = [
        "| vehicle | UDDS model | UDDS EPA | ratio | HWFET model | HWFET EPA | ratio |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for vehicle in vehicles.values():
        cells = [f"`{vehicle.id}`"]
        published = PUBLISHED[vehicle.id]
        for cycle, measured in (("udds", published.udds), ("hwfet", published.hwfet)):
            model = cycle_kwh_per_100km(vehicle, cycle)
            cells.append(f"{model:.1f}")
            cells += ["–", "–"] if measured is None else [f"{measured:.1f}", f"{model / measured:.2f}"]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def with_tables(text: str) -> str:
    """The page with both tables renewed between their markers."""
    vehicles = load_vehicles(VEHICLES)
    for name, table in (("steady", steady_table(vehicles)), ("cycles", cycle_table(vehicles))):
        pattern = re.compile(f"(<!-- {name} -->\n).*?(<!-- /{name} -->)", re.DOTALL)
        text, count = pattern.subn(lambda match, table=table: f"{match[1]}{table}\n{match[2]}", text)
        if count != 1:
            raise ValueError(f"docs/vehicles.md has {count} places for the table {name!r}, needs one")
    return text


if __name__ == "__main__":
    page = DOCS / "vehicles.md"
    page.write_text(with_tables(page.read_text(encoding="utf-8")), encoding="utf-8")
