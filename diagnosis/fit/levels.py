"""Levels that single trips have of their own: a roof box, a load, soft tyres, on some drives and not on others.

After everything else is fitted, each trip is given its own drag, mass or rolling resistance. Where trips differ by more
of it than clean drives do, the upper of two groups of them is named; which of the three it was is decided by what
fits best.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.causes.families import Family
from diagnosis.fit.jackknife import equations, solve
from diagnosis.fit.noise import KERNELS, whitened
from diagnosis.fit.windows import measured_size_j, summed
from energy.units import GRAVITY_MPS2

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from diagnosis.causes.driven import ReplayedDrive
    from diagnosis.fit.model import Model

LEVEL: Final = "level of some trips"
LEAST_TRIPS: Final = 8  # fewer have no bulk that others stand out from
LEAST_GAIN: Final = 20.0  # mean square of trips' differences over what noise makes of them; clean drives reach 30
SAME_GAIN_FRAC: Final = 0.7  # of the best kind's gain, from which on another can't be told from it
USUAL_WIND_MPS: Final = 4.0  # at the height of a vehicle
LEAST_WIND_MPS: Final = 2.2
WIND_RATIO: Final = 5.0
WIND_SHARE_FRAC: Final = 0.04  # a breeze that nobody records holds 2 to 3 %


@dataclass(frozen=True, slots=True)
class LevelKind:
    """Something that a trip can have more of: its energy for twice the vehicle's own, float64 (n,) [J].

    least_rise_frac: of the vehicle's own, below which days differ anyway; least_share_frac: of the energy likewise, of
    all trips' differences together.
    """

    effect: str
    family: Family
    column_j: Callable[[ReplayedDrive], NDArray[np.float64]]
    least_rise_frac: float
    least_share_frac: float


@dataclass(frozen=True, slots=True)
class Level:
    """Trips that carry a level: of which kind, and by what share of the vehicle's own on average [-].

    half_frac: of its 95 % interval. energy_j: of all these trips. rivals: kinds that fit as well.
    """

    kind: LevelKind
    trips: tuple[str, ...]
    rise_frac: float
    half_frac: float
    energy_j: float
    share_frac: float
    z: float
    rivals: tuple[LevelKind, ...]


def _drag(drive: ReplayedDrive) -> NDArray[np.float64]:
    return drive.work_j(drive.vehicle.road_load_c_n_per_mps2 * drive.speed_mps**2)


def _mass(drive: ReplayedDrive) -> NDArray[np.float64]:
    car = drive.vehicle
    force = car.rotating_mass_coef * drive.accel_mps2 + GRAVITY_MPS2 * drive.grade_frac
    return drive.work_j(car.mass_kg * force + car.road_load_a_n)


def _rolling(drive: ReplayedDrive) -> NDArray[np.float64]:
    return drive.work_j(float(drive.vehicle.road_load_a_n))


KINDS: Final = (
    LevelKind("roof_load", Family.AERODYNAMIC, _drag, 0.1, 0.045),
    LevelKind("trip_payload", Family.MASS, _mass, 0.03, 0.0125),
    LevelKind("trip_rolling", Family.ROLLING, _rolling, 0.15, 0.045),
)


def levels(model: Model) -> Level | None:
    """The level that some trips carry, if any stands out."""
    if len(model.windows) < LEAST_TRIPS or model.structures:
        return None
    variance = model.noise.variance.copy()
    for name in ("rolling", "drag"):
        variance[KERNELS.index(name)] = 0.0
    noise = replace(model.noise, variance=variance)
    measured_j = measured_size_j(model.windows)
    roots = [noise.root(trip) for trip in model.windows]
    residuals = [whitened(root, model.residual_w(k)) for k, root in enumerate(roots)]
    known = {candidate.term.family for candidate in model.found}
    tried = [
        _flagged(model, kind, roots, residuals, measured_j)
        for kind in KINDS
        if kind.family is not Family.MASS or Family.MASS not in known
    ]
    found = [flagged for flagged in tried if flagged is not None]
    if not found:
        return None
    found.sort(key=lambda flagged: -flagged.gain)
    best = found[0]
    if not best.clear:
        return None
    rise, half, energy_j = _joint(model, best)
    return Level(
        kind=best.kind,
        trips=tuple(trip.trip_id for trip, on in zip(model.windows, best.on, strict=True) if on),
        rise_frac=rise,
        half_frac=half,
        energy_j=energy_j,
        share_frac=energy_j / measured_j,
        z=float(np.sqrt(best.gain)),
        rivals=tuple(flagged.kind for flagged in found[1:] if flagged.gain >= SAME_GAIN_FRAC * best.gain),
    )


def _joint(model: Model, flagged: _Flagged) -> tuple[float, float, float]:
    """The rise that flagged trips have in common beside everything else, half of its interval, and its energy [J]."""
    columns = [
        summed(trip, flagged.kind.column_j(trip.drive)) * float(on)
        for trip, on in zip(model.trips, flagged.on, strict=True)
    ]
    windows = [trip.with_column(LEVEL, column) for trip, column in zip(model.windows, columns, strict=True)]
    precision, prior = (np.append(values, 0.0) for values in (model.system.precision, model.system.prior))
    solution = solve(equations(windows, model.roots, precision, prior), [*model.solution.names, LEVEL])
    weights = np.array([float(name == LEVEL) for name in solution.names])
    rise = solution.value(LEVEL)
    return rise, solution.half_width(weights), rise * float(sum(column.sum() for column in columns))


@dataclass(frozen=True, slots=True)
class _Flagged:
    """Trips that differ by one kind: how much is gained by it over what noise would, and which trips carry it.

    clear: whether it is more than clean drives differ by.
    """

    kind: LevelKind
    gain: float
    on: NDArray[np.bool_]
    clear: bool


@dataclass(frozen=True, slots=True)
class TripWind:
    """A wind that drives speak of and that was not recorded: of each trip, towards east and north [m/s], (K,).

    energy_j: of all trips; share_frac: of its sizes by trip. ratio: how much it gains over what noise would.
    """

    from_east_mps: NDArray[np.float64]
    from_north_mps: NDArray[np.float64]
    mean_mps: float
    energy_j: float
    share_frac: float
    ratio: float


def trip_wind(model: Model) -> TripWind | None:
    """A wind of each trip's own, where headings were recorded and winds were not; None where nothing speaks of one.

    Each trip gets the wind that explains most of what is left, about none by USUAL_WIND_MPS. Trips must gain far more
    by it than by chance, and the wind must be more than a breeze and hold a share of the energy.
    """
    if any(candidate.term.family is Family.WIND for candidate in model.found):
        return None
    winds, gains, energies, sizes = [], [], [], []
    for k, (trip, windows) in enumerate(zip(model.trips, model.windows, strict=True)):
        channels = trip.drive.channels
        if "heading_rad" not in channels or "wind_speed_mps" in channels:
            continue
        drag = 2.0 * model.nameplate.road_load_c_n_per_mps2 * trip.drive.speed_mps
        columns_j = np.column_stack(
            [summed(trip, trip.drive.work_j(drag * turned(channels["heading_rad"]))) for turned in (np.sin, np.cos)]
        )
        root = model.roots[k]
        columns, residual = whitened(root, columns_j / windows.duration_s[:, None]), whitened(root, model.residual_w(k))
        gram = columns.T @ columns
        side = columns.T @ residual
        wind = np.linalg.solve(gram + np.eye(2) / USUAL_WIND_MPS**2, side)
        winds.append(wind)
        sizes.append(float(np.trace(gram)))
        gains.append(float(2.0 * wind @ side - wind @ gram @ wind))
        energies.append(float((columns_j @ wind).sum()))
    if len(winds) < LEAST_TRIPS:
        return None
    measured_j = measured_size_j(model.windows)
    speeds = np.hypot(*np.array(winds).T)
    known = np.array(sizes)
    found = TripWind(
        np.array(winds)[:, 0],
        np.array(winds)[:, 1],
        float(np.sqrt(np.average(speeds**2, weights=known))),
        float(np.sum(energies)),
        float(np.abs(energies).sum()) / measured_j,
        float(np.median(gains)) / 1.386,  # the median of χ² with two degrees of freedom
    )
    stands_out = found.ratio >= WIND_RATIO and found.mean_mps >= LEAST_WIND_MPS
    return found if stands_out and found.share_frac >= WIND_SHARE_FRAC else None


def _flagged(
    model: Model,
    kind: LevelKind,
    roots: Sequence[NDArray[np.float64]],
    residuals: Sequence[NDArray[np.float64]],
    measured_j: float,
) -> _Flagged | None:
    count = len(model.windows)
    rise, sd, energy_j = np.zeros(count), np.full(count, np.inf), np.zeros(count)
    for k, (trip, windows) in enumerate(zip(model.trips, model.windows, strict=True)):
        column_j = summed(trip, kind.column_j(trip.drive))
        column = whitened(roots[k], column_j / windows.duration_s)
        size = float(column @ column)
        if size > 0.0:
            rise[k], sd[k], energy_j[k] = (
                float(column @ residuals[k]) / size,
                1.0 / np.sqrt(size),
                float(column_j.sum()),
            )
    share = float((np.abs(rise - np.median(rise)) * energy_j).sum()) / measured_j
    gain = float(np.mean(np.square((rise - np.median(rise)) / sd)))
    on = _upper(rise)
    apart = float(rise[on].mean() - rise[~on].mean()) if 0 < int(on.sum()) < count else 0.0
    if not 0 < int(on.sum()) < count:
        return None
    clear = share >= kind.least_share_frac and gain >= LEAST_GAIN and apart >= kind.least_rise_frac
    return _Flagged(kind, gain, on, clear)


def _upper(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which values belong to the upper of the two groups that differ most (Otsu's split), bool (n,)."""
    ordered = np.sort(values)
    below = np.arange(1, ordered.size)
    low = np.cumsum(ordered)[:-1] / below
    high = (ordered.sum() - np.cumsum(ordered)[:-1]) / (ordered.size - below)
    between = below * (ordered.size - below) * np.square(high - low)
    return np.asarray(values > ordered[int(np.argmax(between))], np.bool_)
