"""Answers of other engines as JSON Schema, written down from their public documentation.

OSRM: docs/http.md of Project-OSRM/osrm-backend. openrouteservice: docs/api-reference of GIScience/openrouteservice, and
the response classes that its OpenAPI document is made of. Valhalla: docs/docs/api of valhalla/valhalla. Fields of our
own (`ev`, `energies`, `socs`) are further ones, which none of them forbids.
"""

from __future__ import annotations

from typing import Any, Final

NUMBER: Final[dict[str, Any]] = {"type": "number"}
COUNT: Final[dict[str, Any]] = {"type": "integer", "minimum": 0}
TEXT: Final[dict[str, Any]] = {"type": "string"}
FLAG: Final[dict[str, Any]] = {"type": "boolean"}
BEARING: Final[dict[str, Any]] = {"type": "integer", "minimum": 0, "maximum": 359}
POSITION: Final[dict[str, Any]] = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 3}


def listed(items: dict[str, Any], least: int = 0) -> dict[str, Any]:
    return {"type": "array", "items": items, "minItems": least}


def having(required: dict[str, Any], **further: dict[str, Any]) -> dict[str, Any]:
    """An object with some fields, and perhaps further ones."""
    return {"type": "object", "required": list(required), "properties": {**required, **further}}


def rows(of: dict[str, Any]) -> dict[str, Any]:
    return listed(listed({"anyOf": [of, {"type": "null"}]}))


LINE: Final = having({"type": {"const": "LineString"}, "coordinates": listed(POSITION, 2)})
RING: Final = listed(POSITION, 4)
POLYGON: Final = having({"type": {"const": "Polygon"}, "coordinates": listed(RING, 1)})
BOX: Final = {"type": "array", "items": NUMBER, "minItems": 4, "maxItems": 6}

# --- OSRM
MODIFIERS: Final = (
    *("uturn", "sharp right", "right", "slight right", "straight", "slight left", "left", "sharp left"),
)
MANOEUVRES: Final = (
    *("turn", "new name", "depart", "arrive", "merge", "on ramp", "off ramp", "fork", "end of road", "continue"),
    *("roundabout", "rotary", "roundabout turn", "notification", "exit roundabout", "exit rotary"),
)
OSRM_GEOMETRY: Final = {"anyOf": [TEXT, LINE]}
OSRM_WAYPOINT: Final = having({"name": TEXT, "location": POSITION}, distance=NUMBER, hint=TEXT)
OSRM_LANE: Final = having({"valid": FLAG, "indications": listed({"enum": [*MODIFIERS, "none"]})})
OSRM_INTERSECTION: Final = {
    **having(
        {"location": POSITION, "bearings": listed(BEARING, 1), "entry": listed(FLAG, 1)},
        lanes=listed(OSRM_LANE, 1),
        out=COUNT,
    ),
    "anyOf": [{"required": ["in"]}, {"required": ["out"]}],
}
OSRM_MANOEUVRE: Final = {
    **having(
        {
            "type": {"enum": list(MANOEUVRES)},
            "location": POSITION,
            "bearing_before": BEARING,
            "bearing_after": BEARING,
        },
        modifier={"enum": list(MODIFIERS)},
        exit={"type": "integer", "minimum": 1},
    ),
    "anyOf": [{"required": ["modifier"]}, {"properties": {"type": {"enum": ["depart", "arrive"]}}}],
}
OSRM_STEP: Final = having(
    {
        "distance": NUMBER,
        "duration": NUMBER,
        "weight": NUMBER,
        "geometry": OSRM_GEOMETRY,
        "name": TEXT,
        "mode": TEXT,
        "maneuver": OSRM_MANOEUVRE,
        "intersections": listed(OSRM_INTERSECTION, 1),
        "driving_side": {"enum": ["left", "right"]},
    },
    ref={"type": "string", "minLength": 1},
    destinations={"type": "string", "minLength": 1},
    exits={"type": "string", "minLength": 1},
    rotary_name={"type": "string", "minLength": 1},
)
OSRM_LEG: Final = having(
    {"distance": NUMBER, "duration": NUMBER, "weight": NUMBER, "summary": TEXT, "steps": listed(OSRM_STEP)},
    annotation=having({}, distance=listed(NUMBER), duration=listed(NUMBER), speed=listed(NUMBER)),
)
OSRM_ROUTE: Final = having(
    {"distance": NUMBER, "duration": NUMBER, "weight": NUMBER, "weight_name": TEXT, "legs": listed(OSRM_LEG, 1)},
    geometry=OSRM_GEOMETRY,
)
OK: Final = {"const": "Ok"}
OSRM_ROUTES: Final = having(
    {"code": OK, "routes": listed(OSRM_ROUTE, 1)}, waypoints=listed(OSRM_WAYPOINT, 2), message=TEXT
)
OSRM_TABLE: Final = having(
    {"code": OK},
    durations=rows(NUMBER),
    distances=rows(NUMBER),
    sources=listed(OSRM_WAYPOINT, 1),
    destinations=listed(OSRM_WAYPOINT, 1),
    fallback_speed_cells=listed({"type": "array", "items": COUNT, "minItems": 2, "maxItems": 2}),
)
OSRM_NEAREST: Final = having(
    {"code": OK, "waypoints": listed({"allOf": [OSRM_WAYPOINT, having({"nodes": listed(COUNT, 2)})]}, 1)}
)

# --- openrouteservice
ORS_METADATA: Final = having(
    {
        "attribution": TEXT,
        "service": {"enum": ["routing", "isochrones", "matrix"]},
        "timestamp": COUNT,
        "query": having({}),
        "engine": having({"version": TEXT}),
    },
    id=TEXT,
)
ORS_STEP: Final = having(
    {
        "distance": NUMBER,
        "duration": NUMBER,
        "type": {"type": "integer", "minimum": 0, "maximum": 13},
        "instruction": TEXT,
        "name": TEXT,
        "way_points": {"type": "array", "items": COUNT, "minItems": 2, "maxItems": 2},
    },
    exit_number={"type": "integer", "minimum": 1},
    maneuver=having({"location": POSITION, "bearing_before": BEARING, "bearing_after": BEARING}),
)
ORS_SEGMENT: Final = having(
    {"distance": NUMBER, "duration": NUMBER, "steps": listed(ORS_STEP)},
    detourfactor=NUMBER,
    percentage=NUMBER,
    avgspeed=NUMBER,
    ascent=NUMBER,
    descent=NUMBER,
)
ORS_SUMMARY: Final = having({"distance": NUMBER, "duration": NUMBER}, ascent=NUMBER, descent=NUMBER)
ORS_WARNINGS: Final = listed(having({"code": COUNT, "message": TEXT}), 1)
ORS_ROUTES: Final = having(
    {
        "bbox": BOX,
        "metadata": ORS_METADATA,
        "routes": listed(
            having(
                {"summary": ORS_SUMMARY, "bbox": BOX, "way_points": listed(COUNT, 2)},
                segments=listed(ORS_SEGMENT, 1),
                geometry=TEXT,
                warnings=ORS_WARNINGS,
            ),
            1,
        ),
    }
)
ORS_FEATURES: Final = having(
    {
        "type": {"const": "FeatureCollection"},
        "bbox": BOX,
        "metadata": ORS_METADATA,
        "features": listed(
            having(
                {
                    "type": {"const": "Feature"},
                    "bbox": BOX,
                    "geometry": LINE,
                    "properties": having(
                        {"summary": ORS_SUMMARY, "way_points": listed(COUNT, 2)},
                        segments=listed(ORS_SEGMENT, 1),
                        warnings=ORS_WARNINGS,
                    ),
                }
            ),
            1,
        ),
    }
)
ORS_ISOCHRONES: Final = having(
    {
        "type": {"const": "FeatureCollection"},
        "bbox": BOX,
        "metadata": ORS_METADATA,
        "features": listed(
            having(
                {
                    "type": {"const": "Feature"},
                    "properties": having({"group_index": COUNT, "value": NUMBER, "center": POSITION}, area=NUMBER),
                    "geometry": POLYGON,
                }
            ),
            1,
        ),
    }
)
ORS_LOCATION: Final = having({"location": POSITION, "snapped_distance": NUMBER}, name=TEXT)
ORS_MATRIX: Final = having(
    {"destinations": listed(ORS_LOCATION, 1), "sources": listed(ORS_LOCATION, 1), "metadata": ORS_METADATA},
    durations=rows(NUMBER),
    distances=rows(NUMBER),
)

# --- Valhalla
VALHALLA_WARNINGS: Final = listed(having({"code": COUNT, "description": TEXT}), 1)
VALHALLA_SUMMARY: Final = having(
    {
        "time": NUMBER,
        "length": NUMBER,
        "has_highway": FLAG,
        "has_ferry": FLAG,
        **dict.fromkeys(("min_lat", "min_lon", "max_lat", "max_lon"), NUMBER),
    }
)
VALHALLA_MANEUVER: Final = having(
    {
        "type": {"type": "integer", "minimum": 0, "maximum": 43},
        "time": NUMBER,
        "length": NUMBER,
        "begin_shape_index": COUNT,
        "end_shape_index": COUNT,
        "travel_mode": {"const": "drive"},
        "travel_type": {"const": "car"},
    },
    instruction=TEXT,
    street_names=listed(TEXT, 1),
    bearing_before=BEARING,
    bearing_after=BEARING,
    roundabout_exit_count={"type": "integer", "minimum": 1},
    sign={"type": "object", "additionalProperties": listed(having({"text": TEXT}), 1), "minProperties": 1},
    lanes=listed(having({"directions": COUNT}, valid=COUNT, active=COUNT), 1),
)
VALHALLA_TRIP: Final = having(
    {
        "locations": listed(having({"type": TEXT, "lat": NUMBER, "lon": NUMBER}), 2),
        "legs": listed(
            having(
                {"summary": VALHALLA_SUMMARY},
                maneuvers=listed(VALHALLA_MANEUVER, 2),
                shape={"anyOf": [TEXT, LINE]},
                elevation=listed(NUMBER, 1),
                elevation_interval=NUMBER,
            ),
            1,
        ),
        "summary": VALHALLA_SUMMARY,
        "status": {"const": 0},
        "status_message": TEXT,
        "units": {"enum": ["kilometers", "miles"]},
        "language": TEXT,
    },
    warnings=VALHALLA_WARNINGS,
)
VALHALLA_ROUTE: Final = having({"trip": VALHALLA_TRIP}, alternates=listed(having({"trip": VALHALLA_TRIP}), 1), id=TEXT)
VALHALLA_ISOCHRONE: Final = having(
    {
        "type": {"const": "FeatureCollection"},
        "features": listed(
            having(
                {
                    "type": {"const": "Feature"},
                    "properties": having({}, contour=NUMBER, metric=TEXT, color={"pattern": "^#[0-9a-fA-F]{6}$"}),
                    "geometry": having(
                        {"type": {"enum": ["LineString", "Polygon", "MultiPolygon", "MultiPoint", "Point"]}}
                    ),
                }
            ),
            1,
        ),
    }
)
VALHALLA_PAIR: Final = having(
    {
        "from_index": COUNT,
        "to_index": COUNT,
        "time": {"type": ["number", "null"]},
        "distance": {"type": ["number", "null"]},
    }
)
VALHALLA_MATRIX: Final = having(
    {
        "sources_to_targets": {
            "anyOf": [
                listed(listed(VALHALLA_PAIR, 1), 1),
                having({"durations": rows(NUMBER), "distances": rows(NUMBER)}),
            ]
        },
        "units": {"enum": ["kilometers", "miles"]},
        "algorithm": {"enum": ["timedistancematrix", "costmatrix", "timedistancebssmatrix"]},
    }
)
HEIGHT: Final[dict[str, Any]] = {"type": ["number", "null"]}
VALHALLA_HEIGHT: Final = {
    **having({}, height=listed(HEIGHT, 1), range_height=listed({"type": "array", "items": HEIGHT, "minItems": 2}, 1)),
    "oneOf": [{"required": ["height"]}, {"required": ["range_height"]}],
    "anyOf": [{"required": ["shape"]}, {"required": ["encoded_polyline"]}],
}
VALHALLA_LOCATE: Final = listed(
    having(
        {
            "input_lon": NUMBER,
            "input_lat": NUMBER,
            "nodes": {"type": ["array", "null"]},
            "edges": {
                "anyOf": [
                    {"type": "null"},
                    listed(
                        having(
                            {
                                "way_id": COUNT,
                                "correlated_lat": NUMBER,
                                "correlated_lon": NUMBER,
                                "side_of_street": {"enum": ["left", "right", "neither"]},
                                "percent_along": {"type": "number", "minimum": 0, "maximum": 1},
                            }
                        ),
                        1,
                    ),
                ]
            },
        }
    ),
    1,
)
VALHALLA_STATUS: Final = having({"version": TEXT}, has_tiles=FLAG)
