"""Combinations of tags against an oracle that is written from docs/import.md and the OpenStreetMap wiki alone.

The oracle shares no table with the importer. Pages of the wiki: Key:access (the key of the narrowest class of vehicles
decides), Forward & backward, Key:oneway, Key:maxspeed, Key:barrier, Relation:restriction.
"""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from routing.importers.osm import read_osm
from routing.importers.roads import Roads

Tags = dict[str, str]
ANCHOR = 1  # a road without odd tags, so that a file always has one
EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))

# what the wiki's page Key:access says of a private car that drives through
ADMITTING = ("yes", "permissive", "designated", "destination", "customers")
DENYING = ("no", "private", "agricultural", "forestry", "delivery", "permit", "psv", "bus", "military")
SAYING_NOTHING = ("maybe", "see note", "unknown")
CLASSES = ("access", "vehicle", "motor_vehicle", "motorcar")  # from wide to narrow
ACCESS_KEYS = tuple(f"{name}{end}" for name in CLASSES for end in ("", ":forward", ":backward", ":both_ways"))
# docs/import.md: ways made for others are roads where a key of motor vehicles opens them to all cars
FOR_OTHERS = ("track", "pedestrian", "cycleway")
OPEN_TO_ALL = ("yes", "permissive", "designated")
NOT_THERE = ("abandoned", "demolished", "proposed", "construction", "impassable")


# the oracle


def words(value: str) -> list[str]:
    return [word.strip().lower() for word in value.split(";")]


def allowed(tags: Tags, direction: str) -> bool:
    """The most special key that says something decides: class first, then direction, both ways, none of them."""
    ranks = {"": 0, "both_ways": 1, direction: 2}
    verdicts: dict[tuple[int, int], bool] = {}
    for key, value in tags.items():
        name, _, along = key.partition(":")
        if name not in CLASSES or along not in ranks:
            continue
        if set(words(value)) & set(ADMITTING):
            verdicts[CLASSES.index(name), ranks[along]] = True
        elif set(words(value)) & set(DENYING):
            verdicts[CLASSES.index(name), ranks[along]] = False
    if tags.get("highway") in FOR_OTHERS:  # closed but for what motor vehicles are told
        verdicts = {key: verdict for key, verdict in verdicts.items() if key[0] >= CLASSES.index("motor_vehicle")}
        return verdicts[max(verdicts)] if verdicts else False
    return verdicts[max(verdicts)] if verdicts else True


def directions_by_oneway(tags: Tags) -> set[str] | None:
    """Directions that oneway tags leave, None for those that change with the time of day."""
    meaning: dict[str, set[str] | None] = {
        **{value: {"forward"} for value in ("yes", "true", "1")},
        **{value: {"backward"} for value in ("-1", "reverse")},
        # Key:oneway: an alternating way is driven by turns in both directions, a reversible one at hours
        **{value: {"forward", "backward"} for value in ("no", "false", "0", "alternating")},
        "reversible": None,
    }
    for key in ("oneway:motorcar", "oneway:motor_vehicle", "oneway"):
        if tags.get(key, "").lower() in meaning:
            return meaning[tags[key].lower()]
    implied = tags["highway"] == "motorway" or tags.get("junction") in ("roundabout", "circular")
    return {"forward"} if implied else {"forward", "backward"}


def driven(tags: Tags) -> tuple[set[str], str | None]:
    """Directions in which a way is a road, and why it is none; neither where it is a way of others."""
    opening = [
        tags[key] for key in ACCESS_KEYS if key in tags and key.partition(":")[0] in ("motor_vehicle", "motorcar")
    ]
    if tags["highway"] in FOR_OTHERS and not {word for value in opening for word in words(value)} & set(OPEN_TO_ALL):
        return set(), None
    left = directions_by_oneway(tags)
    open_to_cars = {direction for direction in ("forward", "backward") if allowed(tags, direction)}
    both = open_to_cars if left is None else open_to_cars & left
    if not both:
        return set(), "ways_without_access"
    if tags.get("service") in ("driveway", "parking_aisle", "drive-through", "emergency_access"):
        return set(), "ways_driveway_or_parking"
    if tags.get("area") == "yes":
        return set(), "ways_that_are_areas"
    if any(tags.get(key) == "yes" for key in NOT_THERE):
        return set(), "ways_impassable"
    return (set(), "ways_reversible") if left is None else (both, None)


# units of the wiki's page Key:maxspeed
KMH_OF = {"": 1.0, " km/h": 1.0, " mph": 1.609344, " knots": 1.852}


def limit_kmh(value: str, tags: Tags) -> float | None:
    """The lowest limit of a list within 3..200 km/h, more than 160 as 160."""
    found = []
    unlimited = tags["highway"] in ("motorway", "trunk") or tags.get("motorroad") == "yes"
    for part in value.lower().split(";"):
        text = part.strip()
        if text == "walk":
            found.append(7.0)
        elif text == "none" and not tags["highway"].endswith("_link") and unlimited:
            found.append(130.0)
        for unit, kmh in KMH_OF.items():
            number = text.removesuffix(unit) if unit else text
            if (unit == "" or text.endswith(unit)) and re.fullmatch(r"\d+([.,]\d+)?", number):
                speed = float(number.replace(",", ".")) * kmh
                if 3.0 <= speed <= 200.0:
                    found.append(min(speed, 160.0))
    return min(found) if found else None


def signed_kmh(tags: Tags, keys: Sequence[str]) -> float | None:
    """The limit of the first key that names one."""
    limits = (limit_kmh(tags[key], tags) for key in keys if key in tags)
    return next((limit for limit in limits if limit is not None), None)


PASSABLE = ("gate", "lift_gate", "swing_gate", "cattle_grid", "toll_booth", "height_restrictor", "entrance")
SHUT = ("bollard", "block", "stile", "kissing_gate", "jersey_barrier", "turnstile", "fence", "wall")
NOT_KNOWN = ("dragon", "pile_of_sand")


def barrier_cuts(tags: Tags) -> str | None:
    """The reason under which a barrier is counted, None where cars pass."""
    said = [key for key in ACCESS_KEYS if set(words(tags.get(key, ""))) & {*ADMITTING, *DENYING}]
    if said:
        return None if any(allowed(tags, way) for way in ("forward", "backward")) else "way_points_blocked"
    if tags.get("locked") == "yes" or tags["barrier"] in SHUT:
        return "way_points_blocked"
    return "way_points_blocked_by_unknown_barriers" if tags["barrier"] in NOT_KNOWN else None


BANS = ("no_right_turn", "no_left_turn", "no_u_turn", "no_straight_on", "no_entry", "no_exit")
ORDERS = ("only_right_turn", "only_left_turn", "only_straight_on", "only_u_turn")
ON_RED = ("no_right_turn_on_red", "no_left_turn_on_red")
ODD = ("no_idea", "only_sometimes", "give_way")
OTHER_CLASSES = ("hgv", "bus", "bicycle", "psv")
CARS = ("motorcar", "motor_vehicle", "vehicle")


def turn(tags: Tags) -> str | None:
    """`ban`, `order`, the reason for passing it over, or None where cars are left alone."""
    if any(word in CARS for word in words(tags.get("except", ""))):
        return None
    value = next((tags[key] for key in (*(f"restriction:{name}" for name in CARS), "restriction") if key in tags), None)
    if value is None:
        return None if any(f"restriction:{name}" in tags for name in OTHER_CLASSES) else "restrictions_not_understood"
    if value in ON_RED:
        return None
    if value in BANS:
        return "ban"
    return "order" if value in ORDERS else "restrictions_not_understood"


# the generators


def cased(values: Sequence[str]) -> st.SearchStrategy[str]:
    return st.sampled_from(values).flatmap(lambda value: st.sampled_from((value, value.title(), value.upper())))


ACCESS_VALUE = st.lists(cased((*ADMITTING, *DENYING, *SAYING_NOTHING)), min_size=1, max_size=2).map(";".join)
ACCESS = st.dictionaries(st.sampled_from(ACCESS_KEYS), ACCESS_VALUE, max_size=4)
ONEWAY_VALUE = cased(("yes", "true", "1", "-1", "reverse", "no", "false", "0", "reversible", "alternating", "maybe"))
ONEWAY = st.dictionaries(
    st.sampled_from(("oneway", "oneway:motor_vehicle", "oneway:motorcar", "oneway:bicycle")), ONEWAY_VALUE, max_size=2
)
ROADS = ("motorway", "trunk", "motorway_link", "secondary", "residential", "living_street", "service")
HIGHWAY = st.sampled_from(ROADS)
EXTRA = st.sampled_from(
    (
        *({} for _ in range(12)),
        *({"junction": "roundabout"}, {"junction": "circular"}, {"area": "yes"}, {"bicycle": "no"}),
        *({key: value} for key in NOT_THERE for value in ("yes", "no")),
    )
)
SPEED_PART = st.one_of(
    st.builds("{}{}".format, st.integers(1, 260), st.sampled_from(tuple(KMH_OF))),
    st.builds("{}{}{}".format, st.integers(5, 99), st.sampled_from((".5", ",5")), st.sampled_from(("", " mph"))),
    st.sampled_from(("none", "walk", "signals", "variable", "fast")),
)
SPEED_VALUE = st.lists(SPEED_PART, min_size=1, max_size=3).map("; ".join)
BY_CLASS = ("maxspeed:motorcar", "maxspeed:motor_vehicle", "maxspeed:vehicle", "maxspeed")
BY_DIRECTION = ("maxspeed:forward", "maxspeed:backward", "maxspeed")


@st.composite
def way_tags(draw: st.DrawFn) -> Tags:
    tags = {"highway": draw(st.sampled_from((*ROADS, *FOR_OTHERS))), **draw(EXTRA), **draw(ACCESS), **draw(ONEWAY)}
    if tags["highway"] == "service":
        tags |= draw(st.sampled_from(({}, {"service": "alley"}, {"service": "driveway"}, {"service": "parking_aisle"})))
    return tags


@st.composite
def speed_tags(draw: st.DrawFn) -> Tags:
    keys = draw(st.sampled_from((BY_CLASS, BY_DIRECTION)))  # which of the two goes first the pages leave open
    tags = {"highway": draw(HIGHWAY), **draw(st.dictionaries(st.sampled_from(keys), SPEED_VALUE, max_size=3))}
    return {**tags, "oneway": "no", **draw(st.sampled_from(({}, {}, {"motorroad": "yes"})))}


@st.composite
def barrier_tags(draw: st.DrawFn) -> Tags:
    kind = draw(st.sampled_from((*PASSABLE, *SHUT, *NOT_KNOWN)))
    return {"barrier": kind, **draw(ACCESS), **draw(st.sampled_from(({}, {"locked": "yes"}, {"locked": "no"})))}


@st.composite
def turn_tags(draw: st.DrawFn) -> Tags:
    keys = ("restriction", *(f"restriction:{name}" for name in (*CARS, *OTHER_CLASSES)))
    values = st.sampled_from((*BANS, *ORDERS, *ON_RED, *ODD))
    tags = {"type": "restriction", **draw(st.dictionaries(st.sampled_from(keys), values, min_size=1, max_size=3))}
    return {**tags, **draw(st.sampled_from(({}, {"except": "psv"}, {"except": "bus;motorcar"}, {"except": "hgv"})))}


# what the importer reads


def read(
    ways: Mapping[int, tuple[Sequence[int], Tags]],
    node_tags: Mapping[int, Tags] | None = None,
    relations: Sequence[tuple[tuple[int, int, int], Tags]] = (),
) -> Roads:
    """Roads of a file in which point n lies n thousandths of a degree east."""

    def tagged(tags: Tags) -> str:
        return "".join(f"<tag k={quoteattr(key)} v={quoteattr(value)}/>" for key, value in tags.items())

    ways = {ANCHOR: ((900, 901), {"highway": "primary"}), **ways}
    points = sorted({point for refs, _ in ways.values() for point in refs})
    text = ["<osm version='0.6'>"]
    for ref in points:
        text.append(
            f"<node id='{ref}' lat='42.0' lon='{1.0 + ref / 1000.0}'>{tagged((node_tags or {}).get(ref, {}))}</node>"
        )
    for ref, (refs, tags) in sorted(ways.items()):
        nodes = "".join(f"<nd ref='{point}'/>" for point in refs)
        text.append(f"<way id='{ref}'>{nodes}{tagged(tags)}</way>")
    for ref, ((origin, via, target), tags) in enumerate(relations, start=1):
        members = f"<member type='way' ref='{origin}' role='from'/><member type='node' ref='{via}' role='via'/>"
        text.append(
            f"<relation id='{ref}'>{members}<member type='way' ref='{target}' role='to'/>{tagged(tags)}</relation>"
        )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "map.osm"
        path.write_text("\n".join([*text, "</osm>"]))
        return read_osm(path)


def numbered(tags: Sequence[Tags]) -> dict[int, tuple[tuple[int, int], Tags]]:
    return {10 + number: ((2 * number, 2 * number + 1), own) for number, own in enumerate(tags, start=1)}


@EXAMPLES
@given(st.lists(way_tags(), min_size=1, max_size=12))
def test_ways_are_driven_in_the_directions_that_their_tags_leave(tags: list[Tags]) -> None:
    drawn = numbered(tags)
    roads = read(drawn)
    found = {
        ref: {name for name, may in (("forward", forward), ("backward", backward)) if may}
        for ref, forward, backward in zip(roads.ways.id, roads.ways.forward, roads.ways.backward, strict=True)
        if ref != ANCHOR
    }
    expected = {ref: driven(own) for ref, (_, own) in drawn.items()}
    assert found == {ref: along for ref, (along, reason) in expected.items() if along and reason is None}
    reasons = Counter(reason for _, reason in expected.values() if reason)
    assert {key: count for key, count in roads.dropped.items() if key.startswith("ways_")} == reasons


@EXAMPLES
@given(st.lists(speed_tags(), min_size=1, max_size=12))
def test_limits_are_those_of_the_signs_that_count(tags: list[Tags]) -> None:
    drawn = numbered(tags)
    roads = read(drawn)
    for column, direction in ((roads.ways.forward_mps, "forward"), (roads.ways.backward_mps, "backward")):
        found = dict(zip(roads.ways.id.tolist(), (3.6 * column).tolist(), strict=True))
        for ref, (_, own) in drawn.items():
            expected = signed_kmh(own, (f"maxspeed:{direction}", *BY_CLASS))
            assert found[ref] == pytest.approx(float("nan") if expected is None else expected, nan_ok=True), own


@EXAMPLES
@given(st.lists(barrier_tags(), min_size=1, max_size=12))
def test_barriers_cut_the_way_where_a_car_can_not_or_may_not_pass(tags: list[Tags]) -> None:
    ways = {10 + n: ((3 * n, 3 * n + 1, 3 * n + 2), {"highway": "residential"}) for n in range(len(tags))}
    roads = read(ways, {3 * n + 1: own for n, own in enumerate(tags)})
    parts = Counter(roads.ways.id.tolist())
    reasons = [barrier_cuts(own) for own in tags]
    assert [parts[10 + n] for n in range(len(tags))] == [1 if reason is None else 2 for reason in reasons]
    counted = {key: count for key, count in roads.dropped.items() if key.startswith("way_points")}
    assert counted == Counter(reason for reason in reasons if reason)


@EXAMPLES
@given(st.lists(turn_tags(), min_size=1, max_size=12))
def test_restrictions_are_bans_orders_or_nothing_to_a_car(tags: list[Tags]) -> None:
    ways = {10: ((1, 2), {"highway": "residential"}), 11: ((2, 3), {"highway": "residential"})}
    roads = read(ways, relations=[((10, 2, 11), own) for own in tags])
    expected = [turn(own) for own in tags]
    assert [rule.only for rule in roads.restrictions] == [
        kind == "order" for kind in expected if kind in ("ban", "order")
    ]
    assert roads.dropped.get("restrictions_not_understood", 0) == expected.count("restrictions_not_understood")
