"""The service as a command has it, opened again wherever Dask runs a call."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from app.schemas.place import MAX_PLACES
from app.service.service import Service
from app.settings import Settings

if TYPE_CHECKING:
    from app.service.matrices import MatrixWork

_LOCK = Lock()
_SERVICES: dict[ServiceOrder, Service] = {}
_MATRICES: dict[tuple[ServiceOrder, str], MatrixWork] = {}


@dataclass(frozen=True, slots=True)
class ServiceOrder:
    """Which graphs and vehicles a service answers on; folders are absolute, and the same on every worker.

    What is not said here is a worker's own setting, such as its database of stored vehicles.
    """

    folders: tuple[tuple[str, str], ...]
    vehicle_dir: str
    default_graph: str
    default_vehicle: str
    snap_limit_m: float
    label_limit: int | None


def order_of(service: Service) -> ServiceOrder:
    """What another process needs to answer as a service does."""
    settings, atlas = service.settings, service.atlas
    return ServiceOrder(
        folders=tuple((name, str(atlas.folder(name).resolve())) for name in atlas.names),
        vehicle_dir=str(settings.vehicle_dir.resolve()),
        default_graph=settings.default_graph,
        default_vehicle=settings.default_vehicle,
        snap_limit_m=settings.snap_limit_m,
        label_limit=settings.label_limit,
    )


def opened(order: ServiceOrder) -> Service:
    """The service of an order, one a process; graphs are loaded when they are first asked for."""
    with _LOCK:
        if order not in _SERVICES:
            _SERVICES.clear()
            changes = {
                "vehicle_dir": Path(order.vehicle_dir),
                "default_graph": order.default_graph,
                "default_vehicle": order.default_vehicle,
                "snap_limit_m": order.snap_limit_m,
                "label_limit": order.label_limit,
                "matrix_limit_places": MAX_PLACES,
            }
            folders = {name: Path(folder) for name, folder in order.folders}
            _SERVICES[order] = Service(Settings().model_copy(update=changes), folders)
        return _SERVICES[order]


def opened_matrix(order: ServiceOrder, request: str) -> MatrixWork:
    """The work of a matrix request, as JSON, on the service of an order; one a process is kept."""
    from app.schemas.matrix import MatrixRequest

    service = opened(order)
    with _LOCK:
        if (order, request) not in _MATRICES:
            _MATRICES.clear()
            _MATRICES[order, request] = service.matrix_work(MatrixRequest.model_validate_json(request))
        return _MATRICES[order, request]
