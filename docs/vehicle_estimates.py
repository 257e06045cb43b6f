"""Estimates for vehicles without a published road load, and their errors; `python docs/vehicle_estimates.py` prints.

The formulas are those of docs/vehicles.md. Their coefficients are fitted to the vehicles of docs/data/bodies.csv, which
EPA has coasted down. Errors are measured by leaving a family out (all cars of one platform), fitting to the others and
estimating those left out; each family counts the same. The standard deviations of the vehicle files are these errors.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from functools import cache
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from energy.units import KMH_PER_MPS, MPS_PER_MPH
from energy.vehicle.files import load_vehicle
from energy.vehicle.self_check import bundled_cycle, cycle_consumption
from energy.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

DOCS: Final = Path(__file__).resolve().parent
BODIES: Final = DOCS / "data" / "bodies.csv"
CHARGING: Final = DOCS / "data" / "charging.csv"
MORE: Final = DOCS / "data" / "more_vehicles.csv"
VEHICLES: Final = DOCS.parent / "data" / "vehicles"

BodyKind = Literal["small", "low", "crossover", "large", "van", "pickup"]
BODY_KINDS: Final[tuple[BodyKind, ...]] = ("small", "low", "crossover", "large", "van", "pickup")

GRAVITY_MPS2: Final = 9.80665
N_PER_LBF: Final = 4.4482216152605
KG_PER_LB: Final = 0.45359237
AIR_KG_PER_M3: Final = 1.2
FILL_COEF: Final = 0.85  # assumed: frontal area over width times height of a car
EPA_LOAD_KG: Final = 136.0  # 300 lb, which EPA's equivalent test weight adds to the kerb mass
FITTED_KMH: Final = np.arange(10.0, 131.0, 10.0)
SOC_PERCENT: Final = np.arange(0.0, 101.0, 5.0)


@dataclass(frozen=True, slots=True)
class RoadLoad:
    """F = A + B·v + C·v² [N, N/(m/s), N/(m/s)²]."""

    a_n: float
    b_n_per_mps: float
    c_n_per_mps2: float

    def force_n(self, speed_mps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Force at speeds on the flat [N]."""
        return self.a_n + self.b_n_per_mps * speed_mps + self.c_n_per_mps2 * speed_mps * speed_mps


@dataclass(frozen=True, slots=True)
class Body:
    """What a road load is estimated from: kind, size [m], published drag coefficient, mass with load [kg]."""

    kind: BodyKind
    length_m: float
    width_m: float
    height_m: float
    cd: float | None
    mass_kg: float

    @property
    def frontal_m2(self) -> float:
        """Frontal area [m²], assumed a share of width times height."""
        return FILL_COEF * self.width_m * self.height_m


@dataclass(frozen=True, slots=True)
class Measured:
    """A vehicle that EPA has coasted down. vehicle: None for the combustion ones."""

    name: str
    family: str
    body: Body
    road_load: RoadLoad
    kerb_kg: float | None
    vehicle: Vehicle | None


@dataclass(frozen=True, slots=True)
class RoadLoadFit:
    """A = rolling·m·g, B = rolling_speed·m·g, C = ½·ρ·drag·(frontal area).

    drag: `cd` times the published coefficient, or the figure of the body's kind where none is published.
    """

    rolling_coef: float
    rolling_s_per_m: float
    cd_coef: float
    kind_cd: Mapping[BodyKind, float]

    def road_load(self, body: Body) -> RoadLoad:
        """The estimate for a body."""
        drag = self.kind_cd[body.kind] if body.cd is None else self.cd_coef * body.cd
        weight_n = body.mass_kg * GRAVITY_MPS2
        return RoadLoad(
            self.rolling_coef * weight_n, self.rolling_s_per_m * weight_n, 0.5 * AIR_KG_PER_M3 * drag * body.frontal_m2
        )


@dataclass(frozen=True, slots=True)
class Errors:
    """Root mean squares of relative errors, and how many vehicles of how many families they are of.

    a, c: of A and C, with the error of B shared out between the two. udds, hwfet: of the consumption on the cycles.
    """

    vehicles: int
    families: int
    a: float
    c: float
    udds: float
    hwfet: float


@cache
def measured_vehicles() -> tuple[Measured, ...]:
    """The vehicles of docs/data/bodies.csv."""
    with BODIES.open(encoding="utf-8", newline="") as file:
        return tuple(_measured(row) for row in csv.DictReader(file))


def body_of(row: Mapping[str, str], mass_kg: float) -> Body:
    """The body of a row of bodies.csv or more_vehicles.csv."""
    kind = next(kind for kind in BODY_KINDS if kind == row["body"])
    length_m, width_m, height_m = (float(row[f"{side}_mm"]) / 1000.0 for side in ("length", "width", "height"))
    return Body(kind, length_m, width_m, height_m, float(row["cd"]) if row["cd"] else None, mass_kg)


def _measured(row: dict[str, str]) -> Measured:
    kerb_kg = float(row["kerb_kg"]) if row["kerb_kg"] else None
    if row["id"]:
        vehicle = load_vehicle(VEHICLES / f"{row['id']}.toml")
        if not isinstance(vehicle, Vehicle):
            raise TypeError(f"{row['id']} has no road load")
        road_load = RoadLoad(vehicle.road_load_a_n, vehicle.road_load_b_n_per_mps, vehicle.road_load_c_n_per_mps2)
        return Measured(row["id"], row["family"], body_of(row, vehicle.mass_kg), road_load, kerb_kg, vehicle)
    road_load = RoadLoad(
        float(row["target_coef_a_lbf"]) * N_PER_LBF,
        float(row["target_coef_b_lbf_per_mph"]) * N_PER_LBF / MPS_PER_MPH,
        float(row["target_coef_c_lbf_per_mph2"]) * N_PER_LBF / MPS_PER_MPH**2,
    )
    mass_kg = float(row["equivalent_test_weight_lb"]) * KG_PER_LB
    return Measured(row["combustion_model"], row["family"], body_of(row, mass_kg), road_load, kerb_kg, None)


# --- road load ---------------------------------------------------------------------------------------------------


def fit_road_load(vehicles: Sequence[Measured]) -> RoadLoadFit:
    """Least squares of the relative error of the force from 10 to 130 km/h, each family with the same weight.

    The rolling part and the drag of each kind are fitted to all; then, with that rolling part, the factor on published
    drag coefficients to those that have one.
    """
    speed = FITTED_KMH / KMH_PER_MPS
    kinds = sorted({vehicle.body.kind for vehicle in vehicles})
    weights = _family_weights([vehicle.family for vehicle in vehicles])
    rows, ones = [], []
    for vehicle, weight in zip(vehicles, np.sqrt(weights), strict=True):
        air = 0.5 * AIR_KG_PER_M3 * vehicle.body.frontal_m2 * speed * speed
        drag = [air if kind == vehicle.body.kind else np.zeros_like(air) for kind in kinds]
        weight_n = vehicle.body.mass_kg * GRAVITY_MPS2
        columns = np.stack([np.full_like(speed, weight_n), weight_n * speed, *drag], axis=1)
        rows.append(weight * columns / vehicle.road_load.force_n(speed)[:, None])
        ones.append(np.full_like(speed, weight))
    rolling, rolling_speed, *kind_cd = np.linalg.lstsq(np.concatenate(rows), np.concatenate(ones), rcond=None)[0]
    published = [(v, w) for v, w in zip(vehicles, weights, strict=True) if v.body.cd is not None]
    above = below = 0.0
    for vehicle, weight in published:
        force = vehicle.road_load.force_n(speed)
        air = 0.5 * AIR_KG_PER_M3 * (vehicle.body.cd or 0.0) * vehicle.body.frontal_m2 * speed * speed / force
        weight_n = vehicle.body.mass_kg * GRAVITY_MPS2
        rest = 1.0 - weight_n * (rolling + rolling_speed * speed) / force
        above += weight * float(air @ rest)
        below += weight * float(air @ air)
    return RoadLoadFit(
        float(rolling), float(rolling_speed), above / below, dict(zip(kinds, map(float, kind_cd), strict=True))
    )


@cache
def road_load_fit() -> RoadLoadFit:
    """The fit to all measured vehicles, rounded as docs/vehicles.md prints it."""
    fit = fit_road_load(measured_vehicles())
    return RoadLoadFit(
        round(fit.rolling_coef, 5),
        round(fit.rolling_s_per_m, 6),
        round(fit.cd_coef, 3),
        {kind: round(fit.kind_cd[kind], 3) for kind in BODY_KINDS},
    )


def sister_road_load(sister: Measured, body: Body) -> RoadLoad:
    """The sister's, A and B scaled by mass, C by width times height."""
    mass = body.mass_kg / sister.body.mass_kg
    area = body.frontal_m2 / sister.body.frontal_m2
    own = sister.road_load
    return RoadLoad(own.a_n * mass, own.b_n_per_mps * mass, own.c_n_per_mps2 * area)


def estimate_errors(*, with_cd: bool) -> Errors:
    """Errors of estimates of vehicles whose family took no part in the fit.

    with_cd: of those with a published drag coefficient, using it; else of all, by the kind of body alone.
    """
    vehicles = measured_vehicles()
    estimates = []
    for vehicle in vehicles:
        others = [other for other in vehicles if other.family != vehicle.family]
        if vehicle.body.kind in {other.body.kind for other in others} and (vehicle.body.cd is not None or not with_cd):
            body = vehicle.body if with_cd else replace(vehicle.body, cd=None)
            estimates.append((vehicle, fit_road_load(others).road_load(body)))
    return _errors(estimates)


def sister_errors() -> Errors:
    """Errors of each vehicle taken as the sister of each other one of its family with the same kind of body."""
    pairs = permutations(measured_vehicles(), 2)
    return _errors(
        [
            (vehicle, sister_road_load(sister, vehicle.body))
            for sister, vehicle in pairs
            if sister.family == vehicle.family and sister.body.kind == vehicle.body.kind
        ]
    )


def _errors(estimates: Sequence[tuple[Measured, RoadLoad]]) -> Errors:
    speed = FITTED_KMH / KMH_PER_MPS
    shares = np.stack([np.ones_like(speed), speed * speed], axis=1)
    force_errors, cycle_errors, families, cycle_families = [], [], [], []
    for measured, estimate in estimates:
        missing = measured.road_load.force_n(speed) - estimate.force_n(speed)
        a_n, c_n_per_mps2 = np.linalg.lstsq(shares, missing, rcond=None)[0]
        force_errors.append((a_n / estimate.a_n, c_n_per_mps2 / estimate.c_n_per_mps2))
        families.append(measured.family)
        if measured.vehicle is not None:
            estimated = replace(
                measured.vehicle,
                road_load_a_n=estimate.a_n,
                road_load_b_n_per_mps=estimate.b_n_per_mps,
                road_load_c_n_per_mps2=estimate.c_n_per_mps2,
            )
            cycles = (bundled_cycle("udds"), bundled_cycle("hwfet"))
            cycle_errors.append(
                [cycle_consumption(estimated, c) / cycle_consumption(measured.vehicle, c) - 1.0 for c in cycles]
            )
            cycle_families.append(measured.family)
    a, c = _rms(np.array(force_errors), families)
    udds, hwfet = _rms(np.array(cycle_errors), cycle_families)
    return Errors(len(estimates), len(set(families)), a, c, udds, hwfet)


def _family_weights(families: Sequence[str]) -> NDArray[np.float64]:
    """Weight of each vehicle, one a family in all."""
    return np.array([1.0 / families.count(family) for family in families])


def _rms(errors: NDArray[np.float64], families: Sequence[str]) -> list[float]:
    weights = _family_weights(families)
    return [float(value) for value in np.sqrt(weights @ (errors * errors) / weights.sum())]


# --- mass --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class MassFit:
    """Kerb mass = base + box·(length·width·height) + battery·(usable kWh) + both_axles where both axles are driven."""

    base_kg: float
    box_kg_per_m3: float
    battery_kg_per_kwh: float
    both_axles_kg: float

    def kerb_kg(self, body: Body, capacity_kwh: float, *, both_axles: bool) -> float:
        """The estimate."""
        box_m3 = body.length_m * body.width_m * body.height_m
        driven = self.both_axles_kg if both_axles else 0.0
        return self.base_kg + self.box_kg_per_m3 * box_m3 + self.battery_kg_per_kwh * capacity_kwh + driven


@dataclass(frozen=True, slots=True)
class Weighed:
    """A car whose kerb mass is known, with what it is estimated from."""

    family: str
    body: Body
    capacity_kwh: float
    both_axles: bool
    kerb_kg: float


@cache
def weighed_cars() -> tuple[Weighed, ...]:
    """Electric cars of bodies.csv, EPA's test weight less its load, and those of more_vehicles.csv with a listed mass.

    The family is the make: cars of one make share platforms and a data set's habits.
    """
    with BODIES.open(encoding="utf-8", newline="") as file:
        driven = {row["id"]: row["driven_wheels"] == "4" for row in csv.DictReader(file)}
    cars = [
        Weighed(
            car.name.split("-")[0],
            car.body,
            car.vehicle.usable_capacity_wh / 1000.0,
            driven[car.name],
            car.body.mass_kg - EPA_LOAD_KG,
        )
        for car in measured_vehicles()
        if car.vehicle is not None
    ]
    with MORE.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["kerb_kg"]:
                kerb_kg = float(row["kerb_kg"])
                cars.append(
                    Weighed(
                        row["id"].split("-")[0],
                        body_of(row, kerb_kg),
                        float(row["capacity_kwh"]),
                        row["driven_wheels"] == "4",
                        kerb_kg,
                    )
                )
    return tuple(cars)


def fit_mass(cars: Sequence[Weighed]) -> MassFit:
    """Least squares, each family with the same weight."""
    weights = np.sqrt(_family_weights([car.family for car in cars]))
    columns = np.array(
        [
            (1.0, car.body.length_m * car.body.width_m * car.body.height_m, car.capacity_kwh, float(car.both_axles))
            for car in cars
        ]
    )
    masses = np.array([car.kerb_kg for car in cars])
    return MassFit(*map(float, np.linalg.lstsq(columns * weights[:, None], masses * weights, rcond=None)[0]))


@cache
def mass_fit() -> MassFit:
    """The fit to all weighed cars, rounded as docs/vehicles.md prints it."""
    fit = fit_mass(weighed_cars())
    return MassFit(
        round(fit.base_kg), round(fit.box_kg_per_m3, 1), round(fit.battery_kg_per_kwh, 2), round(fit.both_axles_kg)
    )


@cache
def mass_error_kg() -> float:
    """Error of estimated kerb masses of cars whose make took no part in the fit [kg]."""
    cars = weighed_cars()
    errors = []
    for car in cars:
        fit = fit_mass([other for other in cars if other.family != car.family])
        errors.append((fit.kerb_kg(car.body, car.capacity_kwh, both_axles=car.both_axles) - car.kerb_kg,))
    return _rms(np.array(errors), [car.family for car in cars])[0]


@cache
def listed_mass_error_kg() -> float:
    """Difference between listed kerb masses and EPA's test weights less their load [kg]."""
    cars = [car for car in measured_vehicles() if car.kerb_kg is not None]
    errors = [((car.kerb_kg or 0.0) + EPA_LOAD_KG - car.body.mass_kg,) for car in cars]
    return _rms(np.array(errors), [car.family for car in cars])[0]


# --- listed consumption ------------------------------------------------------------------------------------------


def listed_ratios() -> NDArray[np.float64]:
    """The model's mean of both cycles over the listed consumption of charging.csv, of cars that EPA has tested."""
    with CHARGING.open(encoding="utf-8", newline="") as file:
        listed = {row["id"]: float(row["listed_kwh_per_100km"] or "nan") for row in csv.DictReader(file)}
    cycles = (bundled_cycle("udds"), bundled_cycle("hwfet"))
    ratios = np.array(
        [
            0.5 * sum(cycle_consumption(car.vehicle, cycle) for cycle in cycles) / listed.get(car.name, np.nan)
            for car in measured_vehicles()
            if car.vehicle is not None
        ]
    )
    return ratios[np.isfinite(ratios)]


# --- charging curves ---------------------------------------------------------------------------------------------


@cache
def own_curves() -> tuple[NDArray[np.float64], ...]:
    """Power at SOC_PERCENT over its highest value, of each curve of charging.csv that is a car's own, each once."""
    with CHARGING.open(encoding="utf-8", newline="") as file:
        listed = {
            (row["curve_soc_percent"], row["curve_kw"]) for row in csv.DictReader(file) if row["curve_kind"] == "own"
        }
    return tuple(
        power / power.max()
        for power in (
            np.interp(SOC_PERCENT, [float(x) for x in soc.split()], [float(x) for x in kw.split()])
            for soc, kw in sorted(listed)
        )
    )


def middle_shape(curves: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Median of curves at SOC_PERCENT, to hundredths."""
    return np.round(np.median(np.stack(curves), axis=0), 2)


def minutes_10_to_80(shape: NDArray[np.float64]) -> float:
    """Time from 10 to 80 % of a battery of 1 kWh with 1 kW at most [min]."""
    soc = np.linspace(10.0, 80.0, 7001)
    return float(np.trapezoid(60.0 / np.interp(soc, SOC_PERCENT, shape), soc / 100.0))


def shape_errors(shape_without: Callable[[int], NDArray[np.float64]]) -> tuple[float, float]:
    """Median and root mean square of the relative error of the time from 10 to 80 %, curve k by a shape without it."""
    curves = own_curves()
    errors = np.array(
        [minutes_10_to_80(shape_without(k)) / minutes_10_to_80(curve) - 1.0 for k, curve in enumerate(curves)]
    )
    return float(np.median(errors)), float(np.sqrt(np.mean(errors * errors)))


def _print() -> None:
    fit = road_load_fit()
    print(f"A = {fit.rolling_coef}·m·g, B = {fit.rolling_s_per_m}·m·g, C = ½·ρ·{fit.cd_coef}·Cd·S; kinds {fit.kind_cd}")
    for name, errors in (
        ("estimated with a published Cd", estimate_errors(with_cd=True)),
        ("estimated by kind of body", estimate_errors(with_cd=False)),
        ("sister", sister_errors()),
    ):
        print(
            f"{name}: {errors.vehicles} of {errors.families} families: A {errors.a:.3f}, C {errors.c:.3f}, "
            f"UDDS {errors.udds:.3f}, HWFET {errors.hwfet:.3f}"
        )
    mass = mass_fit()
    print(
        f"{mass}: {len(weighed_cars())} cars, error {mass_error_kg():.0f} kg; listed: {listed_mass_error_kg():.0f} kg"
    )
    ratios = listed_ratios()
    print(f"model over listed: {np.median(ratios):.3f}, {np.std(ratios) / np.mean(ratios):.3f} of {ratios.size} cars")
    curves = own_curves()
    print(f"middle shape of {len(curves)} curves: {middle_shape(curves).tolist()}")
    default = np.interp(SOC_PERCENT, [0.0, 75.0, 100.0], [0.95, 1.0, 0.11])
    median, rms = shape_errors(lambda k: middle_shape([*curves[:k], *curves[k + 1 :]]))
    print(f"10 to 80 %: by the middle shape of the others {median:+.3f}, {rms:.3f}")
    median, rms = shape_errors(lambda _: default)
    print(f"10 to 80 %: by the listed default {median:+.3f}, {rms:.3f}")


if __name__ == "__main__":
    _print()
