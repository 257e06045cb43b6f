"""What the OpenStreetMap tags of a way, a node or a relation mean for a private motor car."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntEnum, StrEnum
from typing import TYPE_CHECKING, Final

from energy.stops import FunctionalClass

if TYPE_CHECKING:
    from collections.abc import Mapping


class Dropped(StrEnum):
    """Why an importer left something out; keys of GraphMeta.dropped."""

    ACCESS = "ways_without_access"
    SERVICE = "ways_driveway_or_parking"
    AREA = "ways_that_are_areas"
    CONDITION = "ways_impassable"
    REVERSIBLE = "ways_reversible"
    POINTS = "way_points_missing"
    BARRIER = "way_points_blocked"
    SPEED = "speed_limits_implausible"
    CONDITIONAL = "conditional_tags_ignored"
    FERRY = "ferries"
    RESTRICTION = "restrictions_not_understood"
    RESTRICTION_CONDITIONAL = "restrictions_conditional"
    RESTRICTION_MOOT = "restrictions_without_effect"
    LOOP = "loops_too_short"
    HEIGHT = "roads_without_height"


@dataclass(frozen=True, slots=True)
class RoadClass:
    """Functional class of a highway value, whether it is a ramp (`*_link`) or a living street."""

    functional_class: FunctionalClass
    ramp: bool = False
    living_street: bool = False


# A motorway's ramp counts as a trunk road: it ends at signals and roundabouts, a motorway never does.
HIGHWAYS: Final[Mapping[str, RoadClass]] = {
    "motorway": RoadClass(FunctionalClass.MOTORWAY),
    "motorway_link": RoadClass(FunctionalClass.TRUNK, ramp=True),
    "trunk": RoadClass(FunctionalClass.TRUNK),
    "trunk_link": RoadClass(FunctionalClass.TRUNK, ramp=True),
    "primary": RoadClass(FunctionalClass.PRIMARY),
    "primary_link": RoadClass(FunctionalClass.PRIMARY, ramp=True),
    "secondary": RoadClass(FunctionalClass.SECONDARY),
    "secondary_link": RoadClass(FunctionalClass.SECONDARY, ramp=True),
    "tertiary": RoadClass(FunctionalClass.TERTIARY),
    "tertiary_link": RoadClass(FunctionalClass.TERTIARY, ramp=True),
    "unclassified": RoadClass(FunctionalClass.UNCLASSIFIED),
    "road": RoadClass(FunctionalClass.UNCLASSIFIED),
    "residential": RoadClass(FunctionalClass.RESIDENTIAL),
    "living_street": RoadClass(FunctionalClass.RESIDENTIAL, living_street=True),
    "service": RoadClass(FunctionalClass.SERVICE),
}
_ACCESS_KEYS: Final = ("motorcar", "motor_vehicle", "vehicle", "access")  # the narrowest wins
_DENIED: Final = frozenset(
    (
        *("no", "private", "agricultural", "forestry", "agricultural;forestry", "emergency", "military", "psv", "bus"),
        *("taxi", "hov", "residents", "permit", "employees", "staff", "official", "restricted"),
    )
)
_SERVICE_DROPPED: Final = frozenset(
    ("driveway", "parking_aisle", "drive-through", "emergency_access", "parking", "bus", "busway")
)
_OPEN_BARRIERS: Final = frozenset(
    (
        *("no", "entrance", "gate", "lift_gate", "swing_gate", "cattle_grid", "toll_booth", "border_control", "kerb"),
        *("sally_port", "height_restrictor", "width_restrictor", "arch", "rising_bollard", "spikes", "speed_bump"),
        "checkpoint",
    )
)
_YES: Final = frozenset(("yes", "true", "1"))
_NO: Final = frozenset(("no", "false", "0"))


def road_class(highway: str) -> RoadClass | None:
    """Class of a highway value that cars may drive, the first known of several, or None."""
    for value in highway.split(";"):
        if value.strip() in HIGHWAYS:
            return HIGHWAYS[value.strip()]
    return None


def car_may_pass(tags: Mapping[str, str]) -> bool:
    """Whether a private car may use the object: motorcar over motor_vehicle over vehicle over access.

    `destination`, `customers`, `permissive` and unknown values let it pass; conditional tags are not read.
    """
    for key in _ACCESS_KEYS:
        if key in tags:
            return tags[key] not in _DENIED
    return True


def blocks_cars(tags: Mapping[str, str]) -> bool:
    """Whether a barrier node stops cars: bollards and blocks do, gates do only where access is denied."""
    barrier = tags.get("barrier")
    if barrier is None or barrier == "no":
        return False
    if any(key in tags for key in _ACCESS_KEYS):
        return not car_may_pass(tags)
    return barrier not in _OPEN_BARRIERS and tags.get("bollard") != "rising"


def reason_to_drop(tags: Mapping[str, str]) -> Dropped | None:
    """Why a way of a drivable class is left out, or None."""
    if not car_may_pass(tags):
        return Dropped.ACCESS
    if tags.get("highway") == "service" and tags.get("service") in _SERVICE_DROPPED:
        return Dropped.SERVICE
    if tags.get("area") == "yes":
        return Dropped.AREA
    if tags.get("smoothness") == "impassable" or tags.get("ice_road") == "yes" or tags.get("winter_road") == "yes":
        return Dropped.CONDITION
    return None


class Oneway(Enum):
    """Directions in which a way may be driven."""

    BOTH = "both"
    FORWARD = "forward"
    BACKWARD = "backward"
    CHANGING = "changing"  # with the time of day: in no direction can one rely on it


def oneway(tags: Mapping[str, str]) -> Oneway:
    """Driving direction of a way from oneway tags, else from what motorways and roundabouts imply."""
    for key in ("oneway:motorcar", "oneway:motor_vehicle", "oneway:vehicle", "oneway"):
        value = tags.get(key)
        if value in _YES:
            return Oneway.FORWARD
        if value in ("-1", "reverse"):
            return Oneway.BACKWARD
        if value in _NO:
            return Oneway.BOTH
        if value in ("reversible", "alternating"):
            return Oneway.CHANGING
    if is_roundabout(tags) or tags.get("highway") == "motorway":
        return Oneway.FORWARD
    return Oneway.BOTH


def is_roundabout(tags: Mapping[str, str]) -> bool:
    """Whether a way is the ring of a roundabout."""
    return tags.get("junction") in ("roundabout", "circular")


def is_structure(tags: Mapping[str, str]) -> bool:
    """Whether a way leaves the terrain: a bridge, a tunnel or a gallery."""
    return (
        tags.get("bridge", "no") not in _NO
        or tags.get("tunnel", "no") not in ("no", "false", "0", "culvert", "building_passage")
        or tags.get("covered") in ("arcade_gallery", "gallery")
    )


class ControlKind(IntEnum):
    """What makes a driver stop at a node."""

    LEVEL_CROSSING = 1
    PEDESTRIAN_SIGNALS = 2
    MINI_ROUNDABOUT = 3
    GIVE_WAY = 4
    STOP = 5
    STOP_ALL = 6
    SIGNALS = 7


class Facing(Enum):
    """Driving direction along its way for which a sign stands."""

    UNSAID = "unsaid"
    FORWARD = "forward"
    BACKWARD = "backward"
    BOTH = "both"


@dataclass(frozen=True, slots=True)
class Control:
    """A sign or signal at a node."""

    kind: ControlKind
    facing: Facing = Facing.UNSAID


def control(tags: Mapping[str, str]) -> Control | None:
    """The strongest control among the tags of a node, or None."""
    highway = [value.strip() for value in tags.get("highway", "").split(";")]
    if "traffic_signals" in highway:
        return Control(ControlKind.SIGNALS, _facing(tags, "traffic_signals:direction"))
    if "stop" in highway:
        everybody = tags.get("stop") == "all"
        return Control(ControlKind.STOP_ALL if everybody else ControlKind.STOP, _facing(tags, "stop:direction"))
    if "give_way" in highway:
        return Control(ControlKind.GIVE_WAY, _facing(tags, "give_way:direction"))
    if "mini_roundabout" in highway:
        return Control(ControlKind.MINI_ROUNDABOUT, Facing.BOTH)
    if tags.get("crossing") == "traffic_signals" or tags.get("crossing:signals") == "yes":
        return Control(ControlKind.PEDESTRIAN_SIGNALS, Facing.BOTH)
    if tags.get("railway") in ("level_crossing", "tram_level_crossing"):
        return Control(ControlKind.LEVEL_CROSSING, Facing.BOTH)
    return None


def _facing(tags: Mapping[str, str], key: str) -> Facing:
    value = tags.get(key, tags.get("direction", ""))
    return Facing(value) if value in ("forward", "backward", "both") else Facing.UNSAID


@dataclass(frozen=True, slots=True)
class TurnRule:
    """Whether a restriction names the only permitted turn or a forbidden one."""

    only: bool


def turn_rule(tags: Mapping[str, str]) -> TurnRule | Dropped | None:
    """What a restriction relation asks of cars: a rule, a reason to pass it over, or None where cars are exempt."""
    exempt = {value.strip() for value in tags.get("except", "").split(";")}
    if exempt & {"motorcar", "motor_vehicle", "vehicle"}:
        return None
    for key in ("restriction:motorcar", "restriction:motor_vehicle", "restriction:vehicle", "restriction"):
        value = tags.get(key)
        if value is None:
            continue
        if any(limit in tags for limit in ("day_on", "hour_on", "day_off", "hour_off")):
            return Dropped.RESTRICTION_CONDITIONAL
        if value.startswith("no_"):
            return TurnRule(only=False)
        if value.startswith("only_"):
            return TurnRule(only=True)
        return Dropped.RESTRICTION
    if any(key.startswith("restriction") and key.endswith(":conditional") for key in tags):
        return Dropped.RESTRICTION_CONDITIONAL
    if any(key.startswith("restriction:") for key in tags):
        return None  # for lorries, buses, bicycles
    return Dropped.RESTRICTION
