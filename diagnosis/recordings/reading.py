"""Recorded drives in SI units, read from the files that loggers and published data sets come in."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from diagnosis.recordings.files import UnpackedBytes, file_content, recording_files, recording_id, text_of
from diagnosis.recordings.formats.car_services import (
    DRIVE,
    SERVICE_NAMES,
    is_ovms,
    is_teslamate,
    read_ovms,
    read_teslamate,
    teslamate_drives,
)
from diagnosis.recordings.formats.csv_tables import csv_table
from diagnosis.recordings.formats.gpx import is_gpx, read_gpx
from diagnosis.recordings.formats.json_tables import is_json, json_table
from diagnosis.recordings.formats.leaf_spy import LEAF_SPY_NAMES, NEEDS, is_leaf_spy, read_leaf_spy
from diagnosis.recordings.formats.named_columns import FORMAT_NAMES, I3_NEEDS, is_plain, read_abrp, read_i3, read_plain
from diagnosis.recordings.formats.obd import (
    DEVICE_TIME,
    LONG,
    OBD_NAMES,
    is_parameter,
    is_torque,
    is_wide,
    read_long,
    read_torque,
    read_wide,
)
from diagnosis.recordings.formats.order import in_order
from diagnosis.recordings.formats.parquet import PARQUET_MAGIC, parquet_table
from diagnosis.recordings.formats.tables import LogTable, check_drives, named_errors
from diagnosis.recordings.formats.totals import TOTALS_NAMES, is_totals, read_totals
from diagnosis.recordings.notes import Note, NoteKind, OrderError, RecordingError, shown
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.soundness.checks import checked

__all__ = ["Note", "NoteKind", "Recording", "RecordingError", "read_recording", "read_recordings"]

FIXED_NAMES: Final = FORMAT_NAMES | OBD_NAMES | TOTALS_NAMES | LEAF_SPY_NAMES | SERVICE_NAMES
SPELLED: Final = tuple(
    {name.casefold(): name for name in sorted(names)}
    for names in (FORMAT_NAMES, OBD_NAMES, LEAF_SPY_NAMES, SERVICE_NAMES)
)
FOLDED: Final = frozenset(name for names in SPELLED for name in names)
HINTS: Final = (  # of exports that are no log of a drive
    (
        re.compile(r"\b[A-Z*]{1,3}-(?:GPS|PWR|OVM)-|h_recordtype"),
        "metrics with names, as records of OVMS' history have none: export v.p.speed, v.b.power and others with a time",
    ),
    (
        re.compile(r"\bstart_date\b.*\bend_date\b"),
        "TeslaMate's table of positions, as that of drives has no samples; or sums of drives with distance_km,"
        " duration_min and energy_kwh",
    ),
    (re.compile(r"^\$?G[A-Z]{4},"), "GPX or CSV, as NMEA has no power: convert it"),
)
OnProgress = Callable[[int, int], None]


def read_recording(path: Path, hidden: Sequence[str] = ()) -> Recording:
    """The recording in a file, plain or gzip, of any known format, checked (diagnosis.recordings.soundness.checks).

    hidden: patterns such as "Heat*" of names of columns that are dropped before anything is read, letter case aside.
    Raises RecordingError naming file, row, column, value and what is allowed; OSError where the file can't be opened.
    """
    drives = read_drives(path, hidden)
    if len(drives) > 1:
        raise RecordingError(str(path), 1, "the file", f"{len(drives)} drives", "one drive; read_drives reads several")
    return drives[0]


def _read(table: LogTable, hidden: Sequence[str]) -> tuple[list[Recording], list[RecordingError]]:
    """The drives in a table, checked, and the errors of those that can't be read where it has several."""
    table, form = _with_form(table)
    parts = [table] if form.split is None else form.split(table)
    check_drives(table.path, len(parts))
    drives: list[Recording] = []
    errors: list[RecordingError] = []
    while parts:
        part = parts.pop(0)
        several = bool(parts or drives or errors)
        try:
            recording = form.read(part, hidden)
            drives.append(checked(replace(recording, notes=(*recording.notes, *part.notes)), part.path))
        except OrderError as error:
            ordered = [] if error.column not in part.names else in_order(part, error.column)
            if not ordered:
                errors.append(_of_part(error, part, several=several))
            parts[:0] = ordered
        except RecordingError as error:
            errors.append(_of_part(error, part, several=several))
    return drives, named_errors(table.path, errors)


def _of_part(error: RecordingError, part: LogTable, *, several: bool) -> RecordingError:
    """The error of a drive, which names it where the file has several; without the frames that hold its table."""
    kept = error.without_trace()
    if not several:
        return kept
    path = f"{error.path}, drive {part.id}"
    return RecordingError(path, kept.row, kept.column, str(kept.value), kept.allowed)


def _with_form(table: LogTable) -> tuple[LogTable, Format]:
    """A table and its format, with the format's spelling of names where letter case is all that differs."""
    try:
        return table, _form(table)
    except RecordingError:
        for names in SPELLED:
            spelled = tuple(names.get(name.casefold(), name) for name in table.names)
            form = next((form for form in FORMATS if form.recognises(spelled)), None)
            if form is not None and form.name != "TeslaMate":  # names that many services use, in other units
                return replace(table, names=spelled), form
        raise


def _form(table: LogTable) -> Format:
    for form in FORMATS:
        if form.recognises(table.names):
            return form
    header = ", ".join(table.names)
    hint = next((text for pattern, text in HINTS if pattern.search(header)), None)
    if hint is not None:
        raise RecordingError(table.path, 1, "the header", shown(header), hint)
    known = "; ".join(f"{form.name}: {', '.join(form.needs)}" for form in FORMATS)
    raise RecordingError(table.path, 1, "the header", shown(header), f"columns of a format ({known})")


def read_drives(path: Path, hidden: Sequence[str] = ()) -> list[Recording]:
    """The drives in a file: one, one a row where it is a table of sums, one an id of TeslaMate; as read_recording.

    The error of one that is no drive is raised.
    """
    drives, errors = _drives(path, hidden)
    if errors:
        raise errors[0]
    return drives


def _drives(
    path: Path, hidden: Sequence[str], together: UnpackedBytes | None = None
) -> tuple[list[Recording], list[RecordingError]]:
    """The drives in a file, and the errors of those that are none where it has several."""
    try:
        return _decoded(path, hidden, together)
    except MemoryError:
        pass  # its frames hold the tables of the file: they go before anything else is made
    allowed = "less than the memory that is left; split it into drives, or send fewer files"
    raise RecordingError(str(path), 1, "the file", "too large once it is read", allowed)


def _decoded(
    path: Path, hidden: Sequence[str], together: UnpackedBytes | None
) -> tuple[list[Recording], list[RecordingError]]:
    content = file_content(path, together=together)
    name = recording_id(path)
    if not content.startswith(PARQUET_MAGIC):
        text = text_of(path, content)
        if is_gpx(text):
            return [checked(read_gpx(str(path), name, text), str(path))], []
        if text.lstrip().startswith("<"):
            found = shown(text.lstrip().partition("\n")[0])
            raise RecordingError(str(path), 1, "the file", f"XML or HTML ({found})", "GPX, or a table in CSV or JSON")
        table = json_table(str(path), name, text, hidden, is_read) if is_json(text) else None
        table = table or csv_table(str(path), name, text, hidden, is_read)
    else:
        table = parquet_table(str(path), name, content, hidden, is_read, together)
    return read_totals(table) if is_totals(table.names) else _read(table, hidden)


def read_recordings(
    paths: Iterable[Path | str],
    hidden: Sequence[str] = (),
    on_progress: OnProgress | None = None,
    *,
    together: UnpackedBytes | None = None,
) -> tuple[list[Recording], list[RecordingError]]:
    """The recordings in files, folders and patterns such as "drives/*.csv", and the errors of those that can't be read.

    A bad file doesn't stop the others, nor does one that can't be opened. Two files of the same id, such as trip.csv
    and trip.csv.gz, can't be told apart: the second is an error. on_progress is called with the files done, and all.
    together: how much may be unpacked of all of them; files beyond it are errors. Errors are without the frames that
    raised them.
    """
    files = recording_files(paths)
    found: list[Recording] = []
    errors: list[RecordingError] = []
    ids: set[str] = set()
    first: dict[str, Path] = {}
    for done, path in enumerate(files, start=1):
        before = first.setdefault(recording_id(path), path)
        try:
            if before is not path:
                raise RecordingError(
                    str(path), 1, "its id", recording_id(path), f"one that {before} does not have already"
                )
            drives, refused = _drives(path, hidden, together)
            errors += refused
            for recording in drives:
                if recording.id in ids:
                    allowed = "one that no file has already"
                    errors.append(RecordingError(str(path), 1, "its id", recording.id, allowed))
                else:
                    ids.add(recording.id)
                    found.append(recording)
        except RecordingError as error:
            errors.append(error.without_trace())
        except OSError as error:
            text = error.strerror or str(error)
            errors.append(
                RecordingError(str(path), 1, "the file", f"not to be opened ({text})", "a file, folder or pattern")
            )
        if on_progress is not None:
            on_progress(done, len(files))
    return found, errors


@dataclass(frozen=True, slots=True)
class Format:
    """A kind of file: how its header is recognised, how its table is read, and how it is split into drives."""

    name: str
    needs: tuple[str, ...]
    read: Callable[[LogTable, Sequence[str]], Recording]
    fits: Callable[[Sequence[str]], bool] | None = None
    split: Callable[[LogTable], list[LogTable]] | None = None

    def recognises(self, names: Sequence[str]) -> bool:
        """Whether a header with these names is of this format."""
        return set(self.needs) <= set(names) if self.fits is None else self.fits(names)


def is_read(name: str) -> bool:
    """Whether some format reads a column of this name."""
    return name in FIXED_NAMES or name.casefold() in FOLDED or is_parameter(name)


# A further format is one more entry, tried in this order; its reader turns the table into a Recording in any way.
FORMATS: Final = (
    Format(
        "TUM BMW i3",
        I3_NEEDS,
        lambda table, _: read_i3(table),
        lambda names: set(I3_NEEDS[:2]) <= set(names),
    ),
    Format("joulepath", ("time_s", "speed_kmh"), lambda table, _: read_plain(table), is_plain),
    Format("ABRP telemetry", ("utc", "speed"), lambda table, _: read_abrp(table)),
    Format("Car Scanner, long", LONG, read_long),
    Format("Car Scanner, wide", ("time", "Vehicle speed (km/h)"), lambda table, _: read_wide(table), is_wide),
    Format("Torque", (DEVICE_TIME.name, "Speed (OBD)(km/h)"), lambda table, _: read_torque(table), is_torque),
    Format("Leaf Spy", NEEDS, lambda table, _: read_leaf_spy(table), is_leaf_spy),
    Format(
        "TeslaMate",
        ("date", "speed", "power", DRIVE),
        lambda table, _: read_teslamate(table),
        is_teslamate,
        teslamate_drives,
    ),
    Format("OVMS", ("timestamp", "v.p.speed"), lambda table, _: read_ovms(table), is_ovms),
)
