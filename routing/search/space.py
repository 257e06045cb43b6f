"""A graph as one vehicle sees it: link arrays, dominance bounds, and what directs searches."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import LinkModel, StopRule
from energy.chain.kernels_link import CARRIED_MPS, TOUCH_MPS, mean_over_intervals
from energy.conditions import STILL, Conditions
from energy.force import kernels_physics
from energy.force.effects import LinkSetting, drive_of
from energy.force.kernels_physics import LinkPhysics
from energy.stops import StopSettings
from routing.dominance import kernels_rules
from routing.dominance.bounds import least_load_n, slack_bounds, slack_rules
from routing.dominance.kernels_rules import SlackRules
from routing.links import kernels_links, kernels_tables
from routing.links.drives import Drives
from routing.links.kernels_tables import LinkArrays
from routing.links.stops import link_stops
from routing.lower_bound.lower_bound import LowerBound
from routing.time_budget import time_budget

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from energy.force.effects import Drive
    from energy.vehicle.files import AnyVehicle
    from routing.graph.link_copies import LinkCopies
    from routing.graph.road_graph import RoadGraph

LOAD_NOISE_N: Final = 1e-9  # a road load that is lifted to 0 may miss it by rounding


@dataclass(frozen=True, slots=True)
class SearchSpace:
    """A graph as one vehicle sees it: what the kernel reads, computed once per vehicle, conditions and settings.

    least_load_n: least road load on any link at a speed that is driven there [N]. copies: of links, as of RoadGraph.
    """

    arrays: LinkArrays
    physics: LinkPhysics
    slack: SlackRules
    half_inertia_kg: float
    drives: Drives
    lower_bound: LowerBound
    least_load_n: float
    copies: LinkCopies | None = None

    @property
    def held_bytes(self) -> int:
        """Memory of its arrays, without known drives, which are counted on their own [B]."""
        arrays = self.arrays
        own = (arrays.row, arrays.roads, arrays.top_class, arrays.settling_m)
        return sum(array.nbytes for array in own) + self.lower_bound.held_bytes

    @property
    def conserving(self) -> bool:
        """Whether no link gives back more than height and speed hold, so that labels can be set (lemma 1)."""
        return not self.physics.printed and self.least_load_n >= -LOAD_NOISE_N

    def originals(self, links: Sequence[int]) -> tuple[int, ...]:
        """Links as RoadGraph.originals has them."""
        if self.copies is None:
            return tuple(links)
        count = self.arrays.length_m.size - self.copies.of.size
        return tuple(link if link < count else int(self.copies.of[link - count]) for link in links)

    def join_reach(self, link_reach_m: NDArray[np.float64]) -> None:
        """Count what is reached on copies of links, float64 (M,), for these links, and the other way round."""
        if self.copies is not None:
            np.maximum.at(link_reach_m, self.copies.of, link_reach_m[-self.copies.of.size :].copy())
            self.copy_values(link_reach_m)

    def copy_values(self, link_value: NDArray[np.float64]) -> None:
        """Give copies of links the values of these links, float64 (M,)."""
        if self.copies is not None:
            link_value[-self.copies.of.size :] = link_value[self.copies.of]

    def carried_s(self, links: Sequence[int]) -> float:
        """Time on board of ferries on a way of links [s]."""
        if not self.arrays.carries:
            return 0.0
        row = self.arrays.row[list(links)]
        return float(row[row[:, kernels_tables.LIMIT] < 0.0, kernels_tables.CRUISE_S].sum())

    def still_owed_j(self, clock_s: float) -> float:
        """Most that an earlier drive may yet pay more than a later one while cabin and tyres warm up (lemma 8) [J].

        clock_s: time since departure at which the earlier one is, or any before it [s].
        """
        owed_j, tyre_s = 0.0, self.physics.tyre_time_s
        if self.slack.cabin_start_w > 0.0:
            owed_j += self.slack.cabin_start_w * self.slack.cabin_time_s * math.exp(-clock_s / self.slack.cabin_time_s)
        if tyre_s > 0.0:
            cold_w = float(self.slack.bounds[kernels_rules.WARM_UP_W, 0]) * math.exp(-clock_s / tyre_s)
            owed_j += tyre_s * max(cold_w, float(self.slack.bounds[kernels_rules.WARM_LATE_W, 0]))
        return owed_j


def link_setting(graph: RoadGraph, drive: Drive) -> LinkSetting:
    """The links of a graph as conditions see them: grade, speed driven, mean altitude, mean heading."""
    return LinkSetting(
        grade_frac=graph.climb_m() / graph.length_m,
        driven_mps=drive.driven_mps(graph.limit_mps(drive.conditions)),
        altitude_m=graph.altitude_m(),
        heading=graph.heading(),
    )


def search_space(
    graph: RoadGraph,
    vehicle: AnyVehicle,
    link_model: LinkModel,
    stop_rule: StopRule,
    settings: StopSettings,
    conditions: Conditions = STILL,
) -> SearchSpace:
    """Everything that the kernel needs to know of a graph for one vehicle under given conditions, in O(M).

    The rule `counted` depends on the way so far and has no state graph; the search then uses `expected`.
    Raises ConditionsError where a vehicle cannot feel a condition, and as TimeBudget.check does, which is asked before
    each step that takes a fraction of a second for a million links.
    """
    drive = drive_of(vehicle, conditions, printed=link_model is LinkModel.PRINTED)
    physics = drive.physics
    probability, wait = link_stops(graph, settings, stop_rule)
    time_budget().check()
    setting = link_setting(graph, drive)
    driven = setting.driven_mps
    time_budget().check()
    roads = drive.roads(setting, wait)
    carried = graph.is_ferry()
    interval, run_up, settling = _run_up(physics, driven)
    run_up[carried] = settling[carried] = 0.0  # all board at rest
    time_budget().check()
    top = interval.copy()
    kernels_links.top_classes(graph.length_m, graph.successor_first, graph.successor, run_up, top)
    half_inertia = 0.5 * physics.inertia_kg
    row = np.zeros((graph.link_count, 8))
    row[:, kernels_tables.LENGTH] = graph.length_m
    row[:, kernels_tables.LIMIT] = np.where(carried, CARRIED_MPS, driven)
    row[:, kernels_tables.HEIGHT] = graph.node_height_m[graph.tail]
    row[:, kernels_tables.STOP] = probability
    time_budget().check()
    kernels_links.fill_cruise(physics, row, roads)
    time_budget().check()
    if graph.ferries is not None:
        row[graph.ferries.link, kernels_tables.CRUISE_S] = graph.ferries.duration_s
    arrays = LinkArrays(
        row=row,
        roads=roads,
        tail_height_m=row[:, kernels_tables.HEIGHT],
        length_m=row[:, kernels_tables.LENGTH],
        grade_frac=roads[:, kernels_physics.ROAD_GRADE],
        speed_limit_mps=row[:, kernels_tables.LIMIT],
        stop_probability_frac=row[:, kernels_tables.STOP],
        stop_time_s=roads[:, kernels_physics.ROAD_WAIT],
        successor_first=graph.successor_first,
        successor=graph.successor,
        top_class=top,
        settling_m=settling,
        carries=graph.ferries is not None,
    )
    slack = slack_rules(physics, roads, driven)
    slack = slack._replace(bounds=slack_bounds(physics, slack, half_inertia, roads, driven))
    lower_bound = LowerBound(graph, arrays, physics, slack, potential_share(physics))
    time_budget().check()
    least_n = least_load_n(physics, roads, driven)
    drives = Drives(graph.successor_first)
    return SearchSpace(arrays, physics, slack, half_inertia, drives, lower_bound, least_n, graph.copies)


def potential_share(physics: LinkPhysics) -> float:
    """α of the potential of lemma 1, half-way between η_chg and 1/η_dis."""
    return 0.5 * (physics.drive_factor + physics.recuperation_factor)


def _run_up(
    physics: LinkPhysics, limit_mps: NDArray[np.float64]
) -> tuple[NDArray[np.int8], NDArray[np.float64], NDArray[np.float64]]:
    """Speed interval of each limit, distance in which any entry reaches it, and that plus the longest braking [m]."""
    bound = physics.speed_bound_mps
    distinct, inverse = np.unique(limit_mps, return_inverse=True)
    edge = np.asarray(distinct - TOUCH_MPS, np.float64)
    interval: NDArray[np.intp] = np.clip(np.searchsorted(bound, edge, side="left") - 1, 0, bound.size - 2)
    run_up, settling = np.empty(distinct.size), np.empty(distinct.size)
    for k, limit in enumerate(distinct.tolist()):
        entries = np.append(bound[bound < limit], 0.0)
        run_up[k] = max(
            (limit**2 - v**2) / (2.0 * mean_over_intervals(bound, physics.accel_sum, v, limit))
            for v in entries.tolist()
        )
        settling[k] = run_up[k] + max(
            (limit**2 - v**2) / (2.0 * mean_over_intervals(bound, physics.decel_sum, v, limit))
            for v in entries.tolist()
        )
    return interval[inverse].astype(np.int8), run_up[inverse], settling[inverse]
