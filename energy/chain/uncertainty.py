"""How far an energy may be off: parameters that are not known exactly, and what the model itself leaves out.

Two parts, independent of each other. The vehicle's parameters are normal with the standard deviations that the vehicle
carries, cut off where no vehicle can be. The model's residual is one factor a trip on the energy that is dissipated,
E = E_sim + f·D with f ~ N(0, RESIDUAL_SD_FRAC), so that what a height or a speed stores stays certain. Draws are the
same for every call with the same seed (common random numbers): two routes, two charges or two weathers are compared on
the same vehicles and residuals. docs/uncertainty.md holds the quantiles beside recorded drives.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from energy.chain.chain import RULE_CODE, DriveSettings, LinkModel, chain_links, check_chain, filling_energy_j
from energy.chain.kernels_chain import ChainDrive, dissipated_j, drive_chain, undriven
from energy.errors import ConditionsError, VehicleError
from energy.force.effects import LinkSetting, drive_of
from energy.units import JOULE_PER_WH
from energy.vehicle.coefficients import COEFFICIENT_RANGES
from energy.vehicle.consumption_table import MOST_J_PER_M, ConsumptionTableVehicle
from energy.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from energy.chain.chain import Chain

# Source, table VII: standard deviation of the energy error over its 23 trips, parameters set from real drives. Its
# speeds, stops and climate were simulated, so it holds the error of the driving profile as well.
RESIDUAL_SD_FRAC: Final = 0.104
MOST_RESIDUAL_SD_FRAC: Final = 0.5
SAMPLES: Final = 200
MOST_SAMPLES: Final = 10_000
SEED: Final = 20_220_923
TRIES: Final = 64  # draws for one vehicle before its standard deviations are refused
QUANTILES: Final = (0.1, 0.5, 0.9)
OUTER_QUANTILES: Final = (0.1, 0.9)
FACTOR_RANGE: Final = (0.05, 20.0)
MOST_AUX_W: Final = 100_000.0
CHUNK: Final = 256  # samples at a time, which bounds memory
AS_USUAL: Final = DriveSettings()


@dataclass(frozen=True, slots=True)
class Sampling:
    """How many vehicles and residuals are drawn, by which seed, and how far the residual spreads."""

    samples: int = SAMPLES
    seed: int = SEED
    residual_sd_frac: float = RESIDUAL_SD_FRAC


STANDARD_SAMPLING: Final = Sampling()


@dataclass(frozen=True, slots=True)
class EnergyDistribution:
    """What a drive may take, and the charge that it may leave.

    energy_p10_j, energy_p50_j, energy_p90_j: not exceeded with a probability of 10, 50 and 90 %; negative where more is
    recuperated. As in simulate_chain, with what no longer fits into a full battery.
    arrival_soc_p10_frac, _p50_frac, _p90_frac: not exceeded with a probability of 10, 50 and 90 %, so p10 is the
    pessimistic one: with 90 % probability more is left. Held at 1 when full, below 0 where energy is missing.
    above_reserve_frac: probability of never being below the reserve, at departure, at any link's end, and on arrival;
    a share of the samples, so in steps of 1/samples.
    duration_s: the same in all samples. parameter_sd_frac: standard deviation of the dissipated energy by the
    vehicle's parameters, over its mean; residual_sd_frac: that of the model's residual.
    soc_p10_frac, soc_p90_frac: float64 (n,) charge at each link's end that is not exceeded with a probability of 10 and
    90 %, each link for itself; the last are those of the arrival. None unless asked for.
    """

    energy_p10_j: float
    energy_p50_j: float
    energy_p90_j: float
    arrival_soc_p10_frac: float
    arrival_soc_p50_frac: float
    arrival_soc_p90_frac: float
    above_reserve_frac: float
    duration_s: float
    samples: int
    seed: int
    parameter_sd_frac: float
    residual_sd_frac: float
    soc_p10_frac: NDArray[np.float64] | None = None
    soc_p90_frac: NDArray[np.float64] | None = None


def sampled_vehicles(
    vehicle: Vehicle | ConsumptionTableVehicle, count: int, seed: int = SEED
) -> tuple[Vehicle | ConsumptionTableVehicle, ...]:
    """Vehicles whose parameters are drawn from independent normals by `vehicle.sd`, cut off at what a vehicle can be.

    A draw that the vehicle or its effect coefficients refuse is drawn anew as a whole. An array moves as a whole, by
    one draw. Each field has its own stream of random numbers, and the first vehicles of a larger count are those of a
    smaller one. A vehicle without standard deviations gives itself, count times.

    Raises VehicleError where a field is unknown, a standard deviation negative, or TRIES draws are refused in a row.
    """
    _check("samples", count, 1, MOST_SAMPLES)
    for name, sd in vehicle.sd.items():
        if not _has(vehicle, name):
            raise VehicleError(f"sd.{name}", sd, "a field of the vehicle, or effects.<field>", vehicle.id)
        if not 0.0 <= sd < np.inf:
            raise VehicleError(f"sd.{name}", sd, "a finite number, at least 0", vehicle.id)
    names = [name for name, sd in vehicle.sd.items() if sd > 0.0]
    if not names:
        return (vehicle,) * count
    shifts = np.stack([vehicle.sd[name] * _normals(name, seed, (count, TRIES)) for name in names], axis=-1)
    return tuple(_first_possible(vehicle, names, shifts[k]) for k in range(count))


def residual_fracs(count: int, seed: int = SEED, sd_frac: float = RESIDUAL_SD_FRAC) -> NDArray[np.float64]:
    """Factors f on the dissipated energy, float64 (count,), normal with sd_frac and never below −1 [-]."""
    _check("samples", count, 1, MOST_SAMPLES)
    _check("residual_sd_frac", sd_frac, 0.0, MOST_RESIDUAL_SD_FRAC)
    return np.maximum(sd_frac * _normals("residual", seed, (count,)), -1.0)


def chain_distribution(
    vehicle: Vehicle | ConsumptionTableVehicle,
    chain: Chain,
    drive: DriveSettings = AS_USUAL,
    *,
    soc_start_frac: float,
    reserve_soc_frac: float,
    sampling: Sampling = STANDARD_SAMPLING,
    along: bool = False,
) -> EnergyDistribution:
    """Quantiles of the energy of driving a chain, and the probability of keeping above the reserve.

    along: with those of the charge at each link's end, which keeps all samples of all links in memory.
    Without standard deviations and residual, all quantiles are those of simulate_chain and energy.battery.soc_along to
    the bit. Raises as simulate_chain does, and ConditionsError for a state of charge, a count or a residual that is
    out of range; VehicleError as sampled_vehicles does.
    """
    _check("soc_start_frac", soc_start_frac, 0.0, 1.0)
    _check("reserve_soc_frac", reserve_soc_frac, 0.0, 1.0)
    samples = sampling.samples
    residual = residual_fracs(samples, sampling.seed, sampling.residual_sd_frac)
    total, dissipated, arrival, lowest = (np.empty(samples) for _ in range(4))
    charge = np.empty((chain.length_m.size, samples)) if along else None
    duration_s = 0.0
    drives = _driven(vehicle, chain, drive, sampling, soc_start_frac)
    for at, energy, lost, capacity_j, chunk_s in drives:
        duration_s = chunk_s
        dissipated[at] = [row.sum() for row in lost]
        energy += residual[at, None] * lost
        total[at] = [row.sum() for row in energy]
        kept = None if charge is None else charge[:, at]
        arrival[at], lowest[at] = _soc(energy, soc_start_frac, capacity_j, kept)
    energy_p10_j, energy_p50_j, energy_p90_j = np.quantile(total, QUANTILES).tolist()
    soc_p10_frac, soc_p50_frac, soc_p90_frac = np.quantile(arrival, QUANTILES).tolist()
    low, high = (None, None) if charge is None else np.quantile(charge, OUTER_QUANTILES, axis=1)
    return EnergyDistribution(
        energy_p10_j=energy_p10_j,
        energy_p50_j=energy_p50_j,
        energy_p90_j=energy_p90_j,
        arrival_soc_p10_frac=soc_p10_frac,
        arrival_soc_p50_frac=soc_p50_frac,
        arrival_soc_p90_frac=soc_p90_frac,
        above_reserve_frac=float(np.count_nonzero(lowest >= reserve_soc_frac)) / samples,
        duration_s=duration_s,
        samples=samples,
        seed=sampling.seed,
        parameter_sd_frac=_spread_frac(dissipated),
        residual_sd_frac=sampling.residual_sd_frac,
        soc_p10_frac=low,
        soc_p90_frac=high,
    )


def dissipation_sd_frac(
    vehicle: Vehicle | ConsumptionTableVehicle,
    chain: Chain,
    drive: DriveSettings = AS_USUAL,
    sampling: Sampling = STANDARD_SAMPLING,
) -> float:
    """Standard deviation of the dissipated energy of a chain by parameters and residual together, over its mean [-].

    Of D·(1 + f) with D and f independent: the square root of s² + r² + s²·r².
    """
    _check("residual_sd_frac", sampling.residual_sd_frac, 0.0, MOST_RESIDUAL_SD_FRAC)
    dissipated = np.empty(sampling.samples)
    for at, _, lost, _, _ in _driven(vehicle, chain, drive, sampling):
        dissipated[at] = [row.sum() for row in lost]
    s2, r2 = _spread_frac(dissipated) ** 2, sampling.residual_sd_frac**2
    return float(np.sqrt(s2 + r2 + s2 * r2))


def pessimistic(vehicle: Vehicle | ConsumptionTableVehicle, factor: float) -> Vehicle | ConsumptionTableVehicle:
    """The vehicle with all that it dissipates scaled by a factor, 0.05..20; below 1 an optimistic one.

    Scaled are A, B and C, P_aux, the losses 1/η_dis − 1 and 1 − η_chg, climate, battery resistance and what wet or
    snowy roads add; of a consumption table its values, P_aux, and how much more heights and speeds take than they give
    back. Values stop at the ends of their ranges: recuperation at 0, a COP at 0.5. The energy of any link grows with
    the factor, and 1 gives the vehicle itself. The dissipated energy follows the factor to within a few per cent of the
    change: losses act on a road load that has changed as well, and a car of more resistance recuperates less and so
    loses less in doing so. Powers that conditions name in watts stay.

    Raises ConditionsError for a factor out of range.
    """
    _check("factor", factor, *FACTOR_RANGE)
    if factor == 1.0:
        return vehicle
    aux_power_w = min(vehicle.aux_power_w * factor, MOST_AUX_W)
    if isinstance(vehicle, ConsumptionTableVehicle):
        up_j_per_m, down_j_per_m = _parted(vehicle.ascent_j_per_m, vehicle.descent_j_per_m, factor)
        up_kg, down_kg = _parted(vehicle.kinetic_up_kg, vehicle.kinetic_down_kg, factor)
        return replace(
            vehicle,
            consumption_j_per_m=np.minimum(vehicle.consumption_j_per_m * factor, MOST_J_PER_M),
            ascent_j_per_m=up_j_per_m,
            descent_j_per_m=down_j_per_m,
            kinetic_up_kg=up_kg,
            kinetic_down_kg=down_kg,
            aux_power_w=aux_power_w,
        )
    effects = {name: getattr(vehicle.effects, name) * factor for name in _SCALED_EFFECTS}
    effects |= {name: getattr(vehicle.effects, name) / factor for name in _DIVIDED_EFFECTS}
    for name, value in effects.items():
        low, high = COEFFICIENT_RANGES[name]
        effects[name] = min(max(value, low), high)
    return replace(
        vehicle,
        road_load_a_n=vehicle.road_load_a_n * factor,
        road_load_b_n_per_mps=vehicle.road_load_b_n_per_mps * factor,
        road_load_c_n_per_mps2=vehicle.road_load_c_n_per_mps2 * factor,
        drive_eff=1.0 / (1.0 + factor * (1.0 / vehicle.drive_eff - 1.0)),
        recuperation_eff=max(1.0 - factor * (1.0 - vehicle.recuperation_eff), 0.0),
        aux_power_w=aux_power_w,
        effects=replace(vehicle.effects, **effects),
    )


_SCALED_EFFECTS: Final = (
    "wet_rolling_coef",
    "wet_drag_n_per_mps",
    "snow_rolling_coef",
    "climate_fan_w",
    "climate_limit_w",
    "aux_climate_w",
    "battery_resistance_ohm",
    "drive_loss_w_per_n2",
)
_DIVIDED_EFFECTS: Final = ("heating_cop", "cooling_cop")


def _parted(taken: float, given: float, factor: float) -> tuple[float, float]:
    """What is taken and given back, their difference scaled about the middle, nothing below 0."""
    middle, half = 0.5 * (taken + given), 0.5 * factor * (taken - given)
    return middle + half, max(middle - half, 0.0)


def _check(field: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        raise ConditionsError(field, value, f"{low:g}..{high:g}")


def _has(vehicle: Vehicle | ConsumptionTableVehicle, name: str) -> bool:
    if name.startswith("effects."):
        field = name.removeprefix("effects.")
        return (
            isinstance(vehicle, Vehicle) and field in COEFFICIENT_RANGES and getattr(vehicle.effects, field) is not None
        )
    return isinstance(getattr(vehicle, name, None), int | float | np.ndarray)


def _normals(name: str, seed: int, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Standard normal numbers of one field's own stream, float64 of the shape."""
    return np.random.default_rng((seed, zlib.crc32(name.encode()))).standard_normal(shape)


def _first_possible(
    vehicle: Vehicle | ConsumptionTableVehicle, names: list[str], shifts: NDArray[np.float64]
) -> Vehicle | ConsumptionTableVehicle:
    """The vehicle shifted by the first row of shifts (tries, names) that it does not refuse."""
    refused = None
    for row in shifts:
        try:
            return _shifted(vehicle, dict(zip(names, row.tolist(), strict=True)))
        except (VehicleError, ConditionsError) as error:
            refused = error
    allowed = f"small enough that one of {TRIES} draws can be a vehicle; the last was refused: {refused}"
    raise VehicleError("sd", dict(vehicle.sd), allowed, vehicle.id)


def _shifted(
    vehicle: Vehicle | ConsumptionTableVehicle, shifts: Mapping[str, float]
) -> Vehicle | ConsumptionTableVehicle:
    own: dict[str, Any] = {}
    effects: dict[str, Any] = {}
    for name, shift in shifts.items():
        if isinstance(vehicle, Vehicle) and name.startswith("effects."):
            field = name.removeprefix("effects.")
            effects[field] = getattr(vehicle.effects, field) + shift
        else:
            own[name] = getattr(vehicle, name) + shift
    if isinstance(vehicle, Vehicle) and effects:
        own["effects"] = replace(vehicle.effects, **effects)
    return replace(vehicle, **own)


# samples at a time: which they are, energy and dissipated energy of each link (samples, n) [J], capacity [J], time [s]
_Driven = tuple[slice, "NDArray[np.float64]", "NDArray[np.float64]", "NDArray[np.float64]", float]


def _driven(
    vehicle: Vehicle | ConsumptionTableVehicle,
    chain: Chain,
    drive: DriveSettings,
    sampling: Sampling,
    soc_start_frac: float | None = None,
) -> Iterator[_Driven]:
    """Energies of the chain with each sampled vehicle, without residual."""
    check_chain(chain, drive.start_speed_mps)
    vehicles = sampled_vehicles(vehicle, sampling.samples, sampling.seed)
    same = vehicles[0] is vehicle
    n = chain.length_m.size
    for begin in range(0, sampling.samples, CHUNK):
        chosen = vehicles[begin : begin + CHUNK]
        energy, lost = np.empty((len(chosen), n)), np.empty((len(chosen), n))
        driven = undriven(n, with_parts=False)
        duration_s = 0.0
        for row, sampled in enumerate(chosen):
            if same and row > 0:
                energy[row:], lost[row:] = energy[0], lost[0]
                break
            of = drive_of(sampled, drive.conditions, printed=drive.link_model is LinkModel.PRINTED)
            driven_mps = of.driven_mps(chain.speed_limit_mps)
            setting = LinkSetting(chain.grade_frac, driven_mps, chain.altitude_m, chain.heading)
            links = chain_links(chain, driven_mps, of.roads(setting, chain.stop_time_s))
            full_j = filling_energy_j(soc_start_frac, sampled.usable_capacity_wh)
            way = ChainDrive(RULE_CODE[drive.stop_rule], float(drive.start_speed_mps), drive.arrive_stopped, full_j)
            driven = driven._replace(energy_j=energy[row])
            duration_s = drive_chain(of.physics, links, way, driven)
            dissipated_j(of.physics, links, way, driven, lost[row])
        capacity_j = np.array([sampled.usable_capacity_wh * JOULE_PER_WH for sampled in chosen])
        yield slice(begin, begin + len(chosen)), energy, lost, capacity_j, float(duration_s)


def _soc(
    energy: NDArray[np.float64],
    soc_start_frac: float,
    capacity_j: NDArray[np.float64],
    charge: NDArray[np.float64] | None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Charge on arrival and the lowest on the way, float64 (samples,), as energy.battery.soc_along for each sample.

    charge: (n, samples) is filled with that at each link's end.
    """
    soc = np.full(capacity_j.size, soc_start_frac)
    lowest = soc.copy()
    for k, used in enumerate(np.ascontiguousarray((energy / capacity_j[:, None]).T)):
        soc -= used
        np.minimum(soc, 1.0, out=soc)
        np.minimum(lowest, soc, out=lowest)
        if charge is not None:
            charge[k] = soc
    return soc, lowest


def _spread_frac(values: NDArray[np.float64]) -> float:
    mean = float(values.mean())
    if values.size < 2 or mean == 0.0 or bool((values == values[0]).all()):
        return 0.0
    return float(values.std(ddof=1)) / abs(mean)
