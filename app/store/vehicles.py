"""Vehicles in the database, as the documents that were stored; what they mean is not known here."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

from sqlalchemy import CursorResult, delete, select, update

from app.store.errors import ConflictError, DatabaseUnavailableError
from app.store.tables import VehicleRow

if TYPE_CHECKING:
    from collections.abc import Iterable

    from app.store.database import Database

MAX_TRIES = 5
_READ: Final = select(VehicleRow.id, VehicleRow.kind, VehicleRow.name, VehicleRow.document)


@dataclass(frozen=True, slots=True)
class VehicleDocument:
    """A vehicle as it is stored: JSON text in the schema's human units."""

    id: str
    kind: str
    name: str
    document: str


class VehicleStore:
    """Reads and writes vehicles, in a transaction each; every method raises DatabaseUnavailableError."""

    def __init__(self, database: Database) -> None:
        self.database = database

    def find(self, vehicle_id: str) -> VehicleDocument | None:
        """One vehicle, or None."""
        with self.database.reading() as session:
            row = session.execute(_READ.where(VehicleRow.id == vehicle_id)).one_or_none()
            return None if row is None else _document(row)

    def all(self) -> list[VehicleDocument]:
        """All vehicles in the order of their ids."""
        with self.database.reading() as session:
            rows = [_document(row) for row in session.execute(_READ)]
        return sorted(rows, key=lambda row: row.id)  # databases differ in how they order hyphens

    def ids(self, limit: int) -> list[str]:
        """At most so many ids, in order."""
        with self.database.reading() as session:
            return sorted(session.scalars(select(VehicleRow.id).order_by(VehicleRow.id).limit(limit)))

    def put(self, vehicle: VehicleDocument) -> bool:
        """Store a vehicle, in place of one of the same id; True when there was none."""
        for _ in range(MAX_TRIES):
            try:
                return self._put(vehicle)
            except ConflictError:
                continue  # another process stored it between our update and our insert
        raise DatabaseUnavailableError(self.database.shown_url, f"vehicle {vehicle.id!r} keeps coming and going")

    def remove(self, vehicle_id: str) -> bool:
        """Remove a vehicle; False when there was none."""
        with self.database.writing() as session:
            removed = session.execute(delete(VehicleRow).where(VehicleRow.id == vehicle_id))
            assert isinstance(removed, CursorResult)
            return removed.rowcount > 0

    def _put(self, vehicle: VehicleDocument) -> bool:
        now = datetime.now(UTC)
        values = {"kind": vehicle.kind, "name": vehicle.name, "document": vehicle.document, "updated": now}
        with self.database.writing() as session:
            changed = session.execute(update(VehicleRow).where(VehicleRow.id == vehicle.id).values(**values))
            assert isinstance(changed, CursorResult)
            if changed.rowcount > 0:
                return False
            session.add(VehicleRow(id=vehicle.id, created=now, **values))
            return True


def _document(row: Iterable[object]) -> VehicleDocument:
    return VehicleDocument(*(str(value) for value in row))  # SQLite holds anything in any column
