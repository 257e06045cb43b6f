"""Totals of whole trips, recorded or simulated, and the tables that they are read from and written to."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import sys
import unicodedata
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.errors import TripTableError
from energy.units import JOULE_PER_KWH, METRE_PER_KM

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class TripRecord:
    """What one trip took, as measured or as one model has it.

    series: who says so, such as "measured", "fast" or "timestep". The same trip_id in two series is the same drive.
    stop_count: may be fractional, where a model counts stops by their expectation.
    energy_j: from the battery, negative where more was recuperated. mass_kg: total mass, None where unknown.
    """

    trip_id: str
    route_type: str
    series: str
    distance_m: float
    duration_s: float
    stop_count: float
    standstill_s: float
    energy_j: float
    mass_kg: float | None = None

    @property
    def speed_mps(self) -> float:
        """Mean speed, standing still included [m/s]."""
        return self.distance_m / self.duration_s

    @property
    def specific_j_per_m(self) -> float:
        """Energy a metre [J/m]."""
        return self.energy_j / self.distance_m


@dataclass(frozen=True, slots=True)
class _Column:
    """A number of a trip table: its factor to SI, and the range allowed in the table's unit."""

    name: str
    to_si: float
    low: float
    high: float
    above_low: bool = False  # low itself is not allowed

    def allowed(self) -> str:
        if self.above_low:
            return f"a number above {self.low:g}, at most {self.high:g}"
        return f"a number from {self.low:g} to {self.high:g}"

    def holds(self, value: float) -> bool:
        return (self.low < value if self.above_low else self.low <= value) and value <= self.high


SMALLEST: Final = 1e-6  # magnitude in a table's unit, assumed: below anything measured, and no ratio of two overflows
_UNPRINTABLE: Final = ("Cc", "Cs", "Zl", "Zp")  # Unicode: control, surrogate, line and paragraph separator
_TEXTS: Final = ("trip", "type", "series")
_DISTANCE: Final = _Column("distance_km", METRE_PER_KM, 0.0, 1e5, above_low=True)
_DURATION: Final = _Column("duration_s", 1.0, 0.0, 1e8, above_low=True)
_STOPS: Final = _Column("stops", 1.0, 0.0, 1e6)
_STANDSTILL: Final = _Column("standstill_s", 1.0, 0.0, 1e8)
_ENERGY: Final = _Column("energy_kwh", JOULE_PER_KWH, -1e5, 1e5)
_MASS: Final = _Column("mass_kg", 1.0, 0.0, 1e5, above_low=True)
_NUMBERS: Final = (_DISTANCE, _DURATION, _STOPS, _STANDSTILL, _ENERGY)
REQUIRED_COLUMNS: Final = (*_TEXTS, *(column.name for column in _NUMBERS))
COLUMNS: Final = (*REQUIRED_COLUMNS, _MASS.name)


@dataclass(frozen=True, slots=True)
class _Place:
    """Where in a file a value stands."""

    path: str
    line: int
    unit: str = "line"

    def error(self, column: str, value: str, allowed: str) -> TripTableError:
        return TripTableError(self.path, self.line, column, value, allowed, unit=self.unit)


def read_trips(paths: Sequence[Path]) -> tuple[TripRecord, ...]:
    """All trips of CSV files and, where the name ends in `.json`, of JSON files, in the order of the files.

    Raises TripTableError for the first value out of range, and where a trip is twice in a series.
    """
    records: list[TripRecord] = []
    seen: dict[tuple[str, str], _Place] = {}
    for path in paths:
        for place, record in _read_json(path) if path.suffix.lower() == ".json" else _read_csv(path):
            earlier = seen.setdefault((record.trip_id, record.series), place)
            if earlier is not place:
                where = f"{earlier.path}, {earlier.unit} {earlier.line}"
                allowed = f"one a series; {record.series!r} has this trip already at {where}"
                raise place.error("trip", repr(record.trip_id), allowed)
            records.append(record)
    return tuple(records)


def write_trips(path: Path, records: Iterable[TripRecord]) -> None:
    """Write a CSV table that read_trips reads, in one step: the file is there whole or not at all.

    Numbers are written in full, so that reading them again gives the same to a rounding of the unit's conversion.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        with partial.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(COLUMNS)
            for record in records:
                writer.writerow(
                    (
                        record.trip_id,
                        record.route_type,
                        record.series,
                        record.distance_m / METRE_PER_KM,
                        record.duration_s,
                        record.stop_count,
                        record.standstill_s,
                        record.energy_j / JOULE_PER_KWH,
                        "" if record.mass_kg is None else record.mass_kg,
                    )
                )
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise _Place(str(path), line).error("the file", "not UTF-8", "a table in UTF-8") from error


def _read_csv(path: Path) -> list[tuple[_Place, TripRecord]]:
    reader = csv.reader(io.StringIO(_text(path), newline=""), strict=True)
    header: list[str] | None = None
    found: list[tuple[_Place, TripRecord]] = []
    while True:
        place = _Place(str(path), reader.line_num + 1)
        try:
            row = next(reader, None)
        except csv.Error as error:
            raise _Place(str(path), reader.line_num).error(
                "the row", f"not CSV ({error})", "comma-separated"
            ) from error
        if row is None:
            break
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        if header is None:
            header = cells
            _check_names(place, header)
        elif len(cells) != len(header):
            raise place.error("the row", f"{len(cells)} cells long", f"{len(header)} cells, as in the header")
        else:
            found.append((place, _record(place, dict(zip(header, cells, strict=True)))))
    if header is None:
        raise _Place(str(path), 1).error("the header", "missing", ",".join(REQUIRED_COLUMNS) + "[,mass_kg]")
    if not found:
        raise _Place(str(path), reader.line_num).error("the table", "without a trip", "at least one trip")
    return found


def _read_json(path: Path) -> list[tuple[_Place, TripRecord]]:
    text = _text(path)
    try:
        entries = json.loads(text)
    except json.JSONDecodeError as error:
        raise _Place(str(path), error.lineno).error("the file", f"not JSON ({error.msg})", "a list of trips") from error
    except RecursionError as error:
        raise _Place(str(path), 1).error("the file", "nested too deeply", "a list of trips") from error
    except ValueError as error:  # what json raises on a long whole number
        digits = sys.get_int_max_str_digits()
        value = f"one with a whole number of more than {digits} digits"
        raise _Place(str(path), 1).error("the file", value, "a list of trips") from error
    if not isinstance(entries, list) or not entries:
        raise _Place(str(path), 1).error("the file", "not a list of trips", "a list of at least one object")
    found: list[tuple[_Place, TripRecord]] = []
    for position, entry in enumerate(entries, start=1):
        place = _Place(str(path), position, "entry")
        if not isinstance(entry, dict):
            raise place.error("the entry", _shown(entry), f"an object with {', '.join(REQUIRED_COLUMNS)}")
        _check_names(place, list(entry))
        found.append((place, _record(place, entry)))
    return found


def _check_names(place: _Place, names: Sequence[str]) -> None:
    allowed = ", ".join(REQUIRED_COLUMNS) + " and, where known, mass_kg"
    for name in names:
        if name not in COLUMNS:
            raise place.error("a column", repr(name), allowed)
        if names.count(name) > 1:
            raise place.error(f"column {name}", "there twice", allowed)
    for name in REQUIRED_COLUMNS:
        if name not in names:
            raise place.error(f"column {name}", "missing", allowed)


def _record(place: _Place, cells: Mapping[str, object]) -> TripRecord:
    trip, kind, series = (_label(place, name, cells[name]) for name in _TEXTS)
    distance_m, duration_s, stops, standstill_s, energy_j = (
        _number(place, column, cells[column.name]) for column in _NUMBERS
    )
    if standstill_s > duration_s:
        raise place.error(_STANDSTILL.name, f"{standstill_s:g}", f"at most duration_s, {duration_s:g}")
    mass = cells.get(_MASS.name)
    mass_kg = None if mass is None or mass == "" else _number(place, _MASS, mass)
    return TripRecord(trip, kind, series, distance_m, duration_s, stops, standstill_s, energy_j, mass_kg)


def _label(place: _Place, name: str, value: object) -> str:
    text = str(value) if isinstance(value, int) and not isinstance(value, bool) else value
    if not isinstance(text, str) or not text.strip():
        raise place.error(name, _shown(value), "a text that is not empty")
    if any(unicodedata.category(character) in _UNPRINTABLE for character in text.strip()):
        raise place.error(name, _shown(value), "a text without line breaks, control characters and lone surrogates")
    return text.strip()


def _number(place: _Place, column: _Column, value: object) -> float:
    number = math.nan
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        try:
            number = float(value)
        except (ValueError, OverflowError):
            number = math.nan
    if not column.holds(number):
        raise place.error(column.name, _shown(value), column.allowed())
    if 0.0 < abs(number) < SMALLEST:
        allowed = f"at least {SMALLEST:g}" if column.above_low else f"0, or at least {SMALLEST:g} in magnitude"
        raise place.error(column.name, _shown(value), allowed)
    return number * column.to_si


def _shown(value: object) -> str:
    text = "empty" if value == "" else str(value) if isinstance(value, int | float) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
