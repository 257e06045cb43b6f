"""What results are made of: places, energies by cause, and features for maps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from energy.force.parts import PART_NAMES
from energy.units import JOULE_PER_KWH
from routing.errors import QueryError
from routing.places import Point, can_only_be_swapped, place_text, swapped_question
from routing.spelling import question, similar_choice

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from geopandas import GeoDataFrame
    from numpy.typing import NDArray

    from energy.force.parts import EnergyParts as PartsJ
    from routing.places import SnappedPoint

Feature = dict[str, Any]
Choice = TypeVar("Choice", bound=StrEnum)


class Place(NamedTuple):
    """A place on the map [deg, WGS 84]; a tuple (lat, lon) does as well wherever one is asked for."""

    lat_deg: float
    lon_deg: float


@dataclass(frozen=True, slots=True)
class Snapped:
    """Where a place that was asked for met the road network."""

    asked: Place
    on_road: Place
    distance_m: float
    link_idx: int
    offset_m: float
    road_name: str


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EnergyParts(Mapping[str, float]):
    """Battery energy by cause [kWh]; the parts add up to the whole. docs/http-api.md has what each of them is."""

    parts_kwh: tuple[float, ...]  # in the order of energy.force.parts.PART_NAMES

    def __repr__(self) -> str:
        return f"EnergyParts({dict(self)})"

    def __getitem__(self, name: str) -> float:
        if name not in PART_NAMES:
            raise KeyError(name)
        return self.parts_kwh[PART_NAMES.index(name)]

    def __iter__(self) -> Iterator[str]:
        return iter(PART_NAMES)

    def __len__(self) -> int:
        return len(PART_NAMES)


class MapFeature:
    """A result that is one feature on the map."""

    __slots__ = ()

    @property
    def __geo_interface__(self) -> Feature:
        """GeoJSON Feature."""
        raise NotImplementedError


class MapFeatures:
    """A result that is several features on the map."""

    __slots__ = ()

    def _features(self) -> Sequence[MapFeature | Feature]:
        raise NotImplementedError

    @property
    def __geo_interface__(self) -> Feature:
        """GeoJSON FeatureCollection, positions in the order lon, lat."""
        features = [part if isinstance(part, dict) else part.__geo_interface__ for part in self._features()]
        return {"type": "FeatureCollection", "features": features}

    def to_geodataframe(self) -> GeoDataFrame:
        """One row a feature, in WGS 84; raises ImportError where geopandas is not installed."""
        try:
            from geopandas import GeoDataFrame
        except ImportError as error:
            raise ImportError("to_geodataframe() needs geopandas: pip install 'joulepath[geo]'") from error
        return GeoDataFrame.from_features(self.__geo_interface__["features"], crs="EPSG:4326")


def feature(geometry: Mapping[str, Any] | None, properties: Mapping[str, Any]) -> Feature:
    """A GeoJSON Feature whose energies by cause lie flat among the other properties."""
    flat: dict[str, Any] = {}
    for name, value in properties.items():
        if isinstance(value, EnergyParts):
            flat |= {f"{part}_kwh": kwh for part, kwh in value.items()}
        else:
            flat[name] = value
    return {"type": "Feature", "geometry": None if geometry is None else dict(geometry), "properties": flat}


def line(lon_lat_deg: NDArray[np.float64]) -> Feature:
    """A GeoJSON LineString along points, float64 (n, 2)."""
    return {"type": "LineString", "coordinates": [tuple(position) for position in lon_lat_deg.tolist()]}


def point_of(field: str, place: tuple[float, float]) -> Point:
    """A place as the planner takes it; raises QueryError naming the field."""
    try:
        lat_deg, lon_deg = (float(number) for number in place)
    except (TypeError, ValueError):
        raise QueryError(field, repr(place), "(lat, lon) in degrees") from None
    if not -90.0 <= lat_deg <= 90.0 or not -180.0 <= lon_deg <= 180.0:
        allowed = "lat -90..90, lon -180..180, in this order"
        if can_only_be_swapped(lat_deg, lon_deg):
            allowed += swapped_question(lat_deg, lon_deg)
        raise QueryError(field, f"({place_text(lat_deg, lon_deg)})", allowed)
    return Point(lat_deg, lon_deg)


def number_of(field: str, value: object) -> float:
    """A number as the planner takes it; raises QueryError naming the field."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise QueryError(field, repr(value), "a number")
    return float(value)


def numbers_of(field: str, values: Iterable[object]) -> tuple[float, ...]:
    """Numbers as the planner takes them; raises QueryError naming the field."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise QueryError(field, repr(values), "a list of numbers")
    return tuple(number_of(f"{field}[{k}]", value) for k, value in enumerate(values))


def one_of(field: str, value: str, choices: type[Choice]) -> Choice:
    """The member of an enumeration that a text names; raises QueryError naming the field."""
    if value not in tuple(choices):
        meant = question(similar_choice(str(value), [choice.value for choice in choices]))
        raise QueryError(field, repr(value), ", ".join(choices) + meant)
    return choices(value)


def place_of(point: Point) -> Place:
    """A place out of an answer."""
    return Place(point.lat_deg, point.lon_deg)


def snapped_of(point: SnappedPoint) -> Snapped:
    """A place that met a road, out of an answer."""
    return Snapped(
        place_of(point.asked),
        place_of(point.on_road),
        point.distance_m,
        point.link_idx,
        point.offset_m,
        point.road_name,
    )


def parts_of(parts: PartsJ) -> EnergyParts:
    """Energies by cause out of an answer."""
    return EnergyParts(tuple(getattr(parts, f"{name}_j") / JOULE_PER_KWH for name in PART_NAMES))


def frozen(values: Any, dtype: type = np.float64) -> NDArray[Any]:
    """A copy of a column that can't be written to."""
    column: NDArray[Any] = np.array(values, dtype)
    column.flags.writeable = False
    return column
