"""How the energy of each link of a chain scatters with the vehicle's parameters, by few drives instead of hundreds.

uncertainty drives a chain with every sampled vehicle. Here it is driven twice for each parameter that is not certain,
one standard deviation up and down, and energies are taken as a quadratic of each: E(x) = E(0) + Σ (s·x + c·x²), with x
in standard deviations. What two parameters do together beyond what each does is left out; docs/charging.md has by how
much quantiles differ from those of all drives.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.special import ndtri

from energy.chain.chain import DriveSettings, check_chain
from energy.chain.sampling import SEED, sampled_vehicles, shifted_vehicle
from energy.chain.uncertainty import driven_by
from energy.errors import ConditionsError, VehicleError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from energy.chain.chain import Chain
    from energy.vehicle.consumption_table import ConsumptionTableVehicle
    from energy.vehicle.vehicle import Vehicle

AS_USUAL: Final = DriveSettings()
CAPACITY: Final = "usable_capacity_wh"  # which no energy depends on
# where a chain is driven [standard deviations]: to both sides, or to one where no vehicle can be on the other
SIDES: Final = ((1.0, -1.0), (0.5, -0.5), (-1.0, -0.5), (1.0, 0.5), (-0.25, -0.125), (0.25, 0.125))


@dataclass(frozen=True, slots=True, eq=False)
class DrawnShifts:
    """m drawn vehicles by what is not certain of them.

    names: (p,) fields as `sd` names them, without the capacity. shifts_sd: float64 (m, p), in standard deviations.
    capacity_wh: float64 (m,).
    """

    names: tuple[str, ...]
    shifts_sd: NDArray[np.float64]
    capacity_wh: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ChainScatter:
    """Energy and dissipated energy of n links by p shifts [J].

    energy_j, dissipated_j: float64 (n,), of the vehicle itself. energy_terms_j, dissipated_terms_j: float64 (2p, n), of
    shifts and of their squares.
    """

    energy_j: NDArray[np.float64]
    dissipated_j: NDArray[np.float64]
    energy_terms_j: NDArray[np.float64]
    dissipated_terms_j: NDArray[np.float64]

    def drawn(self, shifts_sd: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Energy and dissipated energy of each link with vehicles shifted so, (m, p): float64 (m, n) each [J]."""
        powers = np.hstack((shifts_sd, shifts_sd * shifts_sd))
        return self.energy_j + powers @ self.energy_terms_j, self.dissipated_j + powers @ self.dissipated_terms_j

    def with_links(self, at: NDArray[np.bool_], other: ChainScatter) -> ChainScatter:
        """With some links as another one has them, bool (n,)."""
        return ChainScatter(
            np.where(at, other.energy_j, self.energy_j),
            np.where(at, other.dissipated_j, self.dissipated_j),
            np.where(at, other.energy_terms_j, self.energy_terms_j),
            np.where(at, other.dissipated_terms_j, self.dissipated_terms_j),
        )

    def in_blocks(self, first: NDArray[np.int64]) -> ChainScatter:
        """With links from first[b] up to first[b + 1] as one, int64 (B,), rising from 0."""
        return ChainScatter(
            np.add.reduceat(self.energy_j, first),
            np.add.reduceat(self.dissipated_j, first),
            np.add.reduceat(self.energy_terms_j, first, axis=1),
            np.add.reduceat(self.dissipated_terms_j, first, axis=1),
        )


def drawn_shifts(vehicle: Vehicle | ConsumptionTableVehicle, count: int, seed: int = SEED) -> DrawnShifts:
    """Vehicles drawn as by sampled_vehicles, but evenly: of each number one in each of `count` parts of its normal.

    In which order is drawn for each (a Latin hypercube), so that sums of what single numbers do have hardly an error of
    sampling. Draws that no vehicle can be are left out.

    Raises VehicleError as sampled_vehicles does, and where no draw can be a vehicle.
    """
    first = sampled_vehicles(vehicle, 1, seed)[0]
    names = [name for name, sd in vehicle.sd.items() if sd > 0.0]
    if first is vehicle:
        return DrawnShifts((), np.empty((count, 0)), np.full(count, vehicle.usable_capacity_wh))
    parts = np.column_stack(
        [np.random.default_rng((seed, zlib.crc32(name.encode()))).permutation(count) for name in names]
    )
    shifts = ndtri((parts + 0.5) / count)
    kept, capacity_wh = np.ones(count, np.bool_), np.empty(count)
    for k, row in enumerate((shifts * [vehicle.sd[name] for name in names]).tolist()):
        try:
            capacity_wh[k] = shifted_vehicle(vehicle, dict(zip(names, row, strict=True))).usable_capacity_wh
        except (VehicleError, ConditionsError):
            kept[k] = False
    if not kept.any():
        raise VehicleError("sd", dict(vehicle.sd), "small enough that some draw can be a vehicle", vehicle.id)
    moving = [k for k, name in enumerate(names) if name != CAPACITY]
    return DrawnShifts(tuple(names[k] for k in moving), shifts[kept][:, moving], capacity_wh[kept])


def chain_scatter(
    vehicle: Vehicle | ConsumptionTableVehicle,
    chain: Chain,
    drive: DriveSettings = AS_USUAL,
    names: Sequence[str] | None = None,
) -> ChainScatter:
    """How a chain's energies follow parameters, without what a nearly full battery refuses.

    names: of parameters, all that are not certain but the capacity where None. Raises as simulate_chain does.
    """
    check_chain(chain, drive.start_speed_mps)
    names = _uncertain(vehicle) if names is None else tuple(names)
    vehicles, sides = [vehicle], []
    for name in names:
        pair = next(((pair, moved) for pair in SIDES if (moved := _moved(vehicle, name, pair)) is not None), None)
        sides.append(None if pair is None else pair[0])
        vehicles += () if pair is None else pair[1]
    energy, lost = (
        np.concatenate(rows)
        for rows in zip(*((e, d) for _, e, d, _, _ in driven_by(vehicles, chain, drive)), strict=True)
    )
    p, n = len(names), chain.length_m.size
    terms = np.zeros((2, 2 * p, n))
    row = 1
    for k, pair_sd in enumerate(sides):
        if pair_sd is None:
            continue
        a, b = pair_sd
        for of, rows in zip(terms, (energy, lost), strict=True):
            from_a, from_b = (rows[row] - rows[0]) / a, (rows[row + 1] - rows[0]) / b
            of[p + k] = (from_a - from_b) / (a - b)
            of[k] = from_a - a * of[p + k]
        row += 2
    return ChainScatter(energy[0], lost[0], terms[0], terms[1])


def _uncertain(vehicle: Vehicle | ConsumptionTableVehicle) -> tuple[str, ...]:
    return tuple(name for name, sd in vehicle.sd.items() if sd > 0.0 and name != CAPACITY)


def _moved(
    vehicle: Vehicle | ConsumptionTableVehicle, name: str, shifts_sd: tuple[float, float]
) -> list[Vehicle | ConsumptionTableVehicle] | None:
    """The vehicle with one number moved by both shifts, None where one of them can't be."""
    try:
        return [shifted_vehicle(vehicle, {name: shift * vehicle.sd[name]}) for shift in shifts_sd]
    except (VehicleError, ConditionsError):
        return None
