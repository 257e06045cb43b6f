"""How long a battery takes from a charge to another, and what it holds after a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.charging import kernels_charging
from energy.charging.kernels_charging import ChargeCurves
from energy.errors import ChargeError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from energy.charging.charging import PowerCurve

# lower edges of the bands that a stop's time is told by, power into the battery [W]
POWER_BAND_EDGES_W: Final = (0.0, 11e3, 22e3, 50e3, 100e3, 150e3, 250e3)


@dataclass(frozen=True, slots=True)
class ChargeTimes:
    """One battery on the curves of the sockets that charge it, with the time to each of their points.

    curves: for kernels (`energy/charging/kernels_charging.py`), arrays not to be written to.
    """

    curves: ChargeCurves

    def seconds(self, curve: int, start_frac: ArrayLike, end_frac: ArrayLike) -> NDArray[np.float64]:
        """Time from charges to others, no lower ones, on a curve: float64 of the shape both make together [s].

        Raises ChargeError for charges out of 0..1, or an end below its start.
        """
        start, end = np.broadcast_arrays(_within(start_frac, "start_frac"), _within(end_frac, "end_frac"))
        if bool(np.any(end < start)):
            raise ChargeError("end_frac", float(end[end < start].flat[0]), "at least start_frac")
        flat = kernels_charging.seconds_between_all(self.curves, curve, _flat(start), _flat(end))
        return flat.reshape(start.shape)

    def soc_after(self, curve: int, start_frac: ArrayLike, seconds: ArrayLike) -> NDArray[np.float64]:
        """Charge after times on a curve, 1 once the battery is full: float64 of the shape both make together.

        Raises ChargeError for charges out of 0..1 or negative times.
        """
        time = np.asarray(seconds, np.float64)
        if not bool(np.all(time >= 0.0)):
            raise ChargeError("seconds", float(time[~(time >= 0.0)].flat[0]), "at least 0")
        start, time = np.broadcast_arrays(_within(start_frac, "start_frac"), time)
        flat = kernels_charging.soc_after_all(self.curves, curve, _flat(start), _flat(time))
        return flat.reshape(start.shape)


def charge_times(curves: Sequence[PowerCurve], capacity_j: float) -> ChargeTimes:
    """The times of a battery of a capacity [J] on curves of power, in their order.

    Raises ChargeError for a capacity that is not above 0.
    """
    if not 0.0 < capacity_j < np.inf:
        raise ChargeError("capacity_j", capacity_j, "above 0")
    first = np.zeros(len(curves) + 1, np.int64)
    np.cumsum([curve.soc_frac.size for curve in curves], out=first[1:])
    soc = np.concatenate([curve.soc_frac for curve in curves] or [np.zeros(0)])
    power = np.concatenate([curve.power_w for curve in curves] or [np.zeros(0)])
    seconds = np.zeros(soc.size)
    for curve, begin in zip(curves, first.tolist(), strict=False):
        pieces = _piece_seconds(curve, capacity_j)
        seconds[begin + 1 : begin + 1 + pieces.size] = np.cumsum(pieces)
    for array in (first, soc, power, seconds):
        array.flags.writeable = False
    return ChargeTimes(ChargeCurves(first, soc, power, seconds, float(capacity_j)))


def seconds(curve: PowerCurve, capacity_j: float, start_frac: ArrayLike, end_frac: ArrayLike) -> NDArray[np.float64]:
    """Time from charges to others on one curve [s], as `ChargeTimes.seconds`."""
    return charge_times([curve], capacity_j).seconds(0, start_frac, end_frac)


def soc_after(curve: PowerCurve, capacity_j: float, start_frac: ArrayLike, seconds: ArrayLike) -> NDArray[np.float64]:
    """Charge after times on one curve, as `ChargeTimes.soc_after`."""
    return charge_times([curve], capacity_j).soc_after(0, start_frac, seconds)


def mean_power_w(curve: PowerCurve, capacity_j: float, start_frac: float, end_frac: float) -> float:
    """Mean power into the battery from a charge to a higher one [W]; the power itself where they are the same."""
    taken_s = float(seconds(curve, capacity_j, start_frac, end_frac))
    if taken_s == 0.0:
        return float(np.interp(start_frac, curve.soc_frac, curve.power_w))
    return capacity_j * (end_frac - start_frac) / taken_s


def power_bands(
    curve: PowerCurve,
    capacity_j: float,
    start_frac: float,
    end_frac: float,
    edges_w: Sequence[float] = POWER_BAND_EDGES_W,
) -> tuple[tuple[float, float, float], ...]:
    """Time by bands of the power into the battery: from [W], to [W], seconds, for each band with any, lowest first.

    edges_w: lower edges of the bands, rising from 0; the highest has no end. A power that is an edge belongs to the
    band above it. The seconds add up to those from start_frac to end_frac.
    """
    edges = np.array(edges_w, np.float64)
    if edges.ndim != 1 or edges.size == 0 or edges[0] != 0.0 or not bool(np.all(np.diff(edges) > 0.0)):
        raise ChargeError("edges_w", edges.tolist(), "rising from 0")
    charges = [curve.soc_frac, np.array([start_frac, end_frac])]
    before, after = curve.power_w[:-1], curve.power_w[1:]
    for edge in edges[1:].tolist():
        crossed = (before - edge) * (after - edge) < 0.0
        share = (edge - before[crossed]) / (after[crossed] - before[crossed])
        charges.append(curve.soc_frac[:-1][crossed] + share * np.diff(curve.soc_frac)[crossed])
    points = np.unique(np.concatenate(charges))
    points = points[(points >= start_frac) & (points <= end_frac)]
    taken = seconds(curve, capacity_j, points[:-1], points[1:])
    middle_w = np.interp(0.5 * (points[:-1] + points[1:]), curve.soc_frac, curve.power_w)
    band = np.searchsorted(edges, middle_w, side="right") - 1
    upper = np.append(edges[1:], np.inf)
    sums = np.bincount(band, weights=taken, minlength=edges.size)
    return tuple(
        (low, high, time)
        for low, high, time in zip(edges.tolist(), upper.tolist(), sums.tolist(), strict=True)
        if time > 0.0
    )


def stationary_charges(
    curve_a: PowerCurve,
    curve_b: PowerCurve,
    shift_frac: float,
    price_per_w: float = 0.0,
    weight_a: float = 1.0,
    weight_b: float = 1.0,
) -> NDArray[np.float64]:
    """Charges d, rising, with w_a/P_a(d) − w_b/P_b(d − shift) + price = 0, d and d − shift within 0..1: float64 (n,).

    There w_a·T_a(d) − w_b·T_b(d − shift) + C·price·d is stationary: charging a little more at a stop saves as much at
    the next, which is reached with shift less. price_per_w: the linear term over the capacity [1/W], so price of a
    full battery [s] / capacity [J]. weight_a, weight_b: what a second of each counts, at least 0. Where both sides
    agree on a whole interval it has no entry. Charges where the curves have points may be missing: they are candidates
    anyway.
    """
    curves = charge_times([curve_a, curve_b], 1.0).curves
    found = np.empty(kernels_charging.most_stationary(curves, 0, 1), np.float64)
    count = kernels_charging.stationary_charges(
        curves, 0, 1, float(shift_frac), float(price_per_w), found, float(weight_a), float(weight_b)
    )
    return found[:count]


def _piece_seconds(curve: PowerCurve, capacity_j: float) -> NDArray[np.float64]:
    """Time over each piece of a curve, float64 (n - 1,) [s]."""
    power, gained = curve.power_w[:-1], np.diff(curve.soc_frac)
    u = np.diff(curve.power_w) / power
    factor = np.divide(np.log1p(u), u, out=np.ones_like(u), where=u != 0.0)
    return np.asarray(capacity_j * gained / power * factor, np.float64)


def _within(charge: ArrayLike, field: str) -> NDArray[np.float64]:
    array = np.asarray(charge, np.float64)
    inside = (array >= 0.0) & (array <= 1.0)
    if not bool(np.all(inside)):
        raise ChargeError(field, float(array[~inside].flat[0]), "0..1")
    return array


def _flat(array: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.ascontiguousarray(array).reshape(-1)
