"""The table on docs/field.md, renewed from recorded drives: `python -m docs.field_table DIR VEHICLE.toml`."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.comparison.tables import markdown_table
from diagnosis.recordings.reading import read_recordings
from docs.field_splits import HELD_OUT, SPLITS, SUBSETS, VARIANTS, agreement, split_errors
from docs.proof_table import with_results
from energy.vehicle.files import load_vehicle
from energy.vehicle.vehicle import Vehicle
from proof.carriers import HIDDEN

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnosis.recordings.reading import Recording
    from docs.field_splits import SplitErrors

PAGE: Final = Path(__file__).resolve().parent / "field.md"
SEED: Final = 20261130
HEADER: Final = (
    "drives", "file", "refitted", "ridge", "seven sums", "joulepath", "routes", "carried", "P10..P90", "named clearly",
    "numbers",
)  # fmt: skip


def row(name: str, splits: Sequence[SplitErrors]) -> tuple[str, ...]:
    """One line by HEADER: means over splits, and how often each family was named."""
    means = [
        f"{100.0 * np.mean([getattr(split, field) for split in splits]):.1f} %"
        for field in ("file", "refitted", "ridge", "sums", "tool", "routes")
    ]
    named = Counter(family for split in splits for family in split.named)
    numbers = Counter(parameter for split in splits for parameter in split.parameters)
    carried = f"{sum(split.carried for split in splits)}/{len(splits)}"
    shares = [split.covered for split in splits if split.covered is not None]
    covered = f"{np.mean(shares):.0%}" if shares else "–"
    return (name, *means, carried, covered, *(_counted(counter) for counter in (named, numbers)))


def field_table(recordings: Sequence[Recording], vehicle: Vehicle) -> str:
    """The table and what stands below it, as Markdown."""
    rows = []
    for variant in VARIANTS:
        splits = [split_errors(recordings, vehicle, variant, SEED + k) for k in range(SPLITS)]
        rows.append(row(variant.name, splits))
    agreeing, total = agreement(recordings, vehicle, SEED)
    share = f"{agreeing} of {total}" + (f" ({agreeing / total:.0%})" if total else "")
    return (
        f"{markdown_table(HEADER, rows)}\n\n"
        f"Mean sizes of errors of {HELD_OUT} held-out drives, over {SPLITS} splits.\n\n"
        f"Of {SUBSETS} drawn sets of 8 to 20 drives, {share} clear findings are of a family that all drives name too."
    )


def _counted(counter: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counter.most_common()) or "–"


if __name__ == "__main__":
    found, _ = read_recordings([sys.argv[1]], HIDDEN)
    car = load_vehicle(Path(sys.argv[2]))
    assert isinstance(car, Vehicle), "the car is given by its physics"
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(with_results(page, field_table(found, car)), encoding="utf-8")
