"""What energy and charge come to, beside what an engine answers: the object `ev` of routes, legs and steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from energy.units import JOULE_PER_KWH

if TYPE_CHECKING:
    from routing.guidance.step import Step
    from routing.route.route import Route, RouteAnswer, RouteLeg

SOC_DIGITS: Final = 5
KWH_DIGITS: Final = 5


def electric_route(route: Route) -> dict[str, object]:
    """Energy and charge of a route."""
    return {
        "name": route.name,
        "feasible": route.feasible,
        "energy_kwh": kwh(route.energy_j),
        "battery_kwh": kwh(route.battery_j),
        "soc_start": soc(route.soc_start_frac),
        "soc_end": soc(route.soc_end_frac),
        "soc_min": soc(route.soc_min_frac),
        "deficit_kwh": kwh(route.deficit_j),
        "climb_m": round(route.climb_m, 1),
        "descent_m": round(route.descent_m, 1),
        "stop_s": round(route.stop_s, 1),
    }


def electric_leg(leg: RouteLeg) -> dict[str, object]:
    """Energy and charge of a leg, and what it leads to."""
    return {
        "energy_kwh": kwh(leg.energy_j),
        "soc_start": soc(leg.soc_start_frac),
        "soc_end": soc(leg.soc_end_frac),
        "ends_at": leg.ends_at.value,
    }


def electric_step(step: Step) -> dict[str, object]:
    """Energy and charge of a step."""
    return {
        "energy_kwh": kwh(step.energy_j),
        "soc_start": soc(step.soc_start_frac),
        "soc_end": soc(step.soc_end_frac),
    }


def notes_of(answer: RouteAnswer) -> list[str]:
    """What is to be said of routes: that the charge does not suffice, and warnings."""
    short = [
        f"the charge does not suffice for route {route.name!r}: {route.deficit_j / JOULE_PER_KWH:.2f} kWh are missing"
        for route in answer.routes
        if not route.feasible
    ]
    return [*short, *answer.warnings]


def kwh(energy_j: float) -> float:
    """Energy as it is answered [kWh]."""
    return round(energy_j / JOULE_PER_KWH, KWH_DIGITS)


def soc(charge_frac: float) -> float:
    """State of charge as it is answered."""
    return round(charge_frac, SOC_DIGITS)


def rounded(value: float | None) -> float | None:
    """A figure of a matrix in kWh, or a state of charge."""
    return None if value is None else round(value, KWH_DIGITS)
