"""What driving given links takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from energy.battery import soc_along
from energy.chain.chain import LinkModel, StopRule
from energy.chain.timestep import simulate_timestep
from energy.units import JOULE_PER_KWH, JOULE_PER_WH, KMH_PER_MPS
from joulepath.conditions import conditions_in_si
from joulepath.figures import EnergyParts, frozen, number_of, one_of, parts_of
from joulepath.routes import Route
from routing.errors import QueryError
from routing.places import LinkSpan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from joulepath.conditions import Conditions
    from joulepath.graph import Graph
    from joulepath.vehicle import Vehicle


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """Energy and time of driving links one after the other; columns have one value a link.

    battery_kwh: what the charge fell by, as of a Route. It and charges are None where no charge at departure was given;
    charges below 0 mean missing energy.
    """

    distance_m: float
    duration_s: float
    standstill_s: float
    stop_count: float
    energy_kwh: float
    battery_kwh: float | None
    energy_parts: EnergyParts
    soc_end_frac: float | None
    soc_min_frac: float | None
    braked_away_kwh: float | None
    link_idx: NDArray[np.int64]
    link_duration_s: NDArray[np.float64]
    link_energy_wh: NDArray[np.float64]
    link_speed_end_kmh: NDArray[np.float64]
    link_soc_end_frac: NDArray[np.float64] | None


def simulate(
    graph: Graph,
    vehicle: Vehicle,
    links: Route | Sequence[LinkSpan | int],
    *,
    soc_frac: float | None = None,
    model: str = "fast",
    stops: str | None = None,
    link_model: str = "integrated",
    arrive_stopped: bool = True,
    conditions: Conditions | None = None,
) -> Simulation:
    """What driving the links of a route takes, or stretches of links, or whole links by their index.

    model: "fast", link by link as the search has it, or "timestep" in steps of 0.1 s with braking that looks ahead.
    stops: "expected" (default of the fast model), "counted", "none", "crossings" (default of the other).

    Raises QueryError for a value out of range, LinkError where a link is not there, does not follow the one before or a
    stretch leaves it, ConditionsError where a model can't drive it so.
    """
    if model not in ("fast", "timestep"):
        raise QueryError("model", repr(model), "fast, timestep")
    if soc_frac is not None and not 0.0 <= number_of("soc_frac", soc_frac) <= 1.0:
        raise QueryError("soc_frac", soc_frac, "0..1")
    fast = model == "fast"
    rule = one_of("stops", stops or ("expected" if fast else "crossings"), StopRule)
    evaluation = one_of("link_model", link_model, LinkModel)
    if not fast and evaluation is not LinkModel.INTEGRATED:
        raise QueryError("link_model", repr(link_model), "integrated with the time-step model")
    spans = links.links.spans if isinstance(links, Route) else tuple(_span(graph, link) for link in links)
    driven_in = conditions_in_si(conditions)
    result = (
        graph.planner.simulate(
            spans,
            vehicle.model,
            conditions=driven_in,
            link_model=evaluation,
            stop_rule=rule,
            arrive_stopped=arrive_stopped,
            soc_start_frac=soc_frac,
        )
        if fast
        else simulate_timestep(
            vehicle.model,
            graph.planner.chain(spans, conditions=driven_in),
            conditions=driven_in,
            stop_rule=rule,
            arrive_stopped=arrive_stopped,
            soc_start_frac=soc_frac,
        )
    )
    energy_j = np.array([link.energy_j for link in result.links], np.float64)
    charge = None if soc_frac is None else soc_along(energy_j, soc_frac, vehicle.model.usable_capacity_wh)
    return Simulation(
        distance_m=result.distance_m,
        duration_s=result.duration_s,
        standstill_s=result.standstill_s,
        stop_count=result.stop_count,
        energy_kwh=result.energy_j / JOULE_PER_KWH,
        battery_kwh=None if charge is None else (result.energy_j + float(charge[1].sum())) / JOULE_PER_KWH,
        energy_parts=parts_of(result.parts),
        soc_end_frac=None if charge is None else float(charge[0][-1]),
        soc_min_frac=None if charge is None or soc_frac is None else min(soc_frac, float(charge[0].min())),
        braked_away_kwh=None if charge is None else float(charge[1].sum()) / JOULE_PER_KWH,
        link_idx=frozen([span.link_idx for span in spans], np.int64),
        link_duration_s=frozen([link.duration_s for link in result.links]),
        link_energy_wh=frozen(energy_j / JOULE_PER_WH),
        link_speed_end_kmh=frozen([link.carried_mps * KMH_PER_MPS for link in result.links]),
        link_soc_end_frac=None if charge is None else frozen(charge[0]),
    )


def _span(graph: Graph, link: LinkSpan | int) -> LinkSpan:
    if isinstance(link, LinkSpan):
        return link
    if isinstance(link, bool) or not isinstance(link, (int, np.integer)):
        raise QueryError("links", repr(link), "a route, or a list of LinkSpan and numbers of links")
    known = 0 <= link < graph.link_count  # of others the planner says so
    return LinkSpan(int(link), 0.0, float(graph.planner.graph.length_m[link]) if known else 0.0)
