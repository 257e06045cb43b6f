"""Simulated trips held beside measured ones, with the statistics of the source's tables IV to VII, IX and X.

An error is relative to the measurement and positive where the simulation has more (source, section III.C). Averages
over trips are means of each trip's own value, also for speed, consumption and errors: the source's highway column
(82.0 km, 0:47:36 h, 108.0 km/h) has a mean of speeds, for its distance over its time is 103.4 km/h. The ratio of sums
is given beside it, named `pooled`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import stats

from diagnosis.errors import ComparisonError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from diagnosis.comparison.trips import TripRecord

CONFIDENCE_FRAC: Final = 0.95
NORMAL_QUANTILE: Final = 1.96  # the source's −16.8 % and +24.0 % are 3.6 ∓ 1.96 · 10.4
EQUAL_FRAC: Final = 1e-12  # differences that agree to this share are equal: a t-test of them says nothing


@dataclass(frozen=True, slots=True)
class TripPair:
    """One trip as measured and as simulated."""

    measured: TripRecord
    simulated: TripRecord

    @property
    def energy_error_frac(self) -> float | None:
        """Relative error of the simulated energy [-]; None where the measured energy is not positive."""
        return relative_error(self.simulated.energy_j, self.measured.energy_j)


@dataclass(frozen=True, slots=True)
class Averages:
    """A column of the source's table IV: means over trips; pooled values are ratios of sums."""

    trip_count: int
    mass_kg: float | None
    distance_m: float
    duration_s: float
    speed_mps: float
    stop_count: float
    standstill_s: float
    specific_j_per_m: float
    energy_j: float
    pooled_speed_mps: float
    pooled_specific_j_per_m: float


@dataclass(frozen=True, slots=True)
class MeanError:
    """Relative error of one quantity over trips.

    mean_frac: mean of the trips' errors, over the trip_count trips whose measured value is positive; None without one.
    pooled_frac: error of the sums over all trips; None where the measured sum is not positive.
    """

    mean_frac: float | None
    pooled_frac: float | None
    trip_count: int


@dataclass(frozen=True, slots=True)
class QuantityErrors:
    """A column of the source's table V."""

    distance: MeanError
    duration: MeanError
    speed: MeanError
    stops: MeanError
    standstill: MeanError
    specific_energy: MeanError
    energy: MeanError


@dataclass(frozen=True, slots=True)
class Distribution:
    """How values of trips spread: the source's tables VI, VII, IX and X, and its box plots.

    sd: standard deviation with n − 1, as in tables VII and X.
    population_sd: with n, as in tables VI and IX (docs/source-tables.md).
    mean_low, mean_high: 95 % confidence interval of the mean by Student's t with n − 1 degrees of freedom.
    trips_low, trips_high: mean ∓ 1.96 sd, where 95 % of trips lie if they are normally distributed.
    quartiles: 25th, 50th and 75th percentile, interpolated linearly.
    One value has no spread: both standard deviations and both intervals are None.
    """

    count: int
    mean: float
    sd: float | None
    population_sd: float | None
    mean_low: float | None
    mean_high: float | None
    trips_low: float | None
    trips_high: float | None
    minimum: float
    quartiles: tuple[float, float, float]
    maximum: float


@dataclass(frozen=True, slots=True)
class PairedTest:
    """Paired t-test of the energies: is the mean difference simulated − measured zero?

    statistic, p_value: None where all differences are equal, so that nothing can be estimated from their spread.
    """

    difference_j: float
    statistic: float | None
    degrees_of_freedom: int
    p_value: float | None


@dataclass(frozen=True, slots=True)
class TypeComparison:
    """The trips of one route type; energy_error is None where no trip has a positive measured energy."""

    route_type: str
    measured: Averages
    simulated: Averages
    errors: QuantityErrors
    energy_error: Distribution | None


@dataclass(frozen=True, slots=True)
class SeriesComparison:
    """One simulated series against the measured one; trips without a partner are named and left out.

    measured_only, simulated_only: ids of trips without partner. undefined: ids of paired trips whose measured
    energy is not positive, so that they have no relative error. paired_test: None for a single pair.
    """

    series: str
    pairs: tuple[TripPair, ...]
    measured_only: tuple[str, ...]
    simulated_only: tuple[str, ...]
    undefined: tuple[str, ...]
    types: tuple[TypeComparison, ...]
    energy_error: Distribution | None
    measured_energy_j: Distribution
    simulated_energy_j: Distribution
    paired_test: PairedTest | None


@dataclass(frozen=True, slots=True)
class TripComparison:
    """All simulated series against one measured series; types and series in the order of their first trip."""

    measured: str
    route_types: tuple[str, ...]
    series: tuple[SeriesComparison, ...]


def compare(records: Sequence[TripRecord], measured: str = "measured") -> TripComparison:
    """Every other series held beside the measured one, trip by trip.

    Raises ComparisonError where the measured series is missing or alone, where a series shares no trip with it,
    where a trip is twice in a series or has another route type than in the measured one.
    """
    by_series: dict[str, dict[str, TripRecord]] = {}
    for record in records:
        trips = by_series.setdefault(record.series, {})
        if record.trip_id in trips:
            raise ComparisonError(f"trip of series {record.series!r}", repr(record.trip_id), "each trip once")
        trips[record.trip_id] = record
    if measured not in by_series:
        raise ComparisonError("measured series", repr(measured), ", ".join(map(repr, by_series)) or "a series of trips")
    reference = by_series.pop(measured)
    if not by_series:
        raise ComparisonError("series", f"{measured!r} alone", "at least one simulated series beside it")
    route_types = tuple(dict.fromkeys(record.route_type for record in reference.values()))
    return TripComparison(
        measured=measured,
        route_types=route_types,
        series=tuple(_compare_series(name, trips, reference, route_types) for name, trips in by_series.items()),
    )


def _compare_series(
    name: str, trips: dict[str, TripRecord], reference: dict[str, TripRecord], route_types: Sequence[str]
) -> SeriesComparison:
    pairs = tuple(TripPair(record, trips[trip_id]) for trip_id, record in reference.items() if trip_id in trips)
    if not pairs:
        raise ComparisonError(f"series {name!r}", "without a trip of the measured series", "at least one trip in both")
    for pair in pairs:
        if pair.measured.route_type != pair.simulated.route_type:
            raise ComparisonError(
                f"type of trip {pair.simulated.trip_id!r} in series {name!r}",
                repr(pair.simulated.route_type),
                f"{pair.measured.route_type!r}, as measured",
            )
    return SeriesComparison(
        series=name,
        pairs=pairs,
        measured_only=tuple(trip_id for trip_id in reference if trip_id not in trips),
        simulated_only=tuple(trip_id for trip_id in trips if trip_id not in reference),
        undefined=tuple(pair.measured.trip_id for pair in pairs if pair.energy_error_frac is None),
        types=tuple(
            _compare_type(kind, chosen)
            for kind in route_types
            if (chosen := [pair for pair in pairs if pair.measured.route_type == kind])
        ),
        energy_error=_energy_errors(pairs),
        measured_energy_j=distribution([pair.measured.energy_j for pair in pairs]),
        simulated_energy_j=distribution([pair.simulated.energy_j for pair in pairs]),
        paired_test=paired_test(pairs) if len(pairs) > 1 else None,
    )


def _compare_type(kind: str, pairs: Sequence[TripPair]) -> TypeComparison:
    def error(quantity: Callable[[TripRecord], float]) -> MeanError:
        return _mean_error([(quantity(pair.simulated), quantity(pair.measured)) for pair in pairs])

    measured = averages([pair.measured for pair in pairs])
    simulated = averages([pair.simulated for pair in pairs])
    speed = error(lambda trip: trip.speed_mps)
    specific = error(lambda trip: trip.specific_j_per_m)
    return TypeComparison(
        route_type=kind,
        measured=measured,
        simulated=simulated,
        errors=QuantityErrors(
            distance=error(lambda trip: trip.distance_m),
            duration=error(lambda trip: trip.duration_s),
            speed=MeanError(
                speed.mean_frac,
                relative_error(simulated.pooled_speed_mps, measured.pooled_speed_mps),
                speed.trip_count,
            ),
            stops=error(lambda trip: trip.stop_count),
            standstill=error(lambda trip: trip.standstill_s),
            specific_energy=MeanError(
                specific.mean_frac,
                relative_error(simulated.pooled_specific_j_per_m, measured.pooled_specific_j_per_m),
                specific.trip_count,
            ),
            energy=error(lambda trip: trip.energy_j),
        ),
        energy_error=_energy_errors(pairs),
    )


def averages(trips: Sequence[TripRecord]) -> Averages:
    """Means over at least one trip; the mass only where every trip has one."""
    masses = [trip.mass_kg for trip in trips if trip.mass_kg is not None]
    distance_m = math.fsum(trip.distance_m for trip in trips)
    return Averages(
        trip_count=len(trips),
        mass_kg=_mean(masses) if len(masses) == len(trips) else None,
        distance_m=distance_m / len(trips),
        duration_s=_mean(trip.duration_s for trip in trips),
        speed_mps=_mean(trip.speed_mps for trip in trips),
        stop_count=_mean(trip.stop_count for trip in trips),
        standstill_s=_mean(trip.standstill_s for trip in trips),
        specific_j_per_m=_mean(trip.specific_j_per_m for trip in trips),
        energy_j=_mean(trip.energy_j for trip in trips),
        pooled_speed_mps=distance_m / math.fsum(trip.duration_s for trip in trips),
        pooled_specific_j_per_m=math.fsum(trip.energy_j for trip in trips) / distance_m,
    )


def distribution(values: Sequence[float]) -> Distribution:
    """Mean, spread and quantiles of at least one value."""
    array = np.asarray(values, np.float64)
    mean = _mean(values)
    quartiles = tuple(float(q) for q in np.quantile(array, (0.25, 0.5, 0.75)))
    sd = float(array.std(ddof=1)) if array.size > 1 else None
    low, high = (None, None) if sd is None else mean_interval(mean, sd, array.size)
    return Distribution(
        count=array.size,
        mean=mean,
        sd=sd,
        population_sd=None if sd is None else float(array.std()),
        mean_low=low,
        mean_high=high,
        trips_low=None if sd is None else mean - NORMAL_QUANTILE * sd,
        trips_high=None if sd is None else mean + NORMAL_QUANTILE * sd,
        minimum=float(array.min()),
        quartiles=(quartiles[0], quartiles[1], quartiles[2]),
        maximum=float(array.max()),
    )


def mean_interval(mean: float, sd: float, count: int) -> tuple[float, float]:
    """95 % confidence interval of a mean, by Student's t; sd with n − 1, count ≥ 2."""
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE_FRAC, count - 1)) * sd / math.sqrt(count)
    return mean - half, mean + half


def paired_test(pairs: Sequence[TripPair]) -> PairedTest:
    """Paired t-test of the energies of at least two pairs (scipy.stats.ttest_rel)."""
    simulated = np.array([pair.simulated.energy_j for pair in pairs])
    measured = np.array([pair.measured.energy_j for pair in pairs])
    difference = simulated - measured
    scale = max(float(np.abs(simulated).max()), float(np.abs(measured).max()))
    if float(np.ptp(difference)) <= EQUAL_FRAC * scale:
        return PairedTest(_mean(difference.tolist()), None, len(pairs) - 1, None)
    result = stats.ttest_rel(simulated, measured)
    return PairedTest(_mean(difference.tolist()), float(result.statistic), len(pairs) - 1, float(result.pvalue))


def relative_error(simulated: float, measured: float) -> float | None:
    """(simulated − measured)/measured; None where the measured value is not positive."""
    return simulated / measured - 1.0 if measured > 0.0 else None


def _energy_errors(pairs: Iterable[TripPair]) -> Distribution | None:
    errors = [error for pair in pairs if (error := pair.energy_error_frac) is not None]
    return distribution(errors) if errors else None


def _mean_error(values: Sequence[tuple[float, float]]) -> MeanError:
    errors = [error for simulated, measured in values if (error := relative_error(simulated, measured)) is not None]
    pooled = relative_error(math.fsum(s for s, _ in values), math.fsum(m for _, m in values))
    return MeanError(_mean(errors) if errors else None, pooled, len(errors))


def _mean(values: Iterable[float]) -> float:
    listed = list(values)
    return math.fsum(listed) / len(listed)
