"""What a diagnosis leaves behind: diagnosis.json, report.html, effects.json, and the map of residuals."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

from app.conversions.learned_effects import learned_effects
from app.diagnosing.driven_range import fastest_kmh, steepest
from app.errors.diagnosing import storable
from diagnosis.answer.results_json import as_json

if TYPE_CHECKING:
    from pathlib import Path

    from app.diagnosing.order import Diagnosed

RESULT: Final = "diagnosis.json"
REPORT: Final = "report.html"
EFFECTS: Final = "effects.json"
PLACES: Final = "residuals.geojson"


@dataclass(frozen=True, slots=True)
class Documents:
    """Texts of the files; places: GeoJSON of where the differences lie, None without a graph."""

    result: str
    report: str
    effects: str
    places: str | None = None

    def files(self) -> dict[str, str]:
        """The texts by the names of their files."""
        named = {RESULT: self.result, REPORT: self.report, EFFECTS: self.effects}
        return named if self.places is None else {**named, PLACES: self.places}


def documents_of(diagnosed: Diagnosed, *, diagnosis_id: str | None = None, places: str | None = None) -> Documents:
    """The documents of a diagnosis; diagnosis_id: under which it is stored, None for that of a command."""
    from diagnosis.report.page import report_html  # brings the plots along, which take a while to import

    diagnosis = diagnosed.diagnosis
    result = {
        **as_json(diagnosis),
        "refused": [{"file": refused.file, "error": refused.error} for refused in diagnosed.refused],
    }
    fitted = set(diagnosis.fitted_trips)
    driven = [recording for recording in diagnosed.recordings if recording.id in fitted]
    effects = learned_effects(
        diagnosis,
        diagnosis_id=diagnosis_id,
        date=datetime.now(UTC).date().isoformat(),
        speed_kmh=fastest_kmh(driven),
        grade=steepest(driven),
    )
    return Documents(
        result=storable(json.dumps(result, ensure_ascii=False, allow_nan=False, indent=1)),
        report=storable(report_html(diagnosis)),
        effects=effects.model_dump_json(exclude_none=True, indent=1),
        places=places,
    )


def write_documents(folder: Path, documents: Documents) -> list[Path]:
    """Write the files of a diagnosis and return their paths; each takes the place of an older one when all are whole.

    Raises OSError; then no file has changed unless putting them into place itself failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = {folder / name: folder / f".{name}.{os.getpid()}.part" for name in documents.files()}
    try:
        for path, text in zip(written.values(), documents.files().values(), strict=True):
            path.write_text(text + "\n", encoding="utf-8")
        for final, part in written.items():
            part.replace(final)
    finally:
        for part in written.values():
            with suppress(FileNotFoundError):
                part.unlink()
    return list(written)
