"""Reachable areas: what is asked, in the address or as a body, and the GeoJSON that is answered."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, NaiveDatetime, Tag, field_validator, model_validator
from pydantic_core import PydanticCustomError

from app.schemas.base import Answered, Count, Flag, Fraction, Number, refusal
from app.schemas.conditions import condition_field
from app.schemas.drive import GRAPH_MEANS, SearchRequest
from app.schemas.graph import TerrainNote
from app.schemas.lean.form import COMPACT_MEANS
from app.schemas.lean.formats import RangeFormat
from app.schemas.lean.names import MOST_FIELDS, MOST_NAME_CHARS, PICKED_MEANS, Picked, check_names
from app.schemas.learned_effects import MAX_EFFECTS_ID_CHARS
from app.schemas.place import MultiLineStringGeometry, MultiPolygonGeometry, PlaceFeature, PlaceOrText, refuse_swapped
from app.schemas.places.named import PLACES_MEANS, PlaceNamed
from app.schemas.route import SearchStatsAnswer
from energy.chain.chain import LinkModel, StopRule
from energy.conditions import RoadSurface
from routing.queries import By, Outline

MAX_BANDS = 20
MOST_TOLERANCE_M = 100_000.0
TOLERANCE_MEANS = (
    "how far outlines may be moved so that they have fewer points [m]; bands stay within each other; 0 for none; "
    "without it, 1.25 cells of the grid that they are drawn on, about two pixels of a map of the whole area"
)
REVERSE_MEANS = "true gives the area from which the origin is reached, departing there with soc"
ROUND_TRIP_MEANS = "true gives what can be driven to from the origin and back, with a stop there; not with reverse"
BY_MEANS = "what the bands are of; energy, time and distance take limits in place of bands"
LIMITS_MEAN = "the most that is taken, a band each: kWh with energy, min with time, km with distance; else left out"
LIMITS_PATTERN = r"^[0-9]{1,6}(?:\.[0-9]{1,9})?(?:,[0-9]{1,6}(?:\.[0-9]{1,9})?){0,19}$"
OUTLINE_MEANS = "along the roads in reach, or filled: smooth, without small gaps and holes, less exact"
_FRACTION = r"(?:0?\.[0-9]{1,9}|1\.0{1,9})"
_LISTED = rf"(?:0|1|{_FRACTION})"
BANDS_PATTERN = rf"^(?:[1-9]|1[0-9]|20|{_FRACTION}|{_LISTED}(?:,{_LISTED}){{1,19}})$"


def _form_of_bands(value: object) -> str | None:
    if isinstance(value, (list, tuple)):
        return "values"
    return "count" if isinstance(value, int) and not isinstance(value, bool) else None


Bands = Annotated[
    Annotated[Count, Field(ge=1, le=MAX_BANDS, description="number of evenly spaced bands"), Tag("count")]
    | Annotated[
        list[Fraction],
        Field(min_length=1, max_length=MAX_BANDS, description="charge left on arrival, one a band"),
        Tag("values"),
    ],
    Discriminator(
        _form_of_bands,
        custom_error_type="bands",
        custom_error_message="a whole number 1..20, or a list of fractions 0..1",
    ),
]


BandLimit = Annotated[float, Field(gt=0, le=1e6)]


class RangeRequest(SearchRequest):
    """One range request; unknown fields are errors."""

    order: ClassVar[tuple[str, ...]] = (
        "origin",
        "soc",
        "vehicle",
        "graph",
        "reserve_soc",
        "bands",
        "link_model",
        "stops",
        "conditions",
        "effects",
        "uncertainty",
        "reverse",
        "round_trip",
        "outline",
        "by",
        "limits",
        "tolerance_m",
        "fields",
        "compact",
    )

    origin: PlaceOrText
    soc: Fraction = Field(description="state of charge at departure, 0..1; with reverse, at each place")
    reserve_soc: Fraction = Field(
        default=0.0, description="charge that must be left; always the outermost band; at most soc"
    )
    bands: Bands = Field(default=1, description="number of bands from reserve_soc to soc, or the charge left for each")
    uncertainty: Flag = Field(
        default=False, description="true gives each band three times: reached with a probability of 0.1, 0.5 and 0.9"
    )
    reverse: Flag = Field(default=False, description=REVERSE_MEANS)
    round_trip: Flag = Field(default=False, description=ROUND_TRIP_MEANS)
    outline: Outline = Field(default=Outline.ROADS, description=OUTLINE_MEANS)
    by: By = Field(default=By.CHARGE, description=BY_MEANS)
    limits: list[BandLimit] | None = Field(
        default=None, min_length=1, max_length=MAX_BANDS, description=LIMITS_MEAN, examples=[None]
    )
    tolerance_m: Number | None = Field(default=None, ge=0, le=MOST_TOLERANCE_M, description=TOLERANCE_MEANS)
    fields: Picked = None
    compact: Flag | None = Field(default=None, description=COMPACT_MEANS)

    @model_validator(mode="after")
    def _fields_are_known(self) -> RangeRequest:
        check_names(self.fields, RangeFeatureCollection)
        return self

    @model_validator(mode="after")
    def _limits_go_with_what_they_are_of(self) -> RangeRequest:
        if self.by is By.CHARGE and self.limits is not None:
            raise refusal("limits", self.limits, "left out with by charge, which takes bands")
        if self.by is not By.CHARGE:
            if self.limits is None:
                raise refusal("limits", None, f"1..{MAX_BANDS} numbers above 0 with by {self.by.value}")
            if self.bands != 1:
                raise refusal("bands", self.bands, f"left out with by {self.by.value}, which takes limits")
        return self

    @model_validator(mode="after")
    def _one_kind_of_trip(self) -> RangeRequest:
        if self.reverse and self.round_trip:
            raise refusal("round_trip", True, "false where reverse is true")
        return self

    @model_validator(mode="after")
    def _bands_between_reserve_and_soc(self) -> RangeRequest:
        self.check_reserve()
        if isinstance(self.bands, list):
            for band in self.bands:
                if not self.reserve_soc <= band <= self.soc:
                    raise refusal("bands", band, f"between reserve_soc and soc, {self.reserve_soc}..{self.soc}")
        return self


class ConditionsParameters(BaseModel):
    """Conditions in the address: the fields of the body's `conditions`, one parameter each."""

    ambient_c: float | None = condition_field("ambient_k", None, "air temperature [°C]")
    cabin_start_c: float | None = condition_field("cabin_start_k", None, "cabin at departure [°C]; as outside")
    climate: bool = Field(default=True, description="false switches heating and cooling off")
    altitude_density: bool | None = Field(
        default=None, description="whether air is thinner higher up; without it, where ambient_c is sent"
    )
    wind_speed_mps: float = condition_field("wind_speed_mps", 0.0, "at the vehicle's height [m/s]")
    wind_from_deg: float = Field(default=0.0, ge=0, le=360, description="clockwise from north [°]")
    payload_kg: float = condition_field("payload_kg", 0.0, "beyond the vehicle's mass_kg [kg]")
    drag_factor: float = condition_field("drag_factor", 1.0, "on the drag, such as 1.25 for a roof box")
    road: RoadSurface = Field(default=RoadSurface.DRY, description="what lies on the road")
    speed_factor: float = condition_field("speed_factor", 1.0, "driven speed over the limit")
    top_speed_kmh: float | None = condition_field("top_speed_mps", None, "never faster than this [km/h]")
    aux_power_w: float | None = condition_field("aux_power_w", None, "instead of the vehicle's [W]")
    sun_w: float = condition_field("sun_w", 0.0, "heat of the sun into the cabin [W], with ambient_c only")
    regen_limited: bool = Field(default=False, description="whether recuperation has a power cap")
    departure: NaiveDatetime | None = Field(default=None, description="local time at the roads, for limits at hours")


class RangeParameters(ConditionsParameters):
    """A range request in the address."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    lat: float = Field(ge=-90, le=90, examples=[44.4401], description="latitude of the origin [deg]")
    lon: float = Field(ge=-180, le=180, examples=[-36.781], description="longitude of the origin [deg]")
    soc: float = Field(ge=0, le=1, examples=[0.3], description="state of charge at departure, 0..1")
    vehicle: str | None = Field(
        default=None, max_length=200, description="id of a vehicle; without it, the default one"
    )
    graph: str | None = Field(default=None, max_length=200, description=f"name of a graph; {GRAPH_MEANS}")
    reserve_soc: float = Field(default=0.0, ge=0, le=1, description="charge that must be left, at most soc")
    bands: str = Field(
        default="1",
        max_length=400,
        json_schema_extra={"pattern": BANDS_PATTERN},
        description="whole number of evenly spaced bands (1..20), or comma-separated charges left (0..1, with a point)",
    )
    link_model: LinkModel = Field(
        default=LinkModel.INTEGRATED, description="exact integral, or the equations as printed"
    )
    stops: StopRule = Field(
        default=StopRule.EXPECTED, description="stops by expectation, by the source's counters, or none"
    )
    effects: str | None = Field(
        default=None, max_length=MAX_EFFECTS_ID_CHARS, description="id of a finished diagnosis, whose effects apply"
    )
    uncertainty: bool = Field(
        default=False, description="true gives each band three times: reached with a probability of 0.1, 0.5 and 0.9"
    )
    reverse: bool = Field(default=False, description=REVERSE_MEANS)
    round_trip: bool = Field(default=False, description=ROUND_TRIP_MEANS)
    outline: Outline = Field(default=Outline.ROADS, description=OUTLINE_MEANS)
    by: By = Field(default=By.CHARGE, description=BY_MEANS)
    limits: str | None = Field(
        default=None, max_length=400, json_schema_extra={"pattern": LIMITS_PATTERN}, description=LIMITS_MEAN
    )

    tolerance_m: float | None = Field(default=None, ge=0, le=MOST_TOLERANCE_M, description=TOLERANCE_MEANS)
    fields: str | None = Field(
        default=None,
        max_length=MOST_FIELDS * MOST_NAME_CHARS,
        description=f"{PICKED_MEANS}; separated by commas",
    )
    compact: bool | None = Field(default=None, description=COMPACT_MEANS)
    format: RangeFormat | None = Field(default=None, description="format of the answer, whatever Accept says")

    @model_validator(mode="before")
    @classmethod
    def _not_swapped(cls, value: object) -> object:
        if isinstance(value, dict):
            refuse_swapped("lat", value.get("lat"), value.get("lon"))
        return value

    @field_validator("limits")
    @classmethod
    def _readable_limits(cls, value: str | None) -> str | None:
        limits_from_text(value)
        return value

    @field_validator("bands")
    @classmethod
    def _readable(cls, value: str) -> str:
        bands_from_text(value)
        return value


def bands_from_text(text: str) -> int | list[float]:
    """Bands out of a query parameter: a whole number is a count, all else comma-separated charges left."""
    try:
        if text.isascii() and text.isdecimal() and len(text) <= 9:
            return int(text)
        return [_number(part) for part in text.split(",")]
    except ValueError:
        raise PydanticCustomError("bands", "a whole number 1..20, or fractions 0..1 separated by commas") from None


def limits_from_text(text: str | None) -> list[float] | None:
    """Limits out of a query parameter, separated by commas."""
    try:
        return None if text is None else [_number(part) for part in text.split(",")]
    except ValueError:
        raise PydanticCustomError("limits", "numbers above 0 separated by commas") from None


def _number(text: str) -> float:
    """A number in figures; raises ValueError, for 1_0 and figures of other scripts too, which float() takes."""
    if "_" in text or not text.isascii():
        raise ValueError(text)
    return float(text)


class BandProperties(Answered):
    """What is said of one band."""

    kind: Literal["band"] = "band"
    soc_left: float | None = Field(
        description="charge left at the end of the trip, at least; null with by time or distance"
    )
    limit: float | None = Field(description="of the request's limits; null with by charge")
    probability: float | None = Field(
        description="that a place at its edge is reached with that charge; null unless uncertainty was asked for"
    )
    area_km2: float = Field(description="of the exact outline, before it has fewer points [km²]")
    tolerance_m: float = Field(description="how far the boundary may have been moved, so that it has fewer points [m]")
    node_count: int = Field(description="nodes of the graph that are reached")
    false_in_share: float = Field(description="share of the nodes in the drawn area that can't be reached")
    false_out_share: float = Field(description="share of the reached nodes that the drawn area leaves out")
    reaches_map_edge: bool = Field(
        description="whether roads that the map cuts off are reached with charge to spare, or all roads of the map"
    )
    map_edge: MultiLineStringGeometry | None = Field(
        description="the part of the outline that is the map's and not the battery's; null unless reaches_map_edge"
    )
    map_edge_left_kwh: float | None = Field(
        description="energy still in the battery there, with reverse and round_trip at the trip's end; null "
        "with by time or distance"
    )
    reach_nearest_km: float = Field(description="least of reach_by_bearing_km")
    reach_farthest_km: float = Field(description="greatest of reach_by_bearing_km")
    reach_by_bearing_km: list[float] = Field(
        description="from the origin as the crow flies to the area's farthest edge, north first and every 15° clockwise"
    )
    road_nearest_km: float | None = Field(
        description="along roads to the nearest place where the charge ends; null where it ends nowhere"
    )
    road_farthest_km: float = Field(description="along roads to the farthest place in reach")
    stroke: str = Field(description="colour of the outline, by simplestyle-spec")
    fill: str = Field(description="colour of the area, by simplestyle-spec")


class BandFeature(Answered):
    """GeoJSON Feature of one band."""

    type: Literal["Feature"] = "Feature"
    geometry: MultiPolygonGeometry | None = Field(description="null where fields leave it out")
    properties: BandProperties


class FillingAnswer(Answered):
    """What a filled outline leaves out."""

    gap_m: float = Field(description="gaps narrower than this are closed [m]")
    hole_km2: float = Field(description="holes smaller than this are closed [km²]")


class RangeFeatureCollection(Answered):
    """Bands by charge left, the outermost first (with uncertainty: and by probability), then the snapped origin."""

    type: Literal["FeatureCollection"] = "FeatureCollection"
    features: list[BandFeature | PlaceFeature]
    places: list[PlaceNamed] = Field(default=[], description=PLACES_MEANS)
    request: RangeRequest = Field(description="the request as understood; can be sent to POST /range")
    warnings: list[str]
    stats: SearchStatsAnswer
    terrain: TerrainNote
    filling: FillingAnswer | None = Field(description="how far the areas are filled; null along roads")
