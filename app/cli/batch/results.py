"""Files of results, written while they come in; a file is there under its name only when it is complete."""

from __future__ import annotations

import json
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from app.cli.batch.requests import JSON_LINES
from app.errors.raised import CommandError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

PARQUET: Final = ".parquet"
ROUTE_KINDS: Final = (*JSON_LINES, PARQUET)
PAIR_KINDS: Final = (".csv", PARQUET)
ROWS_A_GROUP: Final = 10_000
# name and Arrow type of each column of a Parquet file of routes, one line a route
COLUMNS: Final[Mapping[str, str]] = {
    "row": "int64",
    "id": "string",
    "route": "string",
    "feasible": "bool",
    "energy_kwh": "double",
    "battery_kwh": "double",
    "duration_s": "double",
    "total_s": "double",
    "distance_m": "double",
    "soc_end": "double",
    "soc_min": "double",
    "deficit_kwh": "double",
    "climb_m": "double",
    "descent_m": "double",
    "stops": "int64",
    "charging_s": "double",
    "charged_kwh": "double",
    "charging_price": "double",
    "charging_currency": "string",
    "waiting_s": "double",
    "arrive_time": "string",
    "probability_kept": "double",
    "objective_unit": "string",
    "short_by": "double",
    "least_fallback_soc": "double",
    "stops_without_fallback": "int64",
    "no_plan": "string",
    "start_snapped_m": "double",
    "goal_snapped_m": "double",
    "problem_code": "string",
    "problem_detail": "string",
    "warnings": "string",
    "geometry": "binary",
}
GEO: Final = {  # GeoParquet 1.0.0
    "version": "1.0.0",
    "primary_column": "geometry",
    "columns": {"geometry": {"encoding": "WKB", "geometry_types": ["LineString"]}},
}


def is_flat(out: Path) -> bool:
    """Whether results go to a file of flat records, by its name."""
    return out.suffix.lower() == PARQUET


def check_results_name(out: Path, endings: Sequence[str], inputs: Sequence[Path]) -> None:
    """Raise CommandError on results of a kind that is not written, without a folder, or in place of what is read."""
    if out.suffix.lower() not in endings:
        kinds = f"{', '.join(endings[:-1])} or {endings[-1]}"
        raise CommandError(f"--out is {str(out)!r}, allowed: a name that ends in {kinds}")
    if not out.parent.is_dir():
        raise CommandError(f"--out is {str(out)!r}, allowed: a name in a folder that exists")
    if any(out.resolve() == path.resolve() for path in inputs):
        raise CommandError(f"--out is {str(out)!r}, allowed: another file than the one that is read")


@contextmanager
def written(out: Path) -> Iterator[Callable[[Sequence[Any]], None]]:
    """What is called with lines of JSON, or with records for a Parquet file, to be written to a file."""
    part = out.with_name(out.name + ".part")
    with _parquet(part) if is_flat(out) else _json_lines(part) as write:
        yield write
    part.replace(out)


@contextmanager
def _json_lines(path: Path) -> Iterator[Callable[[Sequence[str]], None]]:
    with path.open("w", encoding="utf-8") as file:

        def write(lines: Sequence[str]) -> None:
            file.writelines(f"{line}\n" for line in lines)

        yield write


@contextmanager
def _parquet(path: Path) -> Iterator[Callable[[Sequence[dict[str, Any]]], None]]:
    import pyarrow as pa
    from pyarrow import parquet

    fields = [pa.field(name, pa.type_for_alias(kind)) for name, kind in COLUMNS.items()]
    schema = pa.schema(fields, metadata={"geo": json.dumps(GEO)})
    waiting: list[dict[str, Any]] = []
    with parquet.ParquetWriter(path, schema) as file:

        def flush() -> None:
            file.write_table(pa.Table.from_pylist(waiting, schema=schema))
            waiting.clear()

        def write(records: Sequence[dict[str, Any]]) -> None:
            waiting.extend(records)
            if len(waiting) >= ROWS_A_GROUP:
                flush()

        yield write
        flush()
