"""Stop settings: the defaults and what they refuse."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from energy.stops import Cross, FunctionalClass, StopSettings

pytestmark = pytest.mark.nojit


def test_default_probabilities_span_the_published_range():
    # source, section III.B: "between 0.05 and 0.5"
    asked = StopSettings().probability_frac[:, Cross.SMALL :]
    assert asked.min() == 0.05
    assert asked.max() == 0.5
    assert np.all(np.diff(asked, axis=1) > 0.0)
    assert np.all(asked[1] > asked[0])  # more often inside towns


def test_default_urban_time_is_the_published_standstill_over_the_stops():
    # table IV, urban: 3234 s / 154
    assert StopSettings().time_s[1, Cross.LARGE] == 3234.0 / 154.0


def test_default_of_no_crossing_never_stops():
    settings = StopSettings()
    assert settings.probability_frac[:, Cross.NONE].tolist() == [0.0, 0.0]
    assert settings.time_s[:, Cross.NONE].tolist() == [0.0, 0.0]


def test_defaults_are_not_shared_between_settings():
    assert StopSettings().probability_frac is not StopSettings().probability_frac


@pytest.mark.parametrize(("field", "upper"), [("probability_frac", 1.0), ("time_s", 86_400.0)])
@pytest.mark.parametrize("value", [math.nan, -0.1, math.inf])
def test_settings_with_a_bad_value_are_refused_with_the_range(field, upper, value):
    table = getattr(StopSettings(), field).copy()
    table[1, 2] = value
    with pytest.raises(ValueError, match=rf"^{field} has a value outside 0\.\.{upper:g}$"):
        StopSettings(**{field: table})


def test_settings_with_another_shape_are_refused():
    with pytest.raises(ValueError, match=r"probability_frac has shape \(3,\), expected \(2, 4\)"):
        StopSettings(probability_frac=np.array([0.1, 0.2, 0.3]))


def test_settings_that_stop_where_none_is_asked_are_refused():
    for field in dataclasses.fields(StopSettings):
        table = getattr(StopSettings(), field.name).copy()
        table[0, Cross.NONE] = 0.1
        with pytest.raises(ValueError, match="never stops"):
            StopSettings(**{field.name: table})


def test_stop_class_of_the_chain_fits_urban_and_cross():
    # 4·urban + cross, eight counters in all
    assert {4 * urban + cross for urban in (0, 1) for cross in Cross} == set(range(8))


def test_functional_classes_begin_with_the_motorway():
    assert FunctionalClass.MOTORWAY == 0
