"""Conditions and effects as sent: the ranges and meanings of energy.conditions, in human units."""

from __future__ import annotations

import dataclasses
import math
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from annotated_types import Ge, Le
from pydantic import BaseModel, ValidationError

from app.conversions.conditions import conditions_from, vehicle_with_effects
from app.conversions.effects import effects_answer, effects_from_sent
from app.schemas.conditions import ConditionsSent
from app.schemas.effects import EffectsSent
from energy.conditions import CONDITION_RANGES, STILL, Conditions, RoadSurface
from energy.errors import ConditionsError
from energy.vehicle.coefficients import COEFFICIENT_FLAGS, COEFFICIENT_RANGES, EffectCoefficients
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.files import load_vehicle

if TYPE_CHECKING:
    from app.settings import Settings
    from energy.vehicle.vehicle import Vehicle

INSIDE = {
    "ambient_c": "ambient_k",
    "cabin_start_c": "cabin_start_k",
    "wind_from_deg": "wind_from_rad",
    "top_speed_kmh": "top_speed_mps",
    "departure": "departure_min",
    "cabin_target_c": "cabin_target_k",
    "regen_cold_full_c": "regen_cold_full_k",
    "regen_cold_none_c": "regen_cold_none_k",
    "cooling_target_c": "cooling_target_k",
}


@pytest.fixture
def kona(settings: Settings) -> Vehicle:
    vehicle = load_vehicle(settings.vehicle_dir / "hyundai-kona-64.toml")
    assert not isinstance(vehicle, ConsumptionTableVehicle)
    return vehicle


def bounds(schema: type[BaseModel], name: str) -> tuple[float, float]:
    metadata = schema.model_fields[name].metadata
    low = next(part.ge for part in metadata if isinstance(part, Ge))
    high = next(part.le for part in metadata if isinstance(part, Le))
    return float(low), float(high)  # type: ignore[arg-type]


def test_conditions_sent_have_the_fields_of_conditions() -> None:
    sent = [INSIDE.get(name, name) for name in ConditionsSent.model_fields]
    assert sent == [field.name for field in dataclasses.fields(Conditions)]
    effects = {INSIDE.get(name, name) for name in EffectsSent.model_fields}
    assert effects == {field.name for field in dataclasses.fields(EffectCoefficients)}


def test_conditions_without_fields_are_those_of_the_source() -> None:
    assert conditions_from(None) is STILL
    assert conditions_from(ConditionsSent()) == STILL


ENDS = [
    (name, end)
    for name in ConditionsSent.model_fields
    if INSIDE.get(name, name) in CONDITION_RANGES and name != "wind_from_deg"
    for end in (0, 1)
]


@pytest.mark.parametrize(("name", "end"), ENDS)
def test_range_of_a_condition_ends_where_that_inside_does(name: str, end: int) -> None:
    shown = bounds(ConditionsSent, name)[end]
    ambient = {"ambient_c": 20.0} if name in ("cabin_start_c", "sun_w") else {}
    inside = conditions_from(ConditionsSent.model_validate({name: shown, **ambient}))
    expected = CONDITION_RANGES[INSIDE.get(name, name)][end]
    assert getattr(inside, INSIDE.get(name, name)) == pytest.approx(expected, rel=1e-12)


def test_wind_comes_from_any_direction_once() -> None:
    assert bounds(ConditionsSent, "wind_from_deg") == (0.0, 360.0)
    assert conditions_from(ConditionsSent(wind_from_deg=360.0)).wind_from_rad == pytest.approx(2.0 * math.pi)


@pytest.mark.parametrize("name", [name for name in EffectsSent.model_fields if name not in COEFFICIENT_FLAGS])
@pytest.mark.parametrize("end", [0, 1])
def test_range_of_a_coefficient_ends_where_that_inside_does(kona: Vehicle, name: str, end: int) -> None:
    shown = bounds(EffectsSent, name)[end]
    others = {
        "regen_cold_full_c": {"regen_cold_none_c": -53.0},
        "regen_cold_none_c": {"regen_cold_full_c": 56.0},
        "cooling_target_c": {"cabin_target_c": 0.0},
    }
    changed = vehicle_with_effects(kona, EffectsSent.model_validate({name: shown, **others.get(name, {})}))
    inside = getattr(changed.effects, INSIDE.get(name, name))
    assert inside == pytest.approx(COEFFICIENT_RANGES[INSIDE.get(name, name)][end], rel=1e-12)


def test_conditions_sent_become_si_units() -> None:
    sent = ConditionsSent(
        ambient_c=-5.0,
        cabin_start_c=18.0,
        climate=False,
        altitude_density=False,
        wind_speed_mps=6.0,
        wind_from_deg=90.0,
        payload_kg=120.0,
        drag_factor=1.25,
        road=RoadSurface.WET,
        speed_factor=0.95,
        top_speed_kmh=108.0,
        aux_power_w=400.0,
        sun_w=250.0,
        regen_limited=True,
        departure=datetime(2026, 12, 1, 8, 15),  # a Tuesday
    )
    inside = conditions_from(sent)
    assert inside.departure_min == (24 + 8) * 60 + 15
    assert (inside.ambient_k, inside.cabin_start_k) == (268.15, 291.15)
    assert (inside.wind_from_rad, inside.top_speed_mps) == pytest.approx((0.5 * math.pi, 30.0))
    for name in set(ConditionsSent.model_fields) - set(INSIDE):
        assert getattr(inside, name) == getattr(sent, name), name
        assert getattr(inside, name) != getattr(STILL, name), name


def test_effects_that_are_not_sent_stay_the_vehicles(kona: Vehicle) -> None:
    own = dataclasses.replace(kona, effects=dataclasses.replace(kona.effects, heating_cop=2.0))
    assert vehicle_with_effects(own, None) is own
    assert vehicle_with_effects(own, EffectsSent()) is own
    changed = vehicle_with_effects(own, EffectsSent(cabin_target_c=19.0))
    assert changed.effects == dataclasses.replace(own.effects, cabin_target_k=292.15)


def test_cold_limits_in_the_wrong_order_are_refused_in_degrees(kona: Vehicle) -> None:
    with pytest.raises(ConditionsError) as caught:
        vehicle_with_effects(kona, EffectsSent(regen_cold_none_c=12.0))
    refused: Any = caught.value
    assert (refused.field, refused.value, refused.allowed) == (
        "effects.regen_cold_none_c",
        12.0,
        "below regen_cold_full_c, 10",
    )


def test_cooling_below_heating_is_refused_in_degrees(kona: Vehicle) -> None:
    own = dataclasses.replace(kona, effects=dataclasses.replace(kona.effects, cooling_target_k=297.15))
    for sent, value, bound in (({"cooling_target_c": 20.5}, 20.5, "21"), ({"cabin_target_c": 25.0}, 24.0, "25")):
        with pytest.raises(ConditionsError) as caught:
            vehicle_with_effects(own, EffectsSent.model_validate(sent))
        refused: Any = caught.value
        assert (refused.field, refused.value) == ("effects.cooling_target_c", value)
        assert refused.allowed == f"at least cabin_target_c, {bound}"


def test_effects_that_a_fit_has_found_reach_the_vehicle_in_si_units(kona: Vehicle) -> None:
    sent = EffectsSent(
        regen_always_limited=True,
        regen_min_speed_mps=2.0,
        tyre_warm_up_frac=0.25,
        tyre_time_s=900.0,
        air_density_coef=0.0,
        cooling_target_c=25.0,
        cooling_soak_w_per_k=300.0,
        cooling_time_s=200.0,
    )
    changed = vehicle_with_effects(kona, sent).effects
    assert changed == dataclasses.replace(
        kona.effects,
        regen_always_limited=True,
        regen_min_speed_mps=2.0,
        tyre_warm_up_frac=0.25,
        tyre_time_s=900.0,
        air_density_coef=0.0,
        cooling_target_k=298.15,
        cooling_soak_w_per_k=300.0,
        cooling_time_s=200.0,
    )
    assert effects_answer(changed).cooling_target_c == 25.0
    assert effects_from_sent(effects_answer(changed)) == changed


def test_effects_on_a_consumption_table_are_refused() -> None:
    table = ConsumptionTableVehicle("van", "Van", np.array([10.0]), np.array([600.0]), 20_000.0, 9000.0, 500.0, 4e4)
    assert vehicle_with_effects(table, EffectsSent()) is table
    with pytest.raises(ConditionsError, match="none for vehicle 'van'"):
        vehicle_with_effects(table, EffectsSent(heating_cop=2.0))


@pytest.mark.parametrize("departure", ["2026-12-01T08:15", "2026-12-01T08:15:30"])
def test_departure_is_a_local_time_whose_weekday_counts(departure: str) -> None:
    sent = ConditionsSent.model_validate_json(f'{{"departure": "{departure}"}}')
    assert conditions_from(sent) == dataclasses.replace(STILL, departure_min=1935)
    assert ConditionsSent.model_validate_json(sent.model_dump_json()) == sent


@pytest.mark.parametrize(
    "departure", ["2026-12-01T08:15Z", "2026-12-01T08:15+01:00", "08:15", "tomorrow", "2026-13-01T08:15"]
)
def test_departure_of_another_form_is_refused(departure: str) -> None:
    with pytest.raises(ValidationError, match="departure"):
        ConditionsSent.model_validate({"departure": departure})
