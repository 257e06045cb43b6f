"""Levels that single trips have of their own: a roof box, a load, soft tyres, on some drives and not on others.

After everything else is fitted, each trip is given its own drag, mass or rolling resistance. Trips that lie
far above what the bulk of trips scatter by are named; which of the three it was is told by what fits best.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.noise import KERNELS, whitened
from diagnosis.results import Family
from diagnosis.windows import summed
from energy.vehicle import GRAVITY_MPS2

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from diagnosis.driven import Driven
    from diagnosis.fitting import Model

LEAST_TRIPS: Final = 8  # fewer have no bulk that others stand out from
LEAST_FLAGGED: Final = 2
STANDS_OUT: Final = 4.5
LEAST_RISE_FRAC: Final = 0.1  # of drag, mass or rolling resistance
LEAST_SHARE_FRAC: Final = 0.01
SAME_GAIN_FRAC: Final = 0.7  # of the best kind's gain, from which on another can't be told from it
NORMAL_HALF: Final = 1.349  # length of the middle half of a normal distribution over its standard deviation


@dataclass(frozen=True, slots=True)
class Kind:
    """Something that a trip can have more of: its energy for twice the vehicle's own, float64 (n,) [J]."""

    effect: str
    family: Family
    column_j: Callable[[Driven], NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class Level:
    """Trips that carry a level: of which kind, by what share of the vehicle's own [-], with sd, and energy [J].

    rivals: kinds that fit as well.
    """

    kind: Kind
    trips: tuple[str, ...]
    rise_frac: tuple[float, ...]
    sd_frac: tuple[float, ...]
    energy_j: float
    energy_sd_j: float
    share_frac: float
    z: float
    rivals: tuple[Kind, ...]


def _drag(drive: Driven) -> NDArray[np.float64]:
    return drive.work_j(drive.vehicle.road_load_c_n_per_mps2 * drive.speed_mps**2)


def _mass(drive: Driven) -> NDArray[np.float64]:
    car = drive.vehicle
    force = car.rotating_mass_coef * drive.accel_mps2 + GRAVITY_MPS2 * drive.grade_frac
    return drive.work_j(car.mass_kg * force + car.road_load_a_n)


def _rolling(drive: Driven) -> NDArray[np.float64]:
    return drive.work_j(float(drive.vehicle.road_load_a_n))


KINDS: Final = (
    Kind("roof_load", Family.AERODYNAMIC, _drag),
    Kind("trip_payload", Family.MASS, _mass),
    Kind("trip_rolling", Family.ROLLING, _rolling),
)


def levels(model: Model) -> Level | None:
    """The level that some trips carry, if any stands out."""
    if len(model.windows) < LEAST_TRIPS:
        return None
    variance = model.noise.variance.copy()
    for name in ("rolling", "drag"):
        variance[KERNELS.index(name)] = 0.0
    noise = replace(model.noise, variance=variance)
    measured_j = sum(float(trip.measured_j.sum()) for trip in model.windows)
    roots = [noise.root(cut) for cut in model.windows]
    left = [whitened(root, model.left_w(k)) for k, root in enumerate(roots)]
    found = [one for kind in KINDS if (one := _flagged(model, kind, roots, left, measured_j)) is not None]
    if not found:
        return None
    found.sort(key=lambda one: -one.gain)
    best = found[0]
    return Level(
        kind=best.kind,
        trips=tuple(cut.trip_id for cut, on in zip(model.windows, best.on, strict=True) if on),
        rise_frac=tuple(best.rise[best.on].tolist()),
        sd_frac=tuple(best.sd[best.on].tolist()),
        energy_j=float((best.rise * best.energy_j)[best.on].sum()),
        energy_sd_j=float(np.sqrt(np.square(best.sd * best.energy_j)[best.on].sum())),
        share_frac=best.share,
        z=best.z,
        rivals=tuple(one.kind for one in found[1:] if one.gain >= SAME_GAIN_FRAC * best.gain),
    )


@dataclass(frozen=True, slots=True)
class _Flagged:
    """Trips that stand out by one kind: which, rise and sd of all trips [-], energy of a rise of 1 [J]."""

    kind: Kind
    gain: float
    on: NDArray[np.bool_]
    rise: NDArray[np.float64]
    sd: NDArray[np.float64]
    energy_j: NDArray[np.float64]
    share: float
    z: float


def _flagged(
    model: Model,
    kind: Kind,
    roots: Sequence[NDArray[np.float64]],
    left: Sequence[NDArray[np.float64]],
    measured_j: float,
) -> _Flagged | None:
    count = len(model.windows)
    rise, sd, energy_j = np.zeros(count), np.full(count, np.inf), np.zeros(count)
    for k, (trip, cut) in enumerate(zip(model.trips, model.windows, strict=True)):
        column_j = summed(trip, kind.column_j(trip.drive))
        column = whitened(roots[k], column_j / cut.duration_s)
        size = float(column @ column)
        if size > 0.0:
            rise[k], sd[k], energy_j[k] = float(column @ left[k]) / size, 1.0 / np.sqrt(size), float(column_j.sum())
    centre, spread = _bulk(rise)
    above = rise - centre
    z = above / np.sqrt(sd**2 + spread**2)
    on = (z > STANDS_OUT) & (above > LEAST_RISE_FRAC)
    share = float((above * energy_j)[on].sum()) / measured_j
    if not LEAST_FLAGGED <= int(on.sum()) <= 0.5 * count or share < LEAST_SHARE_FRAC:
        return None
    gain = float(np.square(above / sd)[on].sum())
    return _Flagged(kind, gain, on, above, np.hypot(sd, spread), energy_j, share, float(z[on].min()))


def _bulk(values: NDArray[np.float64]) -> tuple[float, float]:
    """Centre and standard deviation of the bulk: of the shortest interval that holds half of the values."""
    ordered = np.sort(values)
    half = ordered.size // 2 + 1
    width = ordered[half - 1 :] - ordered[: ordered.size - half + 1]
    first = int(np.argmin(width))
    return float(np.median(ordered[first : first + half])), float(width[first]) / NORMAL_HALF
