"""Tables of Parquet files."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.recordings.files import MOST_BYTES
from diagnosis.recordings.formats.parquet_pages import pages_bytes
from diagnosis.recordings.formats.tables import Cells, LogTable, check_cells, check_rows, is_hidden
from diagnosis.recordings.notes import RecordingError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from diagnosis.recordings.files import UnpackedBytes

PARQUET_MAGIC: Final = b"PAR1"
MOST_METADATA_BYTES: Final = 10_000_000
MOST_TEXT_BYTES: Final = 2 * MOST_BYTES  # of all texts, each as often as rows have it
PER_SECOND: Final = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def parquet_table(
    path: str,
    trip_id: str,
    content: bytes,
    hidden: Sequence[str],
    is_read: Callable[[str], bool],
    together: UnpackedBytes | None = None,
) -> LogTable:
    """The table in a Parquet file: numbers as they are, times as seconds since 1970, texts as texts; rows from 1.

    Columns of any other type are left out; of those that is_read does not name the cells are not read. A text that
    many rows have is unpacked once, and counted for each of them. together: what may be unpacked of this file and
    others. Raises RecordingError for a broken or too large file, before its columns are unpacked.
    """
    import pyarrow as pa  # here, since it takes long and one format needs it
    from pyarrow import parquet

    def opened(texts: Sequence[str]) -> Any:
        return parquet.ParquetFile(
            io.BytesIO(content),
            read_dictionary=list(texts),
            thrift_string_size_limit=MOST_METADATA_BYTES,
            thrift_container_size_limit=MOST_METADATA_BYTES,
        )

    try:
        file = opened(())
        groups = [file.metadata.row_group(k) for k in range(file.metadata.num_row_groups)]
        rows = max(file.metadata.num_rows, sum(group.num_rows for group in groups))
        check_rows(path, rows)
        unpacked = sum(group.total_byte_size for group in groups)
        if not 0 <= unpacked <= MOST_BYTES:
            found = f"{unpacked / 1e6:.0f} MB unpacked"
            raise RecordingError(path, 1, "the file", found, f"at most {MOST_BYTES / 1e6:g} MB; split it into drives")
        if together is not None:
            together.spend(path, unpacked)
        _check_pages(path, content, groups)
        fields = [field for field in file.schema_arrow if not is_hidden(field.name, hidden)]
        wanted = [field for field in fields if is_read(field.name) and _is_cells(field.type, pa)]
        check_cells(path, len(wanted) * rows)
        file = opened([field.name for field in wanted if _is_text(field.type, pa)])
        kept: list[tuple[str, Cells]] = []
        text_bytes = 0
        for name in dict.fromkeys(field.name for field in wanted):
            table = file.read(columns=[name])  # and those whose names go on from it behind a point
            own = [k for k, known in enumerate(table.column_names) if known == name]
            for column in map(table.column, own):
                if len(column) != rows:
                    raise ValueError(f"{len(column)} of {rows} rows in {name}")
                text_bytes += _text_bytes(column, pa)
                if text_bytes > MOST_TEXT_BYTES:
                    raise _too_much_text(path, name)
                kept.append((name, _cells(column, pa)))
        kept += [(field.name, ()) for field in fields if not is_read(field.name)]
    except MemoryError:
        raise
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError, NotImplementedError) as error:
        found = f"not Parquet ({shown(str(error))})"
        raise RecordingError(path, 1, "the file", found, "a whole Parquet file") from error
    if together is not None:
        together.spend(path, text_bytes)
    if rows < 2:
        raise RecordingError(path, 1, "the table", f"{rows} rows", "at least 2 samples")
    names, columns = tuple(name for name, _ in kept), tuple(cells for _, cells in kept)
    return LogTable(path, trip_id, names, columns, range(1, rows + 1))


def _check_pages(path: str, content: bytes, groups: Sequence[Any]) -> None:
    """Raises RecordingError where pages unpack to more than a footer says, ValueError where they can't be found.

    Decoders trust the headers of pages, and the limit of size rests on the footer.
    """
    unpacked = 0
    for column in (group.column(k) for group in groups for k in range(group.num_columns)):
        begin, first = column.data_page_offset, column.dictionary_page_offset
        begin = min(begin, first) if column.has_dictionary_page and first and first > 0 else begin
        for size in pages_bytes(content, begin, column.total_compressed_size):
            unpacked += size
            if unpacked > MOST_BYTES:
                found = f"pages of {unpacked / 1e6:.0f} MB unpacked, which its footer does not say"
                allowed = f"at most {MOST_BYTES / 1e6:g} MB; split it into drives"
                raise RecordingError(path, 1, column.path_in_schema, found, allowed)


def _too_much_text(path: str, name: str) -> RecordingError:
    found = f"texts of more than {MOST_TEXT_BYTES / 1e6:g} MB, each as often as rows have it"
    return RecordingError(path, 1, name, found, "shorter texts; hide the column, or split the file into drives")


def _numeric(pa: Any) -> tuple[Any, ...]:
    return pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_decimal


def _value_type(kind: Any, pa: Any) -> Any:
    return kind.value_type if pa.types.is_dictionary(kind) else kind


def _is_text(kind: Any, pa: Any) -> bool:
    kind = _value_type(kind, pa)
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _is_cells(kind: Any, pa: Any) -> bool:
    """Whether a type is one whose columns are read."""
    value = _value_type(kind, pa)
    return _is_text(kind, pa) or pa.types.is_timestamp(value) or any(is_kind(value) for is_kind in _numeric(pa))


def _text_bytes(column: Any, pa: Any) -> int:
    """How long the texts of a column are in all, each as often as rows have it; 0 for numbers."""
    from pyarrow import compute

    if not _is_text(column.type, pa):
        return 0
    size = 0
    for chunk in column.chunks:
        lengths = compute.binary_length(chunk.dictionary if pa.types.is_dictionary(chunk.type) else chunk)
        if pa.types.is_dictionary(chunk.type):
            lengths = lengths.cast(pa.int64()).take(chunk.indices)
        size += compute.sum(lengths.cast(pa.int64())).as_py() or 0
    return size


def _cells(column: Any, pa: Any) -> Cells:
    kind = column.type
    if _is_text(kind, pa):
        return _texts(column, pa)
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
        kind = column.type
    per_second = 1.0
    if pa.types.is_timestamp(kind):
        per_second = PER_SECOND[kind.unit]
        column = column.cast(pa.int64())
    if pa.types.is_boolean(kind):
        column = column.cast(pa.uint8())
    values = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    return np.asarray(values, np.float64) / per_second


def _texts(column: Any, pa: Any) -> list[str]:
    """The texts of a column, empty where there is none; rows share those that they have in common."""
    found: list[str] = []
    for chunk in column.chunks:
        if not pa.types.is_dictionary(chunk.type):
            found += ["" if text is None else str(text) for text in chunk.to_pylist()]
            continue
        texts = ["" if text is None else str(text) for text in chunk.dictionary.to_pylist()]
        found += ["" if k is None else texts[k] for k in chunk.indices.to_pylist()]
    return found
