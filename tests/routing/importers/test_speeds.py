"""Speed limits from tags, and defaults."""

from __future__ import annotations

import numpy as np
import pytest

from energy.stops import FunctionalClass
from routing.importers.speeds import (
    COUNTRIES,
    GENERAL,
    country_code,
    country_limits,
    default_limits_mps,
    limit_mps_from_value,
    limits_from_tags,
    most_named,
)


@pytest.mark.parametrize(
    ("value", "kmh"),
    [
        ("50", 50.0),
        ("50 km/h", 50.0),
        ("30 mph", 48.28032),  # 30 * 1.609344
        ("30mph", 48.28032),
        ("10 knots", 18.52),  # 10 nautical miles of 1852 m an hour
        ("none", 130.0),
        ("walk", 7.0),
        ("50;30", 30.0),
        ("80; 50", 50.0),
        ("DE:urban", 50.0),
        ("DE:rural", 100.0),
        ("FR:rural", 80.0),
        ("DE:motorway", 130.0),
        ("DE:living_street", 7.0),
        ("IT:zone30", 30.0),
        ("DE:zone:30", 30.0),
        ("DE:30", 30.0),
        ("GB:zone20", 32.18688),
        ("GB:nsl_single", 96.56064),
        ("BE-VLG:urban", 50.0),
        ("XK:rural", 80.0),
        ("ZZ:rural", 90.0),  # no country of the table: the general rule
        ("62,4", 62.4),
        ("30,5 mph", 49.084992),  # 30.5 * 1.609344
        ("50, 70", 50.0),
        ("50 mph,60 mph", 80.4672),
        ("30,50,70", 30.0),
        ("160", 160.0),
        ("180", 160.0),
        ("85 mph", 136.79424),
        ("30 MPH", 48.28032),
        ("None", 130.0),
        ("Walk", 7.0),
        ("de:urban", 50.0),
        ("BE-VLG:rural", 70.0),
        ("BE-WAL:rural", 90.0),
        ("BE-BRU:urban", 30.0),
        ("US:CA:urban", 40.2336),  # 25 mph
        ("US-TX:rural", 96.56064),  # 60 mph
        ("US-ZZ:rural", 88.51392),  # an unknown region: the country's 55 mph
        ("UK:nsl_dual", 112.65408),
        ("UK:30", 48.28032),
        ("GB:20 mph", 32.18688),
        ("zone30", 30.0),
        ("zone:30", 30.0),
        ("walking_pace", 7.0),
        ('"50 km/h"', 50.0),
        ("50kmh", 50.0),
        ("30 km", 30.0),
        ("30 km/hr", 30.0),
        ("30 miles", 48.28032),
        ("10 kn", 18.52),
        ("+30", 30.0),
        ("30.", 30.0),
        ("50/70", 50.0),
        ("80 / 100", 80.0),
        ("50 км/ч", 50.0),
        ("50\u00a0km/h", 50.0),
        ("DE: urban", 50.0),
        ("DE:urban; survey", 50.0),
        ("RO:trunk", 100.0),
        ("CZ:motorroad", 110.0),
        ("CZ:urban_motorway", 80.0),
        ("ZA:rural", 100.0),
        ("EE:rural", 90.0),
        ("LT:motorway", 130.0),
        ("JP:urban", 60.0),
        ("RU:living_street", 20.0),
        ("BE:cyclestreet", 30.0),
        ("AU:QLD:rural", 100.0),
        ("US:MT:rural", 112.65408),  # 70 mph
        ("US-DE:rural", 80.4672),  # Delaware, 50 mph
    ],
)
def test_limit_of_a_value_is_its_speed(value: str, kmh: float) -> None:
    assert limit_mps_from_value(value) == pytest.approx(kmh / 3.6, rel=1e-12)


@pytest.mark.parametrize(
    "value", ["signals", "variable", "", "fast", "0", "-50", "1", "999", "DE:unheard_of", "50 furlongs"]
)
def test_limit_of_a_value_without_a_speed_is_none(value: str) -> None:
    assert limit_mps_from_value(value) is None


@pytest.mark.parametrize("highway", ["service", "residential", "living_street", "tertiary", "motorway_link", "primary"])
def test_limits_of_a_road_that_cannot_be_without_one_leave_none_unsaid(highway: str) -> None:
    limits = limits_from_tags({"highway": highway, "maxspeed": "none"})
    assert (limits.forward_mps, limits.backward_mps, limits.implausible) == (None, None, 1)


@pytest.mark.parametrize(
    "tags", [{"highway": "motorway"}, {"highway": "trunk"}, {"highway": "primary", "motorroad": "yes"}]
)
def test_limits_of_a_road_that_can_be_without_one_believe_none(tags: dict[str, str]) -> None:
    assert limits_from_tags({**tags, "maxspeed": "none"}).forward_mps == pytest.approx(130 / 3.6)


def test_limits_of_a_vehicle_class_are_the_narrowest_and_others_say_nothing() -> None:
    tags = {"maxspeed": "100", "maxspeed:motor_vehicle": "90", "maxspeed:motorcar": "80", "maxspeed:hgv": "60"}
    assert limits_from_tags(tags).forward_mps == 80 / 3.6
    assert limits_from_tags({"maxspeed": "100", "maxspeed:hgv": "60"}).forward_mps == 100 / 3.6


@pytest.mark.parametrize(
    ("value", "code"),
    [
        ("uk", "GB"),
        ("GB", "GB"),
        ("EL", "GR"),
        ("be-vlg", "BE-VLG"),
        ("DE-BY", "DE"),
        ("Deutschland", None),
        ("", None),
    ],
)
def test_country_of_an_address_is_its_code(value: str, code: str | None) -> None:
    assert country_code(value) == code


def test_country_of_rules_is_counted_with_its_regions_and_under_all_its_names() -> None:
    assert limits_from_tags({"maxspeed:type": "UK:nsl_single"}).country == "GB"
    assert limits_from_tags({"source:maxspeed": "BE-VLG:urban"}).country == "BE-VLG"
    assert most_named({"BE-VLG": 3, "BE": 2, "NL": 4}) == "BE-VLG"
    assert most_named({"BE-VLG": 2, "BE-WAL": 2, "NL": 3}) == "BE"
    assert country_limits("UK") == COUNTRIES["GB"]
    assert country_limits("BE-VLG").rural == 70
    assert country_limits("XX") == country_limits(None) == GENERAL


def test_limits_under_a_condition_are_kept_by_direction_and_those_not_understood_counted() -> None:
    limits = limits_from_tags(
        {
            "maxspeed": "100",
            "maxspeed:conditional": "80 @ wet; 30 @ (Mo-Fr 07:00-17:00); 60 @ snow; 60 @ (weight>7.5)",
            "maxspeed:backward:conditional": "70 @ wet",
            "maxspeed:hgv:conditional": "50 @ wet",
        }
    )
    assert limits.forward_mps == 100 / 3.6
    assert [limit.limit_mps * 3.6 for limit in limits.conditional[0]] == pytest.approx([80, 30])
    assert [limit.limit_mps * 3.6 for limit in limits.conditional[1]] == pytest.approx([70])
    assert limits.unread == 1


@pytest.mark.parametrize("source", ["2019-05-12", "30", "survey 2012; 50", "sign", "mapillary;5"])
def test_numbers_in_what_says_where_a_limit_is_from_are_no_limits(source: str) -> None:
    limits = limits_from_tags({"highway": "secondary", "source:maxspeed": source})
    assert (limits.forward_mps, limits.implausible) == (None, 0)


def test_a_rule_among_other_sources_says_its_country_and_surroundings() -> None:
    limits = limits_from_tags({"maxspeed": "50", "source:maxspeed": "survey; RO:urban"})
    assert (limits.country, limits.urban) == ("RO", True)


def test_limits_with_directions_differ() -> None:
    limits = limits_from_tags({"maxspeed": "60", "maxspeed:forward": "80", "maxspeed:backward": "50"})
    assert (limits.forward_mps, limits.backward_mps) == (80 / 3.6, 50 / 3.6)


def test_limits_with_one_direction_leave_the_other_to_the_general_tag() -> None:
    limits = limits_from_tags({"maxspeed": "60", "maxspeed:forward": "80"})
    assert (limits.forward_mps, limits.backward_mps) == (80 / 3.6, 60 / 3.6)


def test_limits_with_sign_and_type_take_the_sign_and_learn_that_it_is_urban() -> None:
    limits = limits_from_tags({"maxspeed": "30", "source:maxspeed": "BR:urban"})
    assert limits.forward_mps == 30 / 3.6
    assert limits.urban is True
    assert limits.country == "BR"


def test_limits_with_type_only_take_the_rule() -> None:
    limits = limits_from_tags({"maxspeed:type": "PT:rural"})
    assert limits.forward_mps == 90 / 3.6
    assert limits.urban is False


def test_limits_in_a_zone_take_the_zone() -> None:
    limits = limits_from_tags({"zone:maxspeed": "DE:30"})
    assert limits.forward_mps == 30 / 3.6
    assert limits.urban is None


def test_limits_out_of_range_are_counted_and_unsaid() -> None:
    limits = limits_from_tags({"maxspeed": "500"})
    assert limits.forward_mps is None
    assert limits.implausible == 1


def test_limits_of_a_variable_sign_are_unsaid_but_not_implausible() -> None:
    assert limits_from_tags({"maxspeed": "signals"}).implausible == 0


def _default_kmh(
    country: str | None, road: FunctionalClass, urban: bool, ramp: bool = False, living: bool = False
) -> float:
    column = [np.array([x]) for x in (ramp, living, urban)]
    return float(default_limits_mps(country, np.array([road], np.int8), *column)[0]) * 3.6


def test_default_limits_follow_country_class_and_surroundings() -> None:
    assert _default_kmh("DE", FunctionalClass.PRIMARY, urban=False) == pytest.approx(100.0)
    assert _default_kmh("DE", FunctionalClass.PRIMARY, urban=True) == pytest.approx(50.0)
    assert _default_kmh(None, FunctionalClass.MOTORWAY, urban=True) == pytest.approx(120.0)
    assert _default_kmh("BR", FunctionalClass.SECONDARY, urban=True) == pytest.approx(60.0)
    assert _default_kmh("BR", FunctionalClass.TERTIARY, urban=True) == pytest.approx(40.0)
    assert _default_kmh("BR", FunctionalClass.RESIDENTIAL, urban=True) == pytest.approx(30.0)
    assert _default_kmh("DE", FunctionalClass.UNCLASSIFIED, urban=False) == pytest.approx(60.0)
    assert _default_kmh(None, FunctionalClass.SERVICE, urban=False) == pytest.approx(20.0)
    assert _default_kmh(None, FunctionalClass.TRUNK, urban=False, ramp=True) == pytest.approx(60.0)
    assert _default_kmh("DE", FunctionalClass.RESIDENTIAL, urban=True, living=True) == pytest.approx(7.0)


def test_default_limits_are_never_zero_and_never_above_the_country_s_highest() -> None:
    for code, row in [*COUNTRIES.items(), ("??", GENERAL)]:
        for road in FunctionalClass:
            for urban in (False, True):
                kmh = _default_kmh(code, road, urban)
                assert 5.0 <= kmh <= max(row.motorway, row.rural, row.expressway) + 1e-9
