"""Recorded drives in SI units, read from the files that loggers and published data sets come in."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from diagnosis.recordings.files import file_content, recording_files, recording_id, text_of
from diagnosis.recordings.formats.json_tables import is_json, json_table
from diagnosis.recordings.formats.named_columns import FORMAT_NAMES, I3_NEEDS, is_plain, read_abrp, read_i3, read_plain
from diagnosis.recordings.formats.obd import LONG, OBD_NAMES, is_parameter, is_wide, read_long, read_wide
from diagnosis.recordings.formats.parquet import PARQUET_MAGIC, parquet_table
from diagnosis.recordings.formats.tables import LogTable, csv_table
from diagnosis.recordings.formats.totals import TOTALS_NAMES, is_totals, read_totals
from diagnosis.recordings.notes import Note, NoteKind, RecordingError, shown
from diagnosis.recordings.recording import Recording
from diagnosis.recordings.soundness.checks import checked

__all__ = ["Note", "NoteKind", "Recording", "RecordingError", "read_recording", "read_recordings"]

FIXED_NAMES: Final = FORMAT_NAMES | OBD_NAMES | TOTALS_NAMES
OnProgress = Callable[[int, int], None]


def read_recording(path: Path, hidden: Sequence[str] = ()) -> Recording:
    """The recording in a file, plain or gzip, of any known format, checked (diagnosis.recordings.soundness.checks).

    hidden: patterns such as "Heat*" of names of columns that are dropped before anything is read, letter case aside.
    Raises RecordingError naming file, row, column, value and what is allowed; OSError where the file can't be opened.
    """
    return _read(_table(path, hidden), hidden)


def _read(table: LogTable, hidden: Sequence[str]) -> Recording:
    for form in FORMATS:
        if form.recognises(table.names):
            recording = form.read(table, hidden)
            return checked(replace(recording, notes=(*recording.notes, *table.notes)), table.path)
    known = "; ".join(f"{form.name}: {', '.join(form.needs)}" for form in FORMATS)
    raise RecordingError(table.path, 1, "the header", shown(", ".join(table.names)), f"columns of a format ({known})")


def read_drives(path: Path, hidden: Sequence[str] = ()) -> list[Recording]:
    """The drives in a file: one, or one a row where it is a table of sums; raises as read_recording.

    Of a row that is no drive the error is raised.
    """
    drives, errors = _drives(path, hidden)
    if errors:
        raise errors[0]
    return drives


def _drives(path: Path, hidden: Sequence[str]) -> tuple[list[Recording], list[RecordingError]]:
    """The drives in a file, and the errors of those that are none where it has several."""
    table = _table(path, hidden)
    return read_totals(table) if is_totals(table.names) else ([_read(table, hidden)], [])


def read_recordings(
    paths: Iterable[Path | str], hidden: Sequence[str] = (), on_progress: OnProgress | None = None
) -> tuple[list[Recording], list[RecordingError]]:
    """The recordings in files, folders and patterns such as "drives/*.csv", and the errors of those that can't be read.

    A bad file doesn't stop the others, nor does one that can't be opened. Two files of the same id, such as trip.csv
    and trip.csv.gz, can't be told apart: the second is an error. on_progress is called with the files done, and all.
    """
    files = recording_files(paths)
    found: list[Recording] = []
    errors: list[RecordingError] = []
    first: dict[str, Path] = {}
    for done, path in enumerate(files, start=1):
        before = first.setdefault(recording_id(path), path)
        try:
            if before is not path:
                raise RecordingError(
                    str(path), 1, "its id", recording_id(path), f"one that {before} does not have already"
                )
            drives, refused = _drives(path, hidden)
            errors += refused
            for recording in drives:
                if any(recording.id == known.id for known in found):
                    allowed = "one that no file has already"
                    errors.append(RecordingError(str(path), 1, "its id", recording.id, allowed))
                else:
                    found.append(recording)
        except RecordingError as error:
            errors.append(error)
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
    """A kind of file: how its header is recognised, and how its table is read."""

    name: str
    needs: tuple[str, ...]
    read: Callable[[LogTable, Sequence[str]], Recording]
    fits: Callable[[Sequence[str]], bool] | None = None

    def recognises(self, names: Sequence[str]) -> bool:
        """Whether a header with these names is of this format."""
        return set(self.needs) <= set(names) if self.fits is None else self.fits(names)


def _table(path: Path, hidden: Sequence[str]) -> LogTable:
    content = file_content(path)
    name = recording_id(path)
    if content.startswith(PARQUET_MAGIC):
        return parquet_table(str(path), name, content, hidden, is_read)
    text = text_of(path, content)
    if is_json(text):
        return json_table(str(path), name, text, hidden, is_read)
    return csv_table(str(path), name, text, hidden, is_read)


def is_read(name: str) -> bool:
    """Whether some format reads a column of this name."""
    return name in FIXED_NAMES or is_parameter(name)


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
)
