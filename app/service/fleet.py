"""The vehicles that requests can name: those that come with joulepath, and those stored in the database."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Final

from pydantic import TypeAdapter, ValidationError

from app.conversions.service_vehicle import table_from_service
from app.conversions.vehicle import detail_of_sent, sent_with_tables, vehicle_detail, vehicle_from_sent, vehicle_summary
from app.errors.validation import validation_detail
from app.schemas.vehicles.answer import VehicleList
from app.schemas.vehicles.services import ServiceVehicle
from app.schemas.vehicles.vehicle import MAX_ID_CHARS, VEHICLE_ID_PATTERN, SentVehicle, VehicleBody
from app.store.errors import DatabaseUnavailableError, VehicleDamagedError, VehicleIsBundledError
from app.store.vehicles import VehicleDocument
from energy.errors import VehicleError, VehicleNotFoundError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from app.schemas.vehicles.answer import AnyVehicleDetail, VehicleSummary
    from app.schemas.vehicles.services import NewVehicle
    from app.store.vehicles import VehicleStore
    from energy.vehicle.files import AnyVehicle

NAMED_IN_ERRORS: Final = 50  # ids of stored vehicles that the error of an unknown one names

_SENT: Final[TypeAdapter[SentVehicle]] = TypeAdapter(VehicleBody)


class Fleet:
    """Bundled and stored vehicles by id; stored ones are read from the database at every use."""

    def __init__(self, bundled: Mapping[str, AnyVehicle], store: VehicleStore, default_id: str) -> None:
        self.bundled = bundled
        self.store = store
        self.default_id = default_id

    def vehicle(self, vehicle_id: str) -> AnyVehicle:
        """One vehicle; raises VehicleNotFoundError, VehicleDamagedError or DatabaseUnavailableError."""
        if vehicle_id in self.bundled:
            return self.bundled[vehicle_id]
        _, vehicle = self._stored(vehicle_id)
        return vehicle

    def detail(self, vehicle_id: str) -> AnyVehicleDetail:
        """One vehicle with all its numbers; raises as `vehicle` does."""
        if vehicle_id in self.bundled:
            return vehicle_detail(self.bundled[vehicle_id])
        return detail_of_sent(*self._stored(vehicle_id))

    def list(self, *, needs_store: bool = True) -> VehicleList:
        """All vehicles in the order of their ids; stored ones that can't be read are named in warnings.

        needs_store: False where a store that is not available is named there as well; otherwise
        DatabaseUnavailableError.
        """
        lines: dict[str, VehicleSummary] = {
            vehicle.id: vehicle_summary(vehicle, self.default_id, bundled=True) for vehicle in self.bundled.values()
        }
        warnings = []
        try:
            stored = self.store.all()
        except DatabaseUnavailableError as error:
            if needs_store:
                raise
            stored = []
            warnings.append(f"stored vehicles are missing: {error}")
        for row in stored:
            if row.id in lines:
                warnings.append(f"stored vehicle {row.id!r} is hidden by the bundled one of this id")
                continue
            try:
                _, vehicle = self._read(row)
            except VehicleDamagedError as error:
                warnings.append(str(error))
            else:
                lines[row.id] = vehicle_summary(vehicle, self.default_id, bundled=False)
        return VehicleList(
            vehicles=[line for _, line in sorted(lines.items())], default=self.default_id, warnings=warnings
        )

    def put(self, vehicle_id: str, new: NewVehicle) -> tuple[AnyVehicleDetail, bool]:
        """Store a vehicle, in place of one of the same id; its numbers, and whether there was none.

        What it leaves out is stored as it is now: the default vehicle's acceleration tables, and the id as its name.
        One in a service's parameters is stored as the consumption table that it stands for.

        Raises VehicleIsBundledError, VehicleError or DatabaseUnavailableError.
        """
        self._refuse_bundled(vehicle_id)
        if not _can_be_stored(vehicle_id):
            allowed = f"lower-case letters and digits, joined by single hyphens, at most {MAX_ID_CHARS}"
            raise VehicleError("id", repr(vehicle_id), allowed)
        sent = table_from_service(new, vehicle_id) if isinstance(new, ServiceVehicle) else new
        named = sent if "name" in sent.model_fields_set else sent.model_copy(update={"name": vehicle_id})
        vehicle = vehicle_from_sent(named, self._tables_for(named), vehicle_id)
        whole = sent_with_tables(named, vehicle)
        document = json.dumps(whole.model_dump(mode="json", exclude_none=True), allow_nan=False)
        created = self.store.put(VehicleDocument(vehicle_id, whole.kind, whole.name, document))
        return detail_of_sent(whole, vehicle), created

    def remove(self, vehicle_id: str) -> None:
        """Remove a stored vehicle; raises VehicleIsBundledError, VehicleNotFoundError or DatabaseUnavailableError."""
        self._refuse_bundled(vehicle_id)
        if not _can_be_stored(vehicle_id) or not self.store.remove(vehicle_id):
            raise self._unknown(vehicle_id)

    def from_sent(self, sent: SentVehicle) -> tuple[AnyVehicle, SentVehicle]:
        """An inline vehicle, and the same as understood; raises VehicleError."""
        vehicle = vehicle_from_sent(sent, self._tables_for(sent))
        return vehicle, sent_with_tables(sent, vehicle)

    def _tables_for(self, sent: SentVehicle) -> AnyVehicle | None:
        """The vehicle whose acceleration tables apply, where the one sent lacks them."""
        needed = sent.kind == "physical" and sent.acceleration is None
        return self.vehicle(self.default_id) if needed else None

    def _stored(self, vehicle_id: str) -> tuple[SentVehicle, AnyVehicle]:
        row = self.store.find(vehicle_id) if _can_be_stored(vehicle_id) else None
        if row is None:
            raise self._unknown(vehicle_id)
        return self._read(row)

    def _read(self, row: VehicleDocument) -> tuple[SentVehicle, AnyVehicle]:
        try:
            sent = _SENT.validate_json(row.document)
            return sent, vehicle_from_sent(sent, None, row.id)
        except ValidationError as error:
            raise VehicleDamagedError(row.id, validation_detail(error)) from error
        except VehicleError as error:
            raise VehicleDamagedError(row.id, str(error)) from error

    def _refuse_bundled(self, vehicle_id: str) -> None:
        if vehicle_id in self.bundled:
            raise VehicleIsBundledError(vehicle_id)

    def _unknown(self, vehicle_id: str) -> VehicleNotFoundError:
        known = sorted({*self.bundled, *self.store.ids(NAMED_IN_ERRORS)})
        return VehicleNotFoundError(vehicle_id, tuple(known))


def _can_be_stored(vehicle_id: str) -> bool:
    return len(vehicle_id) <= MAX_ID_CHARS and re.fullmatch(VEHICLE_ID_PATTERN, vehicle_id) is not None
