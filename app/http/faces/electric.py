"""What other engines do not know of: vehicle, charge and weather, by profile name and by fields of our own."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, get_args

from pydantic import ConfigDict, Field

from app.http.faces.answering import OwnFieldError, read
from app.schemas.learned_effects import MAX_EFFECTS_ID_CHARS
from app.schemas.matrix import MatrixRequest
from app.schemas.range import ConditionsParameters, RangeRequest
from app.schemas.route import NamedWeighting, RouteRequest
from routing.weights import NAMED_WEIGHTS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from routing.weights import Weights

    Place = Sequence[float]  # longitude, latitude [deg]

PROFILE: Final = re.compile(
    r"ev(?::(?P<vehicle>[^@,]{1,200}))?(?:@(?P<soc>[0-9]{0,3}(?:\.[0-9]{1,9})?))?(?:,(?P<fields>.{1,400}))?\Z", re.ASCII
)
PROFILE_FORM: Final = "ev, ev:VEHICLE or ev:VEHICLE@CHARGE, such as ev:vw-id4@0.8 or ev:vw-id4@0.8,ambient_c=-5"
DRIVE_FIELDS: Final = ("vehicle", "soc", "reserve_soc", "graph", "conditions", "effects", "stops")
OWN_FIELDS: Final = (*DRIVE_FIELDS, "weighting", "charging")
WEIGHTINGS: Final[tuple[NamedWeighting, ...]] = get_args(NamedWeighting)


@dataclass(frozen=True, slots=True)
class Electric:
    """What a request says of vehicle, charge and weather.

    drive: fields of a SearchRequest, as they were sent. weighting: what is best, by name. charging: fields of a
    ChargingRequest, None where no stops are asked for.
    """

    drive: Mapping[str, Any]
    weighting: NamedWeighting | None = None
    charging: object = None


class ElectricParameters(ConditionsParameters):
    """Fields of our own in an address: those of `conditions` stand beside the others."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    vehicle: str | None = Field(default=None, max_length=200)
    soc: float | None = Field(default=None, ge=0, le=1)
    reserve_soc: float | None = Field(default=None, ge=0, le=1)
    graph: str | None = Field(default=None, max_length=200)
    weighting: NamedWeighting | None = None
    effects: str | None = Field(default=None, max_length=MAX_EFFECTS_ID_CHARS)
    charging: bool = False

    def long_form(self) -> dict[str, Any]:
        """The same as an object."""
        weather = set(ConditionsParameters.model_fields)
        given = self.model_dump(include=weather, exclude_defaults=True)
        own = self.model_dump(exclude=weather | {"charging"}, exclude_none=True)
        return own | ({"conditions": given} if given else {}) | ({"charging": {}} if self.charging else {})


OWN_PARAMETERS: Final = frozenset(ElectricParameters.model_fields)


def profile_fields(profile: str, plain: frozenset[str]) -> dict[str, Any] | None:
    """What a profile name says, as fields of our own: {} for a plain one such as `driving`, None for what is neither.

    Raises RequestValidationError for fields behind commas that there are not, or not so.
    """
    if profile in plain:
        return {}
    found = PROFILE.match(profile)
    if found is None or found["soc"] == "":
        return None
    said: dict[str, Any] = {} if found["vehicle"] is None else {"vehicle": found["vehicle"]}
    if found["soc"] is not None:
        said["soc"] = float(found["soc"])
    if found["fields"] is None:
        return said
    pairs = [part.partition("=") for part in found["fields"].split(",")]
    return said | read(ElectricParameters, {name: value for name, _, value in pairs}).long_form()


def electric_from(profile: Mapping[str, Any], sent: object, usual_soc: float, field: str = "ev") -> Electric:
    """What a profile name and fields of our own say; of two that say the same, the latter.

    sent: an object of such fields, or None. usual_soc: the charge at departure where neither says one. field: where
    they stand. Raises OwnFieldError for what is none of them.
    """
    own = {} if sent is None else sent
    if not isinstance(own, dict):
        raise OwnFieldError(field, own, "an object")
    for name, value in own.items():
        if name not in OWN_FIELDS:
            raise OwnFieldError(f"{field}.{name}", value, f"one of {', '.join(OWN_FIELDS)}")
    fields = {**profile, **own}
    if isinstance(own.get("conditions"), dict):
        fields["conditions"] = {**profile.get("conditions", {}), **own["conditions"]}
    weighting = fields.get("weighting")
    if weighting is not None and weighting not in WEIGHTINGS:
        raise OwnFieldError(f"{field}.weighting", weighting, f"one of {', '.join(WEIGHTINGS)}")
    drive = {name: fields[name] for name in DRIVE_FIELDS if name in fields}
    return Electric({"soc": usual_soc, **drive}, weighting, fields.get("charging"))


def route_request(
    places: Sequence[Place], electric: Electric, further: int = 0, weights: Weights | None = None
) -> RouteRequest:
    """A request for the best route over places, with further ones by the other weightings.

    weights: where the engine's own words say what is best; electric.weighting is heard first.
    """
    sent: dict[str, Any] = {
        **electric.drive,
        "start": list(places[0]),
        "goal": list(places[-1]),
        "via": [list(place) for place in places[1:-1]],
    }
    if electric.charging is not None:
        sent["charging"] = electric.charging
    elif further > 0:
        first = electric.weighting or _name_of(weights)
        sent["alternatives"] = [first, *(name for name in WEIGHTINGS if name != first)][: 1 + further]
    elif electric.weighting is not None or weights is not None:
        sent["weights"] = _fields_of(_chosen(electric, weights))
    return read(RouteRequest, sent)


def matrix_request(
    sources: Sequence[Place], targets: Sequence[Place], electric: Electric, weights: Weights | None = None
) -> MatrixRequest:
    """A request for the drives from places to places; weights: as of route_request."""
    if electric.charging is not None:
        raise OwnFieldError("ev.charging", "sent", "left out, but for routes")
    sent: dict[str, Any] = {
        **electric.drive,
        "sources": [list(place) for place in sources],
        "targets": [list(place) for place in targets],
    }
    if electric.weighting is not None or weights is not None:
        sent["weights"] = _fields_of(_chosen(electric, weights))
    return read(MatrixRequest, sent)


def range_request(place: Place, electric: Electric, **fields: object) -> RangeRequest:
    """A request for the area around a place; fields: further ones of a RangeRequest."""
    if electric.charging is not None or electric.weighting is not None:
        raise OwnFieldError("ev", "charging or weighting", "left out, but for routes")
    return read(RangeRequest, {**electric.drive, "origin": list(place), **fields})


def _chosen(electric: Electric, weights: Weights | None) -> Weights:
    return NAMED_WEIGHTS[electric.weighting or "eco"] if electric.weighting is not None or weights is None else weights


def _name_of(weights: Weights | None) -> NamedWeighting:
    """The named weighting that is a weighting, or like it."""
    return next((name for name in WEIGHTINGS if NAMED_WEIGHTS[name] == weights), "eco")


def _fields_of(weights: Weights) -> dict[str, float]:
    return {"energy": weights.energy, "time": weights.time, "distance": weights.distance}
