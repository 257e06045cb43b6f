"""What openrouteservice is asked: the bodies of its services."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, NaiveDatetime, ValidationError, model_validator

from app.errors.validation import validation_detail
from app.http.faces.electric import PROFILE_FORM, Electric, electric_from, profile_fields
from app.http.faces.ors.errors import UNKNOWN_PARAMETER, OrsError, OrsKind, OrsService, unsupported
from app.schemas.place import MAX_PLACES
from app.schemas.range import MAX_BANDS
from app.schemas.route import MAX_VIA

if TYPE_CHECKING:
    from collections.abc import Sequence

PLAIN: Final = frozenset({"driving-car", "driving"})
METRES: Final = {"m": 1.0, "km": 1000.0, "mi": 1609.344}
MOST_LOCATIONS: Final = 5  # of one request for isochrones
LANGUAGE: Final = re.compile(r"[A-Za-z]{2,3}(?:-[A-Za-z]{2,4})?\Z")

Lon = float
Pair = tuple[float, float] | tuple[float, float, float]
Units = Literal["m", "km", "mi"]
Bodied = TypeVar("Bodied", bound="OrsBody")


class OrsPart(BaseModel):
    """A part of a body: what is not known is refused, as openrouteservice does."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _without_nulls(cls, sent: object) -> object:
        """A field that is null is left out; clients send so what they do not ask for."""
        return {name: value for name, value in sent.items() if value is not None} if isinstance(sent, dict) else sent


class Options(OrsPart):
    """Further options, of which only our own can be heeded."""

    avoid_features: list[str] = Field(default=[], max_length=20)
    avoid_borders: str | None = None
    avoid_countries: list[int | str] = Field(default=[], max_length=300)
    avoid_polygons: dict[str, Any] = {}
    vehicle_type: str | None = None
    profile_params: dict[str, Any] = {}
    round_trip: dict[str, Any] | None = None
    ev: Any = None


class OrsBody(OrsPart):
    """What all services are asked."""

    id: Annotated[str, Field(max_length=1000)] | Annotated[int, Field(ge=-(2**53), le=2**53)] | None = None
    profile: str | None = Field(default=None, max_length=300)
    profile_name: str | None = Field(default=None, max_length=300)
    options: Options = Options()
    ev: Any = None
    optimized: bool | str | None = None

    def query(self) -> dict[str, Any]:
        """The body as answers repeat it, without what is of any form."""
        return self.model_dump(mode="json", exclude_defaults=True, exclude={"ev", "options"})

    def electric(self, profile: str, usual_soc: float, service: OrsService) -> Electric:
        """What profile and body say of vehicle, charge and weather; refuses options that can't be heeded."""
        said = profile_fields(profile, PLAIN)
        if said is None:
            message = f"Parameter 'profile' has incorrect value of '{profile[:200]}': driving-car, {PROFILE_FORM}."
            raise OrsError(service + OrsKind.VALUE, message)
        options = self.options
        for name in ("avoid_features", "avoid_borders", "avoid_countries", "avoid_polygons", "profile_params"):
            if getattr(options, name):
                raise unsupported(service, f"options.{name}")
        if options.round_trip is not None:
            raise unsupported(service, "options.round_trip")
        own = options.ev if self.ev is None else self.ev
        return electric_from(said, own, usual_soc)


class Alternatives(OrsPart):
    """How many routes, and how they may differ; the latter is not heeded."""

    target_count: int = Field(default=2, ge=1, le=100)
    weight_factor: float | None = None
    share_factor: float | None = None


class DirectionsBody(OrsBody):
    """What directions are asked."""

    coordinates: list[Pair] = Field(min_length=2, max_length=MAX_VIA + 2)
    preference: Literal["fastest", "shortest", "recommended", "custom"] = "recommended"
    units: Units = "m"
    language: str = Field(default="en", max_length=20)
    geometry: bool = True
    geometry_simplify: bool = False
    instructions: bool = True
    instructions_format: Literal["text", "html"] = "text"
    roundabout_exits: bool = False
    attributes: list[Literal["avgspeed", "detourfactor", "percentage"]] = Field(default=[], max_length=10)
    maneuvers: bool = False
    radiuses: list[float] | float | None = None
    bearings: list[list[float]] | None = None
    continue_straight: bool = False
    elevation: bool = False
    extra_info: list[str] = Field(default=[], max_length=50)
    suppress_warnings: bool = False
    skip_segments: list[int] = Field(default=[], max_length=50)
    alternative_routes: Alternatives | None = None
    departure: NaiveDatetime | None = None
    arrival: NaiveDatetime | None = None
    maximum_speed: float | None = Field(default=None, gt=0)
    schedule: bool = False
    format: str | None = Field(default=None, max_length=20)

    def refuse_unheeded(self) -> None:
        """Refuse what would change the route and can't be heeded."""
        for name in ("extra_info", "skip_segments", "continue_straight", "arrival", "schedule"):
            if getattr(self, name):
                raise unsupported(OrsService.DIRECTIONS, name)
        if any(self.bearings or ()):
            raise unsupported(OrsService.DIRECTIONS, "bearings")
        if self.preference == "custom":
            raise unsupported(OrsService.DIRECTIONS, "preference=custom")
        if not LANGUAGE.match(self.language):
            number = OrsService.DIRECTIONS + OrsKind.VALUE
            raise OrsError(number, "Parameter 'language' has incorrect value, such as en or pt-BR is allowed.")


class IsochronesBody(OrsBody):
    """What isochrones are asked; energy [Wh] and charge left [0..1] are ours."""

    locations: list[Pair] = Field(min_length=1, max_length=MOST_LOCATIONS)
    location_type: Literal["start", "destination"] = "start"
    range: list[float] = Field(min_length=1, max_length=MAX_BANDS)
    range_type: Literal["time", "distance", "energy", "charge"] = "time"
    interval: float | None = Field(default=None, gt=0)
    units: Literal["m", "km", "mi", "Wh", "kWh"] | None = None
    area_units: Units = "m"
    attributes: list[Literal["area", "reachfactor", "total_pop"]] = Field(default=[], max_length=10)
    intersections: bool = False
    smoothing: float | None = Field(default=None, ge=0, le=100)
    time: NaiveDatetime | None = None


class MatrixBody(OrsBody):
    """What matrices are asked; energy and soc are ours."""

    locations: list[Pair] = Field(min_length=1, max_length=MAX_PLACES)
    sources: list[int | str] = Field(default=["all"], min_length=1, max_length=MAX_PLACES)
    destinations: list[int | str] = Field(default=["all"], min_length=1, max_length=MAX_PLACES)
    metrics: list[Literal["duration", "distance", "energy", "soc"]] = Field(
        default=["duration"], min_length=1, max_length=10
    )
    resolve_locations: bool = False
    units: Units = "m"


def body_from(model: type[Bodied], sent: object, service: OrsService) -> Bodied:
    """A body; raises OrsError with openrouteservice's number of what is wrong."""
    try:
        return model.model_validate(sent)
    except ValidationError as error:
        kinds = [found["type"] for found in error.errors(include_url=False, include_input=False)]
        if "extra_forbidden" in kinds:
            number = UNKNOWN_PARAMETER[service]
        elif "missing" in kinds:
            number = service + OrsKind.MISSING
        elif any(kind.endswith(("_type", "_parsing")) for kind in kinds):
            number = service + OrsKind.FORMAT
        else:
            number = service + OrsKind.VALUE
        raise OrsError(number, validation_detail(error)) from error


def places_from(sent: Sequence[Pair], service: OrsService, name: str) -> list[tuple[float, float]]:
    """Places as longitude, latitude [deg]; heights are left."""
    places = [(place[0], place[1]) for place in sent]
    for k, (lon, lat) in enumerate(places):
        if not (abs(lon) <= 180.0 and abs(lat) <= 90.0):
            message = f"Parameter '{name}' has incorrect value at {k}: [longitude, latitude] of -180..180 and -90..90."
            raise OrsError(service + OrsKind.VALUE, message)
    return places
