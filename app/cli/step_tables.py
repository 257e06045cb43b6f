"""What a driver is told along routes, as tables for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape
from rich.table import Table

from energy.units import SECOND_PER_MINUTE

if TYPE_CHECKING:
    from app.schemas.guidance.steps import LaneAnswer, StepAnswer
    from app.schemas.route import RouteFound

KM_FROM_M = 1000.0  # below it lengths are told in metres


def steps_table(route: RouteFound) -> Table:
    """One line a step: where along the route it is, what to do there, and the way from there to the next one."""
    table = Table("at km", title=f"{route.name}: steps", title_justify="left")
    table.add_column("what to do", overflow="fold")
    for heading in ("go on for", "min", "kWh", "charge %"):
        table.add_column(heading, justify="right", no_wrap=True)
    at_m = 0.0
    for step in route.steps or []:
        ends = step.ends_at is not None
        table.add_row(
            f"{at_m / 1000.0:.2f}",
            escape(step.instruction + _lanes_text(step.lanes)),
            "" if ends else length_text(step.distance_m),
            "" if ends else f"{step.duration_s / SECOND_PER_MINUTE:.1f}",
            "" if ends else f"{step.energy_kwh:.2f}",
            _charge_text(step),
            end_section=ends,
        )
        at_m += step.distance_m
    return table


def length_text(distance_m: float) -> str:
    """A length as drivers read it: `350 m`, `2.1 km`."""
    return f"{distance_m:.0f} m" if distance_m < KM_FROM_M else f"{distance_m / 1000.0:.1f} km"


def _charge_text(step: StepAnswer) -> str:
    return f"{100.0 * step.soc_start:.1f}"


def _lanes_text(lanes: list[LaneAnswer]) -> str:
    """Which lanes lead on, counted from the left; nothing where all do or none is known to."""
    valid = [k for k, lane in enumerate(lanes, 1) if lane.valid]
    if not valid or len(valid) == len(lanes):
        return ""
    which = f"lane {valid[0]}" if len(valid) == 1 else f"lanes {', '.join(map(str, valid))}"
    return f" ({which} of {len(lanes)} from the left)"
