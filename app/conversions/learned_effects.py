"""What a diagnosis has learned, as the effects that requests take."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from pydantic import TypeAdapter, ValidationError

from app.conversions.effects import schema_name
from app.schemas.effects import CELSIUS_FIELDS, TEMPERATURE_DIGITS, EffectsSent
from app.schemas.learned_effects import LearnedEffects, LearnedFrom, LearnedParameters, OpenCause
from diagnosis.answer.separation import sentence
from energy.units import ZERO_CELSIUS_K
from energy.vehicle.coefficients import COEFFICIENT_FLAGS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from diagnosis.answer.results import Diagnosis, Interval

SIGNIFICANT_DIGITS: Final = 9
GRADE_DIGITS: Final = 4
MAX_REASON_CHARS: Final = 1000


def learned_effects(
    diagnosis: Diagnosis,
    *,
    diagnosis_id: str | None,
    date: str,
    speed_kmh: float | None = None,
    grade: tuple[float, float] | None = None,
) -> LearnedEffects:
    """The content of effects.json; what requests would refuse is named in `not_carried` instead.

    diagnosis_id: None where the diagnosis is not stored. date: YYYY-MM-DD. speed_kmh, grade: the fastest [km/h] and the
    steepest (rise over length) that was driven, None where it was not recorded.
    """
    refused: dict[str, str] = {name: text[:MAX_REASON_CHARS] for name, text in diagnosis.not_carried.items()}
    shown = {schema_name(name): _shown(name, value) for name, value in diagnosis.effects.items()}
    strengths = _accepted(EffectsSent, shown, refused)
    numbers = {name: _rounded(value) for name, value in diagnosis.parameters.items()}
    parameters = LearnedParameters(**_accepted(LearnedParameters, numbers, refused)) if numbers else None
    return LearnedEffects(
        **strengths,
        parameters=parameters,
        learned_from=LearnedFrom(
            vehicle=diagnosis.vehicle_id,
            diagnosis=diagnosis_id,
            date=date,
            trips=len(diagnosis.fitted_trips),
            held_out_trips=len(diagnosis.held_out_trips),
            verdict=diagnosis.verdict.value,
            ambient_c=_ambient_c(diagnosis),
            speed_kmh=None if speed_kmh is None else round(speed_kmh, 1),
            grade=None if grade is None else [round(bound, GRADE_DIGITS) for bound in grade],
            open_causes=_open_causes(diagnosis),
            ci95={schema_name(name): _interval(name, ci95) for name, ci95 in diagnosis.effects_ci95.items()},
            not_carried=refused,
        ),
    )


def _ambient_c(diagnosis: Diagnosis) -> list[float] | None:
    """The coldest and the hottest of the fitted trips [°C]."""
    known = [trip.ambient_c for trip in diagnosis.trips if not trip.held_out and trip.ambient_c is not None]
    return [round(min(known), TEMPERATURE_DIGITS), round(max(known), TEMPERATURE_DIGITS)] if known else None


def _open_causes(diagnosis: Diagnosis) -> list[OpenCause]:
    """Findings that could as well be others, in words."""
    return [
        OpenCause(
            cause=sentence(finding.effect),
            rivals=[sentence(rival.effect) for rival in finding.ambiguous_with],
            recording=None if finding.separating_recording is None else finding.separating_recording[:MAX_REASON_CHARS],
        )
        for finding in diagnosis.findings
        if finding.ambiguous_with
    ]


def _accepted(
    schema: type[EffectsSent] | type[LearnedParameters], values: Mapping[str, float], refused: dict[str, str]
) -> dict[str, Any]:
    """The values that a schema takes; for the others a reason is put into `refused`."""
    accepted: dict[str, Any] = {}
    for name, value in values.items():
        try:
            TypeAdapter(schema).validate_python({name: value})
        except ValidationError as error:
            refused[name] = f"{value:g} is beyond what requests take: {error.errors()[0]['msg']}"[:MAX_REASON_CHARS]
        else:
            accepted[name] = value
    return accepted


def _shown(name: str, value: float) -> float | bool:
    if name in COEFFICIENT_FLAGS:
        return bool(value)
    return round(value - ZERO_CELSIUS_K, TEMPERATURE_DIGITS) if name in CELSIUS_FIELDS else _rounded(value)


def _rounded(value: float) -> float:
    return float(f"{value:.{SIGNIFICANT_DIGITS}g}")


def _interval(name: str, ci95: Interval) -> list[float] | None:
    if ci95 is None or not all(map(math.isfinite, ci95)):
        return None
    return [_shown(name, bound) for bound in ci95]
