"""The tiles of a graph as TileJSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final
from urllib.parse import quote

from app.schemas.tiles import GraphTileJSON, HeightTilesNote, VectorLayer
from app.tiles.ground import NAMES_FROM_ZOOM as WATER_NAMES_FROM_ZOOM
from app.tiles.heights import TILE_SIZE
from app.tiles.roads import CLASS_NAMES, DETAILS_FROM_ZOOM, LAYER, MAX_ZOOM, MIN_ZOOM, NAMES_FROM_ZOOM
from app.tiles.stations import LAYER as STATIONS
from app.tiles.stations import NAMES_FROM_ZOOM as DETAILS_OF_STATIONS_FROM_ZOOM
from routing.ground.kinds import Layer

if TYPE_CHECKING:
    from app.tiles.shelf import GraphTiles

ROAD_LAYER: Final = VectorLayer(
    id=LAYER,
    description="one line a road, the most important ones last",
    minzoom=MIN_ZOOM,
    maxzoom=MAX_ZOOM,
    fields={
        "class": "functional class: " + ", ".join(CLASS_NAMES),
        "name": f"name of the road, where it has one; from zoom {NAMES_FROM_ZOOM}",
        "speed_kmh": f"speed limit, rounded; from zoom {DETAILS_FROM_ZOOM}",
        "oneway": f"whether it is driven in the direction of the line only; from zoom {DETAILS_FROM_ZOOM}",
        "structure": f"whether it is on a bridge or in a tunnel; from zoom {DETAILS_FROM_ZOOM}",
    },
)
STATION_LAYER: Final = VectorLayer(
    id=STATIONS,
    description="one point a charging station; below the closest level the strongest of those close together",
    minzoom=MIN_ZOOM,
    maxzoom=MAX_ZOOM,
    fields={
        "id": "of the station, as in the list of stations",
        "power_kw": "greatest output of a socket, rounded; 0 where none is known",
        "count": "how many stations the point stands for",
        "name": f"name of the station, where it has one; from zoom {DETAILS_OF_STATIONS_FROM_ZOOM}",
        "operator": f"its operator, or else its network; from zoom {DETAILS_OF_STATIONS_FROM_ZOOM}",
        "connectors": f"its plugs, separated by commas; from zoom {DETAILS_OF_STATIONS_FROM_ZOOM}",
        "sockets": f"how many sockets it has; from zoom {DETAILS_OF_STATIONS_FROM_ZOOM}",
        "operational": f"whether it works, where that is known; from zoom {DETAILS_OF_STATIONS_FROM_ZOOM}",
    },
)

_CLASS: Final = "what it is; classes as in docs/tiles.md"
_NAME: Final = f"name, where it has one; from zoom {WATER_NAMES_FROM_ZOOM}; name:de, name:en … where they differ"
GROUND_LAYERS: Final = {
    Layer.LANDCOVER: ("areas of woods, grass, fields, rock, sand, ice", {"class": _CLASS}),
    Layer.LANDUSE: ("built-up areas", {"class": _CLASS}),
    Layer.WATER: ("areas of water", {"class": _CLASS, "name": _NAME}),
    Layer.WATERWAY: ("rivers, canals and streams as lines", {"class": _CLASS, "name": _NAME}),
    Layer.BOUNDARY: ("administrative borders as lines", {"admin_level": "2 for countries, up to 6"}),
    Layer.PLACE: (
        "one point a place, the most important ones first",
        {"class": "city, town, village …", "rank": "0 for the most important", "name": "name; name:de, name:en …"},
    ),
}


def tile_json(tiles: GraphTiles, root_address: str) -> GraphTileJSON:
    """What a map needs to know of a graph's tiles; root_address: of the service, without a slash at the end."""
    meta = tiles.graph.meta
    root = f"{root_address}/graphs/{quote(meta.name, safe='')}"
    heights = None
    if tiles.heights is not None:
        heights = HeightTilesNote(
            tiles=[f"{root}/heights/{{z}}/{{x}}/{{y}}.png?v={tiles.digest}"],
            encoding="terrarium",
            tileSize=TILE_SIZE,
            minzoom=0,
            maxzoom=tiles.heights.max_zoom,
            bounds=tiles.heights.bounds_deg,
        )
    return GraphTileJSON(
        tilejson="3.0.0",
        name=meta.name,
        attribution=_attribution(tiles),
        scheme="xyz",
        tiles=[f"{root}/tiles/{{z}}/{{x}}/{{y}}.mvt?v={tiles.digest}"],
        minzoom=MIN_ZOOM,
        maxzoom=MAX_ZOOM,
        bounds=meta.bbox,
        vector_layers=[
            *_ground_layers(tiles),
            ROAD_LAYER,
            *([STATION_LAYER] if len(tiles.stations) else []),
        ],
        heights=heights,
    )


def _ground_layers(tiles: GraphTiles) -> list[VectorLayer]:
    if tiles.ground is None:
        return []
    return [
        VectorLayer(id=str(layer), description=described, minzoom=MIN_ZOOM, maxzoom=MAX_ZOOM, fields=fields)
        for layer, (described, fields) in GROUND_LAYERS.items()
        if layer in tiles.ground.counts()
    ]


def _attribution(tiles: GraphTiles) -> str:
    """Whose data the tiles show: that of the graph, and that of its stations where it is somebody else's."""
    of_graph = tiles.graph.meta.attribution
    others = [source.name for source in tiles.stations.stations.sources if source.name not in of_graph]
    return "; charging stations: ".join((of_graph, ", ".join(others))) if others and len(tiles.stations) else of_graph
