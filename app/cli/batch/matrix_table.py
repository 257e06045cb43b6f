"""A matrix as a table with one line a pair of places."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from app.cli.batch.requests import NamedPlace
    from app.schemas.matrix import MatrixResponse

FIGURES: Final = (
    *("feasible", "energy_kwh", "battery_kwh", "duration_s", "distance_m"),
    *("soc_end", "soc_min", "deficit_kwh", "reason"),
)


def write_pairs(
    out: Path, answer: MatrixResponse, sources: Sequence[NamedPlace], targets: Sequence[NamedPlace]
) -> None:
    """Write source, target and all figures, sources in order and for each of them the targets; no value is null."""
    names = ("source", "target", *FIGURES)
    if out.suffix.lower() == ".csv":
        with out.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(names)
            for pair in _pairs(answer, sources, targets):
                writer.writerow([str(cell).lower() if isinstance(cell, bool) else cell for cell in pair])
        return
    import pyarrow as pa
    from pyarrow import parquet

    kinds = {"source": "string", "target": "string", "feasible": "bool", "reason": "string"}
    schema = pa.schema([pa.field(name, pa.type_for_alias(kinds.get(name, "double"))) for name in names])
    rows = [dict(zip(names, pair, strict=True)) for pair in _pairs(answer, sources, targets)]
    parquet.write_table(pa.Table.from_pylist(rows, schema=schema), out)


def _pairs(
    answer: MatrixResponse, sources: Sequence[NamedPlace], targets: Sequence[NamedPlace]
) -> Iterator[tuple[Any, ...]]:
    for i, source in enumerate(sources):
        for j, target in enumerate(targets):
            yield (source.id, target.id, *(getattr(answer, name)[i][j] for name in FIGURES))
