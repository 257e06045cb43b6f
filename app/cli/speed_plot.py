"""A picture of the speed along a chain of links, by one model or by both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from app.schemas.simulation import SimulationModel
from energy.units import KMH_PER_MPS

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from energy.chain.profile import SpeedProfile

NAMES: Final = {SimulationModel.FAST: "fast model", SimulationModel.TIMESTEP: "time steps"}
COLOURS: Final = {SimulationModel.FAST: "#0072b2", SimulationModel.TIMESTEP: "#d55e00"}  # told apart by all eyes
WIDTHS: Final = {SimulationModel.FAST: 2.2, SimulationModel.TIMESTEP: 1.0}  # the thinner one lies on top
LIMIT_COLOUR: Final = "#999999"
SIZE_INCH: Final = (11.0, 6.5)
DOTS_PER_INCH: Final = 150
KM_FROM_M: Final = 3000.0  # a longer way is shown in km
MIN_FROM_S: Final = 600.0  # a longer drive is shown in minutes


def draw_speeds(
    path: Path,
    profiles: Mapping[SimulationModel, SpeedProfile],
    length_m: NDArray[np.float64],
    speed_limit_mps: NDArray[np.float64],
    title: str = "",
) -> None:
    """Write a PNG of speed over way and over time; limits as steps, in the lower panel as the last drive meets them.

    length_m, speed_limit_mps: float64 (n,) of the links driven, the limits as they are posted.
    Raises OSError where the file can't be written.
    """
    figure = Figure(figsize=SIZE_INCH, dpi=DOTS_PER_INCH, layout="constrained")
    FigureCanvasAgg(figure)
    over_way, over_time = figure.subplots(2, 1)
    ends_m = np.concatenate(([0.0], np.cumsum(length_m)))
    last = list(profiles.values())[-1]
    per_km, way_unit = (1000.0, "km") if ends_m[-1] > KM_FROM_M else (1.0, "m")
    longest_s = max(float(profile.time_s[-1]) for profile in profiles.values())
    per_min, time_unit = (60.0, "min") if longest_s > MIN_FROM_S else (1.0, "s")
    _draw_limit(over_way, ends_m / per_km, speed_limit_mps)
    _draw_limit(over_time, _times_at(last, ends_m) / per_min, speed_limit_mps)
    for model, profile in profiles.items():
        kmh = profile.speed_mps * KMH_PER_MPS
        label = f"{NAMES[model]}, {_minutes(float(profile.time_s[-1]))}, stops '{profile.stop_rule.value}'"
        style = {"color": COLOURS[model], "linewidth": WIDTHS[model], "label": label}
        over_way.plot(profile.distance_m / per_km, kmh, **style)
        over_time.plot(profile.time_s / per_min, kmh, **style)
    over_way.set_xlabel(f"way [{way_unit}]")
    over_time.set_xlabel(f"time [{time_unit}]")
    over_way.set_xlim(0.0, ends_m[-1] / per_km)
    over_time.set_xlim(0.0, longest_s / per_min)
    for axes in (over_way, over_time):
        axes.set_ylabel("speed [km/h]")
        axes.set_ylim(
            0.0, 1.08 * KMH_PER_MPS * float(max(speed_limit_mps.max(), *(_top(p) for p in profiles.values())))
        )
        axes.grid(alpha=0.25)
    figure.legend(*over_way.get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    if title:
        over_way.set_title(title, fontsize="medium")
    figure.savefig(path, format="png")


def _draw_limit(axes: Axes, ends: NDArray[np.float64], limit_mps: NDArray[np.float64]) -> None:
    axes.stairs(limit_mps * KMH_PER_MPS, ends, baseline=None, color=LIMIT_COLOUR, linestyle="--", label="limit")


def _times_at(profile: SpeedProfile, way_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """When a drive gets to given places; constant acceleration between its points [s]."""
    after = np.searchsorted(profile.distance_m, way_m - 1e-6, side="right").clip(1, profile.distance_m.size - 1)
    before = after - 1
    ds = way_m - profile.distance_m[before]
    whole_m = profile.distance_m[after] - profile.distance_m[before]
    v0, v1 = profile.speed_mps[before], profile.speed_mps[after]
    share = np.divide(ds, whole_m, out=np.zeros_like(ds), where=whole_m > 0.0).clip(0.0, 1.0)
    v = np.sqrt(v0 * v0 + share * (v1 * v1 - v0 * v0))
    passed = np.divide(2.0 * ds, v0 + v, out=np.zeros_like(ds), where=(v0 + v) > 0.0)
    return np.asarray(profile.time_s[before] + passed, np.float64)


def _top(profile: SpeedProfile) -> float:
    return float(profile.speed_mps.max())


def _minutes(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 60} min {whole % 60:02d} s" if whole >= 60 else f"{seconds:.1f} s"
