"""The report's sections on how well drives are met: scores, where the mismatch lies, examples, energies, planning."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from diagnosis.answer.regimes import Axis
from diagnosis.report.plots import (
    MOST_BARS,
    energy_bars,
    energy_reach,
    families,
    family_class,
    family_name,
    fit_panel,
    regime_panel,
    trip_panel,
)
from diagnosis.report.rendering import rendered
from diagnosis.report.tables import Header, Table, cell, data, headers, interval_cell
from diagnosis.report.text import AXIS_NAMES, NONE, count, fit_sentence, fixed, percents, regime_range
from energy.units import SECOND_PER_HOUR

if TYPE_CHECKING:
    from collections.abc import Sequence

    from markupsafe import Markup

    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.answer.results import Diagnosis, FitScore, ProfileSplit, TripAccount
    from diagnosis.report.tables import Cell, Number

SHOWN_AXES: Final = tuple(Axis(name) for name in AXIS_NAMES)
KWH_PLACES: Final = 2
NO_TRIPS: Final = "There is no drive to show."


def fit_section(diagnosis: Diagnosis) -> Markup:
    """How well trips are met before and after: a sentence, the scores and two scatter plots."""
    held_out = len(diagnosis.held_out_trips)
    kind = f"on {count(held_out, 'drive')} held out" if held_out else "on drives left out of the fit one at a time"
    pairs = (("before", diagnosis.before), ("after", diagnosis.after))
    rows = [_score_row(name, score) for name, score in pairs if score is not None]
    heads = headers("model", "error's mean size, MAPE [%]", "95 %", "mean error, bias [%]", "SD [%]", "power, RMS [W]")
    return rendered(
        "fit.html",
        sentence=fit_sentence(diagnosis.before, diagnosis.after, held_out),
        scores=Table(f"Errors of drives' energy {kind}", heads, rows) if rows else None,
        panels=_scatter(diagnosis.trips) if diagnosis.trips else [],
        no_trips=NO_TRIPS,
    )


def regimes_section(diagnosis: Diagnosis) -> Markup:
    """Residual power by regime before and after as small plots, and as a table."""
    if not diagnosis.regimes_before and not diagnosis.regimes_after:
        return rendered("nothing.html", text="No range of the drives was looked at.")
    panels: list[Markup] = []
    rows: list[list[Cell]] = []
    for axis in SHOWN_AXES:
        before = [regime for regime in diagnosis.regimes_before if regime.axis is axis]
        after = [regime for regime in diagnosis.regimes_after if regime.axis is axis]
        if before or after:
            panels.append(regime_panel(axis, before, after))
            rows += _regime_rows(axis, before, after)
    heads = headers("range", "drives", "time [h]", "before [W]", "95 %", "after [W]", "95 %", "energy before [kWh]")
    return rendered(
        "regimes.html", panels=panels, regimes=Table("Measured power less the model's by range", heads, rows)
    )


def examples_section(diagnosis: Diagnosis) -> Markup:
    """Power over time on the trip where most was explained and on the one that is still met worst."""
    examples = example_trips(diagnosis.trips)
    if not examples:
        return rendered("nothing.html", text=NO_TRIPS)
    return rendered("examples.html", examples=[(title, trip_panel(trip)) for title, trip in examples])


def energy_section(diagnosis: Diagnosis) -> Markup:
    """Where each trip's energy went: bars by family, and the table of trips."""
    if not diagnosis.trips:
        return rendered("nothing.html", text=NO_TRIPS)
    cold_first = sorted(diagnosis.trips, key=lambda trip: math.inf if trip.ambient_c is None else trip.ambient_c)
    names = families(diagnosis.trips)
    return rendered(
        "energy.html",
        families=[(family_class(name), family_name(name)) for name in names],
        bars=energy_bars(cold_first),
        trip_count=len(cold_first),
        most_bars=MOST_BARS,
        drives=_trip_table(diagnosis.trips, names),
    )


def profile_section(splits: Sequence[ProfileSplit]) -> Markup:
    """What planning and what the vehicle model got wrong, trip by trip and over all trips."""
    planned, driven, measured = (
        math.fsum(values)
        for values in (
            [split.planned_kwh for split in splits],
            [split.driven_kwh for split in splits],
            [split.measured_kwh for split in splits],
        )
    )
    sentence = None
    if measured > 0.0:
        sentence = (
            f"Over {count(len(splits), 'drive')}, planning errs by {_percent_text(planned - driven, measured)} of the "
            "measured energy, for it takes other speeds and stops than were driven. Given the driven speed, the "
            f"vehicle model errs by {_percent_text(driven - measured, measured)}."
        )
    heads = headers(
        *("drive", "planned [kWh]", "at the driven speed [kWh]", "measured [kWh]", "planning's error [%]"),
        *("vehicle model's error [%]", "planned [min]", "driven [min]", "planned stops", "driven stops"),
        "forecast with the findings [kWh]",
    )
    table = Table("Planning and vehicle model", heads, [_split_row(split) for split in splits])
    return rendered("profile.html", sentence=sentence, splits=table)


def example_trips(trips: Sequence[TripAccount]) -> list[tuple[str, TripAccount]]:
    """The trip whose error shrank most, if any did, and the one with the largest left; held-out ones if any are."""
    known = [trip for trip in trips if math.isfinite(_gain_kwh(trip))]
    pool = [trip for trip in known if trip.held_out] or known
    if not pool:
        return []
    worst = max(pool, key=lambda trip: abs(trip.after_kwh - trip.measured_kwh))
    most = max(pool, key=_gain_kwh)
    if _gain_kwh(most) <= 0.0:
        return [("The drive that is met worst", worst)]
    if most is worst:
        return [("The drive where most was explained, and which is still met worst", most)]
    return [("The drive where most was explained", most), ("The drive that is still met worst", worst)]


def _gain_kwh(trip: TripAccount) -> float:
    return abs(trip.before_kwh - trip.measured_kwh) - abs(trip.after_kwh - trip.measured_kwh)


def _scatter(trips: Sequence[TripAccount]) -> list[Markup]:
    reach = energy_reach(trips)
    return [
        fit_panel(trips, lambda trip: trip.before_kwh, "Before", "before", reach),
        fit_panel(trips, lambda trip: trip.after_kwh, "After", "after", reach),
    ]


def _score_row(name: str, score: FitScore) -> list[Cell]:
    mape = percents(score.mape_ci95)
    return [
        name,
        cell(100.0 * score.mape, mape),
        interval_cell(100.0 * score.mape, mape),
        cell(100.0 * score.bias, mape, signed=True),
        cell(100.0 * score.sd, mape),
        cell(score.rmse_w),
    ]


def _regime_rows(axis: Axis, before: Sequence[RegimeResidual], after: Sequence[RegimeResidual]) -> list[list[Cell]]:
    was, now = ({(regime.low, regime.high): regime for regime in regimes} for regimes in (before, after))
    rows: list[list[Cell]] = []
    for reach, known in sorted((was | now).items(), key=lambda item: item[0]):
        energy = was[reach].energy_kwh if reach in was else None
        rows.append(
            [
                f"{AXIS_NAMES[axis][0]}: {regime_range(axis, *reach)}",
                data(known.trips, str(known.trips)),
                cell(known.duration_s / SECOND_PER_HOUR),
                *_residual_cells(was.get(reach)),
                *_residual_cells(now.get(reach)),
                NONE if energy is None else cell(energy, signed=True),
            ]
        )
    return rows


def _residual_cells(regime: RegimeResidual | None) -> tuple[Cell, Cell]:
    if regime is None:
        return NONE, NONE
    interval = None if regime.low_w is None or regime.high_w is None else (regime.low_w, regime.high_w)
    return cell(regime.mean_w, interval, signed=True), interval_cell(regime.mean_w, interval)


def _trip_table(trips: Sequence[TripAccount], names: Sequence[str]) -> Table:
    heads = headers(
        *("drive", "outside [°C]", "way [km]", "time [min]", "measured [kWh]", "vehicle file [kWh]"),
        *("before [kWh]", "after [kWh]", "explained [kWh]", "error before [%]", "error after [%]"),
        *(f"{family_name(name)} [kWh]" for name in names),
    )
    heads.insert(1, Header("held out"))
    sums = [math.fsum(column) for column in zip(*(_energies(trip, names) for trip in trips), strict=True)]
    held_out = sum(trip.held_out for trip in trips)
    total: list[Cell] = [
        f"all {count(len(trips), 'drive')}",
        data(held_out, str(held_out)),
        "",
        _places(math.fsum(trip.distance_km for trip in trips), 1),
        _places(math.fsum(trip.duration_s for trip in trips) / 60.0, 0),
        *_energy_cells(sums),
    ]
    return Table("Drives", heads, [_trip_row(trip, names) for trip in trips], total)


def _trip_row(trip: TripAccount, names: Sequence[str]) -> list[Cell]:
    return [
        trip.id,
        "yes" if trip.held_out else "no",
        NONE if trip.ambient_c is None else _places(trip.ambient_c, 1),
        _places(trip.distance_km, 1),
        _places(trip.duration_s / 60.0, 0),
        *_energy_cells(_energies(trip, names)),
    ]


def _energies(trip: TripAccount, names: Sequence[str]) -> list[float]:
    """Measured, nameplate, before, after and explained energy, then that of each family [kWh]."""
    return [
        *(trip.measured_kwh, trip.nameplate_kwh, trip.before_kwh, trip.after_kwh, trip.explained_kwh),
        *(trip.by_family_kwh.get(name, 0.0) for name in names),
    ]


def _energy_cells(energies: Sequence[float]) -> list[Cell]:
    measured, _, before, after = energies[:4]
    return [
        *(_places(kwh, KWH_PLACES) for kwh in energies[:5]),
        _error_cell(before - measured, measured),
        _error_cell(after - measured, measured),
        *(_places(kwh, KWH_PLACES) for kwh in energies[5:]),
    ]


def _split_row(split: ProfileSplit) -> list[Cell]:
    return [
        split.trip_id,
        *(_places(kwh, KWH_PLACES) for kwh in (split.planned_kwh, split.driven_kwh, split.measured_kwh)),
        _error_cell(split.planned_kwh - split.driven_kwh, split.measured_kwh),
        _error_cell(split.driven_kwh - split.measured_kwh, split.measured_kwh),
        _places(split.planned_s / 60.0, 1),
        _places(split.driven_s / 60.0, 1),
        _places(split.planned_stops, 1),
        data(split.driven_stops, str(split.driven_stops)),
        NONE if split.forecast_kwh is None else _places(split.forecast_kwh, KWH_PLACES),
    ]


def _places(value: float, places: int) -> Number:
    return data(value, fixed(value, places))


def _error_cell(error_kwh: float, measured_kwh: float) -> Cell:
    """Error relative to the measured energy [%]; none where that is not positive."""
    if not measured_kwh > 0.0:
        return NONE
    return data(100.0 * error_kwh / measured_kwh, fixed(100.0 * error_kwh / measured_kwh, 1, signed=True))


def _percent_text(error_kwh: float, measured_kwh: float) -> str:
    return f"{fixed(100.0 * error_kwh / measured_kwh, 1, signed=True)} %"
