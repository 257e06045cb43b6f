"""The use cases: requests answered on the loaded graphs and vehicles, for HTTP and command line alike."""

from __future__ import annotations

import gc
import logging
import secrets
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, TypeVar

from app.atlas import Atlas
from app.caches import CacheRegistry
from app.conversions.charging.plans import PlannedStops
from app.conversions.charging.query import charging_of, charging_query, charging_warnings
from app.conversions.conditions import conditions_from, vehicle_with_effects
from app.conversions.course import course_of
from app.conversions.graph import graph_detail, graph_summary
from app.conversions.matrix import matrix_query
from app.conversions.range import range_features, range_json, range_query
from app.conversions.route import route_features_json, route_json, route_query, route_response
from app.conversions.simulation import (
    chain_from_numbers,
    chain_link_error,
    simulation_answer,
    simulation_json,
    spans_from_links,
)
from app.conversions.vehicle_check import vehicle_check
from app.conversions.way_limits import area_limits, course_limits, route_limits
from app.exports.answers import RANGE_FILES, ROUTE_FILES
from app.exports.content import RangeContent, RouteContent
from app.observation import INLINE, Stage, note_labels, note_subject, stage
from app.schemas.drive import DriveRequest
from app.schemas.graph import GraphDetail, GraphList, GraphsReloaded, RefusedGraph
from app.schemas.lean.formats import AnswerFormat
from app.schemas.matrix import MatrixRequest, MatrixResponse
from app.schemas.range import RangeFeatureCollection, RangeRequest
from app.schemas.route import RouteRequest, RouteResponse
from app.schemas.simulation import SimulateRequest, SimulateResponse
from app.schemas.vehicles.check import VehicleChecks
from app.service.driving import drive, profiles, warm_up
from app.service.fleet import Fleet
from app.service.found import FoundRoutes
from app.service.graph_choice import graph_for
from app.service.learned import LearnedEffectsShelf, warnings_of, warnings_of_way
from app.service.matrices import MatrixWork, check_places
from app.service.places import Places
from app.sharing.sources import GraphsOnDisk, folders_on_disk
from app.stations.features import GraphStations
from app.store.database import Database
from app.store.diagnoses import LearnedEffectsStore
from app.store.errors import DatabaseUnavailableError
from app.store.vehicles import VehicleStore
from app.tiles.shelf import TileShelf
from energy.errors import LinkError
from energy.stops import USUAL_STOPS
from energy.vehicle.files import load_published, load_vehicles
from routing.errors import GraphNotFoundError
from routing.graph.folders import graph_folders
from routing.stations.names import StationNames

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from app.conversions.course import Course, DrivenCourse
    from app.conversions.way_limits import WayLimits
    from app.schemas.learned_effects import LearnedEffects
    from app.schemas.simulation import SimulationModel
    from app.schemas.vehicles.answer import AnyVehicleDetail, VehicleList
    from app.schemas.vehicles.services import NewVehicle
    from app.schemas.vehicles.vehicle import VehicleChoice
    from app.settings import Settings
    from app.sharing.sources import GraphSource, Reloaded
    from energy.chain.profile import SpeedProfile
    from energy.vehicle.files import AnyVehicle
    from routing.graph.road_graph import RoadGraph
    from routing.planner import Planner
    from routing.queries import RouteQuery
    from routing.range.bands import RangeAnswer
    from routing.route.route import RouteAnswer

LOG = logging.getLogger(__name__)
RUN_NAME_BYTES: Final = 6

Asked = TypeVar("Asked", bound=DriveRequest)


@dataclass(frozen=True, slots=True)
class ChosenVehicle:
    """The vehicle of a request with the effects that apply, how it was chosen, and what is to be said of them."""

    vehicle: AnyVehicle
    choice: VehicleChoice
    effects: LearnedEffects | None
    warnings: tuple[str, ...]

    def warnings_on(self, limits: Callable[[], WayLimits | None]) -> tuple[str, ...]:
        """The warnings, with those of ways that are faster or steeper than what effects were learned on.

        limits: of the ways; asked for only where it is known what the effects were learned from.
        """
        if self.effects is None or self.effects.learned_from is None:
            return self.warnings
        return (*self.warnings, *warnings_of_way(self.effects, limits()))


def new_run_name() -> str:
    """A name that no other run of a service has."""
    return secrets.token_hex(RUN_NAME_BYTES)


class Service:
    """Graphs, vehicles and defaults of one process; answers from any thread.

    graphs: where they come from, or the folder of each by its name; without it, they come from those of the settings.
    run_name: that of this run of the service, which all its processes share; without it, one of this process alone.
    """

    def __init__(
        self, settings: Settings, graphs: GraphSource | Mapping[str, Path] | None = None, run_name: str | None = None
    ) -> None:
        self.settings = settings
        self.run_name = run_name or new_run_name()
        if graphs is None:
            graphs = GraphsOnDisk(lambda: graph_folders(settings.graph_dirs))
        self.atlas = Atlas(
            folders_on_disk(graphs) if isinstance(graphs, Mapping) else graphs,
            snap_limit_m=settings.snap_limit_m,
            label_limit=settings.label_limit,
            cache_limit_bytes=settings.cache_limit_bytes,
        )
        self.tiles = TileShelf(self.atlas)
        self.caches = CacheRegistry()
        self.caches.add(self.tiles.cache_figures)
        self.caches.add(self.atlas.cache_figures)
        self.vehicles: Mapping[str, AnyVehicle] = load_vehicles(settings.vehicle_dir)  # the bundled ones
        named = "database_url" in settings.model_fields_set
        self.database = Database(settings.database_url, named=named, create=settings.database_create)
        self.fleet = Fleet(self.vehicles, VehicleStore(self.database), settings.default_vehicle)
        self.learned = LearnedEffectsShelf(LearnedEffectsStore(self.database))
        self._station_names: dict[str, StationNames] = {}
        self.places = Places(self.atlas, settings)

    def load_all(self) -> None:
        """Load every graph, compile the kernels and bring the database up to date.

        Raises where the defaults name nothing that is there. Without its database the service starts all the same,
        on the bundled vehicles, and looks for it again when one of the others is asked for.
        """
        if self.settings.default_graph not in self.atlas.names:
            raise GraphNotFoundError(self.settings.default_graph, self.atlas.names)
        try:
            self.database.open()
        except DatabaseUnavailableError as error:
            LOG.warning("%s", error)
        default = self.known_vehicle(self.settings.default_vehicle)
        self.atlas.load_all(default)
        warm_up(default)
        self.tiles.warm_up(self.settings.default_graph)

    def reload_graphs(self) -> GraphsReloaded:
        """Take in graphs that were added, replaced or removed on disk; raises as Atlas.reload does."""
        return reloaded_answer(self.take_in())

    def take_in(self) -> Reloaded:
        """What the graphs' source has changed, which is answered on from now on; raises as Atlas.reload does."""
        default = self.settings.default_graph
        changed = self.atlas.reload(self.known_vehicle(self.settings.default_vehicle), default)
        LOG.info("graphs reloaded: %s", changed)
        if old := changed.replaced + changed.removed:
            self.tiles.forget(old)
            for name in old:
                self._station_names.pop(name, None)
            # what is answered on no more lies in circles, which a server has told the collector to leave alone
            gc.unfreeze()
            gc.collect()
            gc.freeze()
        return changed

    def close(self) -> None:
        """Close what is open of the database."""
        self.database.close()

    def known_vehicle(self, vehicle_id: str) -> AnyVehicle:
        """A vehicle by its id; raises VehicleNotFoundError."""
        return self.fleet.vehicle(vehicle_id)

    def route(self, sent: RouteRequest) -> RouteResponse:
        """Routes for a request."""
        return route_response(*self._answered_route(sent))

    def route_json(self, sent: RouteRequest) -> bytes:
        """Routes for a request, as the JSON of what `route` returns."""
        answered = self._answered_route(sent)
        with stage(Stage.WRITE):
            return route_json(*answered)

    def route_geojson(self, sent: RouteRequest) -> bytes:
        """Routes for a request, as the JSON of a RouteFeatureCollection."""
        answered = self._answered_route(sent)
        with stage(Stage.WRITE):
            return route_features_json(*answered)

    def route_in(self, form: AnswerFormat, sent: RouteRequest) -> bytes:
        """Routes for a request in a format."""
        if form is AnswerFormat.JSON:
            return self.route_json(sent)
        if form is AnswerFormat.GEOJSON:
            return self.route_geojson(sent)
        content = RouteContent(*self._answered_route(sent))
        with stage(Stage.WRITE):
            return ROUTE_FILES[form](content)

    def found_routes(self, sent: RouteRequest) -> FoundRoutes:
        """Routes for a request, to be written in another form."""
        return FoundRoutes(*self._answered_route(sent))

    def _answered_route(self, sent: RouteRequest) -> tuple[RouteAnswer, RouteRequest, RoadGraph, PlannedStops | None]:
        with stage(Stage.SEARCH if sent.charging is None else Stage.PLAN):
            return self._found_route(sent)

    def _found_route(self, sent: RouteRequest) -> tuple[RouteAnswer, RouteRequest, RoadGraph, PlannedStops | None]:
        planner, chosen, understood = self._understood(self.places.in_place_of_texts(sent))
        query = route_query(understood, chosen.vehicle)
        planned: PlannedStops | None = None
        notes: tuple[str, ...] = ()
        if understood.charging is None:
            answer = planner.route(query)
        else:
            answer, planned, planner = self._planned(understood, query)
            notes = charging_warnings(charging_of(chosen.vehicle, understood), understood)
            note_labels(planned.stats.labels_settled)
        note_labels(sum(stats.labels_settled for stats in answer.stats))
        warnings = chosen.warnings_on(lambda: route_limits(answer.routes, chosen.vehicle, query.conditions))
        answer = replace(answer, warnings=(*warnings, *notes, *answer.warnings))
        return answer, understood, planner.graph, planned

    def _planned(self, understood: RouteRequest, query: RouteQuery) -> tuple[RouteAnswer, PlannedStops, Planner]:
        """Routes with the charging stops that a request asks for, and the planner that they are from."""
        assert understood.graph is not None
        planner, index, _ = self.atlas.planner_with_stations(understood.graph)
        names = self._station_names.get(understood.graph)
        if names is None or names.stations is not index.stations:
            names = self._station_names[understood.graph] = StationNames(understood.graph, index.stations)
        charging = charging_of(query.vehicle, understood)
        asked = charging_query(understood, charging, names)
        answer, charged = planner.journey(query, asked, charging, index.stations.stations)
        return answer, PlannedStops(charged.plans, charged.no_plan, charged.stats, names.sources), planner

    def matrix(self, sent: MatrixRequest) -> MatrixResponse:
        """All drives from sources to targets, on this thread alone."""
        work = self.matrix_work(sent)
        return work.whole([work.part(idx) for idx in range(work.part_count)])

    @stage(Stage.SEARCH)
    def matrix_work(self, sent: MatrixRequest) -> MatrixWork:
        """All drives from sources to targets, ready to be searched row by row."""
        check_places(sent, self.settings.matrix_limit_places)
        planner, chosen, understood = self._understood(sent)
        search = planner.matrix(matrix_query(understood, chosen.vehicle))
        return MatrixWork(search, understood, planner.graph, chosen.warnings)

    def range(self, sent: RangeRequest) -> RangeFeatureCollection:
        """The reachable area for a request."""
        return range_features(*self._answered_range(sent))

    def range_json(self, sent: RangeRequest) -> bytes:
        """The reachable area for a request, as the JSON of what `range` returns."""
        answer, understood, graph = self._answered_range(sent)
        with stage(Stage.WRITE):
            return range_json(answer, understood, graph)

    def range_in(self, form: AnswerFormat, sent: RangeRequest) -> bytes:
        """The reachable area for a request in one of RANGE_FORMATS."""
        if form is AnswerFormat.GEOJSON:
            return self.range_json(sent)
        content = RangeContent(*self._answered_range(sent))
        with stage(Stage.WRITE):
            return RANGE_FILES[form](content)

    @stage(Stage.SEARCH)
    def _answered_range(self, sent: RangeRequest) -> tuple[RangeAnswer, RangeRequest, RoadGraph]:
        planner, chosen, understood = self._understood(self.places.in_place_of_texts(sent))
        query = range_query(understood, chosen.vehicle)
        answer = planner.range(query)
        note_labels(answer.stats.labels_settled)
        area = answer.bands[0].area
        warnings = chosen.warnings_on(lambda: area_limits(area, planner.graph, chosen.vehicle, query.conditions))
        return replace(answer, warnings=(*warnings, *answer.warnings)), understood, planner.graph

    def simulate(self, sent: SimulateRequest) -> SimulateResponse:
        """What driving given links takes."""
        return simulation_answer(*self._driven(sent))

    def simulate_json(self, sent: SimulateRequest) -> bytes:
        """What driving given links takes, as the JSON of what `simulate` returns."""
        driven = self._driven(sent)
        with stage(Stage.WRITE):
            return simulation_json(*driven)

    @stage(Stage.SEARCH)
    def _driven(self, sent: SimulateRequest) -> tuple[DrivenCourse, Course, SimulateRequest]:
        course, understood = self._course(sent)
        with _links_as_sent(sent):
            return drive(course, understood), course, understood

    def speed_drawing(self, sent: SimulateRequest) -> tuple[Course, dict[SimulationModel, SpeedProfile]]:
        """The course of a simulation, and the speed along it by both models as far as they can drive it."""
        course, understood = self._course(sent)
        with _links_as_sent(sent):
            return course, profiles(course, understood)

    def _course(self, sent: SimulateRequest) -> tuple[Course, SimulateRequest]:
        """What is to be driven, and the request with its defaults filled in."""
        if sent.chain is not None:
            chosen = self._vehicle_with_effects(sent)
            chain = chain_from_numbers(sent.chain, USUAL_STOPS)
            course = course_of(chain, chosen.vehicle, sent)
            warned = replace(course, warnings=chosen.warnings_on(lambda: course_limits(course)))
            return warned, sent.model_copy(update={"vehicle": chosen.choice})
        planner, chosen, understood = self._understood(sent)
        spans = spans_from_links(understood.links or [], planner.graph)
        chain = planner.chain(spans, USUAL_STOPS, conditions_from(understood.conditions))
        course = course_of(chain, chosen.vehicle, sent, spans, planner.graph)
        return replace(course, warnings=chosen.warnings_on(lambda: course_limits(course))), understood

    def list_vehicles(self) -> VehicleList:
        """All vehicles; without the database the bundled ones, with a warning."""
        return self.fleet.list(needs_store=False)

    def show_vehicle(self, vehicle_id: str) -> AnyVehicleDetail:
        """One vehicle with all its numbers."""
        return self.fleet.detail(vehicle_id)

    def put_vehicle(self, vehicle_id: str, sent: NewVehicle) -> tuple[AnyVehicleDetail, bool]:
        """Store a vehicle; its numbers, and whether there was none of this id."""
        return self.fleet.put(vehicle_id, sent)

    def remove_vehicle(self, vehicle_id: str) -> None:
        """Remove a stored vehicle."""
        self.fleet.remove(vehicle_id)

    def check_vehicles(self, vehicle_ids: Sequence[str]) -> VehicleChecks:
        """Vehicles on driving cycles beside what their files say is published; without ids, all that can be read."""
        chosen = vehicle_ids or [line.id for line in self.fleet.list().vehicles]
        checks = []
        for vehicle_id in chosen:
            path = self.settings.vehicle_dir / f"{vehicle_id}.toml"
            published = load_published(path) if vehicle_id in self.vehicles else None
            checks.append(vehicle_check(self.known_vehicle(vehicle_id), published))
        return VehicleChecks(vehicles=checks)

    def list_graphs(self) -> GraphList:
        """All graphs."""
        default = self.settings.default_graph
        graphs = [graph_summary(self.atlas.planner(name).graph, default) for name in self.atlas.names]
        return GraphList(graphs=graphs, default=default)

    def show_graph(self, name: str) -> GraphDetail:
        """One graph with its extent."""
        return graph_detail(self.atlas.planner(name).graph, self.settings.default_graph)

    def stations(self, name: str) -> GraphStations:
        """The stations of one graph; raises GraphNotFoundError, and GraphFormatError where they can't be read."""
        _, index, version = self.atlas.planner_with_stations(name)
        return GraphStations(name, version, index)

    def _understood(self, sent: Asked) -> tuple[Planner, ChosenVehicle, Asked]:
        """Planner and vehicle of a request, and the request with its defaults filled in."""
        chosen = self._vehicle_with_effects(sent)
        graph = graph_for(sent, self.atlas, self.settings.default_graph, self.settings.snap_limit_m)
        understood = sent.model_copy(update={"vehicle": chosen.choice, "graph": graph})
        planner = self.atlas.planner(graph)
        note_subject(graph=graph)  # which is one that exists
        return planner, chosen, understood

    def _vehicle_with_effects(self, sent: DriveRequest) -> ChosenVehicle:
        """The vehicle of a request with the effects that it asks for."""
        vehicle, choice = self.chosen_vehicle(sent.vehicle)
        note_subject(vehicle=choice if isinstance(choice, str) else INLINE)
        effects = self.learned.chosen(sent.effects)
        ambient_c = None if sent.conditions is None else sent.conditions.ambient_c
        warnings = warnings_of(effects, vehicle.id, ambient_c)
        return ChosenVehicle(vehicle_with_effects(vehicle, effects), choice, effects, warnings)

    def chosen_vehicle(self, choice: VehicleChoice | None) -> tuple[AnyVehicle, VehicleChoice]:
        """The vehicle of a choice, the default one without; raises VehicleNotFoundError or VehicleError."""
        if choice is not None and not isinstance(choice, str):
            return self.fleet.from_sent(choice)
        vehicle_id = choice if choice is not None else self.settings.default_vehicle
        return self.known_vehicle(vehicle_id), vehicle_id


def reloaded_answer(changed: Reloaded) -> GraphsReloaded:
    """What a reload has changed, as it is answered."""
    return GraphsReloaded(
        added=list(changed.added),
        replaced=list(changed.replaced),
        removed=list(changed.removed),
        refused=[RefusedGraph(name=name, reason=reason) for name, reason in changed.refused.items()],
    )


@contextmanager
def _links_as_sent(sent: SimulateRequest) -> Iterator[None]:
    """Within it, an error of a link of a chain by numbers names what was sent."""
    try:
        yield
    except LinkError as error:
        if sent.chain is None:
            raise
        raise chain_link_error(error, sent.chain) from error
