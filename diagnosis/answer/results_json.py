"""A diagnosis as JSON, rounded to what its intervals carry."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from diagnosis.answer.results import CapacityEstimate, Diagnosis, FitScore, Interval

if TYPE_CHECKING:
    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.causes.battery import BatteryLoss


SIGNIFICANT_DIGITS: Final = 6


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The object of diagnosis.json, without timelines; numbers rounded to SIGNIFICANT_DIGITS."""
    return {
        "verdict": diagnosis.verdict.value,
        "text": diagnosis.text,
        "findings": [
            {
                "effect": finding.effect,
                "family": finding.family.value,
                "text": finding.text,
                "coefficients": {
                    coefficient.name: {
                        "value": _n(coefficient.value),
                        "unit": coefficient.unit,
                        "ci95": _ci(coefficient.ci95),
                    }
                    for coefficient in finding.coefficients
                },
                "energy_kwh": _n(finding.energy_kwh),
                "energy_kwh_ci95": _ci(finding.energy_kwh_ci95),
                "energy_share": _n(finding.energy_share_frac),
                "t": _n(finding.t),
                "located": [_regime(regime) for regime in finding.located],
                "trips": list(finding.trips),
                "ambiguous_with": [
                    {"effect": rival.effect, "family": rival.family.value} for rival in finding.ambiguous_with
                ],
                "separating_recording": finding.separating_recording,
                "standing_ratio": None if finding.standing_ratio is None else _n(finding.standing_ratio),
                "standing_ratio_ci95": _ci(finding.standing_ratio_ci95),
            }
            for finding in diagnosis.findings
        ],
        "parameter_errors": [
            {
                "parameter": error.parameter,
                "family": error.family.value,
                "unit": error.unit,
                "nameplate": _n(error.nameplate),
                "fitted": _n(error.fitted),
                "ci95": _ci(error.ci95),
                "energy_kwh": _n(error.energy_kwh),
                "energy_share": _n(error.energy_share_frac),
                "aliases": list(error.aliases),
                "text": error.text,
            }
            for error in diagnosis.parameter_errors
        ],
        "unexplained": [
            {
                "axis": structure.axis,
                "unit": structure.unit,
                "interval": [_n(structure.low), _n(structure.high)],
                "low_ci95": _ci(structure.low_ci95),
                "high_ci95": _ci(structure.high_ci95),
                "mean_w": _n(structure.mean_w),
                "ci95_w": _ci(structure.ci95_w),
                "energy_kwh": _n(structure.energy_kwh),
                "p": _n(structure.p),
                "trips": list(structure.trips),
                "text": structure.text,
            }
            for structure in diagnosis.unexplained
        ],
        "data_quality": [
            {"trip": note.trip_id, "kind": note.kind, "channel": note.channel, "text": note.text}
            for note in diagnosis.data_quality
        ],
        "other_car": diagnosis.other_car,
        "capacity": None if diagnosis.capacity is None else _capacity(diagnosis.capacity),
        "missing": [
            {"channel": lack.channel, "trips": list(lack.trips), "decisive": lack.decisive, "text": lack.text}
            for lack in diagnosis.missing
        ],
        "battery": _battery(diagnosis.battery),
        "fit": {
            "fitted_trips": list(diagnosis.fitted_trips),
            "held_out_trips": list(diagnosis.held_out_trips),
            "before": _score(diagnosis.before),
            "after": _score(diagnosis.after),
            "routes": _score(diagnosis.routes),
        },
        "regimes": {
            "before": [_regime(regime) for regime in diagnosis.regimes_before],
            "after": [_regime(regime) for regime in diagnosis.regimes_after],
        },
        "trips": [
            {
                "id": account.id,
                "held_out": account.held_out,
                "ambient_c": None if account.ambient_c is None else _n(account.ambient_c),
                "distance_km": _n(account.distance_km),
                "duration_s": _n(account.duration_s),
                "measured_kwh": _n(account.measured_kwh),
                "nameplate_kwh": _n(account.nameplate_kwh),
                "before_kwh": _n(account.before_kwh),
                "after_kwh": _n(account.after_kwh),
                "explained_kwh": _n(account.explained_kwh),
                "by_family_kwh": {name: _n(value) for name, value in account.by_family_kwh.items()},
                "predicted_by_family_kwh": {name: _n(value) for name, value in account.predicted_by_family_kwh.items()},
            }
            for account in diagnosis.trips
        ],
        "profile": [
            {
                "trip": split.trip_id,
                "planned_kwh": _n(split.planned_kwh),
                "driven_kwh": _n(split.driven_kwh),
                "measured_kwh": _n(split.measured_kwh),
                "planned_s": _n(split.planned_s),
                "driven_s": _n(split.driven_s),
                "planned_stops": _n(split.planned_stops),
                "driven_stops": split.driven_stops,
                "forecast_kwh": None if split.forecast_kwh is None else _n(split.forecast_kwh),
            }
            for split in diagnosis.profile
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


def _battery(battery: BatteryLoss | None) -> dict[str, Any] | None:
    if battery is None:
        return None
    return {
        "ohm": _n(battery.ohm),
        "ohm_ci95": _ci(battery.ohm_ci95),
        "doubling_k": _n(battery.doubling_k),
        "loss_in_power": None if battery.share is None else _n(battery.share),
        "trips": battery.trips,
    }


def _n(value: float) -> float | None:
    """A number as JSON has it: rounded, null where it is not finite."""
    if not math.isfinite(value):
        return None
    return float(f"{value:.{SIGNIFICANT_DIGITS}g}")


def _ci(interval: Interval) -> list[float | None] | None:
    return None if interval is None else [_n(interval[0]), _n(interval[1])]


def _regime(regime: RegimeResidual) -> dict[str, Any]:
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


def _capacity(capacity: CapacityEstimate) -> dict[str, Any]:
    drift = capacity.drift
    return {
        "kind": capacity.kind.value,
        "kwh": _n(capacity.value_wh / 1000.0),
        "kwh_ci95": [_n(bound / 1000.0) for bound in capacity.ci95_wh],
        "file_kwh": _n(capacity.file_wh / 1000.0),
        "trips": list(capacity.trips),
        "charge_fall": _n(capacity.fall_frac),
        "displayed": capacity.displayed,
        "median_c": None if capacity.median_c is None else _n(capacity.median_c),
        "drift_per_year": None if drift is None else _n(drift.frac_per_year),
        "drift_per_year_ci95": None if drift is None else _ci(drift.ci95_frac_per_year),
        "carried": capacity.is_carried,
        "text": capacity.text,
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
