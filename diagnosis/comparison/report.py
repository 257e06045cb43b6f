"""A comparison as a folder: figures as JSON, tables as Markdown, the trips as CSV, and pictures."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

from diagnosis.comparison.comparison import relative_error
from diagnosis.comparison.plots import energy_boxes_png, error_boxes_png, error_histogram_png, type_boxes_png
from diagnosis.comparison.tables import METHOD, markdown_page
from diagnosis.comparison.trips import write_trips
from diagnosis.errors import ComparisonError
from energy.units import JOULE_PER_KWH, JOULE_PER_M_PER_KWH_PER_100KM, KMH_PER_MPS, METRE_PER_KM

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.comparison.comparison import (
        Averages,
        Distribution,
        MeanError,
        PairedTest,
        SeriesComparison,
        TripComparison,
        TripPair,
        TypeComparison,
    )
    from diagnosis.comparison.trips import TripRecord

FIGURES_FILE: Final = "comparison.json"
TABLES_FILE: Final = "tables.md"
TRIPS_FILE: Final = "trips.csv"
_PICTURE: Final = re.compile(r"(error-histogram|error-by-type)-[A-Za-z0-9_-]+\.png|(error|energy)-boxes\.png")


def write_comparison(folder: Path, comparison: TripComparison, records: Sequence[TripRecord]) -> tuple[Path, ...]:
    """Write comparison.json, tables.md, trips.csv and the pictures into a folder; returns their paths.

    Everything is made in a folder beside it first. comparison.json comes last and an older one goes first, so a folder
    that has it is complete. Files of an earlier comparison are replaced, anything else in the folder is left alone.
    Raises ComparisonError where the folder is a file, or has a file of one of these names but no comparison.json, so
    that it may be somebody's data; OSError where it can't be written.
    """
    _check_folder(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    made = Path(tempfile.mkdtemp(prefix=f".{folder.name}.partial-", dir=folder.parent))
    try:
        for name, content in _pictures(comparison).items():
            (made / name).write_bytes(content)
        pictures = sorted(path.name for path in made.iterdir())
        (made / TABLES_FILE).write_text(markdown_page(comparison, pictures), encoding="utf-8")
        write_trips(made / TRIPS_FILE, records)
        text = json.dumps(comparison_figures(comparison), indent=2, ensure_ascii=False, allow_nan=False)
        (made / FIGURES_FILE).write_text(f"{text}\n", encoding="utf-8")
        folder.mkdir(exist_ok=True)
        (folder / FIGURES_FILE).unlink(missing_ok=True)
        for path in folder.iterdir():
            if _PICTURE.fullmatch(path.name):
                path.unlink()
        names = (*pictures, TABLES_FILE, TRIPS_FILE, FIGURES_FILE)
        for name in names:
            (made / name).replace(folder / name)
    finally:
        shutil.rmtree(made, ignore_errors=True)
    return tuple(folder / name for name in names)


def _check_folder(folder: Path) -> None:
    if not folder.exists():
        return
    if not folder.is_dir():
        raise ComparisonError("the folder for results", str(folder), "a folder, or a new name")
    if (folder / FIGURES_FILE).exists():
        return
    for path in sorted(folder.iterdir()):
        if path.name in (TABLES_FILE, TRIPS_FILE) or _PICTURE.fullmatch(path.name):
            allowed = f"a folder without a file of that name, or with {FIGURES_FILE} of an earlier comparison"
            raise ComparisonError("the folder for results", f"one that has {path}", allowed)


def comparison_figures(comparison: TripComparison) -> dict[str, object]:
    """All figures of a comparison in the units of a trip table, as JSON takes them; errors in percent."""
    return {
        "measured": comparison.measured,
        "method": list(METHOD),
        "series": [_series(series) for series in comparison.series],
    }


def _series(series: SeriesComparison) -> dict[str, object]:
    return {
        "series": series.series,
        "trip_count": len(series.pairs),
        "trips_only_measured": list(series.measured_only),
        "trips_only_simulated": list(series.simulated_only),
        "trips_without_relative_error": list(series.undefined),
        "types": [_type(kind) for kind in series.types],
        "energy_error_percent": _percents(series.energy_error),
        "measured_energy_kwh": _spread(series.measured_energy_j, 1.0 / JOULE_PER_KWH),
        "simulated_energy_kwh": _spread(series.simulated_energy_j, 1.0 / JOULE_PER_KWH),
        "paired_t_test": _test(series.paired_test),
        "trips": [_pair(pair) for pair in series.pairs],
    }


def _type(kind: TypeComparison) -> dict[str, object]:
    errors = kind.errors
    return {
        "type": kind.route_type,
        "measured": _averages(kind.measured),
        "simulated": _averages(kind.simulated),
        "errors_percent": {
            "distance": _error(errors.distance),
            "duration": _error(errors.duration),
            "speed": _error(errors.speed),
            "stops": _error(errors.stops),
            "standstill": _error(errors.standstill),
            "specific_energy": _error(errors.specific_energy),
            "energy": _error(errors.energy),
        },
        "energy_error_percent": _percents(kind.energy_error),
    }


def _averages(mean: Averages) -> dict[str, object]:
    return {
        "trip_count": mean.trip_count,
        "mass_kg": mean.mass_kg,
        "distance_km": mean.distance_m / METRE_PER_KM,
        "duration_s": mean.duration_s,
        "speed_kmh": mean.speed_mps * KMH_PER_MPS,
        "stops": mean.stop_count,
        "standstill_s": mean.standstill_s,
        "energy_kwh_per_100km": mean.specific_j_per_m / JOULE_PER_M_PER_KWH_PER_100KM,
        "energy_kwh": mean.energy_j / JOULE_PER_KWH,
        "pooled_speed_kmh": mean.pooled_speed_mps * KMH_PER_MPS,
        "pooled_energy_kwh_per_100km": mean.pooled_specific_j_per_m / JOULE_PER_M_PER_KWH_PER_100KM,
    }


def _error(error: MeanError) -> dict[str, object]:
    return {
        "mean": _times(error.mean_frac, 100.0),
        "pooled": _times(error.pooled_frac, 100.0),
        "trip_count": error.trip_count,
    }


def _percents(spread: Distribution | None) -> dict[str, object] | None:
    return None if spread is None else _spread(spread, 100.0)


def _spread(spread: Distribution, factor: float) -> dict[str, object]:
    return {
        "trip_count": spread.count,
        "mean": spread.mean * factor,
        "sd": _times(spread.sd, factor),
        "population_sd": _times(spread.population_sd, factor),
        "mean_ci95": _range(spread.mean_low, spread.mean_high, factor),
        "trips_range95": _range(spread.trips_low, spread.trips_high, factor),
        "min": spread.minimum * factor,
        "quartiles": [quartile * factor for quartile in spread.quartiles],
        "max": spread.maximum * factor,
    }


def _test(test: PairedTest | None) -> dict[str, object] | None:
    if test is None:
        return None
    return {
        "mean_difference_kwh": test.difference_j / JOULE_PER_KWH,
        "t": test.statistic,
        "degrees_of_freedom": test.degrees_of_freedom,
        "p": test.p_value,
    }


def _pair(pair: TripPair) -> dict[str, object]:
    return {
        "trip": pair.measured.trip_id,
        "type": pair.measured.route_type,
        "measured_kwh": pair.measured.energy_j / JOULE_PER_KWH,
        "simulated_kwh": pair.simulated.energy_j / JOULE_PER_KWH,
        "energy_error_percent": _times(relative_error(pair.simulated.energy_j, pair.measured.energy_j), 100.0),
    }


def _times(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _range(low: float | None, high: float | None, factor: float) -> list[float] | None:
    return None if low is None or high is None else [low * factor, high * factor]


def _pictures(comparison: TripComparison) -> dict[str, bytes]:
    """File names and contents; series without a relative error have no picture of errors."""
    pictures = {"energy-boxes.png": energy_boxes_png(comparison)}
    drawn = [series for series in comparison.series if series.energy_error is not None]
    if drawn:
        pictures["error-boxes.png"] = error_boxes_png(comparison)
    for series, name in zip(drawn, file_names([series.series for series in drawn]), strict=True):
        pictures[f"error-histogram-{name}.png"] = error_histogram_png(series)
        pictures[f"error-by-type-{name}.png"] = type_boxes_png(series)
    return pictures


def file_names(names: Sequence[str]) -> list[str]:
    """Names that a file system takes, all different also where case does not count, in the same order."""
    taken: set[str] = set()
    found: list[str] = []
    for name in names:
        stem = re.sub(r"[^A-Za-z0-9_]+", "-", name).strip("-")[:40] or "series"
        candidate, number = stem, 2
        while candidate.lower() in taken:
            candidate, number = f"{stem}-{number}", number + 1
        taken.add(candidate.lower())
        found.append(candidate)
    return found
