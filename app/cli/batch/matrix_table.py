"""A matrix as a table with one line a pair of places."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.exports.files import csv_file, parquet_file
from app.exports.tables import PAIR_FIGURES, pair_rows

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from app.cli.batch.requests import NamedPlace
    from app.schemas.matrix import MatrixResponse


def write_pairs(
    out: Path, answer: MatrixResponse, sources: Sequence[NamedPlace], targets: Sequence[NamedPlace]
) -> None:
    """Write source, target and all figures, sources in order and for each of them the targets; no value is null."""
    rows = pair_rows(answer, [place.id for place in sources], [place.id for place in targets])
    columns = {"source": "string", "target": "string", **PAIR_FIGURES}
    out.write_bytes(csv_file(rows, columns) if out.suffix.lower() == ".csv" else parquet_file(rows, columns))
