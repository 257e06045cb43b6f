"""The tables of docs/source-tables.md, computed; run as `python -m docs.source_tables` to renew them."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from diagnosis.comparison.comparison import NORMAL_QUANTILE, mean_interval
from diagnosis.comparison.tables import clock, markdown_table
from diagnosis.comparison.trips import TripRecord
from energy.chain.chain import Chain, LinkModel, StopRule, simulate_chain
from energy.chain.timestep import simulate_timestep
from energy.units import JOULE_PER_KWH, KMH_PER_MPS, METRE_PER_KM
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from reproduction.checks import source_checks
from reproduction.derived import pooled, real_averages
from reproduction.published import (
    AUX_EFF,
    COMPLEX_URBAN_DURATION_PERCENT,
    COMPLEX_URBAN_SPEED_PERCENT,
    COMPLEX_URBAN_STOPS_PERCENT,
    TABLE_IV,
    TABLE_IX_COMPLEX,
    TABLE_IX_SIMPLE,
    TABLE_V,
    TABLE_VI,
    TABLE_X_COMPLEX,
    TABLE_X_SIMPLE,
    TRIP_COUNT,
    TYPE_OF,
    WITH_AC_MEAN_PERCENT,
    WITHOUT_AC_MEAN_PERCENT,
    AllTrips,
    PercentErrors,
    RouteError,
    RouteType,
    SourceRoute,
    TypeAverages,
)
from reproduction.routes import source_route
from reproduction.runs import DriveSums, SourceModel, drive_source_trips, loaded_as, route_energies_j, type_averages

DOCS: Final = Path(__file__).resolve().parent
PAGE: Final = DOCS / "source-tables.md"
VEHICLE: Final = DOCS.parent / "data" / "vehicles" / "hyundai-kona-64.toml"
SEEDS: Final = tuple(range(1, 11))
FEWER_STOPS_FRAC: Final = 1.0 + COMPLEX_URBAN_STOPS_PERCENT / 100.0


def _fast(link_model: LinkModel) -> Callable[[Vehicle, Chain], DriveSums]:
    return lambda vehicle, chain: simulate_chain(vehicle, chain, link_model=link_model)


PRINTED: Final = SourceModel("fast, `printed`", _fast(LinkModel.PRINTED))
INTEGRATED: Final = SourceModel("fast, `integrated`", _fast(LinkModel.INTEGRATED))
TIMESTEP: Final = SourceModel(
    "time steps", lambda vehicle, chain: simulate_timestep(vehicle, chain, stop_rule=StopRule.COUNTED)
)
MODELS: Final = (PRINTED, INTEGRATED, TIMESTEP)

# The 23 trips, one tuple a seed, by the model's name; and the averages of each route type of them
Trips = dict[str, list[tuple[TripRecord, ...]]]
Driven = dict[str, list[dict[RouteType, TypeAverages]]]


@dataclasses.dataclass(frozen=True, slots=True)
class Quantity:
    """A row of tables IV and V."""

    name: str
    of: Callable[[TypeAverages], float]
    shown: Callable[[float], str]
    error: Callable[[PercentErrors], float] | None = None


def _whole(value: float) -> str:
    return f"{value:.0f}"


def _tenth(value: float) -> str:
    return f"{value:.1f}"


QUANTITIES: Final = (
    Quantity("total mass [kg]", lambda a: a.mass_kg, _whole),
    Quantity("distance [km]", lambda a: a.distance_km, _tenth, lambda e: e.distance),
    Quantity("travel time [h:mm:ss]", lambda a: a.duration_s, clock, lambda e: e.duration),
    Quantity("mean speed [km/h]", lambda a: a.speed_kmh, _tenth, lambda e: e.speed),
    Quantity("stops", lambda a: a.stops, _whole, lambda e: e.stops),
    Quantity("standstill [s]", lambda a: a.standstill_s, _whole, lambda e: e.standstill),
    Quantity("consumption [kWh/100 km]", lambda a: a.specific_kwh_per_100km, _tenth, lambda e: e.specific_energy),
    Quantity("energy [kWh]", lambda a: a.energy_kwh, _tenth, lambda e: e.energy),
)
ENERGY: Final = QUANTITIES[-1]
DURATION: Final = QUANTITIES[2]


def _over_seeds(quantity: Quantity, driven: Sequence[dict[RouteType, TypeAverages]], kind: RouteType) -> list[float]:
    return [quantity.of(averages[kind]) for averages in driven]


def _spread(values: Sequence[float], shown: Callable[[float], str]) -> str:
    """Mean, and the range over seeds where it shows."""
    low, high = shown(min(values)), shown(max(values))
    mean = shown(float(np.mean(values)))
    return mean if low == high else f"{mean} ({low} … {high})"


def _percent(value: float, digits: int = 0) -> str:
    text = f"{value:+.{digits}f}"
    return f"{0:.{digits}f}" if float(text) == 0.0 else text.replace("-", "−")


def _table_iv(driven: Driven) -> str:
    blocks = []
    for kind in RouteType:
        rows = [
            (
                quantity.name,
                quantity.shown(quantity.of(TABLE_IV[kind])),
                *(_spread(_over_seeds(quantity, seeds, kind), quantity.shown) for seeds in driven.values()),
            )
            for quantity in QUANTITIES
        ]
        blocks.append(markdown_table([f"**{kind}**", "source, table IV", *driven], rows))
    return "\n\n".join(blocks)


def _table_v(driven: Driven) -> str:
    blocks = []
    for kind in RouteType:
        rows = []
        for quantity in QUANTITIES:
            if quantity.error is None:
                continue
            real = quantity.of(real_averages(kind))
            errors = [
                _spread([100.0 * (x / real - 1.0) for x in _over_seeds(quantity, seeds, kind)], _percent)
                for seeds in driven.values()
            ]
            rows.append((quantity.name, quantity.shown(real), _percent(quantity.error(TABLE_V[kind])), *errors))
        header = [f"**{kind}**", "real, derived", "source [%]", *(f"{name} [%]" for name in driven)]
        blocks.append(markdown_table(header, rows))
    return "\n\n".join(blocks)


def _plain_town(vehicle: Vehicle) -> str:
    urban, real = TABLE_IV[RouteType.URBAN], real_averages(RouteType.URBAN)
    drives = {model: _plain_urban(vehicle, model) for model in (LinkModel.PRINTED, LinkModel.INTEGRATED)}
    seconds = {model: drive.duration_s for model, drive in drives.items()}
    share = (seconds[LinkModel.INTEGRATED] - seconds[LinkModel.PRINTED]) / (real.duration_s - urban.duration_s)
    rows = [
        ("source, table IV", f"{urban.duration_s:.0f}", f"{urban.speed_kmh:.1f}"),
        *(
            (f"plain town, `{model}`", f"{drive.duration_s:.0f}", f"{_kmh(drive):.1f}")
            for model, drive in drives.items()
        ),
        ("real, derived from table V", f"{real.duration_s:.0f}", f"{real.speed_kmh:.1f}"),
        ("difference of the two models over what the source lacks", f"{100.0 * share:.0f} %", "–"),
    ]
    return markdown_table(["urban area", "duration [s]", "mean speed [km/h]"], rows)


def _printed_time(driven: Driven) -> str:
    rows = []
    for kind in RouteType:
        real_s = real_averages(kind).duration_s
        printed_s, kinematic_s = (
            float(np.mean(_over_seeds(DURATION, driven[model.name], kind))) for model in (PRINTED, INTEGRATED)
        )
        cells = (real_s, TABLE_IV[kind].duration_s, printed_s, kinematic_s, kinematic_s - printed_s)
        share = (kinematic_s - printed_s) / (real_s - TABLE_IV[kind].duration_s)
        rows.append((kind.value, *(f"{cell:.0f}" for cell in cells), f"{100.0 * share:.0f} %"))
    header = [
        "[s]",
        "real, derived",
        "source",
        PRINTED.name,
        INTEGRATED.name,
        "their difference",
        "of what the source lacks",
    ]
    return markdown_table(header, rows)


def _plain_urban(vehicle: Vehicle, link_model: LinkModel) -> DriveSums:
    row = TABLE_IV[RouteType.URBAN]
    runs = round(row.stops) + 1
    simple = dataclasses.replace(
        vehicle, accel_speed_mps=np.array([0.0, 40.0]), accel_mps2=np.array([1.0]), decel_mps2=np.array([-1.0])
    )
    chain = Chain(
        length_m=np.full(runs, METRE_PER_KM * row.distance_km / runs),
        grade_frac=np.zeros(runs),
        speed_limit_mps=np.full(runs, 50.0 / KMH_PER_MPS),
        stop_probability_frac=np.ones(runs),
        stop_time_s=np.full(runs, row.standstill_s / row.stops),
        stop_class=np.zeros(runs, np.int8),
    )
    return simulate_chain(simple, chain, link_model=link_model)


def _kmh(drive: DriveSums) -> float:
    return drive.distance_m / drive.duration_s * KMH_PER_MPS


def _energy_errors(seeds: Sequence[dict[RouteType, TypeAverages]], kind: RouteType) -> list[float]:
    """Error of the mean energy against the derived real one, a seed each [%]."""
    return [100.0 * (x / real_averages(kind).energy_kwh - 1.0) for x in _over_seeds(ENERGY, seeds, kind)]


def _table_vi(driven: Driven) -> str:
    rows = []
    for route, error in TABLE_VI.items():
        kind = TYPE_OF[route]
        extremes = f"{_percent(error.low or 0.0)} … {_percent(error.high or 0.0)}"
        ours = ["not separable"] * len(driven)
        if kind is not RouteType.COUNTRY:
            ours = [_spread(_energy_errors(seeds, kind), _tenths) for seeds in driven.values()]
        rows.append((route.value, _percent(error.mean, 1), f"{error.sd:.1f}", extremes, *ours))
    country = [_spread(_energy_errors(seeds, RouteType.COUNTRY), _tenths) for seeds in driven.values()]
    mean = 0.5 * (TABLE_VI[SourceRoute.COUNTRY_1].mean + TABLE_VI[SourceRoute.COUNTRY_2].mean)
    rows.insert(4, ("both country roads", _percent(mean, 1), "–", "–", *country))
    header = ["[%]", "source, mean", "source, SD", "source, range", *(f"{name}, mean" for name in driven)]
    return markdown_table(header, rows)


def _all_energy_errors(seeds: Sequence[dict[RouteType, TypeAverages]]) -> list[float]:
    """Error of the mean energy of a type, averaged over the 23 trips, a seed each [%]."""
    total = sum(TRIP_COUNT.values())
    errors = {route: _energy_errors(seeds, TYPE_OF[route]) for route in SourceRoute}
    return [sum(TRIP_COUNT[route] * errors[route][k] for route in SourceRoute) / total for k in range(len(seeds))]


def _table_vii(driven: Driven) -> str:
    ours = [_spread(_all_energy_errors(seeds), _tenths) for seeds in driven.values()]
    rows = [
        (*cells, *(ours if position == 0 else ["–"] * len(driven)))
        for position, cells in enumerate(_all_trips_rows(TABLE_X_SIMPLE, TABLE_VI))
    ]
    return markdown_table(["all 23 trips [%]", "source, table VII", "from its table VI", *driven], rows)


def _all_trips_rows(printed: AllTrips, errors: Mapping[SourceRoute, RouteError]) -> list[tuple[str, str, str]]:
    found = pooled(errors)
    sd = found.sd_from_population_sds
    half = NORMAL_QUANTILE * sd
    low, high = mean_interval(found.mean, sd, sum(TRIP_COUNT.values()))
    return [
        ("mean", _tenths(printed.mean), _tenths(found.mean)),
        ("95 % confidence interval of the mean", _range(printed.mean_low, printed.mean_high), _range(low, high)),
        ("standard deviation", f"{printed.sd:.1f}", f"{sd:.1f}"),
        ("95 % of trips", _range(printed.trips_low, printed.trips_high), _range(found.mean - half, found.mean + half)),
    ]


def _table_viii() -> str:
    """What air conditioning takes, from the errors with and without it, and what that is on the other types."""
    urban = real_averages(RouteType.URBAN)
    simulated_kwh = TABLE_IV[RouteType.URBAN].energy_kwh
    more_kwh = simulated_kwh / (1.0 + WITH_AC_MEAN_PERCENT / 100.0) - simulated_kwh / (
        1.0 + WITHOUT_AC_MEAN_PERCENT / 100.0
    )
    battery_w = more_kwh * JOULE_PER_KWH / urban.duration_s
    rows = []
    for kind in RouteType:
        real = real_averages(kind)
        extra_kwh = battery_w * real.duration_s / JOULE_PER_KWH
        text = "about 15 %" if kind is RouteType.URBAN else "not said" if kind is RouteType.MOUNTAIN else "3 to 8 %"
        cells = (f"{real.duration_s:.0f}", f"{battery_w * AUX_EFF:.0f}", f"{extra_kwh:.2f}")
        rows.append((kind.value, *cells, f"{100.0 * extra_kwh / real.energy_kwh:.1f} %", text))
    header = [
        "",
        "real time, derived [s]",
        "more for A/C [W]",
        "more energy [kWh]",
        "of the real energy",
        "source, III.D",
    ]
    return markdown_table(header, rows)


def _table_ix(trips: Trips) -> str:
    energies = {name: [route_energies_j(records) for records in seeds] for name, seeds in trips.items()}
    rows = []
    for route in SourceRoute:
        simple, complex_ = TABLE_IX_SIMPLE[route], TABLE_IX_COMPLEX[route]
        ratio = (1.0 + complex_.mean / 100.0) / (1.0 + simple.mean / 100.0)
        ours = []
        for fast in (PRINTED, INTEGRATED):
            pairs = zip(energies[TIMESTEP.name], energies[fast.name], strict=True)
            ours.append(_spread([steps[route] / other[route] for steps, other in pairs], lambda x: f"{x:.3f}"))
        rows.append((route.value, _tenths(simple.mean), _tenths(complex_.mean), f"{ratio:.3f}", *ours))
    header = ["energy", "simple [%]", "complex [%]", "complex over simple"]
    ours_header = [f"{TIMESTEP.name} over {fast.name}" for fast in (PRINTED, INTEGRATED)]
    return markdown_table([*header, *ours_header], rows)


def _complex_town(vehicle: Vehicle) -> str:
    """The urban route with 70 % fewer stops beside what the complex algorithm, which had so few, is said to take."""
    real = real_averages(RouteType.URBAN)
    loaded = loaded_as(vehicle, RouteType.URBAN)
    rows = [
        (
            "source, complex algorithm, derived",
            f"{real.stops * FEWER_STOPS_FRAC:.0f}",
            f"about {real.duration_s * (1.0 + COMPLEX_URBAN_DURATION_PERCENT / 100.0):.0f}",
            f"about {real.speed_kmh * (1.0 + COMPLEX_URBAN_SPEED_PERCENT / 100.0):.1f}",
            f"{real.energy_kwh * (1.0 + TABLE_IX_COMPLEX[SourceRoute.URBAN].mean / 100.0):.2f}",
        )
    ]
    for model in (TIMESTEP, INTEGRATED, PRINTED):
        for share in (FEWER_STOPS_FRAC, 1.0):
            drives = [
                model.drive(loaded, source_route(SourceRoute.URBAN, seed, stop_share_frac=share)) for seed in SEEDS
            ]
            rows.append(
                (
                    model.name,
                    f"{drives[0].stop_count:.0f}",
                    _spread([drive.duration_s for drive in drives], _whole),
                    _spread([_kmh(drive) for drive in drives], _tenth),
                    _spread([drive.energy_j / JOULE_PER_KWH for drive in drives], lambda x: f"{x:.2f}"),
                )
            )
    return markdown_table(["urban area", "stops", "duration [s]", "mean speed [km/h]", "energy [kWh]"], rows)


def _table_x() -> str:
    rows = [
        (*simple, *complex_[1:])
        for simple, complex_ in zip(
            _all_trips_rows(TABLE_X_SIMPLE, TABLE_IX_SIMPLE),
            _all_trips_rows(TABLE_X_COMPLEX, TABLE_IX_COMPLEX),
            strict=True,
        )
    ]
    return markdown_table(
        ["all 23 trips [%]", "simple, table X", "from table IX", "complex, table X", "from table IX"], rows
    )


def _checks(holds: bool) -> str:
    rows = [
        tuple(
            re.sub(r"(?<!\w)-(?=\d)", "−", cell) for cell in (check.where, check.printed, check.follows, check.remark)
        )
        for check in source_checks()
        if check.holds is holds
    ]
    lines = ["| table or text | printed | follows from the rest | remark |", "|---|---|---|---|"]
    return "\n".join((*lines, *(f"| {' | '.join(row)} |" for row in rows)))


def _tenths(value: float) -> str:
    return _percent(value, 1)


def _range(low: float, high: float) -> str:
    return f"{_tenths(low)} … {_tenths(high)}"


@cache
def tables() -> Mapping[str, str]:
    """All tables of the page by the name in their markers."""
    vehicle = load_vehicle(VEHICLE)
    if not isinstance(vehicle, Vehicle):
        raise TypeError(f"{VEHICLE} is a consumption table, needs a vehicle given by forces")
    trips = {model.name: [drive_source_trips(vehicle, model, seed) for seed in SEEDS] for model in MODELS}
    driven = {name: [type_averages(records) for records in seeds] for name, seeds in trips.items()}
    return MappingProxyType(
        {
            "iv": _table_iv(driven),
            "v": _table_v(driven),
            "plain-town": _plain_town(vehicle),
            "printed-time": _printed_time(driven),
            "vi": _table_vi(driven),
            "vii": _table_vii(driven),
            "viii": _table_viii(),
            "ix": _table_ix(trips),
            "complex-town": _complex_town(vehicle),
            "x": _table_x(),
            "does-not-add-up": _checks(holds=False),
            "adds-up": _checks(holds=True),
        }
    )


def with_tables(text: str) -> str:
    """The page with all tables renewed between their markers."""
    for name, table in tables().items():
        begin, end = f"<!-- {name} -->\n", f"<!-- /{name} -->"
        if text.count(begin) != 1 or text.count(end) != 1:
            raise ValueError(f"docs/source-tables.md does not have one place for the table {name!r}")
        before, rest = text.split(begin)
        text = f"{before}{begin}{table}\n{end}{rest.split(end)[1]}"
    return text


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
