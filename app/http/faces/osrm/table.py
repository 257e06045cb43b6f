"""OSRM's table service: durations and distances, and energies beside them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.http.faces.electric import matrix_request
from app.http.faces.figures import rounded
from app.http.faces.osrm.errors import OsrmCode, OsrmError
from app.http.faces.osrm.waypoints import waypoint_of
from routing.graph.earth import great_circle_m

if TYPE_CHECKING:
    from app.http.faces.electric import Electric
    from app.http.faces.osrm.asked import OsrmRequest
    from app.schemas.matrix import MatrixRequest, MatrixResponse
    from app.schemas.place import LatLon

OPTIONS: Final = frozenset(
    {"sources", "destinations", "annotations", "fallback_speed", "fallback_coordinate", "scale_factor"}
)
ANNOTATIONS: Final = ("duration", "distance", "energy", "soc")
SECOND_DIGITS: Final = 1


def asked_table(asked: OsrmRequest, electric: Electric) -> MatrixRequest:
    """The matrix request of an OSRM request; refuses options that can't be heeded."""
    asked.check_options(OPTIONS)
    if len(asked.places) < 2:
        raise OsrmError(OsrmCode.INVALID_OPTIONS, "coordinates", f"{len(asked.places)}", "at least two")
    _annotations(asked)
    asked.number("fallback_speed")
    asked.number("scale_factor")
    asked.choice("fallback_coordinate", ("input", "snapped"), "input")
    asked.radiuses()
    sources, targets = ([asked.places[k] for k in asked.indices(name)] for name in ("sources", "destinations"))
    return matrix_request(sources, targets, electric)


def _annotations(asked: OsrmRequest) -> tuple[str, ...]:
    names = tuple(asked.options.get("annotations", "duration").split(",", len(ANNOTATIONS)))
    for name in names:
        if name not in ANNOTATIONS:
            allowed = f"some of {', '.join(ANNOTATIONS)}"
            raise OsrmError(OsrmCode.INVALID_QUERY, "annotations", name[:200], allowed)
    return names


def table_answer(asked: OsrmRequest, found: MatrixResponse) -> dict[str, object]:
    """A matrix as OSRM answers it; what can't be driven on this charge has null, as what no road leads to."""
    limits = asked.radiuses()
    moved: dict[int, float] = {}
    for name, places in (("sources", found.sources), ("destinations", found.targets)):
        moved |= {k: place.distance_m for k, place in zip(asked.indices(name), places, strict=True)}
    if limits:
        asked.check_moved([moved.get(k, 0.0) for k in range(len(asked.places))])
    scale = asked.number("scale_factor") or 1.0
    written: dict[str, object] = {"code": "Ok"}
    if found.warnings:
        written["message"] = "; ".join(found.warnings)
    durations: list[list[float | None]] = [
        [None if value is None else round(value * scale, SECOND_DIGITS) for value in row] for row in found.duration_s
    ]
    distances = [[None if value is None else round(value, SECOND_DIGITS) for value in row] for row in found.distance_m]
    speed = asked.number("fallback_speed")
    if speed is not None:
        snapped = asked.choice("fallback_coordinate", ("input", "snapped"), "input") == "snapped"
        written["fallback_speed_cells"] = _filled(found, durations, distances, speed / scale, snapped=snapped)
    names = _annotations(asked)
    tables: dict[str, tuple[str, object]] = {
        "duration": ("durations", durations),
        "distance": ("distances", distances),
        "energy": ("energies", [[rounded(value) for value in row] for row in found.energy_kwh]),
        "soc": ("socs", [[rounded(value) for value in row] for row in found.soc_end]),
    }
    written |= dict(tables[name] for name in names)
    if not asked.flag("skip_waypoints"):
        written["sources"] = [waypoint_of(place) for place in found.sources]
        written["destinations"] = [waypoint_of(place) for place in found.targets]
    return written


def _filled(
    found: MatrixResponse,
    durations: list[list[float | None]],
    distances: list[list[float | None]],
    speed_mps: float,
    *,
    snapped: bool,
) -> list[tuple[int, int]]:
    """Fill what can't be driven by a speed as the crow flies, and say which entries these are."""

    def at(place: object) -> LatLon:
        here: LatLon = place.on_road if snapped else place.asked  # type: ignore[attr-defined]
        return here

    cells = []
    for i, source in enumerate(found.sources):
        for j, target in enumerate(found.targets):
            if durations[i][j] is None:
                a, b = at(source), at(target)
                away_m = float(great_circle_m(a.lat, a.lon, b.lat, b.lon))
                durations[i][j] = round(away_m / speed_mps, SECOND_DIGITS)
                distances[i][j] = round(away_m, SECOND_DIGITS)
                cells.append((i, j))
    return cells
