"""Given links driven by either model: the link-energy model of the search, or time steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from app.conversions.course import Course, DrivenCourse, stops_of
from app.schemas.simulation import SimulationModel
from energy.chain.chain import Chain, LinkModel, StopRule, simulate_chain
from energy.chain.profile import chain_profile
from energy.chain.timestep import simulate_timestep
from energy.vehicle.consumption_table import ConsumptionTableVehicle

if TYPE_CHECKING:
    from app.schemas.simulation import SimulateRequest
    from energy.chain.profile import SpeedProfile
    from energy.chain.timestep import DriveResult
    from energy.vehicle.files import AnyVehicle


def drive(course: Course, sent: SimulateRequest) -> DrivenCourse:
    """What driving a course takes by the model that a request names."""
    if sent.model is SimulationModel.TIMESTEP:
        result = _timestep(course, sent, stops_of(sent), profile=sent.profile)
        return DrivenCourse(result, result.profile)
    return DrivenCourse(
        simulate_chain(
            course.vehicle,
            course.chain,
            conditions=course.conditions,
            link_model=sent.link_model,
            stop_rule=stops_of(sent),
            arrive_stopped=sent.arrive_stopped,
            soc_start_frac=sent.soc,
        ),
        _fast_profile(course, sent, stops_of(sent)) if sent.profile else None,
    )


def profiles(course: Course, sent: SimulateRequest) -> dict[SimulationModel, SpeedProfile]:
    """The speed along a course by both models under one stop rule, that of the request or `counted` for `expected`.

    A consumption table and equations as printed have the fast model's only.
    """
    rule = StopRule.COUNTED if stops_of(sent) is StopRule.EXPECTED else stops_of(sent)
    drawn = {SimulationModel.FAST: _fast_profile(course, sent, rule)}
    if sent.link_model is LinkModel.INTEGRATED and not isinstance(course.vehicle, ConsumptionTableVehicle):
        stepped = _timestep(course, sent, rule, profile=True).profile
        assert stepped is not None, "asked for"
        drawn[SimulationModel.TIMESTEP] = stepped
    return drawn


def warm_up(vehicle: AnyVehicle) -> None:
    """Compile the time-step model before the first request asks for it; routing.planner does so for the fast one."""
    if not isinstance(vehicle, ConsumptionTableVehicle):
        nothing = np.zeros(1)
        link = Chain(np.array([10.0]), nothing, np.array([10.0]), nothing, nothing, np.zeros(1, np.int8))
        simulate_timestep(vehicle, link)


def _timestep(course: Course, sent: SimulateRequest, rule: StopRule, *, profile: bool) -> DriveResult:
    return simulate_timestep(
        course.vehicle,
        course.chain,
        conditions=course.conditions,
        stop_rule=rule,
        arrive_stopped=sent.arrive_stopped,
        soc_start_frac=sent.soc,
        profile=profile,
    )


def _fast_profile(course: Course, sent: SimulateRequest, rule: StopRule) -> SpeedProfile:
    return chain_profile(
        course.vehicle,
        course.chain,
        conditions=course.conditions,
        link_model=sent.link_model,
        stop_rule=rule,
        arrive_stopped=sent.arrive_stopped,
    )
