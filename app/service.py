"""The use cases: requests answered on the loaded graphs and vehicles, for HTTP and command line alike."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from app.atlas import Atlas, graph_folders
from app.conversions.graph import graph_detail, graph_summary
from app.conversions.range import range_features, range_query
from app.conversions.route import route_features, route_query, route_response
from app.conversions.simulation import chain_from_numbers, simulation_of_chain, simulation_of_links, spans_from_links
from app.conversions.vehicle import inline_with_tables, vehicle_detail, vehicle_from_inline, vehicle_summary
from app.schemas.graph import GraphDetail, GraphList
from app.schemas.range import RangeFeatureCollection, RangeRequest
from app.schemas.route import RouteFeatureCollection, RouteRequest, RouteResponse
from app.schemas.simulation import SimulateRequest, SimulateResponse
from app.schemas.vehicle import InlineVehicle, VehicleChoice, VehicleDetail, VehicleList
from energy.chain import simulate_chain
from energy.errors import VehicleNotFoundError
from energy.stops import StopSettings
from energy.vehicle_files import load_vehicles
from routing.errors import GraphNotFoundError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from app.settings import Settings
    from energy.vehicle import Vehicle
    from routing.planner import Planner
    from routing.query import RouteAnswer

Asked = TypeVar("Asked", RouteRequest, RangeRequest, SimulateRequest)


class Service:
    """Graphs, vehicles and defaults of one process; answers from any thread."""

    def __init__(self, settings: Settings, folders: Mapping[str, Path] | None = None) -> None:
        found = graph_folders(settings.graph_dirs) if folders is None else folders
        self.settings = settings
        self.atlas = Atlas(found, snap_limit_m=settings.snap_limit_m, label_limit=settings.label_limit)
        self.vehicles: Mapping[str, Vehicle] = load_vehicles(settings.vehicle_dir)

    def load_all(self) -> None:
        """Load every graph and compile the kernels; raises where the defaults name nothing that is there."""
        if self.settings.default_graph not in self.atlas.names:
            raise GraphNotFoundError(self.settings.default_graph, self.atlas.names)
        self.atlas.load_all(self.known_vehicle(self.settings.default_vehicle))

    def known_vehicle(self, vehicle_id: str) -> Vehicle:
        """A vehicle by its id; raises VehicleNotFoundError."""
        if vehicle_id not in self.vehicles:
            raise VehicleNotFoundError(vehicle_id, tuple(self.vehicles))
        return self.vehicles[vehicle_id]

    def route(self, sent: RouteRequest) -> RouteResponse:
        """Routes for a request."""
        answer, understood, planner = self._answered_route(sent)
        return route_response(answer, understood, planner.graph)

    def route_as_geojson(self, sent: RouteRequest) -> RouteFeatureCollection:
        """Routes for a request, as GeoJSON."""
        answer, understood, planner = self._answered_route(sent)
        return route_features(answer, understood, planner.graph)

    def _answered_route(self, sent: RouteRequest) -> tuple[RouteAnswer, RouteRequest, Planner]:
        planner, vehicle, understood = self._understood(sent)
        return planner.route(route_query(understood, vehicle)), understood, planner

    def range(self, sent: RangeRequest) -> RangeFeatureCollection:
        """The reachable area for a request."""
        planner, vehicle, understood = self._understood(sent)
        return range_features(planner.range(range_query(understood, vehicle)), understood, planner.graph)

    def simulate(self, sent: SimulateRequest) -> SimulateResponse:
        """What driving given links takes."""
        if sent.chain is not None:
            vehicle, choice = self._vehicle(sent.vehicle)
            result = simulate_chain(
                vehicle,
                chain_from_numbers(sent.chain, StopSettings()),
                link_model=sent.link_model,
                stop_rule=sent.stops,
                arrive_stopped=sent.arrive_stopped,
            )
            return simulation_of_chain(result, sent.model_copy(update={"vehicle": choice}), vehicle)
        planner, vehicle, understood = self._understood(sent)
        spans = spans_from_links(understood.links or [], planner.graph)
        result = planner.simulate(
            spans,
            vehicle,
            link_model=understood.link_model,
            stop_rule=understood.stops,
            stop_settings=StopSettings(),
            arrive_stopped=understood.arrive_stopped,
        )
        return simulation_of_links(result, spans, understood, vehicle, planner.graph)

    def list_vehicles(self) -> VehicleList:
        """All vehicles."""
        default = self.settings.default_vehicle
        return VehicleList(vehicles=[vehicle_summary(v, default) for v in self.vehicles.values()], default=default)

    def show_vehicle(self, vehicle_id: str) -> VehicleDetail:
        """One vehicle with all its numbers."""
        return vehicle_detail(self.known_vehicle(vehicle_id))

    def list_graphs(self) -> GraphList:
        """All graphs."""
        default = self.settings.default_graph
        graphs = [graph_summary(self.atlas.planner(name).graph, default) for name in self.atlas.names]
        return GraphList(graphs=graphs, default=default)

    def show_graph(self, name: str) -> GraphDetail:
        """One graph with its extent."""
        return graph_detail(self.atlas.planner(name).graph, self.settings.default_graph)

    def _understood(self, sent: Asked) -> tuple[Planner, Vehicle, Asked]:
        """Planner and vehicle of a request, and the request with its defaults filled in."""
        vehicle, choice = self._vehicle(sent.vehicle)
        graph = sent.graph if sent.graph is not None else self.settings.default_graph
        return self.atlas.planner(graph), vehicle, sent.model_copy(update={"vehicle": choice, "graph": graph})

    def _vehicle(self, choice: VehicleChoice | None) -> tuple[Vehicle, VehicleChoice]:
        if isinstance(choice, InlineVehicle):
            default = self.known_vehicle(self.settings.default_vehicle)
            vehicle = vehicle_from_inline(choice, default)
            return vehicle, inline_with_tables(choice, vehicle)
        vehicle_id = choice if choice is not None else self.settings.default_vehicle
        return self.known_vehicle(vehicle_id), vehicle_id
