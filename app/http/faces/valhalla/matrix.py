"""Valhalla's matrix: times and distances, and energies and charges beside them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from app.http.faces.electric import matrix_request
from app.http.faces.figures import rounded
from app.http.faces.valhalla.asked import lonlat_sent
from app.http.faces.valhalla.errors import ValhallaError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from app.http.faces.electric import Electric
    from app.http.faces.valhalla.asked import ValhallaRequest
    from app.schemas.matrix import MatrixRequest, MatrixResponse
    from app.schemas.place import Snapped


def asked_matrix(asked: ValhallaRequest, electric: Electric, most: int) -> MatrixRequest:
    """The matrix request of a Valhalla request; most: sources, and targets."""
    sources = asked.places("sources", most, few=121, missing=112, bad=131)
    targets = asked.places("targets", most, few=122, missing=112, bad=132)
    asked.check_heeded()
    if asked.fields.get("shape_format", "no_shape") != "no_shape":
        raise ValhallaError(164, "no_shape")
    asked.flag("verbose")
    return matrix_request(
        [lonlat_sent(place) for place in sources], [lonlat_sent(place) for place in targets], electric, asked.weights()
    )


def matrix_answer(asked: ValhallaRequest, found: MatrixResponse) -> dict[str, Any]:
    """A matrix as Valhalla answers it; null where a pair can't be driven."""
    unit_m = 1000.0 * asked.km_a_unit
    for note in found.warnings:
        asked.warn(299, note)
    written: dict[str, Any] = {"algorithm": "timedistancematrix", "units": asked.units}
    if asked.flag("verbose", default=True):
        written |= {"sources": _sent(found.sources), "targets": _sent(found.targets)}
        written["sources_to_targets"] = [
            [
                {
                    "from_index": i,
                    "to_index": j,
                    "time": _rounded(found.duration_s[i][j], 1.0),
                    "distance": _rounded(found.distance_m[i][j], unit_m),
                    "ev": {
                        "energy_kwh": rounded(found.energy_kwh[i][j]),
                        "soc_end": rounded(found.soc_end[i][j]),
                        "reason": found.reason[i][j],
                    },
                }
                for j in range(len(found.targets))
            ]
            for i in range(len(found.sources))
        ]
    else:
        written["sources_to_targets"] = {
            "durations": [[_rounded(value, 1.0) for value in row] for row in found.duration_s],
            "distances": [[_rounded(value, unit_m) for value in row] for row in found.distance_m],
            "energies": [[rounded(value) for value in row] for row in found.energy_kwh],
        }
    return written | ({"warnings": asked.warnings} if asked.warnings else {}) | asked.asked_id


def _rounded(value: float | None, unit: float) -> float | None:
    return None if value is None else round(value / unit, 3)


def _sent(places: Sequence[Snapped]) -> list[dict[str, float]]:
    return [{"lon": place.asked.lon, "lat": place.asked.lat} for place in places]
