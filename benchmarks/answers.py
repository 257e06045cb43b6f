"""Every answer of the service to a fixed list of requests, in a file, so that two versions can be compared.

`python -m benchmarks.answers OUT.jsonl` records, `python -m benchmarks.answers --compare A B` compares. Two files are
comparable when they come from one machine and one set of libraries. It knows the application by `create_app`,
`Settings`, HTTP and the command line alone, so that the code behind them may move, and is one file, so that it can be
laid beside an older version: `python -P ANSWERS.py OUT.jsonl` asks the version that the environment has installed.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import io
import json
import math
import os
import random
import subprocess
import sys
import tempfile
import time
from bisect import bisect_right
from collections import Counter
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TextIO

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from starlette.testclient import TestClient


# what differs from run to run: the time that a search took, when a diagnosis was asked for, how far it had come when it
# failed, the day on which effects were learned
VOLATILE_KEYS: Final = frozenset({"seconds", "created", "progress", "date"})
KEPT_WHOLE: Final = "/openapi.json"  # there these are names of fields
# what an answer says besides its body; an ETag names contents that are recorded themselves
HEADERS: Final = (
    *("access-control-allow-origin", "allow", "cache-control", "content-encoding", "content-security-policy"),
    *("location", "retry-after", "vary"),
)
JSON_TYPE: Final = "application/json"
LONG_BODY: Final = 4000  # characters of a request beyond which its digest is recorded
SHOWN: Final = 160  # characters of a request or a value that a comparison prints
TEN_TRIPS: Final = ("A01", "A05", "A07", "A10", "A16", "B05", "B16", "B20", "B24", "B30")
WAIT_S: Final = 300.0  # for a diagnosis, and for any answer on a busy machine

Place = tuple[float, float]  # lat, lon [deg]
Body = dict[str, Any]
Asked = tuple[str, str, object, dict[str, str]]  # method, path, body, headers


# --- requests -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Region:
    """A graph and places near its roads; map_file and dem_file: what it is imported from, none where it is bundled."""

    name: str
    places: tuple[Place, ...]
    map_file: str = ""
    dem_file: str = ""

    def pair(self, k: int) -> tuple[Place, Place]:
        """The k-th of its pairs of different places."""
        size = len(self.places)
        return self.places[k % size], self.places[(k + 1 + k // size % (size - 1)) % size]


HIGHLANDS: Final = Region(
    "highlands",
    (
        *((44.4401, -36.781), (44.2838, -36.2298), (44.3536, -36.5003), (44.4746, -36.9114), (44.1808, -36.8369)),
        *((44.3125, -36.9807), (44.3681, -36.5957), (44.0295, -36.7335), (44.2653, -35.4589), (43.6738, -36.3389)),
    ),
)
COQUIMBO: Final = Region(
    "coquimbo",
    (
        *((-29.921, -71.2514), (-29.9435, -71.3466), (-29.8656, -71.2373), (-29.9913, -71.3233)),
        *((-29.8847, -71.2215), (-29.9618, -71.2775), (-29.9228, -71.2108)),
    ),
)
IMPORTED: Final = (
    Region(
        "andorra",
        (
            *((42.552, 1.5364), (42.6159, 1.5384), (42.58, 1.6617), (42.544, 1.7041), (42.5114, 1.5334)),
            *((42.5531, 1.4874), (42.5359, 1.5775), (42.5048, 1.515), (42.5756, 1.6223)),
        ),
        "andorra.osm.pbf",
        "N42E001.hgt.zip",
    ),
    Region(
        "porto-alegre",
        (
            *((-30.0692, -51.1611), (-30.0084, -51.1971), (-30.0852, -51.225), (-30.0986, -51.2416)),
            *((-30.0568, -51.1413), (-29.9988, -51.1687), (-30.087, -51.1643), (-30.0246, -51.2008)),
        ),
        "porto-alegre.osm.pbf",
        "porto-alegre-dem.tif",
    ),
)

COMPACT: Final[Body] = {
    "name": "compact",
    "mass_kg": 1650,
    "road_load": {"a_lbf": 28.0, "b_lbf_per_mph": 0.05, "c_lbf_per_mph2": 0.019},
    "drive_eff": 0.9,
    "recuperation_eff": 0.6,
    "aux_power_w": 450,
    "usable_capacity_kwh": 45,
}
LORRY: Final[Body] = {
    "name": "lorry",
    "mass_kg": 12_500.5,
    "road_load": {"a_n": 900.0, "b_n_per_kmh": 1.5, "c_n_per_kmh2": 0.21},
    "rotating_mass_coef": 1.05,
    "drive_eff": 0.88,
    "recuperation_eff": 0.5,
    "aux_power_w": 3000,
    "aux_move_eff": 0.95,
    "usable_capacity_kwh": 300,
    "acceleration": {"speed_kmh": [0, 30, 60, 90], "accel_mps2": [0.8, 0.5, 0.2], "decel_mps2": [-0.9, -0.8, -0.6]},
    "effects": {"tyre_warm_up_frac": 0.2, "regen_always_limited": True, "regen_cap_w": 80_000},
    "sources": {"mass_kg": "weighed"},
    "sd": {"mass_kg": 500, "drive_eff": 0.02, "road_load.a_n": 40, "effects.tyre_warm_up_frac": 0.05},
}
# takes back all that it gives, which the equations as printed make a gain of
GAINING: Final[Body] = {
    "start": [-36.781, 44.4401],
    "goal": [-36.2298, 44.2838],
    "vehicle": {**COMPACT, "drive_eff": 1.0, "recuperation_eff": 1.0, "aux_power_w": 0},
}
VAN_TABLE: Final[Body] = {
    "kind": "consumption_table",
    "name": "van",
    "consumption": {"speed_kmh": [30, 50, 90, 110, 130], "kwh_per_100km": [13, 14.5, 21, 26.5, 34]},
    "ascent_wh_per_m": 7.5,
    "descent_wh_per_m": 4.9,
    "kinetic": {"mass_kg": 2400, "acceleration_eff": 0.9, "deceleration_eff": 0.6},
    "aux_power_w": 600,
    "usable_capacity_kwh": 60,
    "sd": {"ascent_wh_per_m": 0.4, "aux_power_w": 60},
}
CONDITIONS: Final[tuple[Body, ...]] = (
    {"ambient_c": -10},
    {"ambient_c": 35, "sun_w": 800, "cabin_start_c": 50},
    {"ambient_c": 5, "climate": False, "altitude_density": False},
    {"altitude_density": True},
    {"wind_speed_mps": 9, "wind_from_deg": 250},
    {"payload_kg": 350, "drag_factor": 1.3},
    {"road": "snow", "ambient_c": -3, "speed_factor": 0.8},
    {"road": "wet", "top_speed_kmh": 70},
    {"aux_power_w": 2500, "speed_factor": 1.1},
    {"regen_limited": True, "ambient_c": -8},
)
EFFECTS: Final[tuple[Body, ...]] = (
    {"heating_cop": 2.5, "cabin_target_c": 19, "cabin_time_s": 300},
    {"drive_loss_w_per_n2": 0.0004, "regen_min_speed_mps": 2.5, "air_density_coef": 0.5},
    {"tyre_warm_up_frac": 0.4, "tyre_time_s": 900, "rolling_temp_per_k": 0.02, "battery_resistance_ohm": 0.2},
    {
        "cabin_ua_w_per_k": 118.4,
        "parameters": {"mass_kg": 1800, "aux_power_w": 420, "drive_eff": 0.85},
        "learned_from": {"vehicle": "bmw-i3-60ah", "trips": 28, "ci95": {"mass_kg": [1700, 1900]}},
    },
)
# a change of a plain route request each; all of them are asked on each graph, between places in turn
ROUTES: Final[tuple[Body, ...]] = (
    {},
    {"alternatives": ["eco", "fastest", "balanced"]},
    {"alternatives": ["fastest"], "links": False},
    {"weights": {"energy": 1, "time": 5}},
    {"weights": {"time": 1, "distance": 0.2}, "links": False},
    {"weights": {"distance": 1}, "links": False},
    {"pareto": {}, "links": False},
    {"pareto": {"epsilon_frac": 0.005, "most": 12}, "links": False},
    *({"conditions": conditions, "links": False} for conditions in CONDITIONS),
    *({"effects": effects, "conditions": {"ambient_c": -5}, "links": False} for effects in EFFECTS),
    {"conditions": CONDITIONS[1], "effects": {"cooling_target_c": 24, "cooling_ua_w_per_k": 90, "cooling_cop": 3}},
    {"uncertainty": True},
    {"uncertainty": True, "vehicle": LORRY, "soc": 0.9, "reserve_soc": 0.3, "links": False},
    {"stops": "none"},
    {"stops": "counted", "alternatives": ["eco", "fastest"]},
    {"stops": "crossings", "links": False},
    {"link_model": "printed"},
    {"link_model": "printed", "stops": "none", "conditions": {"payload_kg": 200}, "links": False},
    {"vehicle": "bmw-i3-60ah", "soc": 1.0},
    {"vehicle": "tesla-model-3", "soc": 1.0, "weights": {"energy": 1, "time": 30}, "links": False},
    {"vehicle": "toyota-corolla-petrol", "links": False},
    {"vehicle": "example-tomtom-table"},
    {"vehicle": "example-here-table", "uncertainty": True, "links": False},
    {"vehicle": COMPACT},
    {"vehicle": VAN_TABLE, "soc": 0.5, "uncertainty": True, "links": False},
    {"soc": 0.02},
    {"soc": 0.05, "reserve_soc": 0.04, "alternatives": ["eco", "fastest"], "links": False},
    {"soc": 0.015, "weights": {"energy": 1, "time": 20}, "vehicle": "bmw-i3-60ah", "links": False},
    {"soc": 0.02, "pareto": {"most": 4}, "links": False},
)
RANGES: Final[tuple[Body, ...]] = (
    {},
    {"bands": 3, "soc": 0.2, "reserve_soc": 0.05},
    {"bands": [0.0, 0.02, 0.05], "vehicle": "bmw-i3-60ah"},
    {"soc": 1.0, "vehicle": "bmw-i3-60ah", "bands": 2},
    {"reverse": True, "bands": 2},
    {"round_trip": True},
    {"uncertainty": True, "bands": [0.03]},
    {"conditions": {"ambient_c": -10, "road": "snow"}, "effects": EFFECTS[2]},
    {"reverse": True, "conditions": {"wind_speed_mps": 8, "wind_from_deg": 45, "ambient_c": 0}},
    {"round_trip": True, "vehicle": VAN_TABLE},
    {"stops": "counted", "vehicle": COMPACT},
    {"link_model": "printed", "stops": "none"},
)
RANGE_ADDRESSES: Final = (
    "bands=2&soc=0.08",
    "bands=0.02,0.04&soc=0.06&vehicle=bmw-i3-60ah&stops=none",
    "soc=0.05&ambient_c=-7&payload_kg=150&road=wet&wind_speed_mps=5&wind_from_deg=90&regen_limited=true",
    "soc=0.05&uncertainty=true&reserve_soc=0.01",
    "soc=0.05&reverse=true&top_speed_kmh=60&speed_factor=0.9",
    "soc=0.06&round_trip=true&climate=false&ambient_c=30&drag_factor=1.2&aux_power_w=900",
)
MATRICES: Final[tuple[Body, ...]] = (
    {},
    {"soc": 0.03, "reserve_soc": 0.01},
    {"weights": {"energy": 1, "time": 5}, "conditions": CONDITIONS[0]},
    {"vehicle": "bmw-i3-60ah", "soc": 1.0, "weights": {"time": 1}},
    {"vehicle": VAN_TABLE, "stops": "none"},
    {"vehicle": LORRY, "effects": EFFECTS[3], "stops": "counted", "link_model": "integrated"},
    {"link_model": "printed", "soc": 0.04, "vehicle": COMPACT},
)
TOWN_LINK: Final[Body] = {"length_m": 400, "grade": 0.02, "speed_limit_kmh": 50, "cross": "large", "urban": True}
CHAIN: Final[list[Body]] = [
    {**TOWN_LINK, "functional_class": "tertiary"},
    {"length_m": 2500, "grade": -0.01, "speed_limit_kmh": 80},
    {"length_m": 12.5, "grade": 0.0, "speed_limit_kmh": 30, "cross": "medium", "functional_class": "residential"},
    {"length_m": 5200, "grade": -0.06, "speed_limit_kmh": 120, "functional_class": "motorway"},
    {"length_m": 900, "grade": 0.11, "speed_limit_kmh": 60, "stop_probability": 0.5, "stop_time_s": 20},
]
AIRY_CHAIN: Final[list[Body]] = [
    {**link, "altitude_m": 200 + 300 * k, "heading_deg": 70 * k} for k, link in enumerate(CHAIN)
]
SIMULATIONS: Final[tuple[Body, ...]] = (
    {},
    {"soc": 0.5, "stops": "counted"},
    {"stops": "none", "arrive_stopped": False},
    {"stops": "crossings", "profile": True},
    {"link_model": "printed", "soc": 0.9},
    {"model": "timestep", "soc": 0.5, "profile": True},
    {"model": "timestep", "stops": "none", "arrive_stopped": False, "conditions": CONDITIONS[0]},
    {"model": "timestep", "stops": "counted", "vehicle": LORRY},
    {"profile": True, "conditions": CONDITIONS[5], "vehicle": "bmw-i3-60ah"},
    {"vehicle": VAN_TABLE, "soc": 0.5},
    {"vehicle": COMPACT, "soc": 1.0, "conditions": CONDITIONS[9], "effects": EFFECTS[0]},
)


def ask_routes(record: Recorder, region: Region) -> None:
    """All changes of a plain route request, routes over other places, and the same as GeoJSON."""
    start, goal = region.pair(0)
    for k, change in enumerate(ROUTES):
        start, goal = region.pair(k)
        plain = {"start": place_body(start), "goal": [goal[1], goal[0]], "soc": 0.8, "graph": region.name}
        record.ask("route", "POST", "/route", {**plain, **change})
    over = [place_body(place) for place in region.places]
    plain = {"start": over[0], "goal": over[1], "soc": 0.8, "graph": region.name}
    vias: tuple[Body, ...] = (
        {"via": over[2:3]},
        {"via": over[2:6], "alternatives": ["eco", "fastest"], "uncertainty": True},
        {"via": [over[3], over[3], over[0]], "stops": "counted", "conditions": CONDITIONS[0], "links": False},
        {"via": over[4:5], "soc": 0.03, "vehicle": "bmw-i3-60ah", "links": False},
        {"goal": over[0]},
    )
    for change in vias:
        record.ask("route", "POST", "/route", {**plain, **change})
    for accept in ("application/geo+json", "application/json;q=0.5, application/geo+json", "text/html"):
        record.ask("route", "POST", "/route", {**plain, "via": over[5:6]}, {"Accept": accept})


def ask_ranges(record: Recorder, region: Region) -> None:
    """Areas that are asked for with a body and in the address."""
    for k, change in enumerate(RANGES):
        origin = place_body(region.places[k % len(region.places)])
        record.ask("range", "POST", "/range", {"origin": origin, "soc": 0.06, "graph": region.name, **change})
    for k, query in enumerate(RANGE_ADDRESSES):
        lat, lon = region.places[k % len(region.places)]
        record.ask("range", "GET", f"/range?lat={lat}&lon={lon}&graph={region.name}&{query}")


def ask_matrices(record: Recorder, region: Region) -> None:
    """Drives from many places to many, also from each to each."""
    places = [place_body(place) for place in region.places]
    for k, change in enumerate(MATRICES):
        ends = {"sources": places[:4]} if k % 2 else {"sources": places[1:3], "targets": places[3:]}
        record.ask("matrix", "POST", "/matrix", {**ends, "soc": 0.7, "graph": region.name, **change})


def ask_simulations(record: Recorder, region: Region) -> None:
    """The links of routes, driven by both models, and over a place of rest."""
    for k, change in enumerate(SIMULATIONS):
        links = record.links_between(*region.pair(k), region.name)
        record.ask("simulate", "POST", "/simulate", {"graph": region.name, "links": links, **change})
    links = record.links_between(*region.pair(0), region.name, over=(region.places[2], region.places[4]))
    for model in ("fast", "timestep"):
        asked = {"graph": region.name, "links": links, "model": model, "profile": True}
        record.ask("simulate", "POST", "/simulate", asked)
    first = {"id": 0, "rest": True, "to_m": 3.0}
    record.ask("simulate", "POST", "/simulate", {"graph": region.name, "links": [first, {"id": 0, "from_m": 3.0}]})


def ask_chains(record: Recorder) -> None:
    """Links that are given by their numbers."""
    for change in SIMULATIONS:
        record.ask("simulate", "POST", "/simulate", {"chain": CHAIN, **change})
    for conditions in CONDITIONS:
        record.ask("simulate", "POST", "/simulate", {"chain": AIRY_CHAIN, "soc": 0.6, "conditions": conditions})
    for effects in EFFECTS:
        record.ask("simulate", "POST", "/simulate", {"chain": CHAIN, "conditions": CONDITIONS[0], "effects": effects})


def ask_graphs(record: Recorder, region: Region) -> None:
    """A graph, its TileJSON and tiles about two of its places at several levels."""
    path = f"/graphs/{region.name}"
    record.ask("graphs", "GET", path)
    shown = record.ask("tiles", "GET", f"{path}/tiles.json")
    for place in region.places[:2]:
        for zoom in (5, 8, 10, 12, 14):
            record.ask("tiles", "GET", f"{path}/tiles/{tile_of(place, zoom)}.mvt")
        for zoom in (0, 7, 9, 11, 12):
            record.ask("tiles", "GET", f"{path}/heights/{tile_of(place, zoom)}.png")
    address = tile_of(region.places[0], 11)
    record.ask("tiles", "GET", f"{path}/tiles/{address}.mvt", headers={"Accept-Encoding": "identity"})
    record.ask("tiles", "GET", f"{path}/tiles/{address}.mvt", headers={"If-None-Match": "*"})
    record.ask("tiles", "GET", f"{path}/tiles/8/0/0.mvt")
    current = str(shown["tiles"][0]).partition("?")[2] if isinstance(shown, dict) and "tiles" in shown else ""
    record.ask("tiles", "GET", f"{path}/tiles/{address}.mvt?{current}")


def ask_vehicles(record: Recorder) -> None:
    """Each bundled vehicle; vehicles that are stored, changed, driven and removed."""
    listed = record.ask("vehicles", "GET", "/vehicles")
    for vehicle in listed["vehicles"]:
        record.ask("vehicles", "GET", f"/vehicles/{vehicle['id']}")
    for vehicle_id, body in (("my-compact", COMPACT), ("my-lorry", LORRY), ("my-van", VAN_TABLE)):
        record.ask("vehicles", "PUT", f"/vehicles/{vehicle_id}", body)
        record.ask("vehicles", "PUT", f"/vehicles/{vehicle_id}", {**body, "name": "renamed", "aux_power_w": 0.1 + 0.2})
        record.ask("vehicles", "GET", f"/vehicles/{vehicle_id}")
        record.ask("vehicles", "POST", "/simulate", {"chain": CHAIN, "vehicle": vehicle_id, "soc": 0.4})
    record.ask("vehicles", "GET", "/vehicles")
    record.ask("vehicles", "GET", "/readyz")
    for vehicle_id in ("my-compact", "my-lorry", "my-van", "my-van", "bmw-i3-60ah", "No%20Id"):
        record.ask("vehicles", "DELETE", f"/vehicles/{vehicle_id}")
    refused: tuple[tuple[str, object], ...] = (
        ("bmw-i3-60ah", COMPACT),
        ("Capital", COMPACT),
        ("a--b", COMPACT),
        ("x" * 101, COMPACT),
        ("mine", {}),
        ("mine", "bmw-i3-60ah"),
        ("mine", {**COMPACT, "mass_kg": 0}),
        ("mine", {**COMPACT, "kind": "steam"}),
        ("mine", {**COMPACT, "colour": "red"}),
        ("mine", {**COMPACT, "sd": {"colour": 1}}),
        ("mine", {**COMPACT, "drive_eff": 1.0, "recuperation_eff": 1.0, "road_load": {"a_lbf": 1}}),
        ("mine", {**COMPACT, "road_load": {"a_n": -5, "b_n_per_kmh": 0, "c_n_per_kmh2": 0}}),
        ("mine", {**LORRY, "acceleration": {"speed_kmh": [0, 50, 40], "accel_mps2": [1, 1], "decel_mps2": [-1, -1]}}),
        ("mine", {**LORRY, "acceleration": {"speed_kmh": [0, 50], "accel_mps2": [1, 1], "decel_mps2": [-1]}}),
        ("mine", {**LORRY, "effects": {"regen_cold_full_c": -20, "regen_cold_none_c": -10}}),
        ("mine", {**VAN_TABLE, "descent_wh_per_m": 9}),
        ("mine", {**VAN_TABLE, "consumption": {"speed_kmh": [30, 20], "kwh_per_100km": [1, 2, 3]}}),
        ("mine", {**VAN_TABLE, "name": "two\nlines"}),
    )
    for vehicle_id, sent in refused:
        record.ask("vehicles", "PUT", f"/vehicles/{vehicle_id}", sent)
    record.ask("vehicles", "GET", "/vehicles/delorean")


def ask_errors(record: Recorder, region: Region) -> None:
    """Requests that are refused, each in its own way."""
    start, goal = (place_body(place) for place in region.pair(0))
    route: Body = {"start": start, "goal": goal, "soc": 0.5, "graph": region.name}
    far = {"lat": region.places[0][0] + 0.02, "lon": region.places[0][1] - 0.02}
    routes: tuple[Body, ...] = (
        *({"soc": value} for value in (1.4, -0.1, "0.5", True, None)),
        {"start": {"lat": 95, "lon": 8}},
        {"start": {"lat": 46.5}},
        {"start": [200, 46.5]},
        {"start": [8, 46, 1, 1]},
        {"goal": "there"},
        {"goal": {"lat": 0.0, "lon": 0.0}},
        {"via": [start, {"lat": 10.0, "lon": 10.0}]},
        {"via": [start] * 21},
        {"start": far},
        *({"vehicle": value} for value in (7, "delorean", {**COMPACT, "kind": "steam"})),
        {"vehicle": {"consumption": {}}},
        {"vehicle": {**COMPACT, "sd": {"mass_kg": -1}, "effects": {"colour": 1}}},
        {"vehicle": {**COMPACT, "road_load": {"a_n": -50, "b_n_per_kmh": 0, "c_n_per_kmh2": 0}}},
        {"graph": "atlantis"},
        {"weather": {}},
        *({"conditions": value} for value in ({"ambient_c": 90}, {"cabin_start_c": 5}, {"sun_w": 5}, {"road": "mud"})),
        {"conditions": {"ambient_c": -5}, "vehicle": VAN_TABLE},
        {"conditions": {"drag_factor": 1.5, "payload_kg": 100}, "vehicle": VAN_TABLE},
        *({"effects": value} for value in ({"heating_cop": 0}, "20200101-000000000000", 5, {"cooling_target_c": 10})),
        {"effects": {"parameters": {"drive_eff": 1.0, "recuperation_eff": 1.0, "road_load_a_n": -900}}},
        *({"alternatives": value} for value in (["best"], ["eco", "eco"], [])),
        *({"pareto": value} for value in ({"epsilon_frac": 0.0}, {"most": 51}, {"most": 2.5})),
        {"pareto": {}, "alternatives": ["eco"]},
        *({"weights": value} for value in ({"energy": -1}, {})),
        {"weights": {"energy": 1}, "alternatives": ["eco"]},
        {"reserve_soc": 0.9},
        {"link_model": "exact"},
        {"link_model": "printed", "graph": "highlands", **GAINING},
        {"stops": "all"},
        {"links": "no"},
    )
    for change in routes:
        record.ask("errors", "POST", "/route", {**route, **change})
    for missing in ("start", "goal", "soc"):
        record.ask("errors", "POST", "/route", {key: value for key, value in route.items() if key != missing})
    ranges: tuple[Body, ...] = (
        *({"bands": value} for value in (0, 21, [], [0.9], True, "2", [0.1] * 21)),
        {"reverse": True, "round_trip": True},
        {"reverse": True, "link_model": "printed"},
        {"origin": {"lat": 0.0, "lon": 0.0}},
        {"reserve_soc": 0.9},
    )
    for change in ranges:
        record.ask("errors", "POST", "/range", {"origin": start, "soc": 0.1, "graph": region.name, **change})
    lat, lon = region.places[0]
    for query in ("", "&soc=2", "&soc=0.1&bands=x", "&soc=0.1&bands=0.5", "&soc=0.1&colour=red", "&soc=0.1&reverse=7"):
        record.ask("errors", "GET", f"/range?lat={lat}&lon={lon}{query}")
    for query in ("sun_w=9", "cabin_start_c=9", "ambient_c=90", "vehicle=delorean", "graph=atlantis", "effects=x"):
        record.ask("errors", "GET", f"/range?lat={lat}&lon={lon}&soc=0.1&{query}")
    matrices: tuple[Body, ...] = (
        {"sources": []},
        {"sources": [start] * 101},
        {"targets": [start, {"lat": 0.0, "lon": 0.0}]},
        {"sources": [start, far]},
        {"reserve_soc": 0.9},
    )
    for change in matrices:
        record.ask("errors", "POST", "/matrix", {"sources": [start], "soc": 0.5, "graph": region.name, **change})
    simulations: tuple[Body, ...] = (
        {},
        {"chain": []},
        {"chain": CHAIN, "links": [{"id": 0}]},
        {"chain": CHAIN, "graph": region.name},
        {"chain": [{"length_m": 0, "speed_limit_kmh": 50}]},
        {"chain": [{"length_m": 5, "grade": 2, "speed_limit_kmh": 500, "cross": "huge"}]},
        {"chain": [AIRY_CHAIN[0], CHAIN[1]]},
        {"chain": CHAIN, "model": "timestep", "link_model": "printed"},
        {"chain": CHAIN, "model": "timestep", "stops": "expected"},
        {"chain": CHAIN, "conditions": {"wind_speed_mps": 5}},
        {"chain": CHAIN, "model": "timestep", "vehicle": VAN_TABLE},
        {"links": [{"id": 2**31 - 1}]},
        {"links": [{"id": -1}]},
        {"links": [{"id": 0}, {"id": 0}]},
        {"links": [{"id": 0, "from_m": 9.0, "to_m": 2.0}]},
        {"links": [{"id": 0, "to_m": 1e6}]},
    )
    for body in simulations:
        record.ask("errors", "POST", "/simulate", body)
    raws = (b"{", b"", b"\xff\xfe{", b"[" * 50_000, b'"\\ud800"', b"null", b"[]", b'{"soc": NaN}', b'{"soc": 1e999}')
    for raw in raws:
        for path in ("/route", "/simulate"):
            record.ask("errors", "POST", path, raw, {"Content-Type": JSON_TYPE})
    record.ask("errors", "POST", "/route", b"soc=0.5", {"Content-Type": "application/x-www-form-urlencoded"})
    record.ask("errors", "POST", "/route", b" " * (4 * 1024 * 1024 + 1), {"Content-Type": JSON_TYPE})
    graph = f"/graphs/{region.name}"
    for line in (
        *("GET /route", "PUT /range", "DELETE /matrix", "PATCH /vehicles/bmw-i3-60ah", "POST /graphs", "HEAD /graphs"),
        *("DELETE /healthz", "PUT /diagnoses", "POST /vehicles", "GET /nothing", "GET /web/lib/other.js"),
        *("GET /graphs/atlantis", "GET /graphs/atlantis/tiles.json", f"GET {graph}/tiles/15/0/0.mvt"),
        *(f"GET {graph}/tiles/3/8/0.mvt", f"GET {graph}/heights/14/0/0.png", f"GET {graph}/tiles/3/x/0.mvt"),
        *(f"GET /graphs/{'x' * 201}", f"GET /vehicles/{'x' * 201}"),
    ):
        method, path = line.split()
        record.ask("errors", method, path)


def ask_pages(record: Recorder) -> None:
    """Health, the description of the API, and the web map's page."""
    for path in ("/healthz", "/readyz", "/graphs", KEPT_WHOLE, "/docs", "/redoc", "/", "/web/settings.json"):
        record.ask("pages", "GET", path)


def ask_diagnoses(record: Recorder, region: Region, recordings: Path) -> None:
    """Drives that are made here, diagnosed on a graph and without one, with all that belongs to a diagnosis.

    recordings: the folder that the service reads, still empty.
    """
    drives = [made_drive(record, region, k) for k in range(10)]
    for k, text in enumerate(drives):
        (recordings / f"drive-{k:02d}.csv").write_text(text, encoding="utf-8")
    broken = "time_s,speed_kmh,power_w\n0,10,500\n1,ten,500\n2,11,500\n"
    (recordings / "broken.csv").write_text(broken, encoding="utf-8")
    asked = {"recordings": ["*.csv"], "vehicle": "hyundai-kona-64", "holdout": ["drive-03"], "graph": region.name}
    on_graph = record.ask("diagnoses", "POST", "/diagnoses", asked)["id"]  # each waits for the one before it
    drawn = {"recordings": ["drive-0*.csv"], "holdout_fraction": 0.2, "seed": 7}
    waiting = record.ask("diagnoses", "POST", "/diagnoses", drawn)["id"]
    parts = ("", "/report", "/effects", "/residuals", "/trips", "/trips/drive-00")
    for part in parts:
        record.ask("diagnoses", "GET", f"/diagnoses/{waiting}{part}")
    form = {"vehicle": json.dumps(COMPACT), "holdout": ["drive-0[12]"], "hide": ["ambient*"], "seed": "3"}
    uploaded = record.upload(form, [(f"drive-{k:02d}.csv", text) for k, text in enumerate(drives[:8])])["id"]
    failing = record.ask("diagnoses", "POST", "/diagnoses", {"recordings": ["broken.csv"]})["id"]
    record.ask("diagnoses", "POST", "/diagnoses", asked)  # one more than may wait
    for _ in range(3):  # cancels it, removes it, does not find it
        record.ask("diagnoses", "DELETE", f"/diagnoses/{waiting}")
    for diagnosis_id in (on_graph, uploaded, failing):
        record.wait_for(diagnosis_id)
    record.ask("diagnoses", "GET", "/diagnoses")
    for diagnosis_id in (on_graph, uploaded, failing):
        for part in (*parts, "/trips/drive-03", "/trips/x"):
            record.ask("diagnoses", "GET", f"/diagnoses/{diagnosis_id}{part}")
    (lat, lon), goal = region.pair(0)
    learned = {"graph": region.name, "effects": on_graph, "conditions": {"ambient_c": -5}, "soc": 0.5}
    ends = {"start": [lon, lat], "goal": place_body(goal), "links": False}
    record.ask("diagnoses", "POST", "/route", {**learned, **ends})
    record.ask("diagnoses", "POST", "/route", {**learned, **ends, "vehicle": "bmw-i3-60ah"})
    record.ask("diagnoses", "POST", "/matrix", {**learned, "sources": [[lon, lat], place_body(goal)]})
    record.ask("diagnoses", "GET", f"/range?lat={lat}&lon={lon}&soc=0.05&graph={region.name}&effects={on_graph}")
    record.ask("diagnoses", "POST", "/simulate", {"chain": CHAIN, "effects": uploaded, "conditions": {"ambient_c": -5}})
    for diagnosis_id in (on_graph, uploaded, failing):
        record.ask("diagnoses", "DELETE", f"/diagnoses/{diagnosis_id}")
    record.ask("diagnoses", "POST", "/route", {**learned, **ends})
    refused: tuple[Body, ...] = (
        {},
        {"recordings": []},
        {"recordings": ["nothing*"]},
        {"recordings": ["../*"]},
        {"recordings": ["*.csv"], "vehicle": "delorean"},
        {"recordings": ["*.csv"], "vehicle": "example-here-table"},
        {"recordings": ["*.csv"], "graph": "atlantis"},
        {"recordings": ["*.csv"], "holdout_fraction": 0.95},
        {"recordings": ["*.csv"], "holdout": ["winter"]},
        {"recordings": ["*.csv"], "seed": -1, "hide": [""]},
    )
    for body in refused:
        record.ask("diagnoses", "POST", "/diagnoses", body)
    record.ask("diagnoses", "POST", "/diagnoses", b"<drive/>", {"Content-Type": "text/xml"})
    record.ask("diagnoses", "POST", "/diagnoses", b"no form", {"Content-Type": "multipart/form-data; boundary=x"})
    record.upload({"colour": "red"}, [("drive.csv", broken)])
    record.upload({"seed": "x"}, [("drive.csv", broken)])
    record.ask("diagnoses", "GET", "/diagnoses")


def place_body(place: Place) -> Body:
    """A place by named coordinates."""
    return {"lat": place[0], "lon": place[1]}


def tile_of(place: Place, zoom: int) -> str:
    """z/x/y of the tile that holds a place, in spherical Mercator."""
    lat, lon = place
    x = (lon / 360.0 + 0.5) * 2**zoom
    y = (0.5 - math.asinh(math.tan(math.radians(lat))) / (2.0 * math.pi)) * 2**zoom
    return f"{zoom}/{int(x)}/{int(y)}"


def made_drive(record: Recorder, region: Region, k: int) -> str:
    """A drive along a route as a logger would write it, a row a second, with a heater that the model knows nothing of.

    The car's numbers, the heater's 150 W/K and the noise are made up; the route and its speeds are the service's.
    """
    draw = random.Random(k)
    start, goal = region.pair(k)
    found = record.route_between(start, goal, region.name)
    links = [{key: link[key] for key in ("id", "from_m", "to_m", "rest")} for link in found["links"]]
    asked = {"graph": region.name, "links": links, "model": "timestep", "profile": True}
    profile = record.unrecorded("POST", "/simulate", asked)["profile"]
    lon, lat = ([point[axis] for point in found["geometry"]["coordinates"]] for axis in (0, 1))
    north = math.cos(math.radians(lat[0]))
    steps = [
        math.hypot((x1 - x0) * north, y1 - y0) for (x0, x1), (y0, y1) in zip(pairwise(lon), pairwise(lat), strict=True)
    ]
    way = list(accumulate(steps, initial=0.0))
    along_m = [found["distance_m"] * part / way[-1] for part in way]
    link_ends_m = list(accumulate((link["length_m"] for link in found["links"]), initial=0.0))
    heights_m = [found["height_start_m"], *(link["height_end_m"] for link in found["links"])]
    ambient_c = -12.0 + 4.0 * k
    table = io.StringIO()
    rows = csv.writer(table, lineterminator="\n")
    rows.writerow(("time_s", "speed_kmh", "power_w", "ambient_c", "elevation_m", "lat", "lon"))
    before_mps, before_m, before_height_m = 0.0, 0.0, heights_m[0]
    for second in range(min(int(profile["time_s"][-1]), 1500)):
        at_m = interpolated(second, profile["time_s"], profile["distance_m"])
        speed_mps = interpolated(second, profile["time_s"], profile["speed_kmh"]) / 3.6
        height_m = interpolated(at_m, link_ends_m, heights_m)
        climb_frac = (height_m - before_height_m) / (at_m - before_m) if at_m > before_m else 0.0
        force_n = 150.0 + 0.4 * speed_mps**2 + 1800.0 * (speed_mps - before_mps + 9.81 * climb_frac)
        wheel_w = force_n * speed_mps
        power_w = (wheel_w / 0.88 if wheel_w > 0.0 else wheel_w * 0.75) + 500.0 + 150.0 * max(21.0 - ambient_c, 0.0)
        cells = (speed_mps * 3.6, power_w + draw.gauss(0.0, 100.0), ambient_c, height_m)
        places = (interpolated(at_m, along_m, lat), interpolated(at_m, along_m, lon))
        rows.writerow((second, *(f"{cell:.2f}" for cell in cells), *(f"{degree:.6f}" for degree in places)))
        before_mps, before_m, before_height_m = speed_mps, at_m, height_m
    return table.getvalue()


def interpolated(at: float, xs: Sequence[float], ys: Sequence[float]) -> float:
    """The value at `at` of a line through points whose xs do not fall."""
    right = min(max(bisect_right(xs, at), 1), len(xs) - 1)
    span = xs[right] - xs[right - 1]
    share = min(max((at - xs[right - 1]) / span, 0.0), 1.0) if span > 0.0 else 1.0
    return ys[right - 1] + share * (ys[right] - ys[right - 1])


# --- recording ------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class Recorder:
    """Asks a client, and writes a line for each answer.

    masks: texts that differ from run to run, and what stands for them in the file; counts: answers by group.
    """

    client: TestClient
    out: TextIO
    masks: dict[str, str]
    counts: Counter[str] = field(default_factory=Counter)

    def with_client(self, client: TestClient) -> Recorder:
        """The same file, written from another client's answers."""
        return Recorder(client, self.out, self.masks, self.counts)

    def ask(
        self, group: str, method: str, path: str, body: object = None, headers: Mapping[str, str] | None = None
    ) -> Any:
        """Send a request and record it with its answer, whose JSON is returned; bytes are sent as they are."""
        sent: dict[str, Any] = {} if body is None else {"json": body}
        if isinstance(body, bytes):
            sent = {"content": body}
        asked = {"method": method, "path": path, "headers": dict(headers or {}), "body": recordable(body)}
        return self._recorded(group, asked, lambda: self.client.request(method, path, headers=headers, **sent))

    def upload(self, form: Body, files: Sequence[tuple[str, str]]) -> Any:
        """Send recordings as a form, and record it as `ask` does."""
        parts = [("recordings", (name, text.encode(), "text/csv")) for name, text in files]
        asked = {"method": "POST", "path": "/diagnoses", "form": form, "files": recordable(list(files))}
        return self._recorded("diagnoses", asked, lambda: self.client.post("/diagnoses", data=form, files=parts))

    def _recorded(self, group: str, request: Body, send: Callable[[], Any]) -> Any:
        response = send()
        media_type = response.headers.get("content-type", "")
        line: Body = {"request": request, "status": response.status_code, "type": media_type}
        line["headers"] = {name: response.headers[name] for name in HEADERS if name in response.headers}
        body: Any = json.loads(response.content) if "json" in media_type and response.content else None
        if response.status_code == 202:
            self.masks[body["id"]] = f"DIAGNOSIS-{len(self.masks)}"
        if body is None:
            line["body"] = fingerprint(response.content)
        else:
            line |= self.json_body(body if request["path"] == KEPT_WHOLE else stable(body))
        self.write(group, line)
        return body

    def json_body(self, body: Any) -> Body:
        """A JSON body as it is recorded: with its keys sorted, and the digest of it in the order of its keys."""
        return {"body": body, "body_order": sha256(self.masked(json.dumps(body)).encode())}

    def write(self, group: str, line: Body) -> None:
        """Write a line under the next number of its group."""
        self.counts[group] += 1
        case = f"{group} {self.counts[group]}"
        self.out.write(self.masked(json.dumps({"case": case, **line}, sort_keys=True, allow_nan=False)) + "\n")

    def masked(self, text: str) -> str:
        """A text without what differs from run to run."""
        for secret, shown in self.masks.items():
            text = text.replace(secret, shown)
        return text

    def unrecorded(self, method: str, path: str, body: object = None) -> Any:
        """The answer to a request that is not recorded, since only further requests are made of it."""
        return self.client.request(method, path, json=body).json()

    def route_between(self, start: Place, goal: Place, graph: str, over: Sequence[Place] = ()) -> Body:
        """The route of least energy, whatever the charge."""
        via = [place_body(place) for place in over]
        asked = {"start": place_body(start), "goal": place_body(goal), "via": via, "soc": 1.0, "graph": graph}
        found: Body = self.unrecorded("POST", "/route", asked)["routes"][0]
        return found

    def links_between(self, start: Place, goal: Place, graph: str, over: Sequence[Place] = ()) -> list[Body]:
        """The links of that route, as a simulation takes them."""
        links = self.route_between(start, goal, graph, over)["links"]
        return [{key: link[key] for key in ("id", "from_m", "to_m", "rest")} for link in links]

    def wait_for(self, diagnosis_id: str) -> None:
        """Wait until a diagnosis has ended; raises TimeoutError."""
        until = time.monotonic() + WAIT_S
        while self.unrecorded("GET", f"/diagnoses/{diagnosis_id}")["state"] in ("queued", "running"):
            if time.monotonic() > until:
                raise TimeoutError(f"diagnosis {diagnosis_id} has not ended after {WAIT_S:g} s")
            time.sleep(0.1)


def recordable(sent: object) -> object:
    """What is recorded of what was sent: itself, or the digest of something long or binary."""
    if isinstance(sent, bytes):
        return fingerprint(sent)
    text = json.dumps(sent)
    return sent if len(text) <= LONG_BODY else fingerprint(text.encode())


def stable(body: Any) -> Any:
    """A JSON value without the keys that differ from run to run."""
    if isinstance(body, dict):
        return {key: stable(part) for key, part in body.items() if key not in VOLATILE_KEYS}
    return [stable(part) for part in body] if isinstance(body, list) else body


def fingerprint(content: bytes) -> Body:
    """What is recorded of content that is not JSON."""
    return {"sha256": sha256(content), "bytes": len(content)}


def sha256(content: bytes) -> str:
    """The digest, in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


@contextmanager
def served(settings: Body, *, started: bool = True) -> Iterator[TestClient]:
    """A client of the application in this process; started: whether its graphs are loaded."""
    from starlette.testclient import TestClient

    from app.main import create_app
    from app.settings import Settings

    application = create_app(Settings(**settings, search_threads=1))  # so the order of searches is that of requests
    client = TestClient(application, raise_server_exceptions=False, follow_redirects=False)
    with ExitStack() as stack:
        yield stack.enter_context(client) if started else client


def import_regions(record: Recorder, maps: Path, folder: Path) -> list[Region]:
    """Import each region whose files are there, and record the graph's own files; those that are done."""
    done = []
    for region in IMPORTED:
        files = [maps / region.map_file, maps / region.dem_file]
        if missing := [path.name for path in files if not path.is_file()]:
            say(f"{region.name} left out: no {' and no '.join(missing)} in {maps}")
            continue
        run_command("import", files[0], "--dem", files[1], "--out", folder / region.name)
        record_files(record, f"import {region.name}", folder / region.name)
        done.append(region)
    return done


def diagnose_drives(record: Recorder, drives: Path, scratch: Path) -> None:
    """Two diagnoses of recorded drives of a BMW i3: of ten with fixed held-out trips, and of all without climate."""
    if not drives.is_dir():
        say(f"diagnoses of recorded drives left out: no {drives}")
        return
    ten = [drives / f"Trip{trip}.csv.gz" for trip in TEN_TRIPS]
    hidden = [word for name in ("*Heat*", "*AirCon*", "*Coolant*", "*Cabin*") for word in ("--hide", name)]
    orders: tuple[tuple[str, list[str | Path]], ...] = (
        ("ten", [*ten, "--holdout", "TripA10", "--holdout", "TripB20"]),
        ("all", [drives, "--holdout-fraction", "0.3", *hidden]),
    )
    for name, order in orders:
        out = scratch / f"diagnosis-{name}"
        run_command("diagnose", *order, "--vehicle", "bmw-i3-60ah", "--out", out)
        record_files(record, f"diagnose {name}", out)


def run_command(*words: str | Path) -> None:
    """Run `joulepath` of this environment; raises CalledProcessError."""
    program = Path(sys.executable).parent / "joulepath"
    subprocess.run([program, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def record_files(record: Recorder, command: str, folder: Path) -> None:
    """Write a line for each file that a command has left: its JSON, or the digest of anything else."""
    for path in sorted(folder.iterdir()):
        content = path.read_bytes()
        line: Body = {"request": {"command": command, "file": path.name}}
        if path.suffix == ".json":
            line |= record.json_body(stable(json.loads(content)))
        else:
            line["body"] = fingerprint(content)
        record.write("files", line)


def ask_limits(record: Recorder, scratch: Path) -> None:
    """Services that are not ready, have narrow limits, no time, or no database."""
    start, goal = (place_body(place) for place in COQUIMBO.places[:2])
    route: Body = {"start": start, "goal": goal, "soc": 0.5}
    other_site = {"Origin": "https://map.example"}
    requests: tuple[Asked, ...] = (
        ("GET", "/healthz", None, {}),
        ("GET", "/readyz", None, {}),
        ("POST", "/route", route, {}),
        ("POST", "/route", {**route, "goal": [-71.3, -29.9]}, {}),
        ("POST", "/range", {"origin": start, "soc": 0.1}, {}),
        ("POST", "/matrix", {"sources": [start], "targets": [goal], "soc": 0.5}, {}),
        ("POST", "/matrix", {"sources": [start] * 3, "soc": 0.5}, {}),
        ("POST", "/simulate", {"chain": CHAIN[:2]}, {}),
        ("POST", "/simulate", {"chain": CHAIN * 5}, {}),
        ("GET", "/vehicles", None, {}),
        ("GET", "/vehicles/mine", None, {}),
        ("PUT", "/vehicles/mine", COMPACT, {}),
        ("GET", "/graphs", None, {}),
        ("GET", "/diagnoses", None, {}),
        ("POST", "/diagnoses", {"recordings": ["*"]}, {}),
        ("GET", "/", None, other_site),
        ("GET", "/web/settings.json", None, {"Origin": "https://other.example"}),
        ("OPTIONS", "/route", None, {**other_site, "Access-Control-Request-Method": "POST"}),
    )
    slow: tuple[Asked, ...] = (  # each longer than a thread keeps the interpreter, so that the time is over first
        ("POST", "/route", {**route, "pareto": {"epsilon_frac": 0.001, "most": 50}}, {}),
        ("POST", "/range", {"origin": start, "soc": 0.9, "reverse": True, "bands": 5}, {}),
        ("POST", "/matrix", {"sources": [place_body(place) for place in COQUIMBO.places], "soc": 0.9}, {}),
    )
    narrow: Body = {"label_limit": 50, "body_limit_bytes": 1024, "matrix_limit_places": 2, "snap_limit_m": 20.0}
    narrow |= {"default_vehicle": "bmw-i3-60ah", "diagnosis_limit_bytes": 2048, "diagnosis_limit_files": 1}
    narrow |= {"cors_origins": ("https://map.example",), "map_style_url": "https://tiles.example/style.json"}
    (scratch / "file").touch()
    no_database = {"database_url": f"sqlite:///{scratch / 'file' / 'none.sqlite'}"}
    for change, asked in (({}, requests), (narrow, requests), ({"time_limit_s": 1e-6}, slow), (no_database, requests)):
        settings = {"default_graph": "coquimbo", "database_url": f"sqlite:///{scratch / 'limits.sqlite'}", **change}
        with served(settings, started=bool(change)) as client:
            own = record.with_client(client)
            for method, path, body, headers in asked:
                own.ask("limits", method, path, body, headers)
            if asked is requests:
                own.upload({}, [("a.csv", "time_s\n" * 500), ("b.csv", "time_s\n")])


def record_answers(out: Path, data: Path | None) -> int:
    """Ask everything and write the answers to a file; how many.

    data: folder of maps and recordings, by default beside the project.
    """
    import app

    root = Path(app.__file__).resolve().parent.parent
    shared = data or root.parent / "shared" / "data"
    with tempfile.TemporaryDirectory(prefix="joulepath-answers-") as folder, out.open("w", encoding="ascii") as lines:
        scratch = Path(folder)
        os.environ["XDG_DATA_HOME"] = folder  # the user's own vehicles stay untouched
        recordings, graphs = scratch / "recordings", scratch / "graphs"
        recordings.mkdir()
        settings = {
            "graph_dirs": (root / "data" / "graphs", graphs),
            "database_url": f"sqlite:///{scratch / 'answers.sqlite'}",
            "recordings_dir": recordings,
            "diagnosis_queue_limit": 4,
            "time_limit_s": WAIT_S,
        }
        with served(settings, started=False) as client:  # which has nothing to answer until the graphs are there
            record = Recorder(client, lines, masks={folder: "SCRATCH"})
            regions = [HIGHLANDS, COQUIMBO, *import_regions(record, shared / "maps", graphs)]
            diagnose_drives(record, shared / "recordings" / "bmw-i3", scratch)
        with served(settings) as client:
            record = record.with_client(client)
            ask_pages(record)
            ask_vehicles(record)
            ask_diagnoses(record, HIGHLANDS, recordings)
            for region in regions:
                for ask in (ask_routes, ask_ranges, ask_matrices, ask_simulations, ask_graphs):
                    ask(record, region)
            ask_chains(record)
            ask_errors(record, COQUIMBO)
        ask_limits(record, scratch)
        return record.counts.total()


def say(text: str) -> None:
    """Tell on stderr what happens."""
    print(text, file=sys.stderr)


# --- comparing ------------------------------------------------------------------------------------------------------


def compare(first: Path, second: Path) -> int:
    """Print what differs between two files; 0 where nothing does, else 1."""
    files = [lines_by_case(path) for path in (first, second)]
    cases = files[0] | files[1]
    equal = 0
    for case in cases:
        if case not in files[0] or case not in files[1]:
            difference = f"only in {first if case in files[0] else second}"
        elif files[0][case] == files[1][case]:
            equal += 1
            continue
        else:
            difference = first_difference(json.loads(files[0][case]), json.loads(files[1][case]))
        print(f"{case}: {shortened(json.loads(cases[case])['request'])}\n  {difference}")
    print(f"{equal} of {len(cases)} lines are equal")
    return 0 if equal == len(cases) else 1


def lines_by_case(path: Path) -> dict[str, str]:
    """The lines of a file by what they answer."""
    with path.open(encoding="ascii") as lines:
        return {json.loads(line)["case"]: line for line in lines}


def first_difference(left: Any, right: Any, path: str = "") -> str:
    """Where two different JSON values first differ, and what stands there in each."""
    if isinstance(left, dict) and isinstance(right, dict):
        for key in sorted(left.keys() | right.keys()):
            below = f"{path}.{key}" if path else key
            if key not in left or key not in right:
                return f"{below}: only in the {'first' if key in left else 'second'}"
            if differ(left[key], right[key]):
                return first_difference(left[key], right[key], below)
    if isinstance(left, list) and isinstance(right, list):
        for idx, (left_item, right_item) in enumerate(zip(left, right, strict=False)):
            if differ(left_item, right_item):
                return first_difference(left_item, right_item, f"{path}[{idx}]")
        return f"{path}: {len(left)} items, and {len(right)} items"
    return f"{path}: {shortened(left)}, and {shortened(right)}"


def differ(left: Any, right: Any) -> bool:
    """Whether two JSON values are written differently: 1 is not 1.0, 0.0 is not -0.0."""
    return json.dumps(left, sort_keys=True) != json.dumps(right, sort_keys=True)


def shortened(value: Any) -> str:
    """The beginning of a JSON value."""
    text = json.dumps(value)
    return text if len(text) <= SHOWN else text[: SHOWN - 1] + "…"


def main(argv: Sequence[str]) -> int:
    """Record or compare; 1 where something differs, or where recording failed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.answers", description="Answers, to compare versions by."
    )
    parser.add_argument("out", type=Path, nargs="?", metavar="OUT.jsonl", help="file that all answers are written to")
    parser.add_argument("--data", type=Path, metavar="DIR", help="maps and recordings, by default ../shared/data")
    parser.add_argument("--compare", type=Path, nargs=2, metavar=("A", "B"), help="compare two such files instead")
    asked = parser.parse_args(argv)
    if asked.compare:
        return compare(*asked.compare)
    if asked.out is None:
        parser.error("OUT.jsonl or --compare A B is required")
    for name in [name for name in os.environ if name.startswith("JOULEPATH_")]:
        del os.environ[name]
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # sums over several threads may come out otherwise
    began_s = time.monotonic()
    try:
        total = record_answers(asked.out, asked.data)
    except subprocess.CalledProcessError as error:
        say(f"{error}\n{error.stderr}")
        return 1
    say(f"{total} answers in {time.monotonic() - began_s:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
