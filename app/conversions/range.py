"""Range requests into routing.queries, and its areas into GeoJSON."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final

from shapely import to_ragged_array

from app.conversions.conditions import conditions_from
from app.conversions.graph import terrain_note
from app.conversions.lean.colours import band_colours
from app.conversions.lean.digits import compacted
from app.conversions.lean.selection import asks_for, picked_collection, selection_of
from app.conversions.place import DECIMALS, place_feature, point_from_place
from app.conversions.route import search_stats
from app.schemas.as_json import as_json, written
from app.schemas.conditions import ConditionsSent
from app.schemas.place import LatLon, MultiLineStringGeometry, MultiPolygonGeometry
from app.schemas.places.named import named_places
from app.schemas.range import (
    BandFeature,
    BandProperties,
    ConditionsParameters,
    FillingAnswer,
    RangeFeatureCollection,
    RangeParameters,
    RangeRequest,
    bands_from_text,
    limits_from_text,
)
from energy.units import JOULE_PER_KWH
from routing.queries import LIMIT_UNITS, By, RangeQuery, Trip

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, TypeAlias

    from shapely import MultiLineString

    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.range.bands import RangeAnswer, RangeBand
    from routing.range.rings import AreaRings

    Coordinates: TypeAlias = Callable[[AreaRings], Any]

DECIMALS_OF_KM: Final = 3


def request_from_parameters(sent: RangeParameters) -> RangeRequest:
    """The long form of a request in the address; raises ValidationError as a body would."""
    given = sent.model_dump(include=set(ConditionsParameters.model_fields), exclude_defaults=True)
    return RangeRequest(
        origin=LatLon(lat=sent.lat, lon=sent.lon),
        soc=sent.soc,
        vehicle=sent.vehicle,
        graph=sent.graph,
        reserve_soc=sent.reserve_soc,
        bands=bands_from_text(sent.bands),
        link_model=sent.link_model,
        stops=sent.stops,
        conditions=ConditionsSent(**given) if given else None,
        effects=sent.effects,
        uncertainty=sent.uncertainty,
        reverse=sent.reverse,
        round_trip=sent.round_trip,
        outline=sent.outline,
        by=sent.by,
        limits=limits_from_text(sent.limits),
        tolerance_m=sent.tolerance_m,
        fields=None if sent.fields is None else sent.fields.split(","),
        compact=sent.compact,
    )


def range_query(sent: RangeRequest, vehicle: AnyVehicle) -> RangeQuery:
    """What the planner is asked; a count of bands becomes that many, evenly spaced from the reserve upwards.

    vehicle: with the effects of the request.
    """
    if isinstance(sent.bands, int):
        step = (sent.soc - sent.reserve_soc) / sent.bands
        bands = tuple(sent.reserve_soc + k * step for k in range(1, sent.bands) if step > 0.0)
    else:
        bands = tuple(sorted(set(sent.bands)))
    return RangeQuery(
        origin=point_from_place(sent.origin),
        soc_frac=sent.soc,
        vehicle=vehicle,
        reserve_soc_frac=sent.reserve_soc,
        bands_soc_frac=bands,
        link_model=sent.link_model,
        stop_rule=sent.stops,
        conditions=conditions_from(sent.conditions),
        uncertainty=sent.uncertainty,
        trip=Trip.REVERSE if sent.reverse else Trip.ROUND if sent.round_trip else Trip.OUT,
        outline=sent.outline,
        by=sent.by,
        limits=tuple(limit * LIMIT_UNITS[sent.by] for limit in sent.limits or ()),
        tolerance_m=sent.tolerance_m,
    )


def range_features(answer: RangeAnswer, understood: RangeRequest, graph: RoadGraph) -> RangeFeatureCollection:
    """Bands, the outermost first, and the snapped origin."""
    return _features(answer, understood, graph, _points)


def range_json(answer: RangeAnswer, understood: RangeRequest, graph: RoadGraph) -> bytes:
    """The JSON of range_features, made without an object for each point, which would take longer than the search."""
    selection = selection_of(understood.fields)
    coordinates_of = _written if asks_for(selection, "features", "geometry") else _left_out
    document = picked_collection(_features(answer, understood, graph, coordinates_of), selection)
    return as_json(document if understood.compact is False else compacted(document))


def _written(rings: AreaRings) -> object:
    return written(rings.coordinates_json())


def _left_out(rings: AreaRings) -> list[object]:
    return []


def _features(
    answer: RangeAnswer, understood: RangeRequest, graph: RoadGraph, coordinates_of: Coordinates
) -> RangeFeatureCollection:
    return RangeFeatureCollection(
        features=[
            *(
                _band(band, understood.by, coordinates_of, colour)
                for band, colour in zip(answer.bands, band_colours(band_levels(answer)), strict=True)
            ),
            place_feature(answer.origin, "origin"),
        ],
        places=named_places([understood.origin]),
        request=understood,
        warnings=list(answer.warnings),
        stats=search_stats(answer.stats),
        terrain=terrain_note(graph),
        filling=None
        if answer.filling is None
        else FillingAnswer(gap_m=answer.filling.gap_m, hole_km2=answer.filling.hole_m2 / 1e6),
    )


def band_levels(answer: RangeAnswer) -> list[float]:
    """What bands are ordered by, growing inwards: charge left, or the less that is taken."""
    return [-(band.limit or 0.0) if band.soc_left_frac is None else band.soc_left_frac for band in answer.bands]


def _band(band: RangeBand, by: By, coordinates_of: Coordinates, colour: str) -> BandFeature:
    bearing_km, roads = (band.bearing_reach_m / 1000.0).round(DECIMALS_OF_KM), band.road_reach
    return BandFeature(
        # checking each number takes longer than the search
        geometry=MultiPolygonGeometry.model_construct(coordinates=coordinates_of(band.rings)),
        properties=BandProperties(
            soc_left=band.soc_left_frac,
            limit=None if band.limit is None else round(band.limit / LIMIT_UNITS[by], 9),
            probability=band.probability_frac,
            area_km2=band.area_m2 / 1e6,
            tolerance_m=band.tolerance_m,
            node_count=band.node_count,
            false_in_share=band.false_in_frac,
            false_out_share=band.false_out_frac,
            reaches_map_edge=band.map_edge is not None,
            map_edge=None if band.map_edge is None else _multi_line(band.map_edge.line),
            map_edge_left_kwh=None if band.edge_left_j is None else band.edge_left_j / JOULE_PER_KWH,
            reach_nearest_km=bearing_km.min().item(),
            reach_farthest_km=bearing_km.max().item(),
            reach_by_bearing_km=bearing_km.tolist(),
            road_nearest_km=None if roads.nearest_m is None else roads.nearest_m / 1000.0,
            road_farthest_km=roads.farthest_m / 1000.0,
            stroke=colour,
            fill=colour,
        ),
    )


def _multi_line(lines: MultiLineString) -> MultiLineStringGeometry:
    _, places, (firsts, _) = to_ragged_array([lines])
    points = [(lon, lat) for lon, lat in places.round(DECIMALS).tolist()]
    parts = [points[begin:end] for begin, end in pairwise(firsts.tolist())]
    return MultiLineStringGeometry.model_construct(coordinates=parts)


def _points(area: AreaRings) -> list[list[list[tuple[float, float]]]]:
    """The points of rings, by ring and polygon, as numbers of Python."""
    points = [(lon, lat) for lon, lat in area.lonlat.round(DECIMALS).tolist()]
    rings = [points[begin:end] for begin, end in pairwise(area.ring_first.tolist())]
    return [rings[begin:end] for begin, end in pairwise(area.polygon_first.tolist())]
