"""Areas that can be reached."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from shapely.geometry import mapping

from energy.chain.chain import LinkModel, StopRule
from energy.units import JOULE_PER_KWH, METRE_PER_KM
from joulepath.conditions import conditions_in_si
from joulepath.figures import (
    Feature,
    MapFeature,
    MapFeatures,
    Snapped,
    feature,
    number_of,
    numbers_of,
    one_of,
    point_of,
    snapped_of,
)
from routing.queries import LIMIT_UNITS, By, Outline, RangeQuery, Trip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import MultiLineString, MultiPolygon

    from joulepath.conditions import Conditions
    from joulepath.graph import Graph
    from joulepath.vehicle import Vehicle
    from routing.range.bands import RangeBand

M2_PER_KM2 = 1e6
SHAPES = ("geometry", "map_edge")


@dataclass(frozen=True, slots=True)
class Band(MapFeature):
    """The area in which at least soc_left_frac is left, or no more than limit is taken.

    geometry: in lon, lat [deg], `tolerance_m` off at most.
    probability_frac: that a place at its edge is reached so, where uncertainty was asked for. false_in_frac,
    false_out_frac: share of its nodes that can't be reached, and of reachable nodes that it leaves out.
    reaches_map_edge: whether charge is left where the map ends; then map_edge_left_kwh is what the battery holds there
    at most, or at the end of the trip back, and map_edge the part of the outline that is the map's, in lon, lat [deg].
    reach_by_bearing_km: as the crow flies, 24 directions from north on clockwise. road_nearest_km: along roads to where
    the charge ends first, None where it ends nowhere; road_farthest_km: to the farthest place in reach.
    """

    soc_left_frac: float | None
    limit: float | None
    probability_frac: float | None
    area_km2: float
    tolerance_m: float
    node_count: int
    false_in_frac: float
    false_out_frac: float
    reaches_map_edge: bool
    map_edge_left_kwh: float | None
    reach_by_bearing_km: tuple[float, ...]
    road_nearest_km: float | None
    road_farthest_km: float
    geometry: MultiPolygon
    map_edge: MultiLineString | None

    @property
    def __geo_interface__(self) -> Feature:
        """GeoJSON Feature."""
        shown = {field.name: getattr(self, field.name) for field in fields(self) if field.name not in SHAPES}
        edge = None if self.map_edge is None else mapping(self.map_edge)
        return feature(mapping(self.geometry), shown | {"map_edge": edge})


@dataclass(frozen=True, slots=True)
class Range(MapFeatures):
    """Bands from the outermost, which keeps the reserve, to the innermost."""

    bands: tuple[Band, ...]
    origin: Snapped
    warnings: tuple[str, ...]

    def _features(self) -> Sequence[Band]:
        return self.bands


def range(  # the name of the question; within this package nothing counts
    graph: Graph,
    vehicle: Vehicle,
    *,
    origin: tuple[float, float],
    soc_frac: float,
    reserve_soc_frac: float = 0.0,
    bands_soc_frac: Sequence[float] = (),
    trip: str = "out",
    conditions: Conditions | None = None,
    link_model: str = "integrated",
    stops: str = "expected",
    uncertainty: bool = False,
    outline: str = "roads",
    by: str = "charge",
    limits: Sequence[float] = (),
) -> Range:
    """The area that can be reached from a place (lat, lon) [deg] before the charge falls below the reserve.

    bands_soc_frac: charges that are to be left, a band each, besides the reserve. trip: "out", "reverse" for the area
    from which the place is reached, "round_trip" for what can be driven to and back. outline: "roads" along the roads
    in reach, "filled" smooth, without small gaps and holes. by: "charge", or "energy", "time", "distance" with limits
    in kWh, min, km in place of charges left.

    Raises QueryError for a value out of range, PointOutsideMapError, PointFarFromRoadError, NegativeCycleError,
    SearchLimitError.
    """
    measure = one_of("by", by, By)
    query = RangeQuery(
        origin=point_of("origin", origin),
        soc_frac=number_of("soc_frac", soc_frac),
        vehicle=vehicle.model,
        reserve_soc_frac=number_of("reserve_soc_frac", reserve_soc_frac),
        bands_soc_frac=tuple(sorted(set(numbers_of("bands_soc_frac", bands_soc_frac)))),
        link_model=one_of("link_model", link_model, LinkModel),
        stop_rule=one_of("stops", stops, StopRule),
        conditions=conditions_in_si(conditions),
        uncertainty=uncertainty,
        trip=one_of("trip", trip, Trip),
        outline=one_of("outline", outline, Outline),
        by=measure,
        limits=tuple(limit * LIMIT_UNITS.get(measure, 1.0) for limit in numbers_of("limits", limits)),
    )
    answer = graph.planner.range(query)
    return Range(tuple(_band(band, query.by) for band in answer.bands), snapped_of(answer.origin), answer.warnings)


def _band(found: RangeBand, by: By) -> Band:
    roads = found.road_reach
    return Band(
        soc_left_frac=found.soc_left_frac,
        limit=None if found.limit is None else found.limit / LIMIT_UNITS[by],
        probability_frac=found.probability_frac,
        area_km2=found.area_m2 / M2_PER_KM2,
        tolerance_m=found.tolerance_m,
        node_count=found.node_count,
        false_in_frac=found.false_in_frac,
        false_out_frac=found.false_out_frac,
        reaches_map_edge=found.map_edge is not None,
        map_edge_left_kwh=None if found.edge_left_j is None else found.edge_left_j / JOULE_PER_KWH,
        reach_by_bearing_km=tuple((found.bearing_reach_m / METRE_PER_KM).tolist()),
        road_nearest_km=None if roads.nearest_m is None else roads.nearest_m / METRE_PER_KM,
        road_farthest_km=roads.farthest_m / METRE_PER_KM,
        geometry=found.area,
        map_edge=None if found.map_edge is None else found.map_edge.line,
    )
