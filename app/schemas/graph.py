"""Graphs as they are listed, and what every answer says of the data it rests on."""

from __future__ import annotations

from pydantic import Field

from app.schemas.base import Answered
from routing.graph.road_graph import Terrain


class TerrainNote(Answered):
    """The graph that an answer rests on, where its heights are from, and whose data it is."""

    graph: str
    terrain: Terrain = Field(description="measured heights, made-up heights, or none (all links taken as level)")
    elevation_method: str
    smoothing_m: float = Field(description="length over which heights were smoothed along the road [m], 0 for none")
    source: str
    attribution: str
    licence: str


class GraphSummary(Answered):
    """One loaded graph."""

    name: str
    source: str
    attribution: str
    licence: str
    terrain: Terrain
    elevation_method: str
    smoothing_m: float
    bbox: tuple[float, float, float, float] = Field(description="west, south, east, north [deg]")
    node_count: int
    link_count: int = Field(description="directed links")
    default: bool = Field(description="whether requests that name no graph get this one")


class GraphList(Answered):
    """All graphs that can be asked for by name."""

    graphs: list[GraphSummary]
    default: str


class GraphFolder(Answered):
    """A folder that graphs are looked for in."""

    path: str
    exists: bool


class StoredGraphs(GraphList):
    """All graphs, as the command line lists them: with where they lie."""

    folders: list[GraphFolder] = Field(description="in the order of search; the first of a name wins")
    paths: dict[str, str] = Field(description="folder of each graph by its name")


class RoadClassLength(Answered):
    """Length of the directed links of one functional class."""

    functional_class: str
    link_count: int
    length_km: float


class CutOff(Answered):
    """A part of the map that is not connected to the graph, and a place on it."""

    link_count: int
    length_km: float = Field(description="of road, both directions once [km]")
    lat: float
    lon: float
    name: str = Field(description="of the road there, or empty")


class GraphDetail(GraphSummary):
    """One loaded graph with its extent by road class and what its import left out."""

    height_min_m: float
    height_max_m: float
    length_km: float = Field(description="all directed links")
    road_classes: list[RoadClassLength]
    dropped: dict[str, int] = Field(description="what the import left out, by reason")
    cut_off: list[CutOff] = Field(description="the longest parts of the map that are not connected to the graph")


class RefusedGraph(Answered):
    """A graph that can't be taken in."""

    name: str
    reason: str = Field(description="what is wrong with it; an earlier version of it stays in use")


class GraphsReloaded(Answered):
    """What has changed since the graphs were loaded."""

    added: list[str]
    replaced: list[str]
    removed: list[str]
    refused: list[RefusedGraph]
