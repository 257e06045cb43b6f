"""The picture in README.md, drawn from real answers; run as `python docs/draw_answer.py` to renew it."""

from __future__ import annotations

import math
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Final

import matplotlib as mpl
import numpy as np

mpl.use("Agg")

from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from PIL import Image

from app.schemas.range import BandFeature, RangeFeatureCollection, RangeRequest
from app.schemas.route import RouteFound, RouteRequest, RouteResponse
from app.service import Service
from app.settings import Settings
from energy.stops import FunctionalClass

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from routing.graph import RoadGraph

PICTURE: Final = Path(__file__).resolve().parent / "images" / "route-and-range.png"
START: Final = {"lat": 43.872, "lon": -36.433}  # in the town of Kelbekirk
GOAL: Final = {"lat": 43.697, "lon": -35.19}  # in the town of Wensenfell
SOC: Final = 0.5
RESERVE_SOC: Final = 0.1
BANDS_SOC: Final = (0.1, 0.2, 0.3, 0.4)
KEY_ROOM_DEG: Final = 0.17  # above the roads
KM_PER_DEGREE: Final = 111.195  # of latitude, on a sphere of 6371 km

BAND_COLOURS: Final = ("#e3eef7", "#c1dbec", "#93c1de", "#5b9bc4")  # the most charge left is darkest
ROUTE_COLOURS: Final = {"eco": "#1b6e2c", "fastest": "#c51b7d"}
PLATE: Final = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}  # under a text
ROAD_WIDTHS: Final = {
    FunctionalClass.MOTORWAY: 1.3,
    FunctionalClass.TRUNK: 0.9,
    FunctionalClass.PRIMARY: 0.6,
    FunctionalClass.SECONDARY: 0.45,
    FunctionalClass.TERTIARY: 0.3,
    FunctionalClass.UNCLASSIFIED: 0.2,
}


def ask(service: Service) -> tuple[RouteResponse, RangeFeatureCollection]:
    """What POST /route and POST /range answer."""
    common = {"soc": SOC, "reserve_soc": RESERVE_SOC}
    routes = RouteRequest.model_validate({"start": START, "goal": GOAL, "alternatives": ["eco", "fastest"], **common})
    area = RangeRequest.model_validate({"origin": START, "bands": list(BANDS_SOC), **common})
    return service.route(routes), service.range(area)


def draw_roads(axes: Axes, graph: RoadGraph) -> None:
    """All roads from unclassified upwards, both directions once."""
    for road_class, width in ROAD_WIDTHS.items():
        chosen = np.flatnonzero(graph.functional_class == road_class)
        once = chosen[(graph.reverse_idx[chosen] < 0) | (graph.reverse_idx[chosen] > chosen)]
        lines = [graph.geometry(int(link)) for link in once]
        axes.add_collection(LineCollection(lines, colors="#5b5b5b", linewidths=width, alpha=0.75, zorder=2))


def draw_band(axes: Axes, band: BandFeature, colour: str) -> None:
    """One band of the reachable area, with its holes."""
    for polygon in band.geometry.coordinates:
        outline = Outline.make_compound_path(*(Outline(ring, closed=True) for ring in polygon))
        axes.add_patch(PathPatch(outline, facecolor=colour, edgecolor="#3d7ea8", linewidth=0.4, zorder=1))


def draw_route(axes: Axes, route: RouteFound) -> None:
    """One route with a light rim."""
    lon, lat = zip(*route.geometry.coordinates, strict=True)
    axes.plot(lon, lat, color="white", linewidth=4.2, zorder=4, solid_capstyle="round")
    axes.plot(lon, lat, color=ROUTE_COLOURS[route.name], linewidth=2.4, zorder=5, solid_capstyle="round")


def draw_scale(axes: Axes, west: float, south: float, length_km: float) -> None:
    """A bar of known length."""
    width = length_km / (KM_PER_DEGREE * math.cos(math.radians(south)))
    axes.plot([west, west + width], [south, south], color="black", linewidth=3, solid_capstyle="butt", zorder=7)
    middle = (west + width / 2.0, south)
    axes.annotate(f"{length_km:g} km", middle, (0, 6), textcoords="offset points", ha="center", bbox=PLATE, zorder=7)


def draw_place(axes: Axes, lon: float, lat: float, label: str, offset: tuple[float, float]) -> None:
    """A named place."""
    axes.plot([lon], [lat], "o", markersize=9, markerfacecolor="white", markeredgecolor="black", zorder=8)
    where = {"textcoords": "offset points", "ha": "center", "zorder": 9}
    axes.annotate(label, (lon, lat), offset, weight="bold", bbox=PLATE, **where)


def percent(share: float) -> str:
    """A share in whole per cent."""
    return f"{100.0 * share:.0f} %"


def told(route: RouteFound) -> str:
    """A route in one line."""
    return (
        f"{route.name}: {route.energy_kwh:.1f} kWh, {route.duration_s / 60:.0f} min, {route.distance_m / 1000:.0f} km, "
        f"arrives with {percent(route.soc_end)}"
    )


def draw_map(axes: Axes, graph: RoadGraph, routes: RouteResponse, area: RangeFeatureCollection) -> None:
    """Bands, roads and routes, with their legend."""
    west, south, east, north = graph.meta.bbox
    axes.set(xlim=(west - 0.02, east + 0.02), ylim=(south - 0.02, north + KEY_ROOM_DEG), xticks=[], yticks=[])
    axes.set_aspect(1.0 / math.cos(math.radians((south + north) / 2.0)))
    bands = [feature for feature in area.features if isinstance(feature, BandFeature)]
    for band, colour in zip(bands, BAND_COLOURS, strict=True):
        draw_band(axes, band, colour)
    draw_roads(axes, graph)
    for route in reversed(routes.routes):
        draw_route(axes, route)
    draw_scale(axes, west + 0.03, south + 0.03, 20.0)
    ends = routes.snapped
    draw_place(axes, ends.start.on_road.lon, ends.start.on_road.lat, f"start with {percent(SOC)}", (0, 12))
    draw_place(axes, ends.goal.on_road.lon, ends.goal.on_road.lat, "goal", (0, 12))
    lines = [Line2D([], [], color=ROUTE_COLOURS[r.name], linewidth=2.4, label=told(r)) for r in routes.routes]
    patches = [
        Patch(
            facecolor=colour,
            edgecolor="#3d7ea8",
            linewidth=0.4,
            label=f"{percent(band.properties.soc_left)} left: {band.properties.area_km2:.0f} km²",
        )
        for band, colour in zip(bands, BAND_COLOURS, strict=True)
    ]
    look = {"framealpha": 0.93, "fontsize": 9.5, "borderpad": 0.6}
    routes_key = axes.legend(
        handles=lines,
        loc="upper left",
        title=f"Routes that keep {percent(RESERVE_SOC)} (eco: least energy, fastest: least time)",
        **look,
    )
    axes.add_artist(routes_key).set_zorder(10)
    axes.legend(handles=patches, loc="upper right", title="Reachable with at least", **look).set_zorder(10)


def draw_profile(axes: Axes, routes: RouteResponse) -> None:
    """State of charge at the end of every link over the way driven."""
    for route in routes.routes:
        links = route.links or []
        way_km = np.concatenate(([0.0], np.cumsum([link.length_m for link in links]) / 1000.0))
        soc_percent = 100.0 * np.array([route.soc_start, *(link.soc_end for link in links)])
        axes.plot(way_km, soc_percent, color=ROUTE_COLOURS[route.name], linewidth=1.8, label=route.name)
    axes.axhline(100.0 * RESERVE_SOC, color="black", linewidth=0.9, linestyle="--")
    axes.annotate("reserve", (0.5, 100.0 * RESERVE_SOC), (0, 3), textcoords="offset points")
    axes.set(xlabel="way driven [km]", ylabel="state of charge [%]", xlim=(0.0, None), ylim=(0.0, 100.0 * SOC + 2.0))
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def draw() -> None:
    """Ask the bundled graph and write the picture."""
    service = Service(Settings())
    graph = service.atlas.planner(service.settings.default_graph).graph
    routes, area = ask(service)
    vehicle = service.known_vehicle(service.settings.default_vehicle)
    plt.rcParams.update({"font.size": 10, "font.family": "DejaVu Sans"})
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(11, 10.9), height_ratios=(4.8, 1), layout="constrained")
    top.set_title(f"{vehicle.name}: two routes, and how far the charge goes", fontsize=13)
    draw_map(top, graph, routes, area)
    draw_profile(bottom, routes)
    note = f"Graph '{graph.meta.name}'. {graph.meta.attribution}; terrain {graph.meta.terrain}. {graph.meta.licence}."
    figure.supxlabel(note, fontsize=9, color="#444444")
    drawn = BytesIO()
    figure.savefig(drawn, dpi=100)
    plt.close(figure)
    few_colours = Image.open(drawn).convert("RGB").quantize(64, dither=Image.Dither.NONE)
    few_colours.save(PICTURE, optimize=True)


if __name__ == "__main__":
    draw()
