"""Does the source add up? Its tables held against each other and against its text, within their rounding."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.comparison.comparison import NORMAL_QUANTILE, mean_interval
from reproduction.derived import Pooled, Rounded, percent_factor, pooled, real_averages, rounded
from reproduction.published import (
    COMPLEX_URBAN_DURATION_PERCENT,
    COMPLEX_URBAN_SPEED_PERCENT,
    COUNTRY_ROUTE_KM,
    ROUTE_LENGTHS_KM,
    TABLE_IV,
    TABLE_IX_COMPLEX,
    TABLE_IX_SIMPLE,
    TABLE_V,
    TABLE_VI,
    TABLE_X_COMPLEX,
    TABLE_X_SIMPLE,
    TRIP_COUNT,
    WITH_AC_MEAN_PERCENT,
    WITH_AC_PERCENT,
    WITHOUT_AC_MEAN_PERCENT,
    WITHOUT_AC_PERCENT,
    AllTrips,
    RouteType,
    SourceRoute,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

KM_PER_H_PER_KM_PER_S: Final = 3600.0


@dataclass(frozen=True, slots=True)
class Check:
    """One statement of the source against another: where, what is printed, what follows elsewhere, and a remark."""

    where: str
    printed: str
    follows: str
    holds: bool
    remark: str = ""


def source_checks() -> tuple[Check, ...]:
    """All checks, in the order of the tables."""
    return (*_table_iv(), *_stops(), *_lengths(), *_table_v(), *_all_trips(), *_table_viii(), *_text())


def _table_iv() -> list[Check]:
    checks = []
    for kind, row in TABLE_IV.items():
        speed = (rounded(row.distance_km, 1) / rounded(row.duration_s)).times(KM_PER_H_PER_KM_PER_S)
        holds = speed.meets(rounded(row.speed_kmh, 1))
        remark = ""
        if not holds and row.speed_kmh > speed.high:
            remark = f"a mean of the trips' speeds: with equal distances {_two_speeds()}"
        elif not holds:
            remark = "a mean of speeds is at least that where trips are equally long"
        checks.append(
            Check(f"IV, {kind}: speed", f"{row.speed_kmh} km/h", _span("distance/time", speed), holds, remark)
        )
    for kind, row in TABLE_IV.items():
        energy = rounded(row.energy_kwh, 1)
        specific = (energy / rounded(row.distance_km, 1)).times(100.0)
        printed = rounded(row.specific_kwh_per_100km, 1)
        holds = specific.meets(printed)
        most = 100.0 * energy.high / ROUTE_LENGTHS_KM[0]
        if holds:
            remark = ""
        elif printed.low <= most:
            remark = "possible as a mean of the trips' own consumptions, if shorter trips took more"
        else:
            remark = f"no mean of trips of at least {ROUTE_LENGTHS_KM[0]:.0f} km can exceed {most:.1f}"
        where = f"IV, {kind}: consumption"
        checks.append(
            Check(where, f"{row.specific_kwh_per_100km} kWh/100 km", _span("energy/distance", specific), holds, remark)
        )
    return checks


def _two_speeds() -> str:
    """The speeds of two slow and three fast runs with the printed mean of speeds and distance over time."""
    row = TABLE_IV[RouteType.HIGHWAY]
    slowness = 5.0 * row.duration_s / (row.distance_km * KM_PER_H_PER_KM_PER_S)
    total = 5.0 * row.speed_kmh
    # 2·a + 3·b = total and 2/a + 3/b = slowness, with a the slow speed:
    # 2·slowness·a² − (slowness·total − 5)·a + 2·total = 0 after b = (total − 2·a)/3 and clearing fractions
    p, q, r = 2.0 * slowness, -(slowness * total + 4.0 - 9.0), 2.0 * total
    a = (-q - math.sqrt(q * q - 4.0 * p * r)) / (2.0 * p)
    return f"2 runs at {a:.0f} and 3 at {(total - 2.0 * a) / 3.0:.0f} km/h give both"


def _stops() -> list[Check]:
    each = [rounded(row.standstill_s) / rounded(row.stops) for row in TABLE_IV.values()]
    spans = ", ".join(f"{interval.low:.1f}–{interval.high:.1f}" for interval in each)
    checks = [
        Check(
            "IV: time of a stop",
            "one average in towns, one outside (II.B)",
            f"standstill/stops: {spans} s",
            all(interval.meets(Rounded(21.0, 21.0)) for interval in each),
            "21.0 s fits all four types: the two averages are the same number",
        )
    ]
    for kind in TABLE_IV:
        real = real_averages(kind)
        each_s = real.standstill_s / real.stops
        checks.append(
            Check(
                f"IV and V, {kind}: time of a real stop",
                "average of the real stops (III.B)",
                f"{real.standstill_s:.0f} s / {real.stops:.1f} = {each_s:.0f} s",
                each_s < 60.0,
                "" if each_s < 60.0 else "these are pauses, not stops at junctions",
            )
        )
    return checks


def _lengths() -> list[Check]:
    country = real_averages(RouteType.COUNTRY).distance_km
    other = 2.0 * country - COUNTRY_ROUTE_KM
    shortest, longest = ROUTE_LENGTHS_KM
    largest = max(real_averages(kind).distance_km for kind in RouteType)
    return [
        Check(
            "III, lengths: shortest route",
            f"{shortest:.0f} km",
            f"country roads: 2·{country:.1f} − {COUNTRY_ROUTE_KM:.0f} = {other:.1f} km",
            abs(other - shortest) < 2.0,
            "so one country road is 113 km long, the other 77; which is which is not said",
        ),
        Check(
            "III, lengths: longest route",
            f"{longest:.0f} km",
            f"longest average {largest:.1f} km, longest country road {2.0 * country - shortest:.1f} km",
            False,
            "no route can be that long if a route's trips are equally long",
        ),
    ]


def _table_v() -> list[Check]:
    checks = []
    for kind, error in TABLE_V.items():
        factor = percent_factor(error.distance) / percent_factor(error.duration)
        holds = factor.meets(percent_factor(error.speed))
        checks.append(
            Check(f"V, {kind}: speed", f"{error.speed:+.0f} %", _percent_span("distance/time", factor), holds)
        )
    for kind, error in TABLE_V.items():
        factor = percent_factor(error.energy) / percent_factor(error.distance)
        holds = factor.meets(percent_factor(error.specific_energy))
        remark = "" if holds else "possible only if shorter trips had larger errors"
        if not holds and kind is RouteType.COUNTRY:
            remark = f"{error.specific_energy:+.0f} % equals country road 1's energy error alone (table VI: +17.7 %)"
        checks.append(
            Check(
                f"V, {kind}: consumption",
                f"{error.specific_energy:+.0f} %",
                _percent_span("energy/distance", factor),
                holds,
                remark,
            )
        )
    country = 0.5 * (TABLE_VI[SourceRoute.COUNTRY_1].mean + TABLE_VI[SourceRoute.COUNTRY_2].mean)
    printed = TABLE_V[RouteType.COUNTRY].energy
    checks.append(
        Check(
            "V and VI, country road: energy",
            f"{printed:+.0f} %",
            f"mean of +17.7 and −1.6: {country:+.2f} %",
            rounded(printed).meets(rounded(country, 1)),
            "so table V averages the trips' errors",
        )
    )
    return checks


def _all_trips() -> list[Check]:
    checks = []
    for name, errors, printed in (
        ("VI and VII, simpler", TABLE_VI, TABLE_X_SIMPLE),
        ("IX and X, more complex", TABLE_IX_COMPLEX, TABLE_X_COMPLEX),
    ):
        found = pooled(errors)
        checks.append(
            Check(f"{name}: mean", f"{printed.mean:+.1f} %", f"{found.mean:+.2f} %", _agrees(found.mean, printed.mean))
        )
        checks.append(
            Check(
                f"{name}: standard deviation",
                f"{printed.sd:.1f} %",
                f"{found.sd_from_population_sds:.2f} % if the routes' SDs divide by n, "
                f"{found.sd_from_sample_sds:.2f} % if by n − 1",
                _agrees(found.sd_from_population_sds, printed.sd),
                "so the routes' SDs divide by n, that of all trips by n − 1",
            )
        )
        checks += _intervals(name, printed, found)
    checks.append(
        Check(
            "VI and IX: the simpler algorithm",
            "mean and SD of five routes",
            "the same",
            all(
                (error.mean, error.sd) == (TABLE_IX_SIMPLE[route].mean, TABLE_IX_SIMPLE[route].sd)
                for route, error in TABLE_VI.items()
            ),
        )
    )
    return checks


def _intervals(name: str, printed: AllTrips, found: Pooled) -> list[Check]:
    count = sum(TRIP_COUNT.values())
    low, high = mean_interval(found.mean, found.sd_from_population_sds, count)
    half = NORMAL_QUANTILE * found.sd_from_population_sds
    return [
        Check(
            f"{name}: 95 % interval of the mean",
            f"{printed.mean_low:+.1f} to {printed.mean_high:+.1f} %",
            f"{low:+.2f} to {high:+.2f} % (Student's t, 22 degrees of freedom)",
            _agrees(low, printed.mean_low) and _agrees(high, printed.mean_high),
        ),
        Check(
            f"{name}: 95 % of trips",
            f"{printed.trips_low:+.1f} to {printed.trips_high:+.1f} %",
            f"{found.mean - half:+.2f} to {found.mean + half:+.2f} % (mean ± 1.96 SD)",
            _agrees(found.mean - half, printed.trips_low) and _agrees(found.mean + half, printed.trips_high),
        ),
    ]


def _agrees(computed: float, printed: float) -> bool:
    """Within the rounding of the routes' figures: 0.15 percentage points."""
    return abs(computed - printed) <= 0.15


def _table_viii() -> list[Check]:
    everything = (*WITHOUT_AC_PERCENT, *WITH_AC_PERCENT)
    mean = sum(everything) / len(everything)
    squares = sum((error - mean) ** 2 for error in everything)
    urban = TABLE_VI[SourceRoute.URBAN]
    by_n, by_less = math.sqrt(squares / len(everything)), math.sqrt(squares / (len(everything) - 1))
    checks = [
        Check(
            "VIII and VI, urban area: standard deviation",
            f"{urban.sd:.1f} %",
            f"{by_n:.1f} % dividing by n, {by_less:.1f} % by n − 1",
            abs(by_n - urban.sd) <= 0.5 < by_less - urban.sd,
            "whole percents can shift it by 0.5 at most: again n",
        )
    ]
    for name, errors, printed in (
        ("without A/C", WITHOUT_AC_PERCENT, WITHOUT_AC_MEAN_PERCENT),
        ("with A/C", WITH_AC_PERCENT, WITH_AC_MEAN_PERCENT),
        ("all", everything, urban.mean),
    ):
        average = sum(errors) / len(errors)
        checks.append(
            Check(
                f"VIII, {name}: mean",
                f"{printed:+.1f} %",
                f"{average:+.2f} % of the whole percents printed",
                abs(average - printed) <= 0.5,
            )
        )
    return checks


def _text() -> list[Check]:
    below = [TABLE_IX_SIMPLE[route].mean - TABLE_IX_COMPLEX[route].mean for route in SourceRoute]
    urban = (1.0 + TABLE_V[RouteType.URBAN].distance / 100.0) / (1.0 + COMPLEX_URBAN_DURATION_PERCENT / 100.0)
    more = [TABLE_V[kind].stops / 100.0 for kind in (RouteType.MOUNTAIN, RouteType.COUNTRY)]
    return [
        Check(
            "Text, VI: stops outside towns",
            "two to three times more than in reality",
            f"{1.0 + more[0]:.1f} and {1.0 + more[1]:.1f} times as many",
            True,
            "on the highway 1.1 times",
        ),
        Check(
            "Text, VI: highways and county roads",
            "about 8 to 9 % higher",
            "+8.6 % and +8.05 %",
            True,
            "the latter is the mean of +17.7 and −1.6 %: no country road errs by 8 %",
        ),
        Check(
            "Text, VI: the complex algorithm takes less",
            "several percent on each type of route",
            f"{_joined(below)} percentage points",
            False,
            "on the highway 1",
        ),
        Check(
            "Text, VI: the complex algorithm in town",
            f"speed {COMPLEX_URBAN_SPEED_PERCENT:+.0f} %, time {COMPLEX_URBAN_DURATION_PERCENT:+.0f} %",
            f"{100.0 * (urban - 1.0):+.0f} % from that time and distance −4 %",
            False,
            "both are said to be approximate; −47 % would give +81 %",
        ),
        Check(
            "Abstract: error of a trip's energy",
            "standard deviation of up to 10 %",
            f"{TABLE_X_SIMPLE.sd} % (table VII)",
            True,
            f"rounded down; the mean on country road 1 is {TABLE_VI[SourceRoute.COUNTRY_1].mean:+.1f} %",
        ),
    ]


def _joined(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.1f}" for value in values)


def _span(how: str, interval: Rounded, unit: str = "") -> str:
    return f"{how}: {interval.low:.1f} to {interval.high:.1f}{f' {unit}' if unit else ''}"


def _percent_span(how: str, factor: Rounded) -> str:
    return f"{how}: {100.0 * (factor.low - 1.0):+.1f} to {100.0 * (factor.high - 1.0):+.1f} %"
