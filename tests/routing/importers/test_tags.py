"""What tags mean for a private motor car."""

from __future__ import annotations

import pytest

from energy.stops import FunctionalClass
from routing.importers.tags import (
    Control,
    ControlKind,
    Dropped,
    Facing,
    Oneway,
    TurnRule,
    blocks_cars,
    car_may_pass,
    control,
    is_structure,
    oneway,
    reason_to_drop,
    road_class,
    turn_rule,
)


@pytest.mark.parametrize(
    ("tags", "passes"),
    [
        ({}, True),
        ({"access": "no"}, False),
        ({"access": "private"}, False),
        ({"access": "destination"}, True),
        ({"access": "customers"}, True),
        ({"access": "no", "motor_vehicle": "yes"}, True),
        ({"access": "yes", "motor_vehicle": "no"}, False),
        ({"motor_vehicle": "no", "motorcar": "yes"}, True),
        ({"vehicle": "no"}, False),
        ({"vehicle": "no", "motor_vehicle": "destination"}, True),
        ({"motor_vehicle": "agricultural"}, False),
        ({"access:conditional": "no @ (22:00-06:00)"}, True),
        ({"access": "permissive", "bicycle": "no"}, True),
    ],
)
def test_access_takes_the_narrowest_tag(tags: dict[str, str], passes: bool) -> None:
    assert car_may_pass(tags) is passes


@pytest.mark.parametrize(
    ("tags", "direction"),
    [
        ({}, Oneway.BOTH),
        ({"oneway": "yes"}, Oneway.FORWARD),
        ({"oneway": "true"}, Oneway.FORWARD),
        ({"oneway": "1"}, Oneway.FORWARD),
        ({"oneway": "-1"}, Oneway.BACKWARD),
        ({"oneway": "reverse"}, Oneway.BACKWARD),
        ({"oneway": "no"}, Oneway.BOTH),
        ({"oneway": "reversible"}, Oneway.CHANGING),
        ({"oneway": "alternating"}, Oneway.CHANGING),
        ({"highway": "motorway"}, Oneway.FORWARD),
        ({"highway": "motorway", "oneway": "no"}, Oneway.BOTH),
        ({"highway": "motorway_link"}, Oneway.BOTH),
        ({"junction": "roundabout"}, Oneway.FORWARD),
        ({"junction": "circular"}, Oneway.FORWARD),
        ({"oneway": "yes", "oneway:motor_vehicle": "no"}, Oneway.BOTH),
        ({"oneway:bicycle": "yes"}, Oneway.BOTH),
    ],
)
def test_oneway_in_all_its_forms(tags: dict[str, str], direction: Oneway) -> None:
    assert oneway(tags) is direction


def test_road_class_of_ramps_living_streets_and_paths() -> None:
    ramp = road_class("motorway_link")
    assert ramp is not None
    assert (ramp.functional_class, ramp.ramp) == (FunctionalClass.TRUNK, True)
    living = road_class("living_street")
    assert living is not None
    assert living.living_street
    mixed = road_class("unclassified;tertiary")
    assert mixed is not None
    assert mixed.functional_class is FunctionalClass.UNCLASSIFIED
    for value in ("footway", "track", "construction", "busway", "raceway", ""):
        assert road_class(value) is None


@pytest.mark.parametrize(
    ("tags", "reason"),
    [
        ({"highway": "service"}, None),
        ({"highway": "service", "service": "alley"}, None),
        ({"highway": "service", "service": "driveway"}, Dropped.SERVICE),
        ({"highway": "service", "service": "parking_aisle"}, Dropped.SERVICE),
        ({"highway": "residential", "access": "private"}, Dropped.ACCESS),
        ({"highway": "service", "area": "yes"}, Dropped.AREA),
        ({"highway": "unclassified", "smoothness": "impassable"}, Dropped.CONDITION),
    ],
)
def test_reason_to_drop_names_why(tags: dict[str, str], reason: Dropped | None) -> None:
    assert reason_to_drop(tags) is reason


@pytest.mark.parametrize(
    ("tags", "blocks"),
    [
        ({}, False),
        ({"barrier": "bollard"}, True),
        ({"barrier": "bollard", "bollard": "rising"}, False),
        ({"barrier": "bollard", "motor_vehicle": "yes"}, False),
        ({"barrier": "gate"}, False),
        ({"barrier": "gate", "access": "private"}, True),
        ({"barrier": "toll_booth"}, False),
        ({"barrier": "block"}, True),
    ],
)
def test_barriers_block_cars_unless_they_open(tags: dict[str, str], blocks: bool) -> None:
    assert blocks_cars(tags) is blocks


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        ({"highway": "traffic_signals"}, Control(ControlKind.SIGNALS)),
        ({"highway": "crossing;traffic_signals"}, Control(ControlKind.SIGNALS)),
        (
            {"highway": "traffic_signals", "traffic_signals:direction": "backward"},
            Control(ControlKind.SIGNALS, Facing.BACKWARD),
        ),
        ({"highway": "stop", "direction": "forward"}, Control(ControlKind.STOP, Facing.FORWARD)),
        ({"highway": "stop", "stop": "all"}, Control(ControlKind.STOP_ALL)),
        ({"highway": "give_way", "direction": "both"}, Control(ControlKind.GIVE_WAY, Facing.BOTH)),
        ({"highway": "give_way", "direction": "45"}, Control(ControlKind.GIVE_WAY, Facing.UNSAID)),
        ({"highway": "mini_roundabout"}, Control(ControlKind.MINI_ROUNDABOUT, Facing.BOTH)),
        ({"highway": "crossing", "crossing": "traffic_signals"}, Control(ControlKind.PEDESTRIAN_SIGNALS, Facing.BOTH)),
        ({"railway": "level_crossing"}, Control(ControlKind.LEVEL_CROSSING, Facing.BOTH)),
        ({"highway": "crossing", "crossing": "uncontrolled"}, None),
        ({"highway": "bus_stop"}, None),
    ],
)
def test_control_of_a_node(tags: dict[str, str], expected: Control | None) -> None:
    assert control(tags) == expected


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        ({"restriction": "no_left_turn"}, TurnRule(only=False)),
        ({"restriction": "only_straight_on"}, TurnRule(only=True)),
        ({"restriction": "no_left_turn", "except": "bus;motorcar"}, None),
        ({"restriction": "no_left_turn", "except": "psv"}, TurnRule(only=False)),
        ({"restriction:hgv": "no_left_turn"}, None),
        ({"restriction:motorcar": "no_u_turn"}, TurnRule(only=False)),
        ({"restriction:conditional": "no_left_turn @ (07:00-09:00)"}, Dropped.RESTRICTION_CONDITIONAL),
        ({"restriction": "no_left_turn", "hour_on": "07:00"}, Dropped.RESTRICTION_CONDITIONAL),
        ({"restriction": "give_way"}, Dropped.RESTRICTION),
        ({}, Dropped.RESTRICTION),
    ],
)
def test_turn_rule_of_a_relation(tags: dict[str, str], expected: TurnRule | Dropped | None) -> None:
    assert turn_rule(tags) == expected


def test_structures_are_bridges_and_tunnels_but_no_culverts() -> None:
    assert is_structure({"bridge": "viaduct"})
    assert is_structure({"tunnel": "yes"})
    assert not is_structure({"tunnel": "culvert"})
    assert not is_structure({"tunnel": "building_passage"})
    assert not is_structure({"bridge": "no"})
