"""openrouteservice's matrix: durations, distances, and ours of energy and charge."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from app.http.faces.answering import whole_from
from app.http.faces.electric import matrix_request
from app.http.faces.figures import rounded
from app.http.faces.lines import DECIMALS
from app.http.faces.ors.asked import METRES, places_from
from app.http.faces.ors.errors import OrsError, OrsKind, OrsService, metadata

if TYPE_CHECKING:
    from app.http.faces.electric import Electric
    from app.http.faces.ors.asked import MatrixBody
    from app.schemas.matrix import MatrixRequest, MatrixResponse
    from app.schemas.place import Snapped

VALUE: Final = OrsService.MATRIX + OrsKind.VALUE


def asked_matrix(body: MatrixBody, electric: Electric) -> MatrixRequest:
    """The matrix request of a body."""
    places = places_from(body.locations, OrsService.MATRIX, "locations")
    sources, targets = (
        [places[k] for k in indices(sent, name, len(places))]
        for name, sent in (("sources", body.sources), ("destinations", body.destinations))
    )
    return matrix_request(sources, targets, electric)


def indices(sent: list[int | str], name: str, count: int) -> list[int]:
    """Positions of locations; `all` for each of them."""
    if sent in (["all"], ["ALL"]):
        return list(range(count))
    chosen = []
    for value in sent:
        index = whole_from(value.strip()) if isinstance(value, str) else value
        if index is None or not 0 <= index < count:
            raise OrsError(VALUE, f"Parameter '{name}' has incorrect value: all, or positions 0..{count - 1}.")
        chosen.append(index)
    return chosen


def matrix_json(body: MatrixBody, found: MatrixResponse, profile: str) -> dict[str, Any]:
    """A matrix as openrouteservice's JSON; null where a pair can't be driven."""
    metres = METRES[body.units]
    written: dict[str, Any] = {}
    if "duration" in body.metrics:
        written["durations"] = _each(found.duration_s, 1.0, 2)
    if "distance" in body.metrics:
        written["distances"] = _each(found.distance_m, metres, 2 if metres == 1.0 else 4)
    if "energy" in body.metrics:
        written["energies"] = [[rounded(value) for value in row] for row in found.energy_kwh]
    if "soc" in body.metrics:
        written["socs"] = [[rounded(value) for value in row] for row in found.soc_end]
    written["destinations"] = [_location(place, named=body.resolve_locations) for place in found.targets]
    written["sources"] = [_location(place, named=body.resolve_locations) for place in found.sources]
    query = body.query()
    return written | {"metadata": metadata(body.id, "matrix", query, profile, found.terrain.attribution)}


def _each(rows: list[list[float | None]], unit: float, digits: int) -> list[list[float | None]]:
    return [[None if value is None else round(value / unit, digits) for value in row] for row in rows]


def _location(place: Snapped, *, named: bool) -> dict[str, Any]:
    written: dict[str, Any] = {
        "location": [round(place.on_road.lon, DECIMALS), round(place.on_road.lat, DECIMALS)],
        "snapped_distance": round(place.distance_m, 2),
    }
    return written | ({"name": place.road_name} if named else {})
