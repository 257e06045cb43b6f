"""A road network to ask."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from energy.folders import bundled_folder, user_graphs_folder
from routing.errors import GraphNotFoundError, QueryError
from routing.graph.files import load_graph
from routing.graph.folders import graph_folders
from routing.planner import Planner
from routing.stations.files import NO_STATIONS, load_stations
from routing.stations.names import StationNames

if TYPE_CHECKING:
    from routing.graph.road_graph import GraphMeta
    from routing.stations.station import Stations


class Graph:
    """A road network with its planner and its charging stations; frozen, and safe to share between threads."""

    def __init__(self, planner: Planner, stations: Stations = NO_STATIONS) -> None:
        self.planner = planner
        self.stations = stations
        self.station_names = StationNames(planner.graph.meta.name, stations)

    @classmethod
    def load(cls, graph: str | Path, *, snap_limit_m: float = 1000.0) -> Graph:
        """A stored graph by its name or its folder, with the stations beside it.

        Names are looked for among the user's own graphs, then among those that come with joulepath. snap_limit_m: the
        farthest road that a place is moved to, above 0. Raises GraphNotFoundError, GraphFormatError or QueryError.
        """
        if not snap_limit_m > 0.0:
            raise QueryError("snap_limit_m", snap_limit_m, "above 0")
        folder = Path(graph)
        if not (isinstance(graph, Path) or len(folder.parts) > 1 or (folder / "meta.json").is_file()):
            known = cls.stored()
            if str(graph) not in known:
                raise GraphNotFoundError(str(graph), tuple(known))
            folder = known[str(graph)]
        elif not os.path.isfile(folder / "meta.json"):
            raise GraphNotFoundError(str(graph), tuple(cls.stored()))
        roads = load_graph(folder)
        return cls(Planner(roads, snap_limit_m=snap_limit_m), load_stations(folder, roads))

    @staticmethod
    def stored() -> dict[str, Path]:
        """The folder of each graph that `load` finds by its name."""
        return graph_folders((user_graphs_folder(), bundled_folder("data", "graphs")))

    @property
    def meta(self) -> GraphMeta:
        """Its name, whose data it is under which licence, where its heights are from, and its extent."""
        return self.planner.graph.meta

    @property
    def name(self) -> str:
        """Its name."""
        return self.meta.name

    @property
    def node_count(self) -> int:
        """Nodes."""
        return self.planner.graph.node_count

    @property
    def link_count(self) -> int:
        """Directed links."""
        return self.planner.graph.road_link_count

    @property
    def station_count(self) -> int:
        """Charging stations."""
        return len(self.stations.stations)

    def __repr__(self) -> str:
        return f"<Graph {self.name!r}: {self.node_count} nodes, {self.link_count} links>"
