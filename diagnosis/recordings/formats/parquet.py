"""Tables of Parquet files."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from diagnosis.recordings.files import MOST_BYTES
from diagnosis.recordings.formats.tables import Cells, LogTable, check_rows, is_hidden
from diagnosis.recordings.notes import RecordingError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

PARQUET_MAGIC: Final = b"PAR1"
MOST_METADATA_BYTES: Final = 10_000_000
PER_SECOND: Final = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def parquet_table(
    path: str, trip_id: str, content: bytes, hidden: Sequence[str], is_read: Callable[[str], bool]
) -> LogTable:
    """The table in a Parquet file: numbers as they are, times as seconds since 1970, texts as texts; rows from 1.

    Columns of any other type are left out; of those that is_read does not name the cells are not read. Raises
    RecordingError for a broken or too large file.
    """
    import pyarrow as pa  # here, since it takes long and one format needs it
    from pyarrow import parquet

    try:
        file = parquet.ParquetFile(
            io.BytesIO(content),
            thrift_string_size_limit=MOST_METADATA_BYTES,
            thrift_container_size_limit=MOST_METADATA_BYTES,
        )
        metadata = file.metadata
        check_rows(path, metadata.num_rows)
        unpacked = sum(metadata.row_group(k).total_byte_size for k in range(metadata.num_row_groups))
        if not 0 <= unpacked <= MOST_BYTES:
            found = f"{unpacked / 1e6:.0f} MB unpacked"
            raise RecordingError(path, 1, "the file", found, f"at most {MOST_BYTES / 1e6:g} MB; split it into drives")
        names = [name for name in file.schema_arrow.names if not is_hidden(name, hidden)]
        arrow = file.read(columns=[name for name in names if is_read(name)])
        kept = [(field.name, _cells(arrow.column(k), pa)) for k, field in enumerate(arrow.schema)]
        kept += [(name, ()) for name in names if not is_read(name)]
    except (pa.ArrowException, OSError, ValueError, TypeError, KeyError, NotImplementedError, MemoryError) as error:
        found = f"not Parquet ({shown(str(error))})"
        raise RecordingError(path, 1, "the file", found, "a whole Parquet file") from error
    if metadata.num_rows < 2:
        raise RecordingError(path, 1, "the table", f"{metadata.num_rows} rows", "at least 2 samples")
    found_columns = [(name, cells) for name, cells in kept if cells is not None]
    return LogTable(
        path,
        trip_id,
        tuple(name for name, _ in found_columns),
        tuple(cells for _, cells in found_columns),
        range(1, metadata.num_rows + 1),
    )


def _numeric(pa: Any) -> tuple[Any, ...]:
    return pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean, pa.types.is_decimal


def _cells(column: Any, pa: Any) -> Cells | None:
    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
        kind = column.type
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return ["" if text is None else str(text) for text in column.to_pylist()]
    per_second = 1.0
    if pa.types.is_timestamp(kind):
        per_second = PER_SECOND[kind.unit]
        column = column.cast(pa.int64())
    elif not any(is_kind(kind) for is_kind in _numeric(pa)):
        return None
    if pa.types.is_boolean(kind):
        column = column.cast(pa.uint8())
    values = column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False)
    return np.asarray(values, np.float64) / per_second
