"""From a real map to an answer: import on the command line, the server over a socket, and its answers held together."""

from __future__ import annotations

import itertools
import json
import os
import socket
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
import uvicorn
from typer.testing import CliRunner

from app.cli.main import cli
from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from energy.chain.chain import LinkModel, StopRule
from energy.stops import StopSettings
from energy.units import JOULE_PER_WH
from routing.graph.snap import RoadIndex
from routing.places import LinkPosition, Point
from routing.queries import RouteQuery
from routing.search.found import Limits
from routing.search.search import find_path, reach
from routing.search.space import search_space
from routing.search.workspaces import WorkspacePool
from routing.weights import ECO

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

pytestmark = pytest.mark.shared_data

REPOSITORY = Path(__file__).resolve().parents[2]
MAPS = REPOSITORY.parent / "shared/data/maps"
VEHICLE = "hyundai-kona-64"
SOC = 0.04  # reaches about 60 % of the nodes from the capital
CENTRE = {"lat": 42.5063, "lon": 1.5218}  # Andorra la Vella
NORTH = {"lat": 42.5836, "lon": 1.6425}
SAMPLE = 300
SEED = 20240607


@dataclass(frozen=True)
class Served:
    """The running server, and the service behind it."""

    address: str
    service: Service

    def ask(self, path: str, body: Any = None, accept: str = "application/json", **query: Any) -> Any:
        """An answer, read as JSON."""
        url = f"{self.address}{path}" + (f"?{urllib.parse.urlencode(query)}" if query else "")
        data = None if body is None else json.dumps(body).encode()
        headers = {"accept": accept, "content-type": "application/json"}
        request = urllib.request.Request(url, data, headers)
        with urllib.request.urlopen(request, timeout=60) as response:
            return json.load(response)

    def refused(self, path: str, body: Any) -> tuple[int, Any]:
        """Status and problem of a request that is refused."""
        with pytest.raises(urllib.error.HTTPError) as refusal:
            self.ask(path, body)
        with refusal.value as response:
            return response.code, json.load(response)


@pytest.fixture(scope="module")
def graph_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the graph `andorra`, imported on the command line."""
    if not MAPS.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"no real maps in {MAPS}: CI must have them")
        pytest.skip("no real maps beside the repository (shared/data/maps)")
    folder = tmp_path_factory.mktemp("graphs")
    arguments = ["import", MAPS / "andorra.osm.pbf", "--dem", MAPS / "N42E001.hgt.zip", "--out", folder / "andorra"]
    result = CliRunner().invoke(cli, [str(a) for a in arguments])
    assert result.exit_code == 0, result.output
    assert [p.name for p in folder.iterdir()] == ["andorra"]
    return folder


@pytest.fixture(scope="module")
def served(graph_dir: Path) -> Iterator[Served]:
    """The application on a free port of this machine."""
    settings = Settings(graph_dirs=(graph_dir,), vehicle_dir=REPOSITORY / "data/vehicles", default_graph="andorra")
    service = Service(settings)
    service.load_all()
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    config = uvicorn.Config(create_app(settings, service), log_level="warning", ws="none")
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
    thread.start()
    deadline = time.monotonic() + 60.0
    while not server.started and thread.is_alive() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert server.started
    yield Served(f"http://127.0.0.1:{listener.getsockname()[1]}", service)
    server.should_exit = True
    thread.join(timeout=30.0)
    listener.close()


def route_body(start: Any = None, goal: Any = None, **changes: Any) -> dict[str, Any]:
    return {"start": start or CENTRE, "goal": goal or NORTH, "soc": 0.5, "vehicle": VEHICLE} | changes


def test_server_on_imported_map_is_ready_and_lists_it(served: Served) -> None:
    assert served.ask("/readyz")
    (graph,) = served.ask("/graphs")["graphs"]
    assert graph["name"] == "andorra"


def test_route_over_a_socket_has_charge_at_every_link(served: Served) -> None:
    answer = served.ask("/route", route_body(alternatives=["eco", "fastest", "balanced"]))
    assert [route["name"] for route in answer["routes"]] == ["eco", "fastest", "balanced"]
    for route in answer["routes"]:
        assert route["feasible"]
        assert 10_000.0 < route["distance_m"] < 40_000.0
        charge = [route["soc_start"], *(link["soc_end"] for link in route["links"])]
        energy_wh = [link["energy_wh"] for link in route["links"]]
        capacity_wh = served.service.vehicles[VEHICLE].usable_capacity_wh
        np.testing.assert_allclose(-np.diff(charge) * capacity_wh, energy_wh, atol=1e-6)
        assert route["soc_end"] == charge[-1]
        assert route["soc_min"] == min(charge)
        assert sum(energy_wh) / 1000.0 == pytest.approx(route["energy_kwh"], rel=1e-9)
        assert sum(route["energy_parts_kwh"].values()) == pytest.approx(route["energy_kwh"], rel=1e-9)
        ids = [link["id"] for link in route["links"]]
        graph = served.service.atlas.planner("andorra").graph
        assert all(b in graph.successors(a) for a, b in itertools.pairwise(ids))


def test_answers_on_measured_terrain_name_it_and_its_smoothing(served: Served) -> None:
    simulation = {"links": [{"id": 0}], "vehicle": VEHICLE}
    for answer in (
        served.ask("/route", route_body()),
        served.ask("/range", lat=CENTRE["lat"], lon=CENTRE["lon"], soc=SOC),
        served.ask("/simulate", simulation),
    ):
        assert answer["terrain"]["terrain"] == "measured"
        assert answer["terrain"]["smoothing_m"] == 300.0
        assert "smoothed over 300 m along the road" in answer["terrain"]["elevation_method"]
        assert not [warning for warning in answer["warnings"] if "terrain" in warning]


@pytest.mark.parametrize("stops", ["expected", "counted", "none"])
@pytest.mark.parametrize("link_model", ["integrated", "printed"])
def test_simulation_of_returned_links_equals_the_route(served: Served, link_model: str, stops: str) -> None:
    rng = np.random.default_rng(SEED)
    graph = served.service.atlas.planner("andorra").graph
    for start, goal in rng.choice(graph.node_count, (8, 2), replace=False):
        ends = [{"lat": float(graph.node_lat_deg[n]), "lon": float(graph.node_lon_deg[n])} for n in (start, goal)]
        asked = {"link_model": link_model, "stops": stops, "soc": 0.9, "vehicle": VEHICLE}
        (route,) = served.ask("/route", route_body(*ends, **asked))["routes"]
        links = [{key: link[key] for key in ("id", "from_m", "to_m")} for link in route["links"]]
        answer = served.ask("/simulate", {"links": links, **asked})
        total = sum(link["energy_wh"] for link in answer["links"]) / 1000.0
        assert total == pytest.approx(route["energy_kwh"], rel=1e-9)
        assert answer["energy_kwh"] == pytest.approx(route["energy_kwh"], rel=1e-9)
        assert answer["duration_s"] == pytest.approx(route["duration_s"], rel=1e-9)
        assert answer["distance_m"] == pytest.approx(route["distance_m"], rel=1e-9)
        assert answer["soc_end"] == pytest.approx(route["soc_end"], rel=1e-9)
        assert answer["braked_away_kwh"] == pytest.approx(route["braked_away_kwh"], rel=1e-9, abs=1e-12)


def test_route_as_geojson_is_a_valid_line_between_the_snapped_ends(served: Served) -> None:
    answer = served.ask("/route", route_body(), accept="application/geo+json")
    assert answer["type"] == "FeatureCollection"
    line, start, goal = answer["features"]
    assert line["geometry"]["type"] == "LineString"
    shape = shapely.from_geojson(json.dumps(line["geometry"]))
    assert shape.is_valid
    # both ends lie on the snapped places: 1e-6 degrees are 0.1 m
    for feature, end in ((start, 0), (goal, -1)):
        assert feature["geometry"]["type"] == "Point"
        assert shapely.Point(shape.coords[end]).distance(shapely.Point(feature["geometry"]["coordinates"])) < 1e-6
    lon, lat = np.radians(np.array(shape.coords).T)
    length_m = 6_371_008.8 * np.hypot(np.diff(lon) * np.cos(lat[:-1]), np.diff(lat)).sum()
    assert length_m == pytest.approx(line["properties"]["distance_m"], rel=0.005)


def test_range_over_a_socket_is_valid_geojson_with_nested_bands(served: Served) -> None:
    answer = served.ask("/range", lat=CENTRE["lat"], lon=CENTRE["lon"], soc=SOC, vehicle=VEHICLE, bands=4)
    *bands, origin = answer["features"]
    assert answer["type"] == "FeatureCollection"
    assert [band["properties"]["soc_left"] for band in bands] == pytest.approx([0.0, 0.01, 0.02, 0.03])
    shapes = []
    for band in bands:
        assert band["geometry"]["type"] == "MultiPolygon"
        for polygon in band["geometry"]["coordinates"]:
            for k, ring in enumerate(polygon):
                assert ring[0] == ring[-1]
                assert len(ring) >= 4
                assert shapely.LinearRing(ring).is_ccw == (k == 0)
        shapes.append(shapely.from_geojson(json.dumps(band["geometry"])))
        assert shapes[-1].is_valid
        assert shapes[-1].contains(shapely.Point(origin["geometry"]["coordinates"]))
    for outer, inner in itertools.pairwise(shapes):
        assert inner.difference(outer.buffer(2e-6)).is_empty
        assert inner.area < outer.area


def test_range_at_full_charge_says_that_andorra_ends(served: Served) -> None:
    for trip in ({}, {"reverse": "true"}, {"round_trip": "true"}):
        answer = served.ask("/range", lat=CENTRE["lat"], lon=CENTRE["lon"], soc=1.0, vehicle=VEHICLE, **trip)
        said = answer["features"][0]["properties"]
        assert said["reaches_map_edge"] is True
        assert said["map_edge_left_kwh"] > 50.0
        assert said["road_nearest_km"] is None
        assert len([text for text in answer["warnings"] if "map ends" in text]) == 1


def test_range_that_just_reaches_a_border_ends_with_the_map_there_alone(served: Served) -> None:
    answer = served.ask("/range", lat=CENTRE["lat"], lon=CENTRE["lon"], soc=0.1, vehicle=VEHICLE)
    said = answer["features"][0]["properties"]
    assert said["reaches_map_edge"] is True
    assert 0.0 < said["map_edge_left_kwh"] < 6.4
    edge = shapely.from_geojson(json.dumps(said["map_edge"]))
    outline = shapely.from_geojson(json.dumps(answer["features"][0]["geometry"])).boundary
    assert edge.within(outline.buffer(2e-7))
    assert 0.0 < edge.length < 0.2 * outline.length
    assert any("roads that it cuts off" in text for text in answer["warnings"])
    nothing = served.ask("/range", lat=CENTRE["lat"], lon=CENTRE["lon"], soc=0.005, vehicle=VEHICLE)
    assert nothing["features"][0]["properties"]["reaches_map_edge"] is False
    assert not [text for text in nothing["warnings"] if "map" in text]


def test_post_range_equals_get_range(served: Served) -> None:
    got = served.ask("/range", lat=CENTRE["lat"], lon=CENTRE["lon"], soc=SOC, bands="0.0,0.02")
    posted = served.ask("/range", {"origin": CENTRE, "soc": SOC, "bands": [0.0, 0.02]})
    assert got["features"] == posted["features"]


@pytest.mark.parametrize(
    ("goal", "status", "code"),
    [
        ({"lat": 48.85, "lon": 2.35}, 404, "point_outside_map"),
        ({"lat": 42.62, "lon": 1.43}, 404, "point_far_from_road"),
    ],
)
def test_goal_off_the_map_or_off_the_road_is_refused(served: Served, goal: Any, status: int, code: str) -> None:
    got, problem = served.refused("/route", route_body(goal=goal))
    assert (got, problem["status"], problem["code"]) == (status, status, code)
    (error,) = problem["errors"]
    assert error["field"] == "goal"
    assert error["value"] == goal
    assert error["allowed"]


def sampled_nodes(served: Served) -> list[int]:
    count = served.service.atlas.planner("andorra").graph.node_count
    return sorted(np.random.default_rng(SEED).choice(count, SAMPLE, replace=False).tolist())


def test_sampled_nodes_inside_the_range_are_reachable_and_outside_are_not(
    served: Served, record_property: Callable[[str, object], None]
) -> None:
    answer = served.ask("/range", lat=CENTRE["lat"], lon=CENTRE["lon"], soc=SOC, vehicle=VEHICLE)
    area = shapely.from_geojson(json.dumps(answer["features"][0]["geometry"]))
    graph = served.service.atlas.planner("andorra").graph
    inside = outside = false_in = false_out = 0
    for node in sampled_nodes(served):
        lat, lon = float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node])
        covered = area.contains(shapely.Point(lon, lat))
        body = route_body(goal={"lat": lat, "lon": lon}, soc=SOC, links=False)
        (route,) = served.ask("/route", body)["routes"]
        inside += covered
        outside += not covered
        false_in += covered and not route["feasible"]
        false_out += route["feasible"] and not covered
    record_property(
        "measured",
        f"/range against /route on {SAMPLE} nodes, {inside / SAMPLE:.0%} inside: "
        f"false-in {false_in} ({false_in / inside:.2%}), false-out {false_out} ({false_out / outside:.2%})",
    )
    assert 0.3 * SAMPLE <= inside <= 0.7 * SAMPLE
    assert false_in <= 0.03 * inside
    assert false_out <= 0.03 * outside


def test_sampled_nodes_reached_by_the_search_are_those_that_routes_reach(served: Served) -> None:
    planner = served.service.atlas.planner("andorra")
    graph, car = planner.graph, served.service.vehicles[VEHICLE]
    capacity_j = car.usable_capacity_wh * JOULE_PER_WH
    limits = Limits(-(1.0 - SOC) * capacity_j, SOC * capacity_j)
    space = search_space(graph, car, LinkModel.INTEGRATED, StopRule.EXPECTED, StopSettings())
    pool, roads = WorkspacePool(graph.link_count), RoadIndex(graph)
    origin, starts = roads.snap("origin", Point(CENTRE["lat"], CENTRE["lon"]), 1000.0)
    reached = reach(space, pool, limits, starts, graph.head, graph.node_count)
    incoming: dict[int, list[int]] = {}
    for link, head in enumerate(graph.head.tolist()):
        incoming.setdefault(head, []).append(link)

    def energy_to(positions: Any) -> float:
        path, _ = find_path(space, pool, ECO, limits, starts, positions)
        return np.inf if path is None else path.energy_j

    elsewhere = 0
    for node in sampled_nodes(served):
        ends = {link: LinkPosition(link, float(graph.length_m[link])) for link in incoming[node]}
        energy_j = energy_to(tuple(ends.values()))
        # one search to all and one to the ends of all links into the node: the same energy, the same answer
        assert reached.node_energy_j[node] == pytest.approx(energy_j, rel=1e-9)
        place = Point(float(graph.node_lat_deg[node]), float(graph.node_lon_deg[node]))
        goal, goals = roads.snap("goal", place, 1000.0)
        query = RouteQuery(origin.asked, place, SOC, car)
        route = planner.route(query).routes[0]
        # what a route answers is what the search says of the very positions that the place was snapped to
        assert route.feasible == np.isfinite(energy_to(goals))
        assert goal.distance_m < 0.02
        if route.feasible == np.isfinite(energy_j):
            continue
        # the place is met 10 mm from the node on one of its links: where the answers differ, that link can't be
        # driven to its end with this charge, though another link into the node can
        elsewhere += 1
        assert np.isfinite(energy_j)
        ending = [
            ends[p.link_idx] for p in goals if p.link_idx in ends and p.offset_m > 0.5 * ends[p.link_idx].offset_m
        ]
        assert not np.isfinite(energy_to(ending))
    assert elsewhere <= 0.02 * SAMPLE
