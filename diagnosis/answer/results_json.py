"""A diagnosis as JSON, rounded to what its intervals carry."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from diagnosis.answer.results import Diagnosis, FitScore, Interval

if TYPE_CHECKING:
    from diagnosis.answer.regimes import Regime


SIGNIFICANT_DIGITS: Final = 6


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The object of diagnosis.json, without timelines; numbers rounded to SIGNIFICANT_DIGITS."""
    return {
        "verdict": diagnosis.verdict.value,
        "text": diagnosis.text,
        "findings": [
            {
                "effect": one.effect,
                "family": one.family.value,
                "text": one.text,
                "coefficients": {
                    each.name: {"value": _n(each.value), "unit": each.unit, "ci95": _ci(each.ci95)}
                    for each in one.coefficients
                },
                "energy_kwh": _n(one.energy_kwh),
                "energy_kwh_ci95": _ci(one.energy_kwh_ci95),
                "energy_share": _n(one.energy_share_frac),
                "t": _n(one.t),
                "located": [_regime(each) for each in one.located],
                "trips": list(one.trips),
                "ambiguous_with": [{"effect": each.effect, "family": each.family.value} for each in one.ambiguous_with],
                "separating_recording": one.separating_recording,
            }
            for one in diagnosis.findings
        ],
        "parameter_errors": [
            {
                "parameter": one.parameter,
                "family": one.family.value,
                "unit": one.unit,
                "nameplate": _n(one.nameplate),
                "fitted": _n(one.fitted),
                "ci95": _ci(one.ci95),
                "energy_kwh": _n(one.energy_kwh),
                "energy_share": _n(one.energy_share_frac),
                "aliases": list(one.aliases),
                "text": one.text,
            }
            for one in diagnosis.parameter_errors
        ],
        "unexplained": [
            {
                "axis": one.axis,
                "unit": one.unit,
                "interval": [_n(one.low), _n(one.high)],
                "mean_w": _n(one.mean_w),
                "ci95_w": _ci(one.ci95_w),
                "energy_kwh": _n(one.energy_kwh),
                "p": _n(one.p),
                "trips": list(one.trips),
                "text": one.text,
            }
            for one in diagnosis.unexplained
        ],
        "data_quality": [
            {"trip": one.trip_id, "kind": one.kind, "channel": one.channel, "text": one.text}
            for one in diagnosis.data_quality
        ],
        "fit": {
            "fitted_trips": list(diagnosis.fitted_trips),
            "held_out_trips": list(diagnosis.held_out_trips),
            "before": _score(diagnosis.before),
            "after": _score(diagnosis.after),
            "routes": _score(diagnosis.routes),
        },
        "regimes": {
            "before": [_regime(one) for one in diagnosis.regimes_before],
            "after": [_regime(one) for one in diagnosis.regimes_after],
        },
        "trips": [
            {
                "id": one.id,
                "held_out": one.held_out,
                "ambient_c": None if one.ambient_c is None else _n(one.ambient_c),
                "distance_km": _n(one.distance_km),
                "duration_s": _n(one.duration_s),
                "measured_kwh": _n(one.measured_kwh),
                "nameplate_kwh": _n(one.nameplate_kwh),
                "before_kwh": _n(one.before_kwh),
                "after_kwh": _n(one.after_kwh),
                "explained_kwh": _n(one.explained_kwh),
                "by_family_kwh": {name: _n(value) for name, value in one.by_family_kwh.items()},
            }
            for one in diagnosis.trips
        ],
        "profile": [
            {
                "trip": one.trip_id,
                "planned_kwh": _n(one.planned_kwh),
                "driven_kwh": _n(one.driven_kwh),
                "measured_kwh": _n(one.measured_kwh),
                "planned_s": _n(one.planned_s),
                "driven_s": _n(one.driven_s),
                "planned_stops": _n(one.planned_stops),
                "driven_stops": one.driven_stops,
                "forecast_kwh": None if one.forecast_kwh is None else _n(one.forecast_kwh),
            }
            for one in diagnosis.profile
        ],
        "learned": {
            "effects": {
                name: {"value": _n(value), "ci95": _ci(diagnosis.effects_ci95.get(name))}
                for name, value in diagnosis.effects.items()
            },
            "parameters": {name: _n(value) for name, value in diagnosis.parameters.items()},
            "not_carried": dict(diagnosis.not_carried),
        },
        "model": {"vehicle": diagnosis.vehicle_id, **diagnosis.model},
    }


def _n(value: float) -> float | None:
    """A number as JSON has it: rounded, null where it is not finite."""
    if not math.isfinite(value):
        return None
    return float(f"{value:.{SIGNIFICANT_DIGITS}g}")


def _ci(interval: Interval) -> list[float | None] | None:
    return None if interval is None else [_n(interval[0]), _n(interval[1])]


def _regime(regime: Regime) -> dict[str, Any]:
    known = regime.low_w is not None and regime.high_w is not None
    return {
        "axis": regime.axis.value,
        "interval": [_n(regime.low), _n(regime.high)],
        "mean_w": _n(regime.mean_w),
        "ci95_w": [_n(regime.low_w or 0.0), _n(regime.high_w or 0.0)] if known else None,
        "energy_kwh": _n(regime.energy_kwh),
        "duration_s": _n(regime.duration_s),
        "trips": regime.trips,
    }


def _score(score: FitScore | None) -> dict[str, Any] | None:
    if score is None:
        return None
    return {
        "mape": _n(score.mape),
        "mape_ci95": _ci(score.mape_ci95),
        "bias": _n(score.bias),
        "sd": _n(score.sd),
        "rmse_w": _n(score.rmse_w),
    }
