"""Diagnoses in the database: what was asked, how far each is, and the documents that they leave."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from sqlalchemy import CursorResult, delete, func, select, update

from app.store.tables import MAX_STAGE_CHARS, DiagnosisRow, DiagnosisTripRow, LearnedEffectsRow

if TYPE_CHECKING:
    from sqlalchemy import Update
    from sqlalchemy.orm import Session

    from app.store.database import Database


class DiagnosisState(StrEnum):
    """How far a diagnosis is; the last three stay."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


class Turn(StrEnum):
    """Whether a diagnosis may begin: it has, others come first, or it is not queued any more."""

    NOW = "now"
    LATER = "later"
    NEVER = "never"


UNFINISHED: Final = (DiagnosisState.QUEUED, DiagnosisState.RUNNING)
_UNFINISHED_VALUES: Final = tuple(state.value for state in UNFINISHED)
# a report takes megabytes; who asks how far a diagnosis is must not have it read
_LARGE: Final = ("report", "residuals")


@dataclass(frozen=True, slots=True)
class NewDiagnosis:
    """A diagnosis as it is put into the queue; request: JSON text.

    worker: that will carry it out, as HOST:PROCESS:RUN-NUMBER, where RUN names the run of the service that it is of.
    recordings: number of files.
    """

    id: str
    worker: str
    vehicle: str
    request: str
    recordings: int | None = None


@dataclass(frozen=True, slots=True)
class StoredDiagnosis:
    """A diagnosis as it is stored; request, refused, problem, result and warnings are JSON text.

    result is left out of lists. recordings, verdict, text and warnings are None where they are not known.
    """

    id: str
    state: DiagnosisState
    stage: str
    progress_frac: float
    worker: str
    vehicle: str
    request: str
    refused: str | None
    problem: str | None
    result: str | None
    created: datetime
    updated: datetime
    recordings: int | None
    verdict: str | None
    text: str | None
    warnings: str | None


@dataclass(frozen=True, slots=True)
class TripDocument:
    """One trip along time, by its id: an outline for lists, and the whole timeline, both JSON text."""

    trip: str
    outline: str
    timeline: str


@dataclass(frozen=True, slots=True)
class DiagnosisDocuments:
    """What a finished diagnosis leaves: JSON texts, but the report, which is HTML, and the plain verdict and text.

    residuals: GeoJSON.
    """

    result: str
    report: str
    effects: str
    refused: str
    verdict: str | None = None
    text: str | None = None
    warnings: str = "[]"
    residuals: str | None = None
    trips: tuple[TripDocument, ...] = ()


class DiagnosisStore:
    """Reads and writes diagnoses, in a transaction each; every method raises DatabaseUnavailableError."""

    def __init__(self, database: Database) -> None:
        self.database = database

    def submit(self, new: NewDiagnosis, most_unfinished: int) -> bool:
        """Put a diagnosis into the queue; False where so many are unfinished already."""
        now = datetime.now(UTC)
        count = select(func.count()).select_from(DiagnosisRow).where(DiagnosisRow.state.in_(_UNFINISHED_VALUES))
        with self.database.writing() as session:
            if session.execute(count).scalar_one() >= most_unfinished:
                return False
            session.add(
                DiagnosisRow(
                    id=new.id,
                    state=DiagnosisState.QUEUED.value,
                    stage="",
                    progress_frac=0.0,
                    worker=new.worker,
                    vehicle=new.vehicle,
                    request=new.request,
                    recordings=new.recordings,
                    created=now,
                    updated=now,
                )
            )
            return True

    def find(self, diagnosis_id: str) -> StoredDiagnosis | None:
        """One diagnosis with its result, or None."""
        columns = [column for column in DiagnosisRow.__table__.columns if column.name not in _LARGE]
        with self.database.reading() as session:
            row = session.execute(select(*columns).where(DiagnosisRow.id == diagnosis_id)).one_or_none()
        return None if row is None else _stored(row, row.result)

    def all(self) -> list[StoredDiagnosis]:
        """All diagnoses without their results, the latest first."""
        columns = [column for column in DiagnosisRow.__table__.columns if column.name not in ("result", *_LARGE)]
        with self.database.reading() as session:
            rows = session.execute(select(*columns)).all()
        found = [_stored(row, None) for row in rows]
        return sorted(found, key=lambda diagnosis: (diagnosis.created, diagnosis.id), reverse=True)

    def report(self, diagnosis_id: str) -> str | None:
        """The report of a finished diagnosis."""
        with self.database.reading() as session:
            return session.scalar(select(DiagnosisRow.report).where(DiagnosisRow.id == diagnosis_id))

    def residuals(self, diagnosis_id: str) -> str | None:
        """GeoJSON text of where a finished diagnosis differs from what was measured; None where that was not kept."""
        with self.database.reading() as session:
            return session.scalar(select(DiagnosisRow.residuals).where(DiagnosisRow.id == diagnosis_id))

    def trip_outlines(self, diagnosis_id: str) -> list[str]:
        """Outlines of a finished diagnosis' trips, JSON text each, in its order; none where they were not kept."""
        mine = select(DiagnosisTripRow.outline).where(DiagnosisTripRow.diagnosis == diagnosis_id)
        with self.database.reading() as session:
            return list(session.scalars(mine.order_by(DiagnosisTripRow.position)))

    def timeline(self, diagnosis_id: str, trip: str) -> str | None:
        """The timeline of one trip, JSON text, or None."""
        mine = select(DiagnosisTripRow.timeline).where(
            DiagnosisTripRow.diagnosis == diagnosis_id, DiagnosisTripRow.trip == trip
        )
        with self.database.reading() as session:
            return session.scalars(mine.order_by(DiagnosisTripRow.position).limit(1)).first()

    def is_running(self, diagnosis_id: str) -> bool:
        """Whether a diagnosis is there and running."""
        with self.database.reading() as session:
            state = session.scalar(select(DiagnosisRow.state).where(DiagnosisRow.id == diagnosis_id))
        return state == DiagnosisState.RUNNING.value

    def begin(self, diagnosis_id: str, run_name: str) -> Turn:
        """From queued to running, when none of the same run of the service runs, and none was queued before it."""
        unfinished = (
            select(DiagnosisRow.id, DiagnosisRow.state)
            .where(DiagnosisRow.worker.like(f"%:{run_name}-%"), DiagnosisRow.state.in_(_UNFINISHED_VALUES))
            .order_by(DiagnosisRow.created, DiagnosisRow.id)
            .with_for_update()  # PostgreSQL lets others write meanwhile, SQLite does not
        )
        with self.database.writing() as session:
            rows = session.execute(unfinished).all()
            queued = [row.id for row in rows if row.state == DiagnosisState.QUEUED.value]
            if diagnosis_id not in queued:
                return Turn.NEVER
            if len(queued) < len(rows) or queued[0] != diagnosis_id:
                return Turn.LATER
            begun = _of(diagnosis_id, (DiagnosisState.QUEUED,)).values(state=DiagnosisState.RUNNING.value)
            return Turn.NOW if _rows_changed(session, begun) else Turn.NEVER

    def advance(self, diagnosis_id: str, stage: str, progress_frac: float) -> None:
        """Note how far a running diagnosis is; nothing where it does not run any more."""
        statement = _of(diagnosis_id, (DiagnosisState.RUNNING,))
        self._changed(statement.values(stage=stage[:MAX_STAGE_CHARS], progress_frac=progress_frac))

    def finish(self, diagnosis_id: str, documents: DiagnosisDocuments) -> bool:
        """From running to done, with the effects that it has learned; False where it does not run any more."""
        named = ("result", "report", "refused", "verdict", "text", "warnings", "residuals")
        values = {name: getattr(documents, name) for name in named}
        done = _of(diagnosis_id, (DiagnosisState.RUNNING,)).values(
            state=DiagnosisState.DONE.value, stage="", progress_frac=1.0, **values
        )
        with self.database.writing() as session:
            if not _rows_changed(session, done):
                return False
            vehicle = session.execute(select(DiagnosisRow.vehicle).where(DiagnosisRow.id == diagnosis_id)).scalar_one()
            now = datetime.now(UTC)
            session.add(LearnedEffectsRow(id=diagnosis_id, vehicle=vehicle, document=documents.effects, created=now))
            session.add_all(
                DiagnosisTripRow(
                    diagnosis=diagnosis_id, position=k, trip=trip.trip, outline=trip.outline, timeline=trip.timeline
                )
                for k, trip in enumerate(documents.trips)
            )
            return True

    def fail(self, diagnosis_id: str, problem: str, refused: str | None = None) -> bool:
        """From unfinished to failed, with the problem and the files that could not be used."""
        values = {"state": DiagnosisState.FAILED.value, "problem": problem, "refused": refused}
        return self._changed(_of(diagnosis_id, UNFINISHED).values(**values))

    def cancel(self, diagnosis_id: str) -> bool:
        """From unfinished to cancelled; False where it is finished, or not there."""
        return self._changed(_of(diagnosis_id, UNFINISHED).values(state=DiagnosisState.CANCELLED.value))

    def remove(self, diagnosis_id: str) -> bool:
        """Remove a finished diagnosis with its trips and the effects that it has learned; False where there is none."""
        finished = DiagnosisRow.state.not_in(_UNFINISHED_VALUES)
        with self.database.writing() as session:
            removed = session.execute(delete(DiagnosisRow).where(DiagnosisRow.id == diagnosis_id, finished))
            assert isinstance(removed, CursorResult)
            if removed.rowcount == 0:
                return False
            session.execute(delete(LearnedEffectsRow).where(LearnedEffectsRow.id == diagnosis_id))
            session.execute(delete(DiagnosisTripRow).where(DiagnosisTripRow.diagnosis == diagnosis_id))
            return True

    def show_alive(self, worker: str) -> None:
        """Note that a worker still looks after its unfinished diagnoses."""
        mine = update(DiagnosisRow).where(DiagnosisRow.worker == worker, DiagnosisRow.state.in_(_UNFINISHED_VALUES))
        self._changed(mine.values(updated=datetime.now(UTC)))

    def _changed(self, statement: Update) -> bool:
        with self.database.writing() as session:
            return _rows_changed(session, statement)


class LearnedEffectsStore:
    """Reads effects that diagnoses have learned; every method raises DatabaseUnavailableError."""

    def __init__(self, database: Database) -> None:
        self.database = database

    def find(self, effects_id: str) -> str | None:
        """The document that requests take, as JSON text, or None."""
        with self.database.reading() as session:
            return session.scalar(select(LearnedEffectsRow.document).where(LearnedEffectsRow.id == effects_id))

    def ids(self, limit: int) -> list[str]:
        """At most so many ids, the latest first."""
        newest = select(LearnedEffectsRow.id).order_by(LearnedEffectsRow.created.desc()).limit(limit)
        with self.database.reading() as session:
            return list(session.scalars(newest))


def _of(diagnosis_id: str, states: tuple[DiagnosisState, ...]) -> Update:
    """A change of a diagnosis that is in one of some states."""
    allowed = tuple(state.value for state in states)
    statement = update(DiagnosisRow).where(DiagnosisRow.id == diagnosis_id, DiagnosisRow.state.in_(allowed))
    return statement.values(updated=datetime.now(UTC))


def _rows_changed(session: Session, statement: Update) -> bool:
    changed = session.execute(statement.execution_options(synchronize_session=False))
    assert isinstance(changed, CursorResult)
    return changed.rowcount > 0


def _stored(row: object, result: str | None) -> StoredDiagnosis:
    values = {name: getattr(row, name) for name in StoredDiagnosis.__slots__ if name != "result"}
    values["state"] = DiagnosisState(values["state"])
    for name in ("created", "updated"):
        if values[name].tzinfo is None:  # SQLite keeps no time zone; all times are UTC
            values[name] = values[name].replace(tzinfo=UTC)
    return StoredDiagnosis(result=result, **values)
