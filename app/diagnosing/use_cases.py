"""What can be asked of diagnoses in the service: begin, list, show, cancel, remove."""

from __future__ import annotations

import json
import re
import secrets
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from anyio import CapacityLimiter
from pydantic import TypeAdapter, ValidationError

from app.diagnosing.arrivals import Arrival, Arrivals
from app.diagnosing.jobs import DiagnosisJobs, Job
from app.diagnosing.limits import JobLimits
from app.diagnosing.order import DiagnosisOrder
from app.diagnosing.sources import files_below, uploaded_name
from app.diagnosing.worker import Task
from app.errors.diagnosing import (
    DiagnosisNotDoneError,
    SourceError,
    TooManyDiagnosesError,
    UploadsFullError,
    storable,
)
from app.errors.raised import BodyTooLargeError
from app.errors.validation import validation_detail
from app.schemas.diagnosis import (
    DiagnosisAnswer,
    DiagnosisLinks,
    DiagnosisList,
    DiagnosisRequest,
    DiagnosisSummary,
    RefusedRecording,
    ResidualCollection,
    TripList,
    TripOutline,
)
from app.schemas.problem import Problem
from app.service.learned import DIAGNOSIS_ID_PATTERN
from app.store.diagnoses import UNFINISHED, DiagnosisState, DiagnosisStore, NewDiagnosis
from app.store.errors import DiagnosisDamagedError, DiagnosisNotFoundError, TripNotFoundError
from diagnosis.answer.results import Verdict
from diagnosis.holdout import named_trips
from diagnosis.recordings.files import recording_id
from energy.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.schemas.diagnosis import DiagnosisOptions
    from app.schemas.learned_effects import LearnedEffects
    from app.service.service import Service
    from app.store.diagnoses import StoredDiagnosis

_REFUSED = TypeAdapter(list[RefusedRecording])
FOLDER_SEARCHES: Final = 2  # for what patterns name, at the same time
_WARNINGS = TypeAdapter(list[str])
_NO_RESIDUALS = ResidualCollection(kind="tracks", graph=None, features=[]).model_dump_json()


@dataclass(frozen=True, slots=True)
class UploadedFile:
    """A file that was sent: its name as the sender gave it, and where it lies."""

    name: str
    path: Path


class Diagnoses:
    """The diagnoses of a service; methods may be called from any thread."""

    def __init__(self, service: Service) -> None:
        self.service = service
        self.settings = service.settings
        self.store = DiagnosisStore(service.database)
        self.folder_searches = CapacityLimiter(FOLDER_SEARCHES)
        self.jobs = DiagnosisJobs(self.store, service.run_name)
        self.arrivals = Arrivals(self.settings.diagnosis_upload_limit, self.jobs.folder)

    def close(self) -> None:
        """Stop what runs."""
        self.jobs.close()

    def check_room(self) -> None:
        """Raises TooManyDiagnosesError where the queue is full now, and DatabaseUnavailableError.

        A place in it is taken when the diagnosis begins.
        """
        limit = self.settings.diagnosis_queue_limit
        if sum(row.state in UNFINISHED for row in self._rows()) >= limit:
            raise TooManyDiagnosesError(limit)

    def begin_arrival(self, client: str | None) -> Arrival:
        """Let an upload of a client arrive; raises as check_room does, TooManyUploadsError and UploadsFullError."""
        self.check_room()
        return self.arrivals.begin(client)

    def begin_uploaded(self, options: DiagnosisOptions, files: Sequence[UploadedFile]) -> DiagnosisAnswer:
        """Queue a diagnosis of uploaded recordings, which are moved to where it finds them.

        Raises SourceError naming a file that can't be taken, VehicleNotFoundError, VehicleError, GraphNotFoundError,
        HoldoutError, TooManyDiagnosesError, UploadsFullError or DatabaseUnavailableError.
        """
        names = [uploaded_name(file.name, f"recordings[{k}]") for k, file in enumerate(files)]
        for k, name in enumerate(names):
            if name in names[:k]:
                raise SourceError(f"recordings[{k}]", name, "a name that no other file has")
        self._check_count(len(names))
        sent = DiagnosisRequest(recordings=names, **dict(options))
        try:
            folder = self.jobs.folder()
        except OSError as error:
            raise UploadsFullError(error) from error
        try:
            _move(folder, names, files)
            return self._begin(sent, folder, [Path(name) for name in names], own=True)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise

    def named_files(self, patterns: Sequence[str]) -> tuple[Path, ...]:
        """Recordings below the configured folder, relative to it; raises SourceError."""
        folder = self.settings.recordings_dir
        if folder is None:
            raise SourceError("recordings", patterns, "uploaded files; no folder of recordings is configured")
        return files_below(folder, patterns)

    def begin_referenced(self, sent: DiagnosisRequest, files: Sequence[Path]) -> DiagnosisAnswer:
        """Queue a diagnosis of named_files; raises as `begin_uploaded` does."""
        folder = self.settings.recordings_dir
        assert folder is not None, "files are below it"
        self._check_count(len(files))
        if sum((folder / file).stat().st_size for file in files) > self.settings.diagnosis_limit_bytes:
            raise BodyTooLargeError(self.settings.diagnosis_limit_bytes)
        return self._begin(sent, folder.resolve(), files, own=False)

    def list_all(self) -> DiagnosisList:
        """All diagnoses."""
        rows = self._rows()
        return DiagnosisList(diagnoses=[DiagnosisSummary(**_summary(row)) for row in rows])

    def show(self, diagnosis_id: str) -> DiagnosisAnswer:
        """One diagnosis; raises DiagnosisNotFoundError, DiagnosisDamagedError or DatabaseUnavailableError."""
        return _answer(self._row(diagnosis_id))

    def report(self, diagnosis_id: str) -> str:
        """The HTML page of a diagnosis; raises as `show` does, and DiagnosisNotDoneError."""
        self._done(diagnosis_id)
        report = self.store.report(diagnosis_id)
        if report is None:
            raise DiagnosisNotFoundError(diagnosis_id)  # removed in this moment
        return report

    def effects(self, diagnosis_id: str) -> LearnedEffects:
        """What a diagnosis has learned; raises as `report` does."""
        self._done(diagnosis_id)
        return self.service.learned.find(diagnosis_id)

    def residuals(self, diagnosis_id: str) -> str:
        """GeoJSON text of where a diagnosis differs from measurement, without features where that was not kept.

        Raises as `report` does.
        """
        self._done(diagnosis_id)
        return self.store.residuals(diagnosis_id) or _NO_RESIDUALS

    def trips(self, diagnosis_id: str) -> TripList:
        """The trips of a diagnosis, none where they were not kept; raises as `report` does."""
        self._done(diagnosis_id)
        try:
            outlines = [TripOutline.model_validate_json(outline) for outline in self.store.trip_outlines(diagnosis_id)]
        except ValidationError as error:
            raise DiagnosisDamagedError(diagnosis_id, validation_detail(error)) from error
        return TripList(trips=outlines)

    def timeline(self, diagnosis_id: str, trip: str) -> str:
        """JSON text of one trip along time; raises as `report` does, and TripNotFoundError."""
        self._done(diagnosis_id)
        timeline = self.store.timeline(diagnosis_id, storable(trip))
        if timeline is None:
            raise TripNotFoundError(diagnosis_id, trip)
        return timeline

    def cancel_or_remove(self, diagnosis_id: str) -> DiagnosisAnswer | None:
        """Cancel a diagnosis that is not finished, and show it; remove one that is, with its effects."""
        row = self._row(diagnosis_id)
        if row.state in UNFINISHED and self.store.cancel(diagnosis_id):
            self.jobs.stop(diagnosis_id)
            return self.show(diagnosis_id)
        if not self.store.remove(diagnosis_id):
            raise DiagnosisNotFoundError(diagnosis_id)
        return None

    def _begin(self, sent: DiagnosisRequest, folder: Path, files: Sequence[Path], *, own: bool) -> DiagnosisAnswer:
        named_trips([recording_id(file) for file in files], sent.holdout)
        vehicle, choice = self.service.chosen_vehicle(sent.vehicle)
        if not isinstance(vehicle, Vehicle):
            raise SourceError("vehicle", vehicle.id, "a vehicle given by its physics, not by a consumption table")
        graph_dir = None if sent.graph is None else self.service.atlas.folder(sent.graph).resolve()
        understood = sent.model_copy(update={"vehicle": choice}).model_dump_json(exclude_none=True)
        diagnosis_id = f"{datetime.now(UTC):%Y%m%d}-{secrets.token_hex(6)}"
        new = NewDiagnosis(diagnosis_id, self.jobs.worker, vehicle.id, understood, len(files))
        order = DiagnosisOrder(
            files=tuple(files),
            vehicle=vehicle,
            hidden=tuple(sent.hide),
            held_out=tuple(sent.holdout),
            held_out_frac=sent.holdout_fraction,
            seed=sent.seed,
            unpacked_bytes=self.settings.diagnosis_unpacked_bytes,
        )
        limits = JobLimits(
            memory_bytes=self.settings.diagnosis_memory_bytes,
            time_s=self.settings.diagnosis_time_limit_s,
            unpacked_bytes=self.settings.diagnosis_unpacked_bytes,
        )
        limit = self.settings.diagnosis_queue_limit
        self._rows()  # those that are lost don't count
        if not self.store.submit(new, limit):
            raise TooManyDiagnosesError(limit)
        self.jobs.add(Job(Task(diagnosis_id, order, folder, limits, graph_dir), own))
        return self.show(diagnosis_id)

    def _rows(self) -> list[StoredDiagnosis]:
        """All diagnoses; those that nobody carries out any more are failed."""
        rows = self.store.all()
        lost = [row for row in rows if self.jobs.tell_lost(row)]
        return self.store.all() if lost else rows

    def _check_count(self, count: int) -> None:
        limit = self.settings.diagnosis_limit_files
        if not 1 <= count <= limit:
            raise SourceError("recordings", f"{count} files", f"1..{limit} files")

    def _row(self, diagnosis_id: str) -> StoredDiagnosis:
        if re.fullmatch(DIAGNOSIS_ID_PATTERN, diagnosis_id) is None:
            raise DiagnosisNotFoundError(diagnosis_id)
        row = self.store.find(diagnosis_id)
        if row is not None and self.jobs.tell_lost(row):
            row = self.store.find(diagnosis_id)
        if row is None:
            raise DiagnosisNotFoundError(diagnosis_id)
        return row

    def _done(self, diagnosis_id: str) -> None:
        row = self._row(diagnosis_id)
        if row.state is not DiagnosisState.DONE:
            raise DiagnosisNotDoneError(diagnosis_id, row.state.value)


def _move(folder: Path, names: Sequence[str], files: Sequence[UploadedFile]) -> None:
    """Move uploaded files into a folder; raises UploadsFullError."""
    try:
        for name, file in zip(names, files, strict=True):
            file.path.replace(folder / name)
    except OSError as error:
        raise UploadsFullError(error) from error


def _summary(row: StoredDiagnosis) -> dict[str, Any]:
    path = f"/diagnoses/{row.id}"
    done = row.state is DiagnosisState.DONE
    return {
        "id": row.id,
        "state": row.state,
        "stage": row.stage if row.state is DiagnosisState.RUNNING else "",
        "progress": row.progress_frac,
        "vehicle": row.vehicle,
        "created": row.created,
        "recordings": row.recordings,
        "verdict": row.verdict if row.verdict in set(Verdict) else None,  # that of another version is not shown
        "text": row.text,
        "links": DiagnosisLinks(
            self=path,
            report=f"{path}/report" if done else None,
            effects=f"{path}/effects" if done else None,
            residuals=f"{path}/residuals" if done else None,
            trips=f"{path}/trips" if done else None,
        ),
    }


def _answer(row: StoredDiagnosis) -> DiagnosisAnswer:
    try:
        return DiagnosisAnswer(
            **_summary(row),
            request=DiagnosisRequest.model_validate_json(row.request),
            refused=[] if row.refused is None else _REFUSED.validate_json(row.refused),
            warnings=[] if row.warnings is None else _WARNINGS.validate_json(row.warnings),
            problem=None if row.problem is None else Problem.model_validate_json(row.problem),
            result=None if row.result is None else json.loads(row.result),
        )
    except ValidationError as error:
        raise DiagnosisDamagedError(row.id, validation_detail(error)) from error
    except ValueError as error:
        raise DiagnosisDamagedError(row.id, str(error)) from error
