"""A vehicle's consumption over regulatory driving cycles, beside what is published of it."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Final, Literal, get_args

import numpy as np

from energy.errors import EnergyError, Refusal
from energy.folders import bundled_folder
from energy.units import JOULE_PER_M_PER_KWH_PER_100KM, MPS_PER_MPH
from energy.vehicle.vehicle import Powertrain, Vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from energy.vehicle.files import AnyVehicle
    from energy.vehicle.published import Published

CycleName = Literal["udds", "hwfet"]
Driven = CycleName | Literal["mixed"]  # mixed: the mean of both

CYCLE_FOLDER: Final = bundled_folder("data", "cycles")
# assumed: between fastsim's chg_eff of 0.86 for every electric car and emobpy's battery_charging_eff of 0.9
WALL_EFF: Final = 0.88
# EPA's label for electric cars: the range of the dynamometer tests times 0.7, hence their consumption over 0.7
LABEL_FACTOR: Final = 0.7
# two standard deviations: charger 5 %, drive efficiency 3 %, road load 4 %, recuperation and auxiliaries 3 % of a cycle
BAND: Final = (0.85, 1.15)
# two standard deviations: 11 % of databases' figures of cars that EPA has tested, 10 % of an estimated road load
LISTED_BAND: Final = (0.70, 1.30)


class CycleError(Refusal, EnergyError):
    """A driving cycle that can't be one: names the file, the field, its value and what is allowed."""

    def __init__(self, path: str, field: str, value: object, allowed: str) -> None:
        self.path = path
        super().__init__(field, value, allowed, subject=f"{path}: {field}")


@dataclass(frozen=True, slots=True)
class DrivingCycle:
    """Speed against time of a driving cycle on the flat.

    name: what it is called. speed_mps: float64 (n,), the speed at every second from 0 [m/s].
    """

    name: str
    speed_mps: NDArray[np.float64]

    @property
    def distance_m(self) -> float:
        """Length of the cycle [m], with speed linear in each second."""
        return float(np.sum(0.5 * (self.speed_mps[1:] + self.speed_mps[:-1])))


@dataclass(frozen=True, slots=True)
class CycleCheck:
    """One published figure beside the model's.

    figure: its name in `Published`. cycle: the cycle driven. model_kwh_per_100km: at the wall for an electric car, at
    the battery for a listed figure, fuel otherwise. published_kwh_per_100km: as measured on the dynamometer, so without
    a label's adjustment.
    ratio: model over published [-]. band: lowest and highest ratio that agree [-]. met: ratio within band.
    """

    figure: str
    cycle: Driven
    model_kwh_per_100km: float
    published_kwh_per_100km: float
    ratio: float
    band: tuple[float, float]
    met: bool


@dataclass(frozen=True, slots=True)
class SelfCheck:
    """All published figures of one vehicle that a cycle can be driven for, beside the model's."""

    vehicle_id: str
    checks: tuple[CycleCheck, ...]

    @property
    def met(self) -> bool | None:
        """Whether every figure is within its band; None where nothing comparable is published."""
        return all(check.met for check in self.checks) if self.checks else None


def load_cycle(path: Path) -> DrivingCycle:
    """The cycle in a CSV file with the columns time_s (0, 1, 2, …) and speed_mph, named after the file.

    Raises CycleError when the file can't be read, a time is missing or a speed is not a number within 0..200 mph.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise CycleError(str(path), "file", error.strerror, "a readable file") from error
    if len(rows) < 2:
        raise CycleError(str(path), "rows", len(rows), "at least 2")
    speeds_mps: list[float] = []
    for second, row in enumerate(rows):
        if row.get("time_s") != str(second):
            raise CycleError(str(path), f"time_s of row {second}", row.get("time_s"), f"{second}: one row a second")
        try:
            speed_mph = float(row["speed_mph"])
        except (KeyError, TypeError, ValueError):
            speed_mph = -1.0
        if not 0.0 <= speed_mph <= 200.0:
            raise CycleError(str(path), f"speed_mph of row {second}", row.get("speed_mph"), "0..200")
        speeds_mps.append(speed_mph * MPS_PER_MPH)
    speed_mps = np.array(speeds_mps, dtype=np.float64)
    if not bool(np.any(speed_mps > 0.0)):
        raise CycleError(str(path), "speed_mph", "0 everywhere", "a cycle that moves")
    speed_mps.flags.writeable = False
    return DrivingCycle(path.stem, speed_mps)


@cache
def bundled_cycle(name: CycleName) -> DrivingCycle:
    """A cycle of data/cycles: EPA's urban (UDDS) or highway (HWFET) dynamometer schedule."""
    return load_cycle(CYCLE_FOLDER / f"{name}.csv")


def cycle_consumption(vehicle: AnyVehicle, cycle: DrivingCycle) -> float:
    """Battery (or fuel) energy over a cycle on the flat, without wind, divided by its length [kWh/100 km].

    A road-load vehicle: equations (1) to (5) at the mean speed of each second. A consumption table: its equation, with
    the gain and loss of v² in each second.
    """
    before, after = cycle.speed_mps[:-1], cycle.speed_mps[1:]
    v = 0.5 * (before + after)
    if isinstance(vehicle, Vehicle):
        road_load_n = vehicle.road_load_a_n + vehicle.road_load_b_n_per_mps * v + vehicle.road_load_c_n_per_mps2 * v * v
        force_n = road_load_n + vehicle.mass_kg * vehicle.rotating_mass_coef * (after - before)
        wheel_w = force_n * v
        power_w = np.where(wheel_w > 0.0, wheel_w / vehicle.drive_eff, wheel_w * vehicle.recuperation_eff)
        power_w += vehicle.effects.drive_loss_w_per_n2 * np.where(v > 0.0, force_n * force_n, 0.0)
        power_w += vehicle.aux_power_w / np.where(v > 0.0, vehicle.aux_move_eff, vehicle.aux_idle_eff)
    else:
        half_gain = 0.5 * (after * after - before * before)
        kinetic_w = half_gain * np.where(half_gain > 0.0, vehicle.kinetic_up_kg, vehicle.kinetic_down_kg)
        power_w = vehicle.consumption_at(v) * v + kinetic_w + vehicle.aux_power_w
    return float(np.sum(power_w)) / cycle.distance_m / JOULE_PER_M_PER_KWH_PER_100KM


def self_check(vehicle: AnyVehicle, published: Published | None) -> SelfCheck:
    """The model's consumption over EPA's cycles beside the published figures.

    Electric cars are measured from the wall, so the model's battery energy is divided by WALL_EFF. A label's figure is
    multiplied by LABEL_FACTOR, which takes its adjustment out. A vehicle agrees with a figure when the ratio lies in
    BAND. What a database lists of mixed driving is brought to the mean of both cycles by LABEL_FACTOR too and has
    LISTED_BAND. Figures without a bundled cycle (WLTP, ranges) are not compared.
    """
    if published is None:
        return SelfCheck(vehicle.id, ())
    source_eff = WALL_EFF if vehicle.powertrain is Powertrain.BEV else 1.0
    figures: tuple[tuple[str, CycleName, float | None], ...] = (
        ("epa_udds_kwh_per_100km", "udds", published.epa_udds_kwh_per_100km),
        ("epa_hwfet_kwh_per_100km", "hwfet", published.epa_hwfet_kwh_per_100km),
        ("epa_city_kwh_per_100km", "udds", _without_adjustment(published.epa_city_kwh_per_100km)),
        ("epa_highway_kwh_per_100km", "hwfet", _without_adjustment(published.epa_highway_kwh_per_100km)),
    )
    checks: list[CycleCheck] = []
    for figure, cycle, measured in figures:
        if measured is not None:
            model = cycle_consumption(vehicle, bundled_cycle(cycle)) / source_eff
            ratio = model / measured
            checks.append(CycleCheck(figure, cycle, model, measured, ratio, BAND, BAND[0] <= ratio <= BAND[1]))
    if published.listed_kwh_per_100km is not None:
        model = 0.5 * sum(cycle_consumption(vehicle, bundled_cycle(cycle)) for cycle in get_args(CycleName))
        listed = published.listed_kwh_per_100km * LABEL_FACTOR
        ratio, (low, high) = model / listed, LISTED_BAND
        met = low <= ratio <= high
        checks.append(CycleCheck("listed_kwh_per_100km", "mixed", model, listed, ratio, LISTED_BAND, met))
    return SelfCheck(vehicle.id, tuple(checks))


def _without_adjustment(label_kwh_per_100km: float | None) -> float | None:
    return None if label_kwh_per_100km is None else label_kwh_per_100km * LABEL_FACTOR
