"""Structure that no effect explains: power that is higher somewhere on an axis than in the rest of the drives.

Every interval of every axis is tried like an effect, beside all that was found, with the trip as the unit. What counts
is how far the highest of them all stands out, against drives with nothing left out, so that looking in many places
is paid for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import stats

from diagnosis.fit.axes import AXES, Axis
from diagnosis.fit.jackknife import Added, first_least, ranked, simulated_z, tried
from diagnosis.fit.noise import whitened
from diagnosis.fit.windows import measured_size_j

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from diagnosis.fit.jackknife import Additions
    from diagnosis.fit.windows import Windows

BINS: Final = 16
LONGEST: Final = 7  # bins of an interval; what covers more of an axis is its other side
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
    """A box that stands out: power above the rest [W], its 95 % interval, energy [J], z, p over all boxes."""

    box: Box
    mean_w: float
    low_w: float
    high_w: float
    energy_j: float
    z: float
    p: float
    trips: tuple[str, ...]
    inside: tuple[NDArray[np.float64], ...]


def boxes(
    trips: Sequence[Windows], left_out: frozenset[Axis] = frozenset()
) -> tuple[tuple[Box, ...], list[NDArray[np.float64]]]:
    """All boxes that LEAST_TRIPS trips reach, and whether windows lie in each: float64 (n, m), 0 or 1, a trip.

    left_out: axes that are not looked at.
    """
    found: list[Box] = []
    columns: list[list[NDArray[np.float64]]] = [[] for _ in trips]
    for axis in SCANNED:
        values = [None if axis in left_out else AXES[axis].values(trip) for trip in trips]
        known = [of_trip for of_trip in values if of_trip is not None]
        if len(known) < LEAST_TRIPS:
            continue
        edges = np.unique(np.quantile(np.concatenate(known), np.linspace(0.0, 1.0, BINS + 1)))
        n = edges.size - 1
        for first in range(n):
            for last in range(first + 1, min(first + LONGEST, n) + 1):
                if last - first >= n:
                    continue
                inside = [
                    _inside(of_trip, edges, first, last, trip) for of_trip, trip in zip(values, trips, strict=True)
                ]
                if sum(bool(flags.any()) for flags in inside) >= LEAST_TRIPS:
                    found.append(Box(axis, float(edges[first]), float(edges[last])))
                    for column, flags in zip(columns, inside, strict=True):
                        column.append(flags)
    for number, reach, inside in _cells(trips):
        found.append(Box(Axis.PLACE, float(number), float(reach)))
        for column, flags in zip(columns, inside, strict=True):
            column.append(flags)
    return tuple(found), [
        np.column_stack(column) if column else np.empty((trip.begin_s.size, 0))
        for column, trip in zip(columns, trips, strict=True)
    ]


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
    rng = np.random.default_rng(seed)
    parts: dict[str, list[NDArray[np.float64]]] = {name: [] for name in ("gb", "x", "own", "vb", "v", "rb", "r")}
    for trip, root, base, column, more in zip(trips, roots, bases, columns, scatter, strict=True):
        b = base.shape[1]
        turned = whitened(root, np.column_stack((base, trip.residual_j() / trip.duration_s, column)))
        x, y, u = turned[:, :b], turned[:, b], turned[:, b + 1 :]
        noise = more * rng.standard_normal((y.size, DRAWS))
        for name, value in zip(
            parts, (x.T @ x, x.T @ u, np.square(u).sum(axis=0), x.T @ y, u.T @ y, x.T @ noise, u.T @ noise), strict=True
        ):
            parts[name].append(np.asarray(value, np.float64))
    added = Added(
        gram_base=np.array(parts["gb"]),
        cross=np.array(parts["x"]),
        own=np.array(parts["own"]),
        base_vector=np.array(parts["vb"]),
        vector=np.array(parts["v"]),
        precision_base=precision,
        precision=np.zeros(len(found)),
        base_prior=pull,
        added_prior=np.zeros(len(found)),
    )
    highest = np.abs(simulated_z(added, np.array(parts["rb"]), np.array(parts["r"]))).max(axis=1)
    hours = sum((column * trip.duration_s[:, None]).sum(axis=0) for trip, column in zip(trips, columns, strict=True))
    return Scanned(
        found,
        columns,
        tried(added),
        highest,
        float(np.quantile(highest, 1.0 - FALSE_CLAIM_FRAC)),
        np.asarray(hours, np.float64),
    )


def strongest(scanned: Scanned, trips: Sequence[Windows], least_z: float) -> Structure | None:
    """The box that stands out most, if it passes the threshold and holds a share of the energy.

    Of boxes that stand out alike, as those that hold the same windows, it is the first.
    """
    passes = _large(scanned, trips) & (np.abs(scanned.added.z) >= max(scanned.threshold, least_z))
    if not passes.any():
        return None
    return _structure(scanned, trips, int(first_least(np.where(passes, -np.abs(scanned.added.z), 1.0))))


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


def in_box(box: Box, trip: Windows) -> NDArray[np.float64]:
    """Whether windows lie in a box, float64 (n,), 0 or 1; a bound is as good as the next window's place."""
    if box.axis is Axis.PLACE:
        near = _around(int(box.low), int(box.high))
        numbers = _numbers(trip)
        return np.zeros(trip.begin_s.size) if numbers is None else np.isin(numbers, near).astype(np.float64)
    values = AXES[box.axis].values(trip)
    if values is None:
        return np.zeros(trip.begin_s.size)
    return np.asarray((values >= box.low) & (values < box.high), np.float64)


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


def _inside(
    values: NDArray[np.float64] | None, edges: NDArray[np.float64], first: int, last: int, trip: Windows
) -> NDArray[np.float64]:
    if values is None:
        return np.zeros(trip.begin_s.size)
    below = values < edges[last] if last < edges.size - 1 else values <= edges[last]
    return np.asarray((values >= edges[first]) & below, np.float64)
