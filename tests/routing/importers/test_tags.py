"""What tags mean for a private motor car."""

from __future__ import annotations

import pytest

from energy.stops import FunctionalClass
from routing.importers.tags import (
    Barrier,
    Control,
    ControlKind,
    Dropped,
    Facing,
    Oneway,
    TurnRule,
    admitted_class,
    barrier_of,
    blocks_cars,
    car_may_pass,
    control,
    drivable,
    is_conditional,
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
        ({"access": "delivery"}, False),
        ({"motor_vehicle": "delivery;destination"}, True),
        ({"motor_vehicle": "private;no"}, False),
        ({"access": "psv; taxi"}, False),
        ({"motor_vehicle": "bus,taxi"}, False),
        ({"motor_vehicle": "agricultural;destination"}, True),
        ({"access": "Private"}, False),
        ({"access": "NO", "motorcar": "Yes"}, True),
        ({"access": "private", "motor_vehicle": "unknown"}, False),
        ({"access": "unknown"}, True),
        ({"motor_vehicle": ""}, True),
        ({"bicycle:backward": "no"}, True),
    ],
)
def test_access_takes_the_narrowest_tag(tags: dict[str, str], passes: bool) -> None:
    assert car_may_pass(tags) is passes


@pytest.mark.parametrize(
    ("tags", "along", "against"),
    [
        ({}, True, True),
        ({"access:backward": "no"}, True, False),
        ({"vehicle:forward": "no"}, False, True),
        ({"motor_vehicle:backward": "Private"}, True, False),
        ({"motorcar:forward": "bus;taxi"}, False, True),
        ({"access": "no", "motorcar:forward": "yes"}, True, False),
        ({"access:backward": "no", "motor_vehicle": "yes"}, True, True),  # the narrower class wins over the direction
        ({"motor_vehicle": "no", "motor_vehicle:backward": "destination"}, False, True),
        ({"access:forward": "no", "access:backward": "no"}, False, False),
        ({"oneway": "yes", "access:backward": "no"}, True, False),
        ({"oneway": "-1", "access:backward": "no"}, False, False),
        ({"oneway": "yes", "motor_vehicle:backward": "yes"}, True, False),
        ({"oneway": "yes", "oneway:motorcar": "no", "vehicle:backward": "no"}, True, False),
        ({"highway": "motorway", "access:forward": "no"}, False, False),
        ({"access": "no", "motor_vehicle:forward": "yes"}, True, False),
        ({"access:both_ways": "no"}, False, False),
        ({"access": "no", "motorcar:both_ways": "yes"}, True, True),
        ({"motor_vehicle:both_ways": "no", "motor_vehicle:forward": "yes"}, True, False),
        ({"vehicle": "no", "motorcar": "destination"}, True, True),
        ({"access": "government"}, False, False),
        ({"motor_vehicle": "forbidden"}, False, False),
        ({"motor_vehicle": "farm;forestry"}, False, False),
        ({"access": "private;destination"}, True, True),
    ],
)
def test_access_of_a_direction_is_by_class_then_direction_within_the_oneway(
    tags: dict[str, str], along: bool, against: bool
) -> None:
    assert drivable(tags) == (along, against)
    assert (reason_to_drop(tags) is Dropped.ACCESS) is not (along or against)


@pytest.mark.parametrize(
    ("tags", "direction"),
    [
        ({}, Oneway.BOTH),
        ({"oneway": "Yes"}, Oneway.FORWARD),
        ({"oneway": "TRUE"}, Oneway.FORWARD),
        ({"oneway": "No"}, Oneway.BOTH),
        ({"junction": "Roundabout"}, Oneway.FORWARD),
        ({"oneway": "yes"}, Oneway.FORWARD),
        ({"oneway": "true"}, Oneway.FORWARD),
        ({"oneway": "1"}, Oneway.FORWARD),
        ({"oneway": "-1"}, Oneway.BACKWARD),
        ({"oneway": "reverse"}, Oneway.BACKWARD),
        ({"oneway": "no"}, Oneway.BOTH),
        ({"oneway": "reversible"}, Oneway.CHANGING),
        ({"oneway": "alternating"}, Oneway.BOTH),  # by turns, at signals
        ({"oneway": "-1", "oneway:motorcar": "no"}, Oneway.BOTH),
        ({"oneway": "no", "oneway:motorcar": "-1"}, Oneway.BACKWARD),
        ({"oneway": "yes", "oneway:bicycle": "no", "oneway:psv": "no"}, Oneway.FORWARD),
        ({"junction": "roundabout", "oneway": "-1"}, Oneway.BACKWARD),
        ({"junction": "roundabout", "oneway": "no"}, Oneway.BOTH),
        ({"junction": "mini_roundabout"}, Oneway.BOTH),
        ({"oneway:conditional": "yes @ (Mo-Fr 07:00-09:00)"}, Oneway.BOTH),
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
    assert road_class("Residential") == road_class("residential")
    for value in ("footway", "track", "construction", "busway", "raceway", ""):
        assert road_class(value) is None


@pytest.mark.parametrize(
    ("tags", "is_road"),
    [
        ({"highway": "track", "motor_vehicle": "yes"}, True),
        ({"highway": "track", "motorcar": "permissive", "tracktype": "grade2"}, True),
        ({"highway": "cycleway", "motor_vehicle:forward": "yes"}, True),
        ({"highway": "Footway", "motorcar": "Designated"}, True),
        ({"highway": "track"}, False),
        ({"highway": "track", "tracktype": "grade1"}, False),
        ({"highway": "track", "motor_vehicle": "yes", "tracktype": "grade5"}, False),
        ({"highway": "path", "access": "yes"}, False),
        ({"highway": "path", "vehicle": "yes"}, False),
        ({"highway": "cycleway", "motor_vehicle": "destination"}, False),
        ({"highway": "pedestrian", "motor_vehicle": "delivery"}, False),
        ({"highway": "steps", "motor_vehicle": "yes"}, False),
        ({"highway": "proposed", "motor_vehicle": "yes"}, False),
        ({"highway": "raceway", "motorcar": "yes"}, False),
    ],
)
def test_a_way_made_for_others_is_a_road_only_where_it_is_open_to_all_cars(tags: dict[str, str], is_road: bool) -> None:
    assert road_class(tags["highway"]) is None
    found = admitted_class(tags["highway"], tags)
    assert (found is not None) is is_road
    if found is not None:
        assert found.functional_class is FunctionalClass.SERVICE


@pytest.mark.parametrize(
    ("tags", "directions"),
    [
        ({"motor_vehicle": "yes"}, (True, True)),
        ({"motor_vehicle:forward": "yes"}, (True, False)),
        ({"motor_vehicle:forward": "yes", "access": "yes"}, (True, False)),
        ({"motorcar": "yes", "motor_vehicle": "no"}, (True, True)),
        ({"motorcar": "yes", "oneway": "yes"}, (True, False)),
    ],
)
def test_a_way_made_for_others_is_driven_only_where_it_is_opened(
    tags: dict[str, str], directions: tuple[bool, bool]
) -> None:
    assert drivable({"highway": "cycleway", **tags}) == directions


def test_a_street_of_pedestrians_that_admits_cars_is_driven_as_a_living_street() -> None:
    found = admitted_class("pedestrian", {"highway": "pedestrian", "motor_vehicle": "yes"})
    assert found is not None
    assert found.living_street


@pytest.mark.parametrize(
    ("tags", "waits"),
    [
        ({"access:conditional": "no @ (22:00-06:00)"}, True),
        ({"oneway:conditional": "yes @ (Mo-Fr 07:00-09:00)"}, True),
        ({"motor_vehicle:backward:conditional": "no @ (Mo-Fr)"}, True),
        ({"access:conditional": "no @ (weight>3.5); yes @ (06:00-20:00)"}, True),
        ({"access:conditional": "no @ (weight>3.5)"}, False),
        ({"hgv:conditional": "no @ (22:00-06:00)"}, False),
        ({"oneway:bicycle:conditional": "no @ (20:00-06:00)"}, False),
        (
            {"maxheight:conditional": "3.5 @ (Mo-Fr)", "parking:right:restriction:conditional": "no_parking @ (Mo)"},
            False,
        ),
    ],
)
def test_a_way_is_conditional_only_by_what_can_hold_for_cars(tags: dict[str, str], waits: bool) -> None:
    assert is_conditional(tags) is waits


@pytest.mark.parametrize(
    ("tags", "reason"),
    [
        ({"highway": "residential", "construction": "yes"}, Dropped.CONDITION),
        ({"highway": "primary", "construction": "primary"}, Dropped.CONDITION),
        ({"highway": "residential", "construction": "minor"}, None),
        ({"highway": "residential", "construction": "cycleway"}, None),
        ({"highway": "residential", "construction": "widening"}, None),
        ({"highway": "residential", "proposed": "yes"}, Dropped.CONDITION),
        ({"highway": "residential", "abandoned": "yes"}, Dropped.CONDITION),
        ({"highway": "residential", "abandoned": "no"}, None),
        ({"highway": "residential", "demolished": "Yes"}, Dropped.CONDITION),
        ({"highway": "residential", "status": "impassable"}, Dropped.CONDITION),
        ({"highway": "residential", "ford": "yes"}, None),
        ({"highway": "service", "service": "driveway2"}, Dropped.SERVICE),
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
        ({"barrier": "Bollard"}, True),
        ({"barrier": "bollard", "bollard": "removable"}, True),
        ({"barrier": "sliding_gate"}, False),
        ({"barrier": "sliding_beam"}, False),
        ({"barrier": "hampshire_gate"}, False),
        ({"barrier": "lift_gate"}, False),
        ({"barrier": "swing_gate"}, False),
        ({"barrier": "bump_gate"}, False),
        ({"barrier": "height_restrictor"}, False),
        ({"barrier": "wicket_gate"}, True),
        ({"barrier": "kissing_gate"}, True),
        ({"barrier": "gate;cattle_grid"}, False),
        ({"barrier": "gate;bollard"}, True),
        ({"barrier": "gate", "access": "delivery"}, True),
        ({"barrier": "gate", "locked": "yes"}, True),
        ({"barrier": "gate", "locked": "yes", "motor_vehicle": "yes"}, False),
        ({"barrier": "bollard", "access": "unknown"}, True),
        ({"barrier": "gate", "motor_vehicle:forward": "no"}, False),
    ],
)
def test_barriers_block_cars_unless_they_open(tags: dict[str, str], blocks: bool) -> None:
    assert blocks_cars(tags) is blocks


def test_barriers_without_a_known_meaning_are_told_apart() -> None:
    assert barrier_of({"barrier": "force_field"}) is Barrier.UNKNOWN
    assert barrier_of({"barrier": "force_field", "motor_vehicle": "yes"}) is Barrier.OPEN
    assert barrier_of({"barrier": "force_field;block"}) is Barrier.SHUT
    assert blocks_cars({"barrier": "force_field"})


@pytest.mark.parametrize(
    ("tags", "expected"),
    [
        ({"highway": "Traffic_Signals"}, Control(ControlKind.SIGNALS)),
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
        ({"highway": "crossing", "crossing": "toucan"}, Control(ControlKind.PEDESTRIAN_SIGNALS, Facing.BOTH)),
        ({"crossing": "marked", "crossing:signals": "yes"}, Control(ControlKind.PEDESTRIAN_SIGNALS, Facing.BOTH)),
        ({"highway": "stop", "direction": "forward;backward"}, Control(ControlKind.STOP, Facing.BOTH)),
        ({"highway": "give_way", "direction": "N;backward"}, Control(ControlKind.GIVE_WAY, Facing.BACKWARD)),
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
        ({"restriction": "no_turn_on_red"}, None),
        ({"restriction": "no_right_turn_on_red"}, None),
        ({"restriction": "no_thoroughfare"}, Dropped.RESTRICTION),
        ({"restriction": "only_uphill"}, Dropped.RESTRICTION),
        ({"restriction": "none"}, None),
        ({"restriction": "No_Left_Turn"}, TurnRule(only=False)),
        ({"restriction": "no_left_turn;no_u_turn"}, TurnRule(only=False)),
        ({"restriction": "no_left_turn;only_straight_on"}, Dropped.RESTRICTION),
        *(
            ({"restriction": f"no_{turn}"}, TurnRule(only=False))
            for turn in ("right_turn", "u_turn", "straight_on", "entry", "exit")
        ),
        *(({"restriction": f"only_{turn}"}, TurnRule(only=True)) for turn in ("right_turn", "left_turn", "u_turn")),
        ({"type": "restriction:hgv", "restriction": "no_left_turn"}, None),
        ({"type": "restriction:bus", "restriction:conditional": "no_left_turn @ (Mo-Fr)"}, None),
        ({"type": "restriction:motorcar", "restriction": "no_left_turn"}, TurnRule(only=False)),
        ({"type": "restriction:hgv;motorcar", "restriction": "no_left_turn"}, TurnRule(only=False)),
        ({"restriction": "no_left_turn", "restriction:motorcar": "none"}, None),
        ({"restriction:hgv:conditional": "no_left_turn @ (Mo-Fr)"}, None),
        ({"restriction": "no_left_turn", "except": "PSV, Motorcar"}, None),
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
