"""What the OpenStreetMap tags of a way, a node or a relation mean for a private motor car."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum, IntEnum, StrEnum
from typing import TYPE_CHECKING, Final, Literal

from energy.stops import FunctionalClass
from routing.importers.conditional import concerns_cars

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
    BARRIER_UNKNOWN = "way_points_blocked_by_unknown_barriers"
    SPEED = "speed_limits_implausible"
    CONDITIONAL = "conditional_tags_ignored"
    LIMIT_CONDITION = "speed_limits_under_unknown_conditions"
    FERRY = "ferries"
    FERRY_M = "ferries_m"
    FERRY_ASSUMED = "ferries_at_assumed_speed"
    FERRY_DURATION = "ferry_durations_not_used"
    FERRY_END = "ferries_that_lead_nowhere"
    RESTRICTION = "restrictions_not_understood"
    RESTRICTION_CONDITIONAL = "restrictions_conditional"
    RESTRICTION_MOOT = "restrictions_without_effect"
    RESTRICTION_VIA_WAY = "restrictions_over_ways"
    LOOP = "loops_too_short"
    HEIGHT = "roads_without_height"
    LENGTH = "stated_lengths_implausible"


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
# Ways made for others, and roads only where a tag of motor vehicles admits cars; `access=yes` does not.
ADMITTING_HIGHWAYS: Final[Mapping[str, RoadClass]] = {
    "pedestrian": RoadClass(FunctionalClass.SERVICE, living_street=True),
    "track": RoadClass(FunctionalClass.SERVICE),
    "cycleway": RoadClass(FunctionalClass.SERVICE),
    "footway": RoadClass(FunctionalClass.SERVICE),
    "path": RoadClass(FunctionalClass.SERVICE),
    "bridleway": RoadClass(FunctionalClass.SERVICE),
    "busway": RoadClass(FunctionalClass.SERVICE),
}
_ACCESS_KEYS: Final = ("motorcar", "motor_vehicle", "vehicle", "access")  # the narrowest wins
_ACCESS_KEYS_ALONG: Final = {
    direction: tuple(own for key in _ACCESS_KEYS for own in (f"{key}:{direction}", f"{key}:both_ways", key))
    for direction in ("forward", "backward")
}
_ENDS: Final = ("", ":forward", ":backward", ":both_ways")
_ALL_ACCESS_KEYS: Final = frozenset(f"{key}{end}" for key in _ACCESS_KEYS for end in _ENDS)
_ADMITTING_KEYS: Final = tuple(f"{key}{end}" for key in ("motorcar", "motor_vehicle") for end in _ENDS)
_OPEN_TO_ALL: Final = frozenset(("yes", "permissive", "designated", "public", "allowed"))
_SOFT_TRACKS: Final = frozenset(("grade4", "grade5"))
_ADMITTING_SET: Final = frozenset(_ADMITTING_KEYS)
_CAR_CLASSES: Final = frozenset(("motorcar", "motor_vehicle", "vehicle"))
_CONDITIONAL_KEYS: Final = frozenset(
    (
        *(f"{key}{end}:conditional" for key in _ACCESS_KEYS for end in _ENDS),
        *(f"oneway{name}:conditional" for name in ("", ":motorcar", ":motor_vehicle", ":vehicle")),
    )
)
_PERMITTED: Final = frozenset(
    (
        *("yes", "permissive", "designated", "destination", "customers", "public", "discouraged", "allowed", "toll"),
        *("motorcar", "motor_vehicle", "vehicle", "car", "visitors", "guests", "tolls"),
    )
)
# Values that admit others than a private car on its way through. The wiki's page on access=delivery: only suppliers.
_DENIED: Final = frozenset(
    (
        *(
            "no",
            "private",
            "agricultural",
            "forestry",
            "emergency",
            "military",
            "psv",
            "bus",
            "taxi",
            "hov",
            "delivery",
        ),
        *("residents", "resident", "permit", "employees", "employee", "staff", "official", "restricted", "disabled"),
        *("hgv", "goods", "coach", "tourist_bus", "share_taxi", "minibus", "public_transport", "tram", "service"),
        *("bicycle", "foot", "pedestrian", "pedestrians", "horse", "moped", "mofa", "motorcycle", "use_sidepath"),
        *("dismount", "police", "garbage", "authorized", "authorised", "members", "closed"),
        *("license", "licence", "agriculture", "forest", "hazmat", "caravan", "carsharing", "car_sharing"),
        *(
            "none",
            "prohibited",
            "forbidden",
            "not",
            "farm",
            "farmer",
            "farmers",
            "government",
            "students",
            "construction",
        ),
        *("owner", "owners", "tenants", "school", "maintenance", "logging", "lorry", "truck", "trailer", "tractor"),
    )
)
_SERVICE_DROPPED: Final = frozenset(
    (
        "driveway",
        "driveway2",
        "parking_aisle",
        "drive-through",
        "drive_through",
        "emergency_access",
        "parking",
        "bus",
        "busway",
    )
)
# After the wiki page Key:barrier. A gate opens; what only keeps out animals, great heights or widths lets a car by.
_OPEN_BARRIERS: Final = frozenset(
    (
        *("no", "entrance", "gate", "lift_gate", "swing_gate", "sliding_gate", "sliding_beam", "hampshire_gate"),
        *("bump_gate", "double_gate", "wire_gate", "garage_door", "ticket_gate", "cattle_grid", "toll_booth"),
        *("border_control", "kerb", "sally_port", "height_restrictor", "width_restrictor", "arch", "coupure"),
        *("rising_bollard", "rising_bollards", "spikes", "speed_bump", "speed_hump", "speed_table", "checkpoint"),
        *("drawbridge", "cattlegrid", "cattle_stop", "cattle_guard", "lowered_kerb", "gap", "none", "removed", "open"),
    )
)
_SHUT_BARRIERS: Final = frozenset(
    (
        *("bollard", "bollards", "block", "blocks", "bar", "boulder", "rock", "bus_trap", "cable_barrier", "chain"),
        *("city_wall", "concrete", "cycle_barrier", "debris", "ditch", "fence", "full-height_turnstile", "guard_rail"),
        *("handrail", "hedge", "hedge_bank", "horse_stile", "jersey_barrier", "kent_carriage_gap", "kissing_gate"),
        *("log", "motorcycle_barrier", "pipe", "planter", "pole", "retaining_wall", "rope", "stile", "sump_buster"),
        *("tank_trap", "tree", "trench", "turnstile", "tyres", "wall", "wedge", "wicket_gate", "yes"),
        *(
            "lych_gate",
            "lychgate",
            "bridle_gate",
            "horse_gate",
            "foot_gate",
            "pedestrian_gate",
            "hand_gate",
            "garden_gate",
        ),
        *("cycle_gate", "bicycle_gate", "squeeze_gate", "half_gate", "squeeze", "squeeze_stile", "barrier_board"),
        *("barricade", "concrete_block", "roadblock", "road_block", "stone", "stones", "rocks", "logs", "earth_bank"),
        *("berm", "mound", "rubble", "railing", "railings", "post", "posts", "removable_bollard", "flower_pot"),
    )
)
_GATES: Final = ("gate", "gates")  # a kind that ends so is a gate for vehicles unless it is listed as shut
_YES: Final = frozenset(("yes", "true", "1"))
# Said of a way that is none at present, after the wiki's pages on life cycles, Key:construction and Key:ice_road.
_NO_ROAD_KEYS: Final = (
    *("ice_road", "winter_road", "impassable", "abandoned", "razed", "demolished", "removed", "proposed", "planned"),
)
_STATE_KEYS: Final = frozenset((*_NO_ROAD_KEYS, "smoothness", "status", "construction"))
_NO: Final = frozenset(("no", "false", "0"))
_NO_STRUCTURE: Final = (*_NO, "none", "0.0", "low_water_crossing")  # the last is a ford with a floor


def tag_values(tags: Mapping[str, str], key: str) -> list[str]:
    """The values of a tag, several apart at `;`, in lower case as they are meant; empty where there is none."""
    value = tags.get(key)
    if value is None:
        return []
    return [word for part in value.split(";") if (word := part.strip().lower())]


def _value(tags: Mapping[str, str], key: str) -> str | None:
    """The first value of a tag in lower case, or None."""
    return next(iter(tag_values(tags, key)), None) if key in tags else None


def road_class(highway: str) -> RoadClass | None:
    """Class of a highway value that cars may drive, the first known of several, or None."""
    for value in tag_values({"highway": highway}, "highway"):
        if value in HIGHWAYS:
            return HIGHWAYS[value]
    return None


def admitted_class(highway: str, tags: Mapping[str, str]) -> RoadClass | None:
    """Class of a way made for others that its tags open to all cars (`track` and `motorcar=yes`), or None.

    highway: the value of that tag among tags. `access` and `vehicle` alone make it no road, nor does `destination`; nor
    is a track of grade 4 or 5 one, which is soft.
    """
    found = ADMITTING_HIGHWAYS.get(highway.strip().lower())
    if found is None or not any(key in tags for key in _ADMITTING_KEYS):
        return None
    open_to_all = any(value in _OPEN_TO_ALL for key in _ADMITTING_KEYS for value in tag_values(tags, key))
    return found if open_to_all and _value(tags, "tracktype") not in _SOFT_TRACKS else None


def car_may_pass(tags: Mapping[str, str]) -> bool:
    """Whether a private car may use the object in either direction; see car_may_pass_along."""
    return car_may_pass_along(tags, "forward") or car_may_pass_along(tags, "backward")


def car_may_pass_along(tags: Mapping[str, str], direction: Literal["forward", "backward"]) -> bool:
    """Whether a private car may use the object in one direction of its way.

    motorcar wins over motor_vehicle, that over vehicle, that over access; of the same class the key with the
    direction (`access:backward`) wins, then that with `:both_ways`. A list denies when none of its values admits.
    `destination`, `customers` and `permissive` let a car pass; a value that is not known says nothing; conditional
    tags are not read.
    """
    if _ALL_ACCESS_KEYS.isdisjoint(tags):
        return True
    for key in _ACCESS_KEYS_ALONG[direction]:
        if key in tags:
            admitted = _admits(tags, key)
            if admitted is not None:
                return admitted
    return True


def _is_opened_along(tags: Mapping[str, str], direction: Literal["forward", "backward"]) -> bool:
    """Whether a tag of motor vehicles opens a way of others in a direction; what is not said is closed there."""
    said = (_admits(tags, key) for key in _ACCESS_KEYS_ALONG[direction] if key in tags and key in _ADMITTING_SET)
    return next((admitted for admitted in said if admitted is not None), False)


def _admits(tags: Mapping[str, str], key: str) -> bool | None:
    values = [v for value in tag_values(tags, key) for part in re.split(r"[,|]", value) if (v := part.strip())]
    if any(value in _PERMITTED for value in values):
        return True
    return False if any(value in _DENIED for value in values) else None


class Barrier(Enum):
    """What a barrier node does to cars."""

    OPEN = "open"
    SHUT = "shut"
    UNKNOWN = "unknown"  # a value without a known meaning: shut


def barrier_of(tags: Mapping[str, str]) -> Barrier:
    """What the barrier of a node does to cars: bollards and blocks shut, gates where locked or where access is denied.

    Access tags win over the kind of barrier; of several kinds (`gate;cattle_grid`) all must be open.
    """
    kinds = tag_values(tags, "barrier")
    if not set(kinds) - {"no"}:
        return Barrier.OPEN
    if any(_admits(tags, f"{key}{end}") is not None for key in _ACCESS_KEYS for end in _ENDS):
        return Barrier.OPEN if car_may_pass(tags) else Barrier.SHUT
    if _value(tags, "locked") in _YES:
        return Barrier.SHUT
    rising = _value(tags, "bollard") in ("rising", "retractable")
    kinds = [kind for kind in kinds if not (rising and kind == "bollard")]
    if any(kind in _SHUT_BARRIERS for kind in kinds):
        return Barrier.SHUT
    return Barrier.OPEN if all(kind in _OPEN_BARRIERS or kind.endswith(_GATES) for kind in kinds) else Barrier.UNKNOWN


def blocks_cars(tags: Mapping[str, str]) -> bool:
    """Whether a barrier node stops cars: bollards, blocks and unknown barriers do, gates where access is denied."""
    return barrier_of(tags) is not Barrier.OPEN


def reason_to_drop(tags: Mapping[str, str]) -> Dropped | None:
    """Why a way of a drivable class is left out, or None."""
    if not any(drivable(tags)):
        return Dropped.ACCESS
    if _value(tags, "highway") == "service" and _value(tags, "service") in _SERVICE_DROPPED:
        return Dropped.SERVICE
    if _value(tags, "area") in _YES:
        return Dropped.AREA
    return Dropped.CONDITION if _is_no_road(tags) else None


def _is_no_road(tags: Mapping[str, str]) -> bool:
    """Whether a way can't be driven at present: not built yet, given up, or of ice."""
    if _STATE_KEYS.isdisjoint(tags):
        return False
    return (
        any(_value(tags, key) in _YES for key in _NO_ROAD_KEYS)
        or any(_value(tags, key) == "impassable" for key in ("smoothness", "status"))
        or any(work in _YES or work in HIGHWAYS for work in tag_values(tags, "construction"))
    )


def is_conditional(tags: Mapping[str, str]) -> bool:
    """Whether access or oneway of cars depends on a condition that is not read here."""
    if _CONDITIONAL_KEYS.isdisjoint(tags):
        return False
    return any(key in _CONDITIONAL_KEYS and concerns_cars(value) for key, value in tags.items())


class Oneway(Enum):
    """Directions in which a way may be driven."""

    BOTH = "both"
    FORWARD = "forward"
    BACKWARD = "backward"
    CHANGING = "changing"  # with the time of day: in no direction can a driver rely on it


def oneway(tags: Mapping[str, str]) -> Oneway:
    """Driving direction of a way from oneway tags, else from what motorways and roundabouts imply.

    An alternating way changes its direction every few minutes, at signals: it may be driven in both.
    """
    for key in ("oneway:motorcar", "oneway:motor_vehicle", "oneway:vehicle", "oneway"):
        value = _value(tags, key)
        if value in _YES:
            return Oneway.FORWARD
        if value in ("-1", "reverse"):
            return Oneway.BACKWARD
        if value in _NO or value == "alternating":
            return Oneway.BOTH
        if value == "reversible":
            return Oneway.CHANGING
    if is_roundabout(tags) or _value(tags, "highway") == "motorway":
        return Oneway.FORWARD
    return Oneway.BOTH


def drivable(tags: Mapping[str, str]) -> tuple[bool, bool]:
    """Whether a private car may drive a way along and against its points: by its oneway and its access tags."""
    direction = oneway(tags)
    may = _is_opened_along if tags.get("highway", "").strip().lower() in ADMITTING_HIGHWAYS else car_may_pass_along
    return (
        direction is not Oneway.BACKWARD and may(tags, "forward"),
        direction is not Oneway.FORWARD and may(tags, "backward"),
    )


def is_roundabout(tags: Mapping[str, str]) -> bool:
    """Whether a way is the ring of a roundabout."""
    return _value(tags, "junction") in ("roundabout", "circular")


def is_structure(tags: Mapping[str, str]) -> bool:
    """Whether a way leaves the terrain: a bridge, a tunnel or a gallery."""
    return (
        (_value(tags, "bridge") or "no") not in _NO_STRUCTURE
        or (_value(tags, "tunnel") or "no") not in (*_NO_STRUCTURE, "culvert", "building_passage")
        or _value(tags, "covered") in ("arcade_gallery", "gallery")
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


# pelican and the like are the British names of crossings with signals
_SIGNAL_CROSSINGS: Final = frozenset(("traffic_signals", "pelican", "puffin", "toucan", "pegasus"))


def control(tags: Mapping[str, str]) -> Control | None:
    """The strongest control among the tags of a node, or None."""
    highway = tag_values(tags, "highway")
    if "traffic_signals" in highway:
        return Control(ControlKind.SIGNALS, _facing(tags, "traffic_signals:direction"))
    if "stop" in highway:
        everybody = _value(tags, "stop") == "all"
        return Control(ControlKind.STOP_ALL if everybody else ControlKind.STOP, _facing(tags, "stop:direction"))
    if "give_way" in highway:
        return Control(ControlKind.GIVE_WAY, _facing(tags, "give_way:direction"))
    if "mini_roundabout" in highway:
        return Control(ControlKind.MINI_ROUNDABOUT, Facing.BOTH)
    if not _SIGNAL_CROSSINGS.isdisjoint(tag_values(tags, "crossing")) or _value(tags, "crossing:signals") == "yes":
        return Control(ControlKind.PEDESTRIAN_SIGNALS, Facing.BOTH)
    if _value(tags, "railway") in ("level_crossing", "tram_level_crossing"):
        return Control(ControlKind.LEVEL_CROSSING, Facing.BOTH)
    return None


def _facing(tags: Mapping[str, str], key: str) -> Facing:
    named = {"forward", "backward", "both"}.intersection(tag_values(tags, key) or tag_values(tags, "direction"))
    if len(named) > 1:
        return Facing.BOTH
    return Facing(named.pop()) if named else Facing.UNSAID


@dataclass(frozen=True, slots=True)
class TurnRule:
    """Whether a restriction names the only permitted turn or a forbidden one."""

    only: bool


_BANS: Final = frozenset(("no_right_turn", "no_left_turn", "no_u_turn", "no_straight_on", "no_entry", "no_exit"))
_ORDERS: Final = frozenset(("only_right_turn", "only_left_turn", "only_straight_on", "only_u_turn"))
_RED: Final = frozenset(("no_turn_on_red", "no_right_turn_on_red", "no_left_turn_on_red", "no_straight_on_red"))


def turn_rule(tags: Mapping[str, str]) -> TurnRule | Dropped | None:
    """What a restriction relation asks of cars: a rule, a reason to pass it over, or None where it leaves cars alone.

    `type=restriction:CLASS` and `restriction:CLASS` are for that class alone, `except` exempts; the narrowest key that
    holds for cars wins. Values other than the closed list of the wiki's page Relation:restriction are not understood;
    a ban of turning on red leaves the turn free on green.
    """
    if _listed(tags.get("except", "")) & _CAR_CLASSES:
        return None
    kind = tags.get("type", "").strip().lower()
    if kind.startswith("restriction:"):
        classes = set(kind.split(":")[1:]) - {"conditional"}
        if classes and not set().union(*map(_listed, classes)) & _CAR_CLASSES:
            return None
    for key in ("restriction:motorcar", "restriction:motor_vehicle", "restriction:vehicle", "restriction"):
        values = {value.replace(" ", "_").replace("-", "_") for value in tag_values(tags, key)}
        if not values:
            continue
        if values <= _RED | {"none", "no"}:
            return None
        if any(limit in tags for limit in ("day_on", "hour_on", "day_off", "hour_off")):
            return Dropped.RESTRICTION_CONDITIONAL
        if values <= _BANS:
            return TurnRule(only=False)
        return TurnRule(only=True) if values <= _ORDERS else Dropped.RESTRICTION
    conditional = [
        tags.get(f"{key}:conditional") for key in ("restriction", *(f"restriction:{c}" for c in _CAR_CLASSES))
    ]
    if any(conditional):
        return Dropped.RESTRICTION_CONDITIONAL if any(v and concerns_cars(v) for v in conditional) else None
    if any(key.startswith("restriction:") for key in tags):
        return None  # for lorries, buses, bicycles
    return Dropped.RESTRICTION


def _listed(value: str) -> set[str]:
    return {part.strip().lower() for part in re.split(r"[;,|]", value)}
