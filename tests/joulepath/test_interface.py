"""The Python interface: the figures of the planner in human units, frozen, and ready for the map."""

from __future__ import annotations

import dataclasses
import pickle
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from shapely.geometry import shape

import joulepath
from energy.errors import ConditionsError, LinkError, VehicleError, VehicleNotFoundError
from energy.vehicle.files import load_vehicle
from joulepath import Conditions, Graph, LinkSpan, ParetoSettings, Vehicle, Weights
from routing.errors import GraphNotFoundError, PointOutsideMapError, QueryError
from routing.graph.files import save_graph
from routing.graph.road_graph import Terrain
from routing.places import Point
from routing.planner import Planner
from routing.queries import RouteQuery
from tests.app.conftest import VEHICLES, street_grid
from tests.app.recorded import write_winter
from tests.app.street_drives import write_street_drive

if TYPE_CHECKING:
    from collections.abc import Callable

START, GOAL = (46.5, 8.003), (46.518, 8.02)
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def grid() -> Graph:
    return Graph(Planner(street_grid("grid", Terrain.SYNTHETIC)))


@pytest.fixture(scope="module")
def leaf() -> Vehicle:
    return Vehicle.load("nissan-leaf")


@pytest.fixture(scope="module")
def routes(grid: Graph, leaf: Vehicle) -> joulepath.Routes:
    return joulepath.route(
        grid, leaf, start=START, goal=GOAL, via=[(46.51, 8.01)], soc_frac=0.5, alternatives=("eco", "fastest")
    )


def test_route_has_the_figures_of_the_planner(grid: Graph, leaf: Vehicle) -> None:
    (route,) = joulepath.route(grid, leaf, start=START, goal=GOAL, soc_frac=0.4)
    query = RouteQuery(Point(*START), Point(*GOAL), 0.4, load_vehicle(VEHICLES / "nissan-leaf.toml"))
    (found,) = grid.planner.route(query).routes
    assert route.energy_kwh == found.energy_j / 3.6e6
    assert (route.distance_m, route.duration_s) == (found.distance_m, found.duration_s)
    assert route.soc_end_frac == found.soc_end_frac
    assert sum(route.energy_parts.values()) == pytest.approx(route.energy_kwh, rel=1e-12)
    assert route.links.link_idx.tolist() == found.links.link_idx
    assert route.links.energy_wh.sum() / 1000.0 == pytest.approx(route.energy_kwh, rel=1e-12)


def test_routes_are_a_sequence_in_the_order_of_the_alternatives(routes: joulepath.Routes) -> None:
    eco, fastest = routes
    assert [eco.name, fastest.name] == ["eco", "fastest"]
    assert eco.energy_kwh <= fastest.energy_kwh
    assert len(eco.legs) == 2
    assert len(routes.via) == 1
    assert "synthetic" in routes.warnings[0]


def test_own_weights_and_pareto_set_are_answered(grid: Graph, leaf: Vehicle) -> None:
    places: dict[str, Any] = {"start": START, "goal": GOAL, "soc_frac": 0.5}
    (own,) = joulepath.route(grid, leaf, **places, weights=Weights(1.0, 10.0, 0.0))
    assert own.name == "custom"
    front = joulepath.route(grid, leaf, **places, pareto=ParetoSettings(0.02))
    assert front.epsilon_frac is not None
    assert front[0].duration_s <= front[-1].duration_s


def test_conditions_in_human_units_are_those_of_the_model(grid: Graph, leaf: Vehicle) -> None:
    places: dict[str, Any] = {"start": START, "goal": GOAL, "soc_frac": 0.5}
    (mild,) = joulepath.route(grid, leaf, **places)
    (cold,) = joulepath.route(grid, leaf, **places, conditions=Conditions(ambient_c=-5, road="wet"), uncertainty=True)
    assert cold.energy_parts["cabin"] > 0.0 == mild.energy_parts["cabin"]
    assert cold.energy_parts["road_surface"] > 0.0
    assert cold.uncertainty is not None
    assert cold.uncertainty.energy_p10_kwh < cold.energy_kwh < cold.uncertainty.energy_p90_kwh


def test_route_out_of_reach_says_what_is_missing(grid: Graph, leaf: Vehicle) -> None:
    (route,) = joulepath.route(grid, leaf, start=START, goal=GOAL, soc_frac=0.005)
    assert not route.feasible
    assert route.deficit_kwh > 0.0
    assert route.furthest is not None
    assert route.charge_needed_kwh is not None
    assert route.charge_needed_kwh == pytest.approx(route.deficit_kwh, rel=1e-9)


def test_simulating_a_route_takes_its_energy(grid: Graph, leaf: Vehicle, routes: joulepath.Routes) -> None:
    again = joulepath.simulate(grid, leaf, routes[0], soc_frac=0.5)
    assert again.energy_kwh == pytest.approx(routes[0].energy_kwh, rel=1e-12)
    assert again.soc_end_frac == pytest.approx(routes[0].soc_end_frac, rel=1e-12)
    stepped = joulepath.simulate(grid, leaf, routes[0], model="timestep")
    assert stepped.energy_kwh == pytest.approx(again.energy_kwh, rel=0.2)
    assert stepped.soc_end_frac is None


def test_links_are_simulated_by_index_and_by_stretch(grid: Graph, leaf: Vehicle) -> None:
    length_m = float(grid.planner.graph.length_m[0])
    whole = joulepath.simulate(grid, leaf, [0])
    same = joulepath.simulate(grid, leaf, [LinkSpan(0, 0.0, length_m)])
    assert whole.energy_kwh == same.energy_kwh
    assert whole.distance_m == pytest.approx(length_m)


def test_range_has_the_reserve_and_the_bands_asked_for(grid: Graph, leaf: Vehicle) -> None:
    reached = joulepath.range(grid, leaf, origin=START, soc_frac=0.01, bands_soc_frac=(0.005,))
    assert [band.soc_left_frac for band in reached.bands] == [0.0, 0.005]
    assert reached.bands[0].area_km2 >= reached.bands[1].area_km2 > 0.0
    back = joulepath.range(grid, leaf, origin=START, soc_frac=0.01, trip="reverse")
    assert back.bands[0].area_km2 > 0.0


def test_matrix_has_the_figures_of_its_routes_and_nan_beyond_the_charge(grid: Graph, leaf: Vehicle) -> None:
    whole = joulepath.matrix(grid, leaf, sources=[START], targets=[GOAL, START], soc_frac=0.4)
    (route,) = joulepath.route(grid, leaf, start=START, goal=GOAL, soc_frac=0.4)
    assert whole.energy_kwh[0, 0] == pytest.approx(route.energy_kwh, rel=1e-9)
    assert whole.reason == ((None, None),)
    empty = joulepath.matrix(grid, leaf, sources=[START], targets=[GOAL], soc_frac=0.005)
    assert np.isnan(empty.energy_kwh).all()
    assert empty.reason == (("charge",),)
    assert empty.deficit_kwh[0, 0] > 0.0


def results(grid: Graph, leaf: Vehicle, routes: joulepath.Routes) -> dict[str, Any]:
    return {
        "routes": routes,
        "links": routes[0].links,
        "range": joulepath.range(grid, leaf, origin=START, soc_frac=0.01, bands_soc_frac=(0.005,)),
        "matrix": joulepath.matrix(grid, leaf, sources=[START, GOAL], soc_frac=0.4),
    }


@pytest.mark.parametrize("which", ["routes", "links", "range", "matrix"])
def test_result_is_a_feature_collection_and_a_geodataframe(
    grid: Graph, leaf: Vehicle, routes: joulepath.Routes, which: str
) -> None:
    result = results(grid, leaf, routes)[which]
    collection = result.__geo_interface__
    west, south, east, north = grid.meta.bbox
    for feature in collection["features"]:
        assert feature["type"] == "Feature"
        left, bottom, right, top = shape(feature["geometry"]).bounds
        assert west - 0.1 < left <= right < east + 0.1
        assert south - 0.1 < bottom <= top < north + 0.1
    frame = result.to_geodataframe()
    assert len(frame) == len(collection["features"])
    assert frame.crs == "EPSG:4326"
    assert not [name for name in frame.columns if frame[name].map(lambda value: isinstance(value, dict)).any()]


def test_links_of_a_route_follow_its_line(routes: joulepath.Routes) -> None:
    lines = [shape(feature["geometry"]) for feature in routes[0].links.__geo_interface__["features"]]
    joined = [lines[0].coords[0], *(position for line in lines for position in line.coords[1:])]
    assert joined == [tuple(position) for position in routes[0].geometry_lon_lat_deg.tolist()]


def test_results_are_frozen_and_can_be_pickled(routes: joulepath.Routes) -> None:
    route = routes[0]
    with pytest.raises(dataclasses.FrozenInstanceError):
        route.energy_kwh = 0.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        route.links.energy_wh[0] = 0.0
    with pytest.raises(TypeError):
        route.energy_parts["rolling"] = 0.0  # type: ignore[index]
    again = pickle.loads(pickle.dumps(routes))
    assert again[0].energy_kwh == route.energy_kwh
    assert dict(again[0].energy_parts) == dict(route.energy_parts)


def test_geodataframe_without_geopandas_names_it(routes: joulepath.Routes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "geopandas", None)
    with pytest.raises(ImportError, match=r"needs geopandas: pip install 'joulepath\[geo\]'"):
        routes.to_geodataframe()


@pytest.mark.parametrize(
    ("ask", "error", "said"),
    [
        (lambda g, v: joulepath.route(g, v, start=(8, 46.5, 1), goal=GOAL, soc_frac=1), QueryError, "start is"),
        (lambda g, v: joulepath.route(g, v, start=(190, 46.5), goal=GOAL, soc_frac=1), QueryError, "in this order"),
        (
            lambda g, v: joulepath.route(g, v, start=(120, 46.5), goal=GOAL, soc_frac=1),
            QueryError,
            "mean lat 46.5, lon",
        ),
        (lambda g, v: joulepath.route(g, v, start=(8.0, 46.5), goal=GOAL, soc_frac=1), PointOutsideMapError, "start"),
        (lambda g, v: joulepath.route(g, v, start=START, goal=GOAL, soc_frac=50), QueryError, "soc_frac is 50.0"),
        (lambda g, v: joulepath.route(g, v, start=START, goal=GOAL, soc_frac="1"), QueryError, "soc_frac is '1'"),
        (lambda g, v: joulepath.matrix(g, v, sources=[START], soc_frac=None), QueryError, "None, allowed: a number"),
        (lambda g, v: joulepath.range(g, v, origin=START, soc_frac=True), QueryError, "soc_frac is True"),
        (lambda g, v: joulepath.range(g, v, origin=START, soc_frac=0.1, limits=[5]), QueryError, "left out with by"),
        (
            lambda g, v: joulepath.range(g, v, origin=START, soc_frac=0.1, by="time", limits=[-1]),
            QueryError,
            "limits is -1.0, allowed: above 0",
        ),
        (
            lambda g, v: joulepath.range(g, v, origin=START, soc_frac=0.1, bands_soc_frac=0.05),
            QueryError,
            "bands_soc_frac is 0.05, allowed: a list of numbers",
        ),
        (
            lambda g, v: joulepath.route(g, v, start=START, goal=GOAL, soc_frac=1, alternatives="eco"),
            QueryError,
            "in a list",
        ),
        (lambda g, v: joulepath.route(g, v, start=START, goal=GOAL, soc_frac=1, stops="no"), QueryError, "expected,"),
        (
            lambda g, v: joulepath.route(g, v, start=START, goal=GOAL, soc_frac=1, alternatives=["eko"]),
            QueryError,
            "eco, fastest, balanced",
        ),
        (lambda g, v: joulepath.range(g, v, origin=START, soc_frac=0.1, trip="back"), QueryError, "round_trip"),
        (lambda g, v: joulepath.simulate(g, v, [10**6]), LinkError, "0..23"),
        (lambda g, v: joulepath.simulate(g, v, [0.5]), QueryError, "links is 0.5"),
        (lambda g, v: joulepath.simulate(g, v, [0], conditions={"road": "wet"}), ConditionsError, "Conditions"),
        (lambda g, v: Graph.load("highlands", snap_limit_m=-5.0), QueryError, "snap_limit_m is -5.0, allowed: above"),
        (lambda g, v: joulepath.simulate(g, v, [0], model="slow"), QueryError, "fast, timestep"),
        (lambda g, v: joulepath.simulate(g, v, [0], soc_frac=2.0), QueryError, "0..1"),
        (lambda g, v: joulepath.matrix(g, v, sources=[], soc_frac=0.5), QueryError, "at least one place"),
        (lambda g, v: Conditions(ambient_c=300.0), ConditionsError, "ambient_c is 300.0, allowed: -53.15..56.85"),
        (lambda g, v: Conditions(top_speed_kmh=900.0), ConditionsError, "top_speed_kmh is 900.0, allowed: 3.6..200"),
        (
            lambda g, v: Conditions(sun_w=100.0),
            ConditionsError,
            "sun_w is 100.0, allowed: only together",
        ),
        (lambda g, v: Conditions(road="ice"), ConditionsError, "dry, wet, snow"),
        (lambda g, v: Graph.load("atlantis"), GraphNotFoundError, "coquimbo, highlands"),
        (lambda g, v: Graph.load(Path("no/graph")), GraphNotFoundError, "no/graph"),
        (lambda g, v: Vehicle.load("bmw-i3"), VehicleNotFoundError, "bmw-i3-60ah"),
        (lambda g, v: Vehicle.from_mapping({"id": "x"}), VehicleError, "x"),
    ],
)
def test_what_cannot_be_answered_raises_an_error_that_says_what_is_allowed(
    grid: Graph, leaf: Vehicle, ask: Callable[[Graph, Vehicle], object], error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said.replace(".", r"\.")):
        ask(grid, leaf)
    assert issubclass(error, joulepath.RoutingError | joulepath.EnergyError)


def test_graph_is_loaded_by_name_from_the_users_folder_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    own = tmp_path / "joulepath" / "graphs" / "highlands"
    save_graph(street_grid("highlands", Terrain.ABSENT), own)
    assert Graph.load("highlands").link_count == Graph.load(own).link_count == 24
    assert Graph.stored()["coquimbo"] == ROOT / "data" / "graphs" / "coquimbo"


def test_vehicle_is_loaded_from_a_file_of_ones_own(tmp_path: Path) -> None:
    text = (VEHICLES / "nissan-leaf.toml").read_text(encoding="utf-8").replace('"nissan-leaf"', '"my-leaf"', 1)
    (tmp_path / "my-leaf.toml").write_text(text, encoding="utf-8")
    assert Vehicle.load(tmp_path / "my-leaf.toml").id == "my-leaf"
    assert "nissan-leaf" in Vehicle.bundled()


def test_diagnosis_says_what_is_left_out_and_a_vehicle_can_take_it(tmp_path: Path) -> None:
    car = Vehicle.load("bmw-i3-60ah")
    files = write_winter(tmp_path, load_vehicle(VEHICLES / "bmw-i3-60ah.toml"))
    (tmp_path / "broken.csv").write_text("nothing\n", encoding="utf-8")
    stages: list[str] = []
    found = joulepath.diagnose(
        [*files, tmp_path / "broken.csv"], car, held_out_frac=0.2, progress=lambda stage, _: stages.append(stage)
    )
    assert found.verdict == found.as_json()["verdict"]
    assert found.text
    assert len(found.refused) == 1
    assert "broken.csv" in found.refused[0]
    assert "fitting" in stages
    assert found.report_html().startswith("<!DOCTYPE html>")
    assert [finding.effect for finding in found.findings] != []
    assert found.learned_vehicle(car).model != car.model
    with pytest.raises(joulepath.DiagnosisError, match=r"broken\.csv"):
        joulepath.diagnose([tmp_path / "broken.csv"], car)


def test_drives_without_height_get_that_of_a_graph_or_of_files(grid: Graph, tmp_path: Path) -> None:
    car = Vehicle.load("bmw-i3-60ah")
    model = load_vehicle(VEHICLES / "bmw-i3-60ah.toml")
    write_street_drive(tmp_path / "street.csv", model)
    stages: list[str] = []
    found = joulepath.diagnose(
        [tmp_path / "street.csv"], car, graph=grid, progress=lambda stage, _: stages.append(stage)
    )
    assert "Height was filled in from graph grid on all drives" in found.text
    assert "filling in heights" in stages
    with pytest.raises(joulepath.RoutingError, match=r"gone\.tif: no such file"):
        joulepath.diagnose([tmp_path / "street.csv"], car, dem=[tmp_path / "gone.tif"])


def test_importing_it_brings_no_web_framework_and_no_database() -> None:
    program = "import sys, joulepath; print(sorted(sys.modules.keys() & set(sys.argv[1:])))"
    heavy = ["fastapi", "pydantic", "sqlalchemy", "typer", "rich", "matplotlib", "geopandas", "rasterio", "app"]
    ran = subprocess.run([sys.executable, "-c", program, *heavy], cwd=ROOT, capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"


def test_steps_are_those_of_the_planner_in_human_units_and_only_where_asked_for(grid: Graph, leaf: Vehicle) -> None:
    (plain,) = joulepath.route(grid, leaf, start=START, goal=GOAL, soc_frac=0.5)
    (route,) = joulepath.route(grid, leaf, start=START, goal=GOAL, soc_frac=0.5, steps=True)
    assert plain.steps is None
    assert route.steps is not None
    assert (route.steps[0].type, route.steps[-1].type) == ("depart", "arrive")
    assert sum(step.energy_kwh for step in route.steps) == pytest.approx(route.energy_kwh)
    assert sum(step.distance_m for step in route.steps) == pytest.approx(route.distance_m)
    for step in route.steps:
        lon, lat = route.geometry_lon_lat_deg[step.geometry_first]
        assert step.place == (lat, lon)
    assert dataclasses.replace(route, steps=None).__geo_interface__ == plain.__geo_interface__


def test_plans_with_charging_stops_have_steps_too(leaf: Vehicle) -> None:
    highlands = Graph.load("highlands")
    car = Vehicle.load("hyundai-kona-64")
    places = {"start": (43.872, -36.433), "goal": (43.697, -35.19)}
    (route,) = joulepath.route(highlands, car, **places, soc_frac=0.3, charging=joulepath.Charging(), steps=True)
    assert route.steps is not None
    arrivals = [step for step in route.steps if step.type == "arrive"]
    assert [step.instruction for step in arrivals[:-1]] == ["Stop here to charge"] * len(route.charging.stops)
