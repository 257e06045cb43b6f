"""How far an energy may be off: parameters that are not known exactly, and what the model itself leaves out.

Two parts, independent of each other. The vehicle's parameters are normal with the standard deviations that the vehicle
carries, cut off where no vehicle can be. The model's residual is one factor a trip on the energy that is dissipated,
E = E_sim + f·D with f ~ N(0, RESIDUAL_SD_FRAC), so that what a height or a speed stores stays certain. Draws are the
same for every call with the same seed (common random numbers): two routes, two charges or two weathers are compared on
the same vehicles and residuals. docs/uncertainty.md holds the quantiles beside recorded drives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from energy.chain.chain import RULE_CODE, DriveSettings, LinkModel, chain_links, check_chain, filling_energy_j
from energy.chain.kernels_chain import ChainDrive, dissipated_j, drive_chain, undriven
from energy.chain.sampling import (
    STANDARD_SAMPLING,
    Sampling,
    check_within,
    residual_fracs,
    sampled_vehicles,
    sampling_of,
)
from energy.force.effects import LinkSetting, drive_of
from energy.units import JOULE_PER_WH
from energy.vehicle.vehicle import MOST_RESIDUAL_SD_FRAC

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from energy.chain.chain import Chain
    from energy.vehicle.consumption_table import ConsumptionTableVehicle
    from energy.vehicle.vehicle import Vehicle

QUANTILES: Final = (0.1, 0.5, 0.9)
OUTER_QUANTILES: Final = (0.1, 0.9)
CHUNK: Final = 256  # samples at a time, which bounds memory
AS_USUAL: Final = DriveSettings()


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
    check_within("soc_start_frac", soc_start_frac, 0.0, 1.0)
    check_within("reserve_soc_frac", reserve_soc_frac, 0.0, 1.0)
    sampling = sampling_of(vehicle, sampling)
    samples = sampling.samples
    residual = residual_fracs(samples, sampling.seed, sampling.residual_sd_frac)
    total, dissipated, arrival, lowest = (np.empty(samples) for _ in range(4))
    charge = np.empty((chain.length_m.size, samples)) if along else None
    duration_s = 0.0
    drives = _driven(vehicle, chain, drive, sampling, soc_start_frac)
    for at, energy, lost, capacity_j, chunk_s in drives:
        duration_s = chunk_s
        dissipated[at] = _sums_j(lost)
        energy += residual[at, None] * lost
        total[at] = _sums_j(energy)
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
    sampling = sampling_of(vehicle, sampling)
    check_within("residual_sd_frac", sampling.residual_sd_frac, 0.0, MOST_RESIDUAL_SD_FRAC)
    dissipated = np.empty(sampling.samples)
    for at, _, lost, _, _ in _driven(vehicle, chain, drive, sampling):
        dissipated[at] = _sums_j(lost)
    s2, r2 = _spread_frac(dissipated) ** 2, sampling.residual_sd_frac**2
    return float(np.sqrt(s2 + r2 + s2 * r2))


# samples at a time: which they are, energy and dissipated energy of each link (samples, n) [J], capacity [J], time [s]
Driven: TypeAlias = tuple[slice, "NDArray[np.float64]", "NDArray[np.float64]", "NDArray[np.float64]", float]


def _driven(
    vehicle: Vehicle | ConsumptionTableVehicle,
    chain: Chain,
    drive: DriveSettings,
    sampling: Sampling,
    soc_start_frac: float | None = None,
) -> Iterator[Driven]:
    """Energies of the chain with each sampled vehicle, without residual."""
    check_chain(chain, drive.start_speed_mps)
    yield from driven_by(sampled_vehicles(vehicle, sampling.samples, sampling.seed), chain, drive, soc_start_frac)


def driven_by(
    vehicles: Sequence[Vehicle | ConsumptionTableVehicle],
    chain: Chain,
    drive: DriveSettings = AS_USUAL,
    soc_start_frac: float | None = None,
) -> Iterator[Driven]:
    """Energies of a chain with each of some vehicles, CHUNK of them at a time."""
    same = all(vehicle is vehicles[0] for vehicle in vehicles)
    n = chain.length_m.size
    for begin in range(0, len(vehicles), CHUNK):
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


def _sums_j(rows: NDArray[np.float64]) -> list[float]:
    """The sum of each row, as that of a single chain is made."""
    return [row.sum() for row in rows]


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
