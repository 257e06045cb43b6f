"""A diagnosis of drives that are made for it, as the service answers it, for the OpenAPI document."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any, Final

from app.diagnosing.use_cases import Diagnoses
from app.http.examples.answers import DIAGNOSIS_REQUESTS
from app.http.examples.drives import write_winter
from app.schemas.diagnosis import DiagnosisRequest
from app.store.diagnoses import UNFINISHED

if TYPE_CHECKING:
    from app.service.service import Service

ID: Final = "20260301-0c9f2a7b1d4e"
CREATED: Final = "2026-03-01T09:30:00Z"
BROKEN: Final = "time_s,speed_kmh,power_w\n0,10,500\n1,ten,500\n2,11,500\n"
POLL_S: Final = 0.2


def diagnosis_answers(service: Service) -> dict[str, Any]:
    """What the service answers of a diagnosis, by the names of the examples, under a fixed id and date.

    service: with a folder of recordings that is empty.
    """
    folder = service.settings.recordings_dir
    assert folder is not None, "recordings are written to a folder"
    write_winter(folder / "winter", service)
    (folder / "winter" / "broken.csv").write_text(BROKEN, encoding="utf-8")
    diagnoses = Diagnoses(service)
    try:
        asked = DiagnosisRequest.model_validate(DIAGNOSIS_REQUESTS["on a graph"]["value"])
        shown = diagnoses.begin_referenced(asked, diagnoses.named_files(asked.recordings))
        while shown.state in UNFINISHED:
            time.sleep(POLL_S)
            shown = diagnoses.show(shown.id)
        trips = diagnoses.trips(shown.id)
        effects = diagnoses.effects(shown.id)
        dated = None if effects.learned_from is None else effects.learned_from.model_copy(update={"date": CREATED[:10]})
        answers = {
            "diagnosis": {**shown.model_dump(mode="json"), "created": CREATED},
            "diagnosis_residuals": json.loads(diagnoses.residuals(shown.id)),
            "diagnosis_trips": trips.model_dump(mode="json"),
            "diagnosis_trip": json.loads(diagnoses.timeline(shown.id, trips.trips[0].id)),
            "learned_effects": effects.model_copy(update={"learned_from": dated}).model_dump(
                mode="json", exclude_none=True
            ),
        }
    finally:
        diagnoses.close()
    renamed: dict[str, Any] = json.loads(json.dumps(answers).replace(shown.id, ID))
    return renamed
