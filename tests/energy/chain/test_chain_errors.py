"""A chain that cannot be driven is named: field, position, value and allowed range."""

from __future__ import annotations

import math

import numpy as np
import pytest

from energy.chain.chain import simulate_chain
from energy.errors import LinkError

pytestmark = pytest.mark.nojit

NUMBERS = {
    "length_m": (math.nan, math.inf, 0.0, -1.0),
    "speed_limit_mps": (math.nan, math.inf, 0.0, -13.9),
    "grade_frac": (math.nan, math.inf, 1.01, -1.01),
    "stop_probability_frac": (math.nan, math.inf, -0.01, 1.01),
    "stop_time_s": (math.nan, math.inf, -1.0),
}
CASES = [(field, value) for field, values in NUMBERS.items() for value in values]


@pytest.mark.parametrize(("field", "value"), CASES)
@pytest.mark.parametrize("position", [0, 2])
def test_chain_with_a_bad_number_names_field_position_value_and_range(
    altered, round_vehicle, make_chain, field, value, position
):
    chain = make_chain([100.0, 200.0, 300.0], 20.0)
    column = getattr(chain, field).copy()
    column[position] = value
    with pytest.raises(LinkError) as caught:
        simulate_chain(round_vehicle, altered(chain, **{field: column}))
    error = caught.value
    assert (error.field, error.position) == (field, position)
    assert error.value == value or (math.isnan(error.value) and math.isnan(value))
    assert error.allowed
    assert str(error) == f"{field} of link {position} is {value}, allowed: {error.allowed}"


@pytest.mark.parametrize("value", [-1, 9, 127])
def test_chain_with_an_unknown_stop_class_names_it(altered, round_vehicle, make_chain, value):
    chain = make_chain([100.0, 200.0], 20.0)
    with pytest.raises(LinkError) as caught:
        simulate_chain(round_vehicle, altered(chain, stop_class=np.array([0, value], np.int8)))
    assert (caught.value.field, caught.value.position, caught.value.value) == ("stop_class", 1, value)


@pytest.mark.parametrize(
    "field", ["grade_frac", "speed_limit_mps", "stop_probability_frac", "stop_time_s", "stop_class"]
)
def test_chain_with_a_column_too_short_names_it(altered, round_vehicle, make_chain, field):
    chain = make_chain([100.0, 200.0, 300.0], 20.0)
    with pytest.raises(LinkError) as caught:
        simulate_chain(round_vehicle, altered(chain, **{field: getattr(chain, field)[:2]}))
    assert caught.value.field == field
    assert caught.value.value == "2 values"


def test_chain_without_links_is_an_error(round_vehicle, make_chain):
    with pytest.raises(LinkError, match="at least one link"):
        simulate_chain(round_vehicle, make_chain([], 20.0))


@pytest.mark.parametrize("value", [math.nan, math.inf, -0.1, 55.6])
def test_start_speed_out_of_range_is_named(round_vehicle, make_chain, value):
    with pytest.raises(LinkError) as caught:
        simulate_chain(round_vehicle, make_chain([100.0], 20.0), start_speed_mps=value)
    assert (caught.value.field, caught.value.allowed) == ("start_speed_mps", "0..55.56 (200 km/h)")
    assert caught.value.value is value


def test_chain_at_the_edges_of_the_ranges_is_driven(round_vehicle, make_chain):
    chain = make_chain(
        [1e-3, 1e6, 1.0, 1.0], [1e-3, 55.5, 20.0, 20.0], [0.0, 0.0, 1.0, -1.0], [0.0, 1.0, 0.5, 1.0], stop_class=7
    )
    result = simulate_chain(round_vehicle, chain, start_speed_mps=55.5)
    assert math.isfinite(result.energy_j)
