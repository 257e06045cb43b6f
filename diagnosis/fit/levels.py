"""Levels that single trips have of their own: a roof box, a load, soft tyres, a draw that was left on, on some drives.

After everything else is fitted, each trip is given its own drag, mass, rolling resistance or constant power. Those that
carry a level differ from the others by one size: the trips' own values are a mixture of two groups, days that differ a
little and the same with the level on top (b ~ (1 − π)·N(m, τ²) + π·N(m + μ, τ²)), against days that differ by cold
and heat alone. A level is named where the mixture gains more than it does on drawn days without one, where both halves
of the trips that carry it show it, and where its size is one that such a thing can have.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.causes.families import Family
from diagnosis.fit.jackknife import FORM_SD_FRAC, equations, solve
from diagnosis.fit.mixture import Groups, drawn_gains, groups_of, spread_of, step_of
from diagnosis.fit.noise import KERNELS, estimated, whitened
from diagnosis.fit.windows import FINE_WINDOW_S, is_heightless, measured_size_j, summed
from energy.units import GRAVITY_MPS2, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from diagnosis.causes.driven import ReplayedDrive
    from diagnosis.fit.model import Model
    from diagnosis.fit.noise import Noise
    from diagnosis.fit.windows import WindowedTrip, Windows

LEVEL: Final = "level of some trips"
LEAST_TRIPS: Final = 8  # fewer have no bulk that others stand out from
LEAST_ON: Final = 2  # trips that carry a level; one alone may be anything
FALSE_CLAIM_FRAC: Final = 0.01
DRAWS: Final = 200
LEAST_STEP: Final = 1.5  # likewise of a step, which all trips from a date on have taken
LEAST_APART: Final = 4.0  # spreads of days by which a level lies from them
SAME_FRAC: Final = 0.8  # of what the best kind explains, from which on another can't be told from it
SURE_FRAC: Final = 0.85  # of the trips, that must clearly carry the level or clearly not
SURE: Final = 0.9
HALVES_FRAC: Final = 0.75  # of the trips that carry it, both halves of which must be better met with it
STEP_HALVES_FRAC: Final = 0.5  # likewise of a step, which need not show on each trip
STEP_LEAST_FRAC: Final = 0.6  # of the least size of a level, that a step has
STEP_GAIN: Final = 2.5  # beyond what draws of normal days reach: real days have more of the rare
LEAST_SPREAD: Final = 1.4  # times what days differ by, that loads make of trips' own masses
LEAST_SPREAD_GAIN: Final = 8.0
AGREEMENT: Final = 0.7  # of ranks, between stretches of trips
STRETCH: Final = 6  # windows
LEAST_SHARE_FRAC: Final = 0.01  # of the energy of all trips
CLEAR_Z: Final = 5.5  # of a level that is no stand-in for something else
EPOCH_S: Final = 1e8  # times from here on are of a calendar
COLD_C: Final = 20.0
HOT_C: Final = 22.0
USUAL_WIND_MPS: Final = 4.0  # at the height of a vehicle
LEAST_WIND_MPS: Final = 2.2
WIND_RATIO: Final = 5.0
WIND_SHARE_FRAC: Final = 0.04  # a breeze that nobody records holds 2 to 3 %


@dataclass(frozen=True, slots=True)
class LevelKind:
    """Something that a trip can have more of: the energy of one unit of it, float64 (n,) [J].

    unit: "1" for a share of the vehicle's own, whose field is named, else the unit. kernel: of the noise, that stands
    for days that differ by it. days: how much they do anyway; least, most: what a level of it has.
    """

    effect: str
    family: Family
    unit: str
    column_j: Callable[[ReplayedDrive], NDArray[np.float64]]
    field: str
    kernel: str
    days: float
    least: float
    most: float


@dataclass(frozen=True, slots=True)
class Level:
    """Trips that carry a level: of which kind, and how much on average in its unit.

    half: of its 95 % interval. energy_j: of all these trips. since: from or up to which trip all carry it and no other,
    where it was a step, or how it drifts; of a level that drifts, trips are those that have more than half of it.
    rivals: kinds that fit as well. z: root of twice the gain in log likelihood. unit_size: times the kind's column;
    carried: what each trip has of it, by its id.
    """

    kind: LevelKind
    trips: tuple[str, ...]
    size: float
    half: float
    energy_j: float
    share_frac: float
    z: float
    since: str | None
    rivals: tuple[LevelKind, ...]
    unit_size: float
    carried: Mapping[str, float]
    drifts: bool


def _drag(drive: ReplayedDrive) -> NDArray[np.float64]:
    return drive.work_j(drive.vehicle.road_load_c_n_per_mps2 * drive.speed_mps**2)


def _mass(drive: ReplayedDrive) -> NDArray[np.float64]:
    car = drive.vehicle
    force = car.rotating_mass_coef * drive.accel_mps2 + GRAVITY_MPS2 * drive.grade_frac
    return drive.work_j(car.mass_kg * force + car.road_load_a_n)


def _rolling(drive: ReplayedDrive) -> NDArray[np.float64]:
    return drive.work_j(float(drive.vehicle.road_load_a_n))


def _power(drive: ReplayedDrive) -> NDArray[np.float64]:
    return drive.duration_s


def _grade(drive: ReplayedDrive) -> NDArray[np.float64]:
    return drive.work_j(0.01 * drive.vehicle.mass_kg * GRAVITY_MPS2)


DRAG: Final = LevelKind("roof_load", Family.AERODYNAMIC, "1", _drag, "road_load_c_n_per_mps2", "drag", 0.05, 0.12, 1.0)
LOAD: Final = LevelKind("trip_payload", Family.MASS, "1", _mass, "mass_kg", "", 0.025, 0.06, 0.6)
ROLLING: Final = LevelKind("trip_rolling", Family.ROLLING, "1", _rolling, "road_load_a_n", "rolling", 0.05, 0.12, 0.8)
POWER: Final = LevelKind("trip_power", Family.AUXILIARY, "W", _power, "", "level", 60.0, 250.0, 5000.0)
KINDS: Final = (DRAG, LOAD, ROLLING, POWER)
# where no height was recorded
GRADE: Final = LevelKind("trip_grade", Family.GRADE, "%", _grade, "", "mean_grade", 0.3, 0.8, 4.0)


def levels(model: Model) -> Level | None:
    """The level that some trips carry, if any stands out."""
    if len(model.windows) < LEAST_TRIPS or model.structures:
        return None
    differing = loads(model)
    if differing is not None:
        return differing
    noise = _within(model)
    known = {candidate.term.family for candidate in model.found}
    heightless = is_heightless(model.windows)
    kinds = [kind for kind in KINDS if kind.family is not Family.MASS or Family.MASS not in known]
    tried = [_tried(model, kind, noise) for kind in (*kinds, *((GRADE,) if heightless else ()))]
    found = sorted((one for one in tried if one is not None and one.clear), key=lambda one: -one.explained)
    if not found:
        return None
    best = found[0]
    size, half, energy_j = _joint(model, best)
    unit_size = size
    if best.kind.field:  # of the file's number, whatever the fit has made of it
        file = abs(float(getattr(model.nameplate, best.kind.field)))
        factor = abs(float(getattr(model.vehicle, best.kind.field))) / max(file, 1e-9)
        size, half = factor * size, factor * half
    share = abs(energy_j) / measured_size_j(model.windows)
    if not _least(best.kind, best.groups) <= size <= best.kind.most or size - half <= 0.0 or share < LEAST_SHARE_FRAC:
        return None
    on = [trip.trip_id for trip, carries in zip(model.windows, best.groups.on, strict=True) if carries]
    return Level(
        kind=best.kind,
        trips=tuple(on),
        size=size,
        half=half,
        energy_j=energy_j,
        share_frac=energy_j / measured_size_j(model.windows),
        z=float(np.sqrt(2.0 * best.groups.gain)),
        since=_since(model.trips, best.groups) if best.groups.step else None,
        rivals=tuple(one.kind for one in found[1:] if one.explained >= SAME_FRAC * best.explained),
        unit_size=unit_size,
        carried={trip.trip_id: share for trip, share in zip(model.windows, _carried(best.groups), strict=True)},
        drifts=best.groups.drift,
    )


@dataclass(frozen=True, slots=True)
class _Tried:
    """One kind: the groups of trips that it makes, whether they are more than days that differ, and what it explains.

    explained: log likelihood that windows of trips which carry it gain by it.
    """

    kind: LevelKind
    groups: Groups
    clear: bool
    explained: float


def _within(model: Model) -> Noise:
    """The noise within trips: of residuals after each trip's own level, rolling resistance and drag."""
    own = []
    for k, trip in enumerate(model.windows):
        columns = np.column_stack(
            [trip.duration_s, trip.column("road_load_a_n"), trip.column("road_load_c_n_per_mps2")]
        )
        powers = columns / trip.duration_s[:, None]
        residual_w = model.residual_w(k)
        own.append(residual_w - powers @ np.linalg.lstsq(powers, residual_w, rcond=1e-9)[0])
    noise = estimated(model.windows, own, model.noise.window_s)
    car = model.vehicle
    variance = noise.variance.copy()
    variance[KERNELS.index("level")] = POWER.days**2
    variance[KERNELS.index("rolling")] = (ROLLING.days * car.road_load_a_n) ** 2
    variance[KERNELS.index("drag")] = (DRAG.days * car.road_load_c_n_per_mps2) ** 2
    return replace(noise, variance=variance)


def _own(
    model: Model, kind: LevelKind, within: Noise
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[NDArray[np.float64]], list[NDArray[np.float64]]]:
    """What trips say of a kind: values and deviations (K,), whitened columns, and what they are to explain.

    A trip that does not tell has an infinite deviation. Beside their own of the kind, days differ in the other kinds as
    they do anyway.
    """
    variance = within.variance.copy()
    if kind.kernel:
        variance[KERNELS.index(kind.kernel)] = 0.0
    noise = replace(within, variance=variance)
    roots = [noise.root(trip) for trip in model.windows]
    residuals = [whitened(root, model.residual_w(k)) for k, root in enumerate(roots)]
    values, sd = np.zeros(len(model.windows)), np.full(len(model.windows), np.inf)
    columns = []
    for k, (trip, windows) in enumerate(zip(model.trips, model.windows, strict=True)):
        column = whitened(roots[k], summed(trip, kind.column_j(trip.drive)) / windows.duration_s)
        columns.append(column)
        size = float(column @ column)
        if size > 0.0:
            values[k], sd[k] = float(column @ residuals[k]) / size, 1.0 / np.sqrt(size)
    return values, sd, columns, residuals


def loads(model: Model) -> Level | None:
    """Loads that differ from trip to trip: their own masses spread more than days do; None where they do not.

    Odd and even stretches of a trip must tell of the same load, or it is no property of the trip. trips: those whose
    load is clear; energy of all that have any.
    """
    seen = model.noise.window_s <= FINE_WINDOW_S and not is_heightless(model.windows)
    if not seen or any(candidate.term.family is Family.MASS for candidate in model.found):
        return None
    values, sd, columns, residuals = _own(model, LOAD, _within(model))
    known = np.isfinite(sd)
    if int(known.sum()) < LEAST_TRIPS:
        return None
    spread, gain = spread_of(values, sd, _weather(model.windows), LOAD.days)
    if spread < LEAST_SPREAD * LOAD.days or gain < LEAST_SPREAD_GAIN or _agreement(columns, residuals) < AGREEMENT:
        return None
    factor = model.vehicle.mass_kg / model.nameplate.mass_kg * (1.0 + _gain_of_both(model))
    share = factor * (1.0 + values * spread**2 / (spread**2 + np.where(known, sd, np.inf) ** 2)) - 1.0
    on = known & (share >= LOAD.least) & (share > 2.0 * sd)
    if int(on.sum()) < LEAST_ON or float(share[on].max()) > LOAD.most:
        return None
    size = float(share[on].mean())
    more = np.where(known, np.maximum(share, 0.0), 0.0)
    energies = [
        float(summed(trip, LOAD.column_j(trip.drive)).sum()) * own / factor
        for trip, own in zip(model.trips, more.tolist(), strict=True)
    ]
    half = 1.96 * float(np.hypot(FORM_SD_FRAC * size, LOAD.days))
    names = [trip.trip_id for trip in model.windows]
    carried = (more / size).tolist()
    return Level(
        kind=LOAD,
        trips=tuple(name for name, carries in zip(names, on.tolist(), strict=True) if carries),
        size=size,
        half=half,
        energy_j=sum(energies),
        share_frac=sum(map(abs, energies)) / measured_size_j(model.windows),
        z=float(np.sqrt(2.0 * gain)),
        since=None,
        rivals=(),
        unit_size=size / factor,
        carried=dict(zip(names, carried, strict=True)),
        drifts=False,
    )


def _gain_of_both(model: Model) -> float:
    """What a fit has called gains of acceleration and of grade, where both are of one sign: mass as well [-]."""
    gains = [model.solution.value(name) for name in ("acceleration_gain", "grade_gain")]
    return float(np.mean(gains)) if gains[0] * gains[1] > 0.0 else 0.0


def _agreement(columns: Sequence[NDArray[np.float64]], residuals: Sequence[NDArray[np.float64]]) -> float:
    """Correlation over trips of what their odd and their even stretches tell [-]."""
    pairs = []
    for column, residual in zip(columns, residuals, strict=True):
        odd = (np.arange(column.size) // STRETCH) % 2 == 1
        sizes = [float(column[part] @ column[part]) for part in (odd, ~odd)]
        if min(sizes) > 0.0:
            pairs.append(
                [float(column[part] @ residual[part]) / size for part, size in zip((odd, ~odd), sizes, strict=True)]
            )
    if len(pairs) < LEAST_TRIPS:
        return 0.0
    first, second = (np.argsort(np.argsort(side)) for side in np.array(pairs).T)  # ranks, since one trip may be far off
    return float(np.corrcoef(first, second)[0, 1])


def _tried(model: Model, kind: LevelKind, within: Noise) -> _Tried | None:
    """One kind: what trips say of it, in two groups or a step."""
    values, sd, columns, residuals = _own(model, kind, within)
    told = np.isfinite(sd)
    if int(told.sum()) < LEAST_TRIPS:
        return None
    weather, order = _weather(model.windows), _order(model.trips)
    groups = groups_of(values, sd, weather, kind.days)
    step = step_of(values, sd, weather, kind.days, order)
    if step is not None and (groups is None or step.gain > groups.gain):
        groups = step
    if groups is None or not LEAST_ON <= int(groups.on.sum()) <= len(model.windows) - LEAST_ON:
        return None
    clear = (
        groups.apart >= (LEAST_STEP if groups.step else LEAST_APART)
        and (groups.drift or float((np.abs(groups.belongs - 0.5) >= SURE - 0.5).mean()) >= SURE_FRAC)
        and _least(kind, groups) <= groups.shift <= kind.most
        and _both_halves(columns, residuals, groups) >= (STEP_HALVES_FRAC if groups.step else HALVES_FRAC)
    )
    if clear:
        draws = drawn_gains(sd, weather, kind.days, groups.null_spread, DRAWS, order if groups.step else None)
        clear = groups.gain > float(np.quantile(draws, 1.0 - FALSE_CLAIM_FRAC)) + (STEP_GAIN if groups.step else 0.0)
    explained = 0.0
    for k in np.flatnonzero(groups.on).tolist():
        residual, column = residuals[k] - groups.usual[k] * columns[k], columns[k]
        explained += 0.5 * _gain(column, residual, groups.shift * _carried(groups)[k])
    return _Tried(kind, groups, clear, explained)


def _least(kind: LevelKind, groups: Groups) -> float:
    """What a level has at least; a step is one of few possible ones, so that less of it stands out."""
    return kind.least * (STEP_LEAST_FRAC if groups.step else 1.0)


def _weather(windows: Sequence[Windows]) -> NDArray[np.float64]:
    """What cold and heat would make of each trip's own value, float64 (K, 2) [K]; 0 where no temperature is known."""
    known = [np.nan if trip.ambient_k is None else trip.ambient_k - ZERO_CELSIUS_K for trip in windows]
    celsius = np.array(known)
    pair = np.column_stack((np.maximum(COLD_C - celsius, 0.0), np.maximum(celsius - HOT_C, 0.0)))
    return np.asarray(np.nan_to_num(pair), np.float64)


def _both_halves(
    columns: Sequence[NDArray[np.float64]], residuals: Sequence[NDArray[np.float64]], groups: Groups
) -> float:
    """Share of the trips that carry a level, both halves of which are better met with it than without [-]."""
    better = []
    for k in np.flatnonzero(groups.on).tolist():
        half = residuals[k].size // 2
        gains = []
        for part in (slice(0, half), slice(half, None)):
            residual, column = residuals[k][part] - groups.usual[k] * columns[k][part], columns[k][part]
            gains.append(_gain(column, residual, groups.shift * _carried(groups)[k]))
        better.append(min(gains) > 0.0)
    return float(np.mean(better))


def _gain(column: NDArray[np.float64], residual: NDArray[np.float64], size: float) -> float:
    """How much less is left of whitened residuals, squared, with so many units of a column."""
    return float(2.0 * size * column @ residual - size**2 * column @ column)


def _order(trips: Sequence[WindowedTrip]) -> NDArray[np.int64]:
    """Indices of trips in the order that they were driven in: by the calendar, or else by their names."""
    begins = [float(trip.recording.time_s[0]) for trip in trips]
    dated = min(begins) > EPOCH_S and len(set(begins)) == len(begins)
    keys = [(begin if dated else 0.0, _natural(trip.recording.id)) for begin, trip in zip(begins, trips, strict=True)]
    return np.array(sorted(range(len(trips)), key=keys.__getitem__), np.int64)


def _carried(groups: Groups) -> list[float]:
    """What each trip has of a level: all or nothing, or its share of one that grows."""
    shares: list[float] = (groups.belongs if groups.drift else groups.on.astype(np.float64)).tolist()
    return shares


def _since(trips: Sequence[WindowedTrip], groups: Groups) -> str:
    """When a step was taken, in words that follow a number of trips."""
    order = _order(trips)
    carried = groups.on[order]
    if groups.drift:
        first, last = (trips[order[k]].recording.id for k in ((-1, 0) if carried[0] else (0, -1)))
        return f"growing from none on {first} to all of it on {last}"
    if carried[0]:
        return f"up to {trips[order[int(carried.sum()) - 1]].recording.id}"
    return f"from {trips[order[int(np.argmax(carried))]].recording.id} on"


def _natural(name: str) -> tuple[tuple[int, str], ...]:
    """A name in the order that people count in: trip 9 before trip 10."""
    return tuple((int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", name))


def _joint(model: Model, tried: _Tried) -> tuple[float, float, float]:
    """The size that trips have in common beside everything else, half of its interval, and its energy [J]."""
    columns = [
        summed(trip, tried.kind.column_j(trip.drive)) * share
        for trip, share in zip(model.trips, _carried(tried.groups), strict=True)
    ]
    windows = [trip.with_column(LEVEL, column) for trip, column in zip(model.windows, columns, strict=True)]
    system = equations(windows, model.roots, model.system.prior.with_free())
    solution = solve(system, [*model.solution.names, LEVEL])
    weights = np.array([float(name == LEVEL) for name in solution.names])
    size = solution.value(LEVEL)
    return size, solution.half_width(weights), size * float(sum(column.sum() for column in columns))


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


def trip_wind(model: Model, level: Level | None = None) -> TripWind | None:
    """A wind of each trip's own, where headings were recorded and winds were not; None where nothing speaks of one.

    level: what some trips carry, to be taken out before.

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
        left_w = model.residual_w(k)
        if level is not None:
            size = level.unit_size * level.carried[windows.trip_id]
            left_w = left_w - size * summed(trip, level.kind.column_j(trip.drive)) / windows.duration_s
        columns, residual = whitened(root, columns_j / windows.duration_s[:, None]), whitened(root, left_w)
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
