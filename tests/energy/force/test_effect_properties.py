"""Effects on any drive: against quadrature, their signs, parts that add up, consumption tables, errors."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from energy.chain.chain import LinkModel, StopRule, simulate_chain
from energy.conditions import CONDITION_RANGES, Conditions, RoadSurface
from energy.errors import ConditionsError
from energy.force.effects import LinkSetting, cabin_power_w, drive_of
from energy.force.kernels_force import battery_power, road_load_n
from energy.force.kernels_phase import ramp_energy
from energy.force.kernels_physics import Road
from energy.force.kernels_terms import ramp_terms, total_j
from energy.force.parts import PART_NAMES
from energy.vehicle.coefficients import COEFFICIENT_RANGES, EffectCoefficients
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from tests.energy.drives import energy_j, north

MANY = settings(max_examples=150, deadline=None)
NORTH = 0.0
EVERYTHING = Conditions(
    ambient_k=263.0,
    cabin_start_k=268.0,
    wind_speed_mps=7.0,
    wind_from_rad=0.7,
    payload_kg=250.0,
    drag_factor=1.25,
    road=RoadSurface.WET,
    speed_factor=0.95,
    regen_limited=True,
)


LEARNED = EffectCoefficients(
    drive_loss_w_per_n2=2e-4,
    regen_cap_w=15_000.0,
    regen_min_speed_mps=2.5,
    tyre_warm_up_frac=0.3,
    tyre_time_s=900.0,
    air_density_coef=1.2,
)


# Any ramp against quadrature


@MANY
@given(
    wind=st.one_of(st.just(0.0), st.floats(-35.0, 35.0)),
    grade=st.floats(-0.15, 0.15),
    v_a=st.floats(0.0, 40.0),
    dv=st.floats(1.0, 40.0),
    braking=st.booleans(),
    accel=st.floats(0.05, 3.0),
    cap_w=st.one_of(st.just(math.inf), st.floats(0.0, 60_000.0)),
    resistance=st.one_of(st.just(0.0), st.floats(1e-7, 3e-6)),
    load=st.one_of(st.just(0.0), st.floats(1e-5, 1e-3)),
    least_mps=st.one_of(st.just(0.0), st.floats(0.0, 15.0)),
)
def test_any_ramp_with_effects_equals_the_quadrature_of_battery_power(
    make_physics, wind, grade, v_a, dv, braking, accel, cap_w, resistance, load, least_mps
):
    limits = {"regen_cap_w": cap_w, "regen_min_mps": least_mps}
    p = make_physics(**limits, loss_per_w=resistance, loss_per_n2=load, lossy=True).physics
    r = Road(grade, 100.0, -2.0, 0.5, wind)
    low, high = v_a, v_a + dv
    ds = (high**2 - low**2) / (2.0 * accel)
    a = -accel if braking else accel
    got, dt = ramp_energy(p, r, ds, *((high, low) if braking else (low, high)))
    # corners of the law, found on a fine grid of speeds: between them 12-point quadrature has nothing to trip over
    grid = np.linspace(low, high, 4001)
    if low < least_mps < high:  # where recuperation sets in power leaps: a point on either side of it
        grid = np.sort(np.append(grid, (math.nextafter(least_mps, 0.0), least_mps)))
    power = np.array([battery_power(p, r, max(v, 1e-12), a) for v in grid])
    twin = np.trapezoid(power, grid) / accel
    scale = np.trapezoid(np.abs(power), grid) / accel
    assert dt == pytest.approx(dv / accel)
    assert got == pytest.approx(twin, abs=2e-5 * scale + 1e-6)
    terms, _ = ramp_terms(p, r, ds, *((high, low) if braking else (low, high)))
    assert total_j(terms) == got


@MANY
@given(wind=st.floats(-40.0, 40.0), v=st.floats(0.0, 55.0), b=st.floats(-3.0, 3.0))
def test_road_load_in_any_wind_is_continuous_and_rises_with_the_wind(wind, v, b):
    at, more, near = (road_load_n(Road(0.0, 110.0, b, 0.5, w), v) for w in (wind, wind + 1.0, wind + 1e-7))
    assert more >= at - 1e-9
    assert near == pytest.approx(at, abs=1e-4)
    if wind < 0.0:
        assert at >= 0.0


# Monotone


@MANY
@given(masses=st.lists(st.floats(0.0, 1500.0), min_size=2, max_size=2), rule=st.sampled_from(list(StopRule)))
def test_energy_never_falls_with_payload_on_a_round_trip(kona, hilly, masses, rule):
    less, more = sorted(masses)
    assert energy_j(kona, hilly, Conditions(payload_kg=less), stop_rule=rule) <= energy_j(
        kona, hilly, Conditions(payload_kg=more), stop_rule=rule
    ) * (1.0 + 1e-12)


@MANY
@given(winds=st.lists(st.floats(0.0, 40.0), min_size=2, max_size=2))
def test_energy_never_falls_with_head_wind(kona, hilly, winds):
    less, more = sorted(winds)
    ahead, stronger = (Conditions(wind_speed_mps=w, wind_from_rad=NORTH) for w in (less, more))
    assert energy_j(kona, north(hilly), ahead) <= energy_j(kona, north(hilly), stronger) * (1.0 + 1e-12)


@MANY
@given(away=st.lists(st.floats(0.0, 45.0), min_size=2, max_size=2), hot=st.booleans())
def test_climate_energy_never_falls_with_distance_from_comfort(kona, hilly, away, hot):
    sign = 1.0 if hot else -1.0
    near, far = (
        simulate_chain(kona, hilly, conditions=Conditions(ambient_k=294.15 + sign * min(d, 34.0))).parts.cabin_j
        for d in sorted(away)
    )
    assert 0.0 <= near <= far


@MANY
@given(temps=st.lists(st.floats(230.0, 294.15), min_size=2, max_size=2))
def test_energy_never_falls_with_cold_below_comfort(kona, hilly, temps):
    colder, warmer = sorted(temps)
    assert energy_j(kona, hilly, Conditions(ambient_k=warmer)) <= energy_j(kona, hilly, Conditions(ambient_k=colder))


@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("drag_factor", (0.9, 1.0, 1.14, 1.5)),
        ("aux_power_w", (0.0, 520.0, 3000.0)),
        ("road", (RoadSurface.DRY, RoadSurface.WET, RoadSurface.SNOW)),
    ],
)
def test_energy_rises_with(kona, hilly, field, values):
    energies = [energy_j(kona, hilly, Conditions(**{field: value})) for value in values]
    assert all(a < b for a, b in itertools.pairwise(energies))


def test_energy_falls_with_a_higher_cap_on_recuperation(kona, hilly):
    limited = Conditions(regen_limited=True)
    energies = [
        energy_j(replace(kona, effects=EffectCoefficients(regen_cap_w=cap)), hilly, limited)
        for cap in (0.0, 5000.0, 20_000.0, 60_000.0, 1e6)
    ]
    assert all(a >= b for a, b in itertools.pairwise(energies))
    assert energies[-1] == pytest.approx(energy_j(kona, hilly), rel=1e-12)


# Parts


@pytest.mark.nojit
@pytest.mark.parametrize("model", list(LinkModel))
@pytest.mark.parametrize("rule", list(StopRule))
def test_parts_with_every_effect_on_add_up_to_the_energy_of_each_link(kona, hilly, model, rule):
    vehicle = replace(kona, effects=LEARNED)
    result = simulate_chain(
        vehicle, hilly, conditions=EVERYTHING, link_model=model, stop_rule=rule, soc_start_frac=0.97
    )
    for link in result.links:
        assert link.parts_j.sum() == pytest.approx(link.energy_j, rel=1e-9, abs=1e-6)
    assert result.parts.total_j() == pytest.approx(result.energy_j, rel=1e-12)
    effects = result.links[0].parts_j[8:-1]
    assert len(effects) == len(PART_NAMES) - 9
    total = np.sum([link.parts_j for link in result.links], axis=0)
    assert np.all(total[8:-1] != 0.0)  # each effect is on
    assert total[-1] == 0.0  # no consumption table


def test_a_single_effect_shows_in_its_own_part_and_nowhere_else(kona, hilly):
    for conditions, part in (
        (Conditions(payload_kg=200.0), "payload"),
        (Conditions(drag_factor=1.2), "drag"),
        (Conditions(road=RoadSurface.SNOW), "road_surface"),
        (Conditions(altitude_density=True), "air_density"),
        (Conditions(regen_limited=True), "regen_limit"),
    ):
        vehicle = replace(kona, effects=EffectCoefficients(regen_cap_w=5000.0))
        parts = simulate_chain(vehicle, hilly, conditions=conditions, soc_start_frac=0.5).parts
        shown = {name for name in PART_NAMES[8:] if getattr(parts, f"{name}_j") != 0.0}
        assert shown == {part}


@pytest.mark.nojit
def test_cabin_power_has_no_step_where_heating_turns_into_cooling(kona):
    for conditions in (
        Conditions(ambient_k=294.15, cabin_start_k=320.0),
        Conditions(ambient_k=294.15, cabin_start_k=270.0),
        Conditions(ambient_k=284.15, sun_w=1100.0),
    ):
        near = [
            cabin_power_w(replace(conditions, ambient_k=conditions.ambient_k + d), kona.effects) for d in (-1e-6, 1e-6)
        ]
        assert near[0] == pytest.approx(near[1], abs=0.01)
    hot = cabin_power_w(Conditions(ambient_k=293.0, cabin_start_k=330.0), kona.effects)
    assert hot[1] > 1000.0  # a hot cabin is cooled even where it is cool outside


@pytest.mark.nojit
@pytest.mark.parametrize(
    "sky", [Conditions(drag_factor=0.3), Conditions(ambient_k=320.0), Conditions(altitude_density=True)]
)
def test_road_load_of_a_vehicle_with_falling_drag_stays_at_least_0_in_any_conditions(round_vehicle, sky):
    falling = replace(round_vehicle, road_load_b_n_per_mps=-4.0, road_load_c_n_per_mps2=0.0422)
    setting = LinkSetting(np.zeros(2), np.array([20.0, 55.0]), np.array([0.0, 3000.0]), np.array([[0.0, 1.0]] * 2))
    roads = drive_of(falling, sky).roads(setting, np.zeros(2))
    for row in roads:
        load = [road_load_n(Road(*row[:5]), v) for v in np.linspace(0.0, 200.0 / 3.6, 400)]
        assert min(load) >= -1e-9
        assert min(load) < 0.1 or row[1] <= 100.0  # lifted by no more than it has to be


# Consumption tables


@pytest.fixture
def table():
    return ConsumptionTableVehicle(
        id="table",
        name="table",
        speed_mps=np.array([10.0, 20.0, 40.0]),
        consumption_j_per_m=np.array([400.0, 500.0, 900.0]),
        ascent_j_per_m=20_000.0,
        descent_j_per_m=12_000.0,
        aux_power_w=500.0,
        usable_capacity_wh=50_000.0,
        kinetic_up_kg=2200.0,
        kinetic_down_kg=1200.0,
    )


@pytest.mark.nojit
def test_consumption_table_takes_its_figures(table, make_chain):
    # 15 m/s: 450 J/m; 30 m/s: 700 J/m. Climb 30 m, fall 20 m. Speeds: 0 → 15 → 30 → 0. 500 W over 1000/15 + 1000/30 s
    chain = make_chain([1000.0, 1000.0], [15.0, 30.0], [0.03, -0.02])
    result = simulate_chain(table, chain)
    kinetic = 1100.0 * 15.0**2 + 1100.0 * (30.0**2 - 15.0**2) - 600.0 * 30.0**2
    expected = (
        450_000.0 + 700_000.0 + 30.0 * 20_000.0 - 20.0 * 12_000.0 + kinetic + 500.0 * (1000.0 / 15.0 + 100.0 / 3.0)
    )
    assert result.energy_j == pytest.approx(expected)
    assert result.duration_s == pytest.approx(100.0)
    assert result.parts.consumption_table_j == pytest.approx(1_150_000.0)
    assert result.parts.total_j() == pytest.approx(result.energy_j)


@pytest.mark.nojit
def test_consumption_table_is_constant_beyond_its_ends(table):
    np.testing.assert_allclose(table.consumption_at(np.array([1.0, 60.0])), [400.0, 900.0])


@pytest.mark.nojit
def test_consumption_table_refuses_what_it_cannot_feel_and_takes_climate(table, make_chain):
    for conditions in (Conditions(wind_speed_mps=3.0), Conditions(payload_kg=1.0), Conditions(road=RoadSurface.WET)):
        with pytest.raises(ConditionsError, match="consumption table"):
            drive_of(table, conditions)
    cold = simulate_chain(table, make_chain([1000.0], 20.0), conditions=Conditions(ambient_k=263.0))
    assert cold.parts.cabin_j > 0.0


# Errors


@pytest.mark.nojit
@pytest.mark.parametrize("field", CONDITION_RANGES)
def test_condition_out_of_range_is_refused_with_field_value_and_range(field):
    low, high = CONDITION_RANGES[field]
    together = {} if field == "ambient_k" else {"ambient_k": 280.0}
    for value in (low - 1.0, high + 1.0, math.nan):
        with pytest.raises(ConditionsError) as caught:
            Conditions(**together, **{field: value})
        assert caught.value.field == f"conditions.{field}"
        assert f"{low:g}..{high:g}" in str(caught.value)


@pytest.mark.nojit
@pytest.mark.parametrize("field", COEFFICIENT_RANGES)
def test_coefficient_out_of_range_is_refused_with_field_value_and_range(field):
    low, high = COEFFICIENT_RANGES[field]
    for value in (low - 1.0, high * 1.001 + 1e-9, math.nan):
        with pytest.raises(ConditionsError) as caught:
            EffectCoefficients(**{field: value})
        assert caught.value.field == f"effects.{field}"
        assert str(caught.value.value) == str(value)


@pytest.mark.nojit
def test_wind_without_headings_and_thin_air_without_altitudes_are_refused(kona, make_chain):
    chain = make_chain([100.0], 10.0)
    with pytest.raises(ConditionsError, match="heading"):
        simulate_chain(kona, chain, conditions=Conditions(wind_speed_mps=1.0))
    with pytest.raises(ConditionsError, match="altitude"):
        simulate_chain(kona, chain, conditions=Conditions(altitude_density=True))
    with pytest.raises(ConditionsError, match="only together with ambient_k"):
        Conditions(sun_w=100.0)
