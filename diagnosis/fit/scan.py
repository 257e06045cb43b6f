"""Structure that no effect explains: power that is higher somewhere on an axis than in the rest of the drives.

Every interval of every axis is tried like an effect, beside all that was found, with the trip as the unit. What counts
is how far the highest of them all stands out, against drives with nothing left out, so that looking in many places
is paid for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import stats

from diagnosis.fit.axes import AXES, Axis
from diagnosis.fit.jackknife import AT_ONCE, Added, Additions, first_least, ranked, simulated_z, tried
from diagnosis.fit.noise import whitened
from diagnosis.fit.windows import measured_size_j

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.fit.windows import WindowedTrip, Windows

BINS: Final = 16
LONGEST: Final = 7  # bins of an interval; what covers more of an axis is its other side
ENDS: Final = 13  # places of each end of an interval, once it is found
LEAST_LENGTH_FRAC: Final = 0.25  # of its length, that it keeps
LEAST_TRIPS: Final = 4
DRAWS: Final = 200
FALSE_CLAIM_FRAC: Final = 0.01
LEAST_SHARE_FRAC: Final = 0.01
FORM_AXES: Final = (Axis.SPEED, Axis.POWER)
FORM_SHARE_FRAC: Final = 0.02  # on axes that the base model's own form lives on, which is never quite a real vehicle's
MOST_CELLS: Final = 300
CELL_M: Final = 250.0
METRES_PER_DEGREE: Final = 111_195.0
SCANNED: Final = (
    Axis.SPEED,
    Axis.POWER,
    Axis.SINCE_START,
    Axis.DISTANCE,
    Axis.AMBIENT,
    Axis.ALTITUDE,
    Axis.SOC,
    Axis.BATTERY_TEMPERATURE,
    Axis.HEADING,
)
REACHES: Final = (1, 2, 4)  # cells to each side of a place's middle, which takes it to 0.4, 0.6 and 1.1 km


@dataclass(frozen=True, slots=True)
class Box:
    """An interval of an axis in its unit; at a place, low is a map cell's number, high cells to each side."""

    axis: Axis
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Structure:
    """A box that stands out: power above the rest [W], its 95 % interval, energy [J], z, p over all boxes.

    low_set, high_set: where its ends may be with 95 %, None for a place. inside: share of each
    window's time, of each trip.
    """

    box: Box
    mean_w: float
    low_w: float
    high_w: float
    energy_j: float
    z: float
    p: float
    trips: tuple[str, ...]
    inside: tuple[NDArray[np.float64], ...]
    low_set: tuple[float, float] | None = None
    high_set: tuple[float, float] | None = None


Boxes = tuple[tuple[Box, ...], list["NDArray[np.float64]"]]


def boxes(
    trips: Sequence[Windows],
    left_out: frozenset[Axis] = frozenset(),
    driven: Sequence[WindowedTrip] | None = None,
) -> Boxes:
    """All boxes that LEAST_TRIPS trips reach, and the share of each window's time in each, float64 (n, m), a trip.

    left_out: axes that are not looked at. driven: the trips step by step, without which a window lies where its mean
    does.
    """
    found: list[Box] = []
    columns: list[list[NDArray[np.float64]]] = [[] for _ in trips]
    for axis in SCANNED:
        values = [None if axis in left_out else AXES[axis].values(trip) for trip in trips]
        known = [of_trip for of_trip in values if of_trip is not None]
        if len(known) < LEAST_TRIPS:
            continue
        edges = np.unique(np.quantile(np.concatenate(known), np.linspace(0.0, 1.0, BINS + 1)))
        below = _below(axis, edges, trips, driven)
        n = edges.size - 1
        for first in range(n):
            for last in range(first + 1, min(first + LONGEST, n) + 1):
                if last - first >= n:
                    continue
                inside = [_share(part, first, last, trip) for part, trip in zip(below, trips, strict=True)]
                if sum(bool(share.any()) for share in inside) >= LEAST_TRIPS:
                    found.append(Box(axis, float(edges[first]), float(edges[last])))
                    for column, share in zip(columns, inside, strict=True):
                        column.append(share)
    for number, reach, inside in _cells(trips):
        found.append(Box(Axis.PLACE, float(number), float(reach)))
        for column, share in zip(columns, inside, strict=True):
            column.append(share)
    return tuple(found), _stacked(columns, trips)


def around(box: Box, reach: float, trips: Sequence[Windows], driven: Sequence[WindowedTrip] | None = None) -> Boxes:
    """A box with each of its ends moved by up to reach, and the share of each window's time in each."""
    known = [values for values in (AXES[box.axis].values(trip) for trip in trips) if values is not None and values.size]
    least, most = min(float(values.min()) for values in known), max(float(values.max()) for values in known)
    lows, highs = (
        np.unique(np.clip(np.linspace(end - reach, end + reach, ENDS), least, most)) for end in (box.low, box.high)
    )
    edges = np.unique(np.concatenate((lows, highs)))
    below = _below(box.axis, edges, trips, driven)
    found: list[Box] = []
    columns: list[list[NDArray[np.float64]]] = [[] for _ in trips]
    for low in lows.tolist():
        for high in highs.tolist():
            if high - low < LEAST_LENGTH_FRAC * (box.high - box.low):
                continue
            first, last = (int(np.searchsorted(edges, end)) for end in (low, high))
            inside = [_share(part, first, last, trip) for part, trip in zip(below, trips, strict=True)]
            if sum(bool(share.any()) for share in inside) >= LEAST_TRIPS:
                found.append(Box(box.axis, low, high))
                for column, share in zip(columns, inside, strict=True):
                    column.append(share)
    return tuple(found), _stacked(columns, trips)


def _stacked(columns: Sequence[list[NDArray[np.float64]]], trips: Sequence[Windows]) -> list[NDArray[np.float64]]:
    return [
        np.column_stack(column) if column else np.empty((trip.begin_s.size, 0))
        for column, trip in zip(columns, trips, strict=True)
    ]


def _below(
    axis: Axis, edges: NDArray[np.float64], trips: Sequence[Windows], driven: Sequence[WindowedTrip] | None
) -> list[NDArray[np.float64] | None]:
    """Share of each window's time that lies below each edge, float64 (n, edges), of each trip; None where not known."""
    steps = [None] * len(trips) if driven is None else [AXES[axis].steps(trip) for trip in driven]
    found: list[NDArray[np.float64] | None] = []
    for k, trip in enumerate(trips):
        values, own = AXES[axis].values(trip), steps[k]
        if values is None:
            found.append(None)
        elif own is None or driven is None:
            found.append((values[:, None] < edges[None, :]).astype(np.float64))
        else:
            found.append(_time_below(driven[k], own, edges))
    known = [values for values in (AXES[axis].values(trip) for trip in trips) if values is not None and values.size]
    for share in found:
        if share is not None and edges[-1] >= max(float(values.max()) for values in known):
            share[:, -1] = 1.0  # the last interval holds the highest, and the first the lowest
        if share is not None and edges[0] <= min(float(values.min()) for values in known):
            share[:, 0] = 0.0
    return found


def _time_below(trip: WindowedTrip, values: NDArray[np.float64], edges: NDArray[np.float64]) -> NDArray[np.float64]:
    inside = trip.window >= 0
    window, duration_s = trip.window[inside], trip.drive.duration_s[inside]
    windows = int(trip.window.max(initial=-1)) + 1
    bins = np.searchsorted(edges, values[inside], side="right")  # values below edges[k] have a bin up to k
    time_s = np.bincount(window * (edges.size + 1) + bins, weights=duration_s, minlength=windows * (edges.size + 1))
    summed_s = np.cumsum(time_s.reshape(windows, edges.size + 1), axis=1)
    return np.asarray(summed_s[:, :-1] / summed_s[:, -1:], np.float64)


def _share(below: NDArray[np.float64] | None, first: int, last: int, trip: Windows) -> NDArray[np.float64]:
    """Share of each window's time between two edges, float64 (n,)."""
    if below is None:
        return np.zeros(trip.begin_s.size)
    return np.asarray(below[:, last] - below[:, first], np.float64)


@dataclass(frozen=True, slots=True)
class Scanned:
    """All boxes beside a base: what they would be, their places among simulated drives, and the threshold."""

    boxes: tuple[Box, ...]
    columns: list[NDArray[np.float64]]
    added: Additions
    highest: NDArray[np.float64]
    threshold: float
    hours: NDArray[np.float64]


def scan(
    trips: Sequence[Windows],
    roots: Sequence[NDArray[np.float64]],
    bases: Sequence[NDArray[np.float64]],
    precision: NDArray[np.float64],
    pull: NDArray[np.float64],
    scatter: NDArray[np.float64],
    seed: int,
    places: tuple[tuple[Box, ...], list[NDArray[np.float64]]],
) -> Scanned | None:
    """Every box beside the base: powers (n, b) [W] of each trip's columns with the precision and pull of their prior.

    scatter: how much more than the noise each trip's windows scatter. None where there is no box to look at.
    """
    found, columns = places
    if not found:
        return None
    powers = [
        whitened(root, np.column_stack((base, trip.residual_j() / trip.duration_s)))
        for trip, root, base in zip(trips, roots, bases, strict=True)
    ]
    step = max(AT_ONCE // (len(trips) * DRAWS), 1)
    parts = []
    for first in range(0, len(found), step):
        some = [column[:, first : first + step] for column in columns]
        parts.append(_some(trips, roots, powers, some, precision, pull, scatter, seed))
    added = _together([additions for additions, _ in parts])
    highest = np.max([z for _, z in parts], axis=0)
    hours = sum((column * trip.duration_s[:, None]).sum(axis=0) for trip, column in zip(trips, columns, strict=True))
    return Scanned(
        found,
        columns,
        added,
        highest,
        float(np.quantile(highest, 1.0 - FALSE_CLAIM_FRAC)),
        np.asarray(hours, np.float64),
    )


def _some(
    trips: Sequence[Windows],
    roots: Sequence[NDArray[np.float64]],
    powers: Sequence[NDArray[np.float64]],
    columns: Sequence[NDArray[np.float64]],
    precision: NDArray[np.float64],
    pull: NDArray[np.float64],
    scatter: NDArray[np.float64],
    seed: int,
) -> tuple[Additions, NDArray[np.float64]]:
    """Some of the boxes beside the base, and how far the highest of them stands out in each drawn set of drives.

    powers: whitened base and residual power of each trip, (n, b + 1). What is drawn is the same for all boxes.
    """
    rng = np.random.default_rng(seed)
    parts: dict[str, list[NDArray[np.float64]]] = {name: [] for name in ("gb", "x", "own", "vb", "v", "rb", "r")}
    for root, power, column, more in zip(roots, powers, columns, scatter, strict=True):
        x, y, u = power[:, :-1], power[:, -1], whitened(root, column)
        noise = more * rng.standard_normal((y.size, DRAWS))
        for name, value in zip(
            parts, (x.T @ x, x.T @ u, np.square(u).sum(axis=0), x.T @ y, u.T @ y, x.T @ noise, u.T @ noise), strict=True
        ):
            parts[name].append(np.asarray(value, np.float64))
    count = columns[0].shape[1]
    added = Added(
        gram_base=np.array(parts["gb"]),
        cross=np.array(parts["x"]),
        own=np.array(parts["own"]),
        base_vector=np.array(parts["vb"]),
        vector=np.array(parts["v"]),
        precision_base=precision,
        precision=np.zeros(count),
        base_prior=pull,
        added_prior=np.zeros(count),
    )
    z = np.abs(simulated_z(added, np.array(parts["rb"]), np.array(parts["r"]))).max(axis=1)
    return tried(added), np.asarray(z, np.float64)


def _together(parts: Sequence[Additions]) -> Additions:
    def all_of(name: str) -> NDArray[np.float64]:
        return np.concatenate([getattr(part, name) for part in parts], axis=-1)

    return Additions(all_of("coefficients"), all_of("sd"), all_of("z"), all_of("effective"), all_of("losses"))


def strongest(scanned: Scanned, trips: Sequence[Windows], least_z: float) -> Structure | None:
    """Of the boxes that pass the threshold and hold a share of the energy the one that predicts left-out trips best.

    Of boxes that do so alike, as those that hold the same windows, it is the first.
    """
    passes = _large(scanned, trips) & (np.abs(scanned.added.z) >= max(scanned.threshold, least_z))
    if not passes.any():
        return None
    return _structure(scanned, trips, int(first_least(np.where(passes, scanned.added.losses.sum(axis=0), np.inf))))


def placed(scanned: Scanned, structure: Structure, trips: Sequence[Windows], step: float, seed: int) -> Structure:
    """The structure at the ends that predict left-out trips best, and where they may be.

    scanned: the boxes around it, whose ends lie a step apart. The set of an end is what 95 % of draws of trips choose,
    and half a step to each side.
    """
    losses = scanned.added.losses
    usable = _large(scanned, trips) & (np.sign(scanned.added.coefficients) == np.sign(structure.mean_w))
    if not usable.any():
        return structure
    best = _structure(scanned, trips, int(first_least(np.where(usable, losses.sum(axis=0), np.inf))))
    drawn = np.random.default_rng(seed).multinomial(len(trips), np.full(len(trips), 1.0 / len(trips)), size=DRAWS)
    chosen = first_least(np.where(usable, drawn @ losses, np.inf))
    sets = []
    for end in ("low", "high"):
        ends = np.array([getattr(scanned.boxes[k], end) for k in chosen.tolist()])
        low, high = np.quantile(ends, (0.025, 0.975))
        sets.append((float(low) - 0.5 * step, float(high) + 0.5 * step))
    return replace(best, z=structure.z, p=structure.p, low_set=sets[0], high_set=sets[1])


def leading(scanned: Scanned, trips: Sequence[Windows], count: int) -> list[Structure]:
    """The box that predicts left-out trips best of each axis, of the axes where this is most, thresholds aside."""
    loss = scanned.added.losses.sum(axis=0)
    large = _large(scanned, trips)
    by_axis: dict[Axis, list[int]] = {}
    for k, box in enumerate(scanned.boxes):
        if large[k]:
            by_axis.setdefault(box.axis, []).append(k)
    best = [own[int(first_least(loss[own]))] for own in by_axis.values()]
    return [_structure(scanned, trips, best[k]) for k in ranked(loss[best])[:count]]


def only(
    places: tuple[tuple[Box, ...], list[NDArray[np.float64]]], axis: Axis
) -> tuple[tuple[Box, ...], list[NDArray[np.float64]]]:
    """The boxes of one axis."""
    kept = np.array([box.axis == axis for box in places[0]])
    return tuple(box for box in places[0] if box.axis == axis), [column[:, kept] for column in places[1]]


def joined(first: Boxes, second: Boxes) -> Boxes:
    """Boxes of both."""
    return (*first[0], *second[0]), [np.hstack(pair) for pair in zip(first[1], second[1], strict=True)]


def _large(scanned: Scanned, trips: Sequence[Windows]) -> NDArray[np.bool_]:
    """Whether each box holds its share of the energy."""
    measured_j = measured_size_j(trips)
    least = np.array([FORM_SHARE_FRAC if box.axis in FORM_AXES else LEAST_SHARE_FRAC for box in scanned.boxes])
    return np.asarray(np.abs(scanned.added.coefficients * scanned.hours) >= least * measured_j, np.bool_)


def _structure(scanned: Scanned, trips: Sequence[Windows], k: int) -> Structure:
    added = scanned.added
    half = float(stats.t.ppf(0.975, max(added.effective[k] - 1.0, 1.0)) * added.sd[k])
    inside = tuple(column[:, k] for column in scanned.columns)
    return Structure(
        scanned.boxes[k],
        float(added.coefficients[k]),
        float(added.coefficients[k]) - half,
        float(added.coefficients[k]) + half,
        float(added.coefficients[k] * scanned.hours[k]),
        float(added.z[k]),
        float((scanned.highest >= abs(added.z[k])).mean()),
        tuple(trip.trip_id for trip, flags in zip(trips, inside, strict=True) if flags.any()),
        inside,
    )


def in_box(box: Box, trip: Windows, driven: WindowedTrip | None = None) -> NDArray[np.float64]:
    """Share of each window's time in a box, float64 (n,); driven: the trip step by step, as `boxes`."""
    if box.axis is Axis.PLACE:
        near = _around(int(box.low), int(box.high))
        numbers = _numbers(trip)
        return np.zeros(trip.begin_s.size) if numbers is None else np.isin(numbers, near).astype(np.float64)
    edges = np.array([box.low, box.high])
    steps = None if driven is None else AXES[box.axis].steps(driven)
    values = AXES[box.axis].values(trip)
    if values is None:
        return np.zeros(trip.begin_s.size)
    below = (
        (values[:, None] < edges[None, :]).astype(np.float64)
        if steps is None or driven is None
        else _time_below(driven, steps, edges)
    )
    return _share(below, 0, 1, trip)


def cell_of(latitude_deg: NDArray[np.float64], longitude_deg: NDArray[np.float64]) -> NDArray[np.int64]:
    """Number of the map cell of CELL_M that each position lies in, int64 (n,)."""
    row = np.floor(latitude_deg * METRES_PER_DEGREE / CELL_M).astype(np.int64)
    at = (row + 0.5) * CELL_M / METRES_PER_DEGREE
    column = np.floor(longitude_deg * METRES_PER_DEGREE * np.cos(np.radians(at)) / CELL_M).astype(np.int64)
    return np.asarray(row * 1_000_000 + column + 500_000, np.int64)


def cell_centre_deg(number: int) -> tuple[float, float]:
    """Latitude and longitude of the centre of a map cell."""
    row, column = divmod(number, 1_000_000)
    latitude = (row + 0.5) * CELL_M / METRES_PER_DEGREE
    longitude = (column - 500_000 + 0.5) * CELL_M / (METRES_PER_DEGREE * np.cos(np.radians(latitude)))
    return float(latitude), float(longitude)


def _around(number: int, reach: int) -> NDArray[np.int64]:
    """Numbers of the cells within a reach of one."""
    steps = range(-reach, reach + 1)
    return np.array([number + 1_000_000 * dy + dx for dy in steps for dx in steps], np.int64)


def _cells(trips: Sequence[Windows]) -> list[tuple[int, int, list[NDArray[np.float64]]]]:
    """The map cells that most trips pass, each with its neighbours within several reaches."""
    numbers = [_numbers(trip) for trip in trips]
    passed: dict[int, int] = {}
    for cells in numbers:
        for number in np.unique(cells).tolist() if cells is not None else ():
            passed[number] = passed.get(number, 0) + 1
    chosen = sorted((number for number, count in passed.items() if count >= LEAST_TRIPS), key=lambda k: (-passed[k], k))
    found = []
    for reach in REACHES:
        for number in chosen[: MOST_CELLS : max(reach // 2, 1)]:
            near = _around(number, reach)
            inside = [
                np.zeros(trip.begin_s.size) if cells is None else np.isin(cells, near).astype(np.float64)
                for cells, trip in zip(numbers, trips, strict=True)
            ]
            found.append((number, reach, inside))
    return found


def _numbers(trip: Windows) -> NDArray[np.int64] | None:
    if not {"latitude_deg", "longitude_deg"} <= trip.places.keys():
        return None
    return cell_of(trip.places["latitude_deg"], trip.places["longitude_deg"])
