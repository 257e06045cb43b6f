"""Drives on a bundled graph as a logger would record them, with a heater that the model knows nothing of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from app.schemas.route import RouteRequest
from energy.chain.profile import chain_profile
from energy.replay.replay import DrivenProfile, graded, replay
from energy.units import KMH_PER_MPS
from energy.vehicle.vehicle import Vehicle
from routing.graph.earth import METRE_PER_DEGREE
from routing.places import LinkSpan

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from app.service.service import Service
    from routing.planner import Planner

GRAPH: Final = "highlands"
VEHICLE: Final = "hyundai-kona-64"
TRIPS: Final = 10
BETWEEN_KM: Final = (7.0, 16.0)  # start and goal, as the crow flies
TEMPERATURES_C: Final = (-12.0, 27.0)
HEATER_W_PER_K: Final = 150.0
CABIN_C: Final = 21.0
NOISE_W: Final = 100.0
PACE_SD: Final = 0.08  # of a drive's speed over that of the plan
POSITION_SD_M: Final = 3.0
HEADER: Final = "time_s,speed_kmh,power_w,ambient_c,elevation_m,lat,lon"


def write_winter(folder: Path, service: Service) -> None:
    """Write TRIPS recordings of least-energy routes, between −12 and +27 °C: winter-00.csv and so on."""
    folder.mkdir(parents=True)
    random = np.random.default_rng(1)
    for k, ambient_c in enumerate(np.linspace(*TEMPERATURES_C, TRIPS).tolist()):
        (folder / f"winter-{k:02d}.csv").write_text(_recording(service, random, ambient_c), encoding="utf-8")


def _recording(service: Service, random: np.random.Generator, ambient_c: float) -> str:
    """One drive as joulepath's own CSV, a row a second."""
    planner, vehicle = service.atlas.planner(GRAPH), service.known_vehicle(VEHICLE)
    assert isinstance(vehicle, Vehicle)
    spans = _spans(service, planner, random)
    plan = chain_profile(vehicle, planner.chain(spans))
    moves = np.append(True, np.diff(plan.time_s) > 0.0)
    pace = float(np.exp(random.normal(0.0, PACE_SD)))
    time_s = np.arange(0.0, float(plan.time_s[-1]) / pace)
    way_m = np.interp(time_s * pace, plan.time_s[moves], plan.distance_m[moves])
    lat, lon, height_m = _places(planner, spans, way_m)
    speed_mps = np.maximum(np.gradient(way_m, time_s), 0.0)
    driven = replay(vehicle, graded(DrivenProfile(time_s, speed_mps, elevation_m=height_m)))
    power_w = np.append(driven.power_w, driven.power_w[-1]) + random.normal(0.0, NOISE_W, time_s.size)
    power_w += HEATER_W_PER_K * max(CABIN_C - ambient_c, 0.0)
    north_m, east_m = random.normal(0.0, POSITION_SD_M, (2, time_s.size))
    lat, lon = lat + north_m / METRE_PER_DEGREE, lon + east_m / (METRE_PER_DEGREE * np.cos(np.radians(lat)))
    rows = zip(time_s, speed_mps * KMH_PER_MPS, power_w, height_m, lat, lon, strict=True)
    lines = [f"{t:.0f},{v:.2f},{p:.0f},{ambient_c:.1f},{h:.1f},{y:.6f},{x:.6f}" for t, v, p, h, y, x in rows]
    return "\n".join([HEADER, *lines]) + "\n"


def _spans(service: Service, planner: Planner, random: np.random.Generator) -> tuple[LinkSpan, ...]:
    """The least-energy route between two nodes that are drawn at random."""
    graph = planner.graph
    while True:
        start, goal = random.integers(0, graph.node_lat_deg.size, 2)
        places = [{"lat": float(graph.node_lat_deg[n]), "lon": float(graph.node_lon_deg[n])} for n in (start, goal)]
        north = places[1]["lat"] - places[0]["lat"]
        east = (places[1]["lon"] - places[0]["lon"]) * np.cos(np.radians(places[0]["lat"]))
        if BETWEEN_KM[0] <= np.hypot(north, east) * METRE_PER_DEGREE / 1000.0 <= BETWEEN_KM[1]:
            break
    asked = {"start": places[0], "goal": places[1], "soc": 1.0, "graph": GRAPH, "vehicle": VEHICLE}
    found = service.route(RouteRequest.model_validate(asked)).routes[0]
    return tuple(LinkSpan(link.id, link.from_m, link.to_m) for link in found.links or [])


def _places(
    planner: Planner, spans: tuple[LinkSpan, ...], way_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Latitude, longitude [deg] and height [m] at ways from the beginning, float64 as way_m each."""
    graph = planner.graph
    corners: list[tuple[float, float, float, float]] = []  # way, lat, lon, height
    begun_m = 0.0
    for span in spans:
        lonlat = graph.geometry(span.link_idx)
        steps = np.hypot(np.diff(lonlat[:, 0]) * np.cos(np.radians(lonlat[0, 1])), np.diff(lonlat[:, 1]))
        share = np.append(0.0, np.cumsum(steps)) / steps.sum()
        ends_m = [graph.node_height_m[nodes[span.link_idx]] for nodes in (graph.tail, graph.head)]
        along_m = share * float(graph.length_m[span.link_idx]) - span.from_m + begun_m
        height_m = ends_m[0] + share * (ends_m[1] - ends_m[0])
        corners += zip(along_m.tolist(), lonlat[:, 1].tolist(), lonlat[:, 0].tolist(), height_m.tolist(), strict=True)
        begun_m += span.to_m - span.from_m
    along, lat, lon, height = np.array(corners).T
    return np.interp(way_m, along, lat), np.interp(way_m, along, lon), np.interp(way_m, along, height)
