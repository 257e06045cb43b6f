"""Effects that a diagnosis has learned, as requests take them: in place, or by the id of the diagnosis."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Discriminator, Field, Tag

from app.schemas.base import Count, Number, Sent
from app.schemas.effects import EffectsSent

MAX_NAMES: Final = 100
MAX_EFFECTS_ID_CHARS: Final = 200

Name = Annotated[str, Field(max_length=100)]
Reason = Annotated[str, Field(max_length=1000)]
Bounds = Annotated[list[Number], Field(min_length=2, max_length=2)]


class LearnedParameters(Sent):
    """Numbers in place of the vehicle's own; what is left out stays the vehicle's."""

    mass_kg: Number | None = Field(default=None, ge=1, le=100_000, description="total mass [kg]")
    road_load_a_n: Number | None = Field(default=None, ge=-1e6, le=1e6, description="constant resistance [N]")
    road_load_b_n_per_mps: Number | None = Field(
        default=None, ge=-1e6, le=1e6, description="resistance that grows with speed [N/(m/s)]"
    )
    road_load_c_n_per_mps2: Number | None = Field(
        default=None, ge=-1e6, le=1e6, description="resistance that grows with speed squared [N/(m/s)²]"
    )
    drive_eff: Number | None = Field(
        default=None, ge=0.01, le=1, description="efficiency from battery to wheel; times recuperation_eff ≤ 1"
    )
    recuperation_eff: Number | None = Field(
        default=None, ge=0, le=1, description="efficiency from wheel to battery; 0 for none"
    )
    aux_power_w: Number | None = Field(default=None, ge=0, le=100_000, description="power of the auxiliaries [W]")
    usable_capacity_wh: Number | None = Field(
        default=None, ge=1, le=1e7, description="usable energy of the battery [Wh]; charges and ranges follow it"
    )
    residual_sd_frac: Number | None = Field(
        default=None,
        ge=0,
        le=0.5,
        description="standard deviation of a trip's dissipated energy about the model's, as trips that were left out"
        " showed it; quantiles use it in place of the usual one and of the sd of the numbers that are carried",
    )


class OpenCause(Sent):
    """A cause that could as well be another one, in words, and the recording that would tell."""

    cause: Name
    rivals: list[Name] = Field(min_length=1, max_length=MAX_NAMES, description="what it could be as well")
    recording: Reason | None = Field(default=None, description="what would tell them apart")


class LearnedFrom(Sent):
    """Where learned effects come from; told back, and used for nothing but warnings."""

    vehicle: str | None = Field(default=None, max_length=200, description="id of the vehicle that was diagnosed")
    diagnosis: str | None = Field(default=None, max_length=200, description="id of the diagnosis")
    date: str | None = Field(default=None, max_length=40, description="day of the diagnosis, YYYY-MM-DD")
    trips: Count | None = Field(default=None, ge=0, description="trips that were fitted")
    held_out_trips: Count | None = Field(default=None, ge=0, description="trips that were kept out of the fit")
    verdict: Annotated[str, Field(max_length=40)] | None = Field(
        default=None, description="of the diagnosis; at `cannot_tell` requests are warned"
    )
    ambient_c: Bounds | None = Field(
        default=None, description="coldest and hottest of the fitted trips [°C]; beyond it requests are warned"
    )
    speed_kmh: Number | None = Field(
        default=None,
        ge=0,
        description="fastest that the fitted trips held for 10 s in sum [km/h]; beyond it requests are warned",
    )
    grade: Bounds | None = Field(
        default=None,
        description="steepest descent and climb that 200 m in sum of the fitted trips had, rise over length, where"
        " height was recorded; beyond it requests are warned",
    )
    open_causes: list[OpenCause] = Field(
        default=[], max_length=MAX_NAMES, description="findings that could as well be others; requests are warned"
    )
    ci95: dict[Name, Bounds | None] = Field(
        default={}, max_length=MAX_NAMES, description="95 % interval of a learned number by its field, in its unit"
    )
    not_carried: dict[Name, Reason] = Field(
        default={}, max_length=MAX_NAMES, description="findings that routes and ranges can't use, and why"
    )


class LearnedEffects(EffectsSent):
    """Strengths of effects and numbers of the vehicle in place of its own; effects.json of a diagnosis is this."""

    parameters: LearnedParameters | None = Field(default=None, description="numbers in place of the vehicle's own")
    learned_from: LearnedFrom | None = Field(default=None, description="told back only")


# names of branches hold a space, so that no field can be of the same name
EFFECTS_ID_BRANCH: Final = "effects id"
EFFECTS_BRANCH: Final = "effects object"


def _form(value: object) -> str | None:
    if isinstance(value, str):
        return EFFECTS_ID_BRANCH
    return EFFECTS_BRANCH if isinstance(value, (dict, EffectsSent)) else None


EffectsChoice = Annotated[
    Annotated[
        str, Field(max_length=MAX_EFFECTS_ID_CHARS, description="id of a finished diagnosis"), Tag(EFFECTS_ID_BRANCH)
    ]
    | Annotated[LearnedEffects, Tag(EFFECTS_BRANCH)],
    Discriminator(
        _form,
        custom_error_type="effects",
        custom_error_message="the id of a finished diagnosis, or an object of strengths of effects",
    ),
]
