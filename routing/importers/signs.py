"""What drivers read along a way, after its tags, and on which side they drive."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from routing.graph.signs import RoadSign

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from routing.importers.roads import Ways

    Direction = Literal["forward", "backward"]

DIRECTIONS: Final[tuple[Direction, Direction]] = ("forward", "backward")
MOST_LANES: Final = 20  # more are a typing error (assumed)
# Countries and territories that drive on the left, ISO 3166-1 alpha-2 (public lists of right- and left-hand traffic).
_LEFT: Final = (
    "AG AI AU BB BD BM BN BS BT BW CC CK CX CY DM FJ FK GB GD GG GY HK ID IE IM IN JE JM JP KE KI KN KY LC LK LS MO MS "
    "MT MU MV MW MY MZ NA NF NP NR NU NZ PG PK PN SB SC SG SH SR SZ TC TH TK TL TO TT TV TZ UG VC VG VI WS ZA ZM ZW"
)
DRIVES_LEFT: Final = frozenset(_LEFT.split())
FEWEST_RINGS: Final = 3  # whose sense says more than the country that was found (assumed)
_LANGUAGE: Final = re.compile(r"name:([a-z]{2,3}(?:[-_][A-Za-z]{2,4})?)")
_NO_LANGUAGES: Final = frozenset(("old", "alt"))


_PLAIN_KEYS: Final = ("ref", "destination", "destination:ref", "junction:ref", "lanes", "turn:lanes")
_KEYS: Final = frozenset(
    ("highway", "junction", "int_name", *_PLAIN_KEYS, *(f"{key}:{way}" for key in _PLAIN_KEYS for way in DIRECTIONS))
)


def read_tags(tags: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """The tags that sign_of reads: most ways have few of them, and so the signs of others."""
    read = [(key, value) for key, value in tags.items() if key in _KEYS or key.startswith("name:")]
    if "name" in tags and any(key.startswith("name:") for key, _ in read):
        read.append(("name", tags["name"]))
    return tuple(read)


def sign_of(tags: Mapping[str, str], direction: Direction, *, oneway: bool) -> RoadSign:
    """What is read on a way in one direction; a tag with the direction wins over that without.

    oneway: it is driven in this direction only, so that plain tags of lanes are of this direction. Of a road with two
    directions they are of both, and only half of its lanes counts.
    """

    def along(key: str) -> str:
        return (tags.get(f"{key}:{direction}") or tags.get(key) or "").strip()

    turn_lanes = tags.get(f"turn:lanes:{direction}") or (tags.get("turn:lanes") if oneway else None) or ""
    junction = (tags.get("junction") or "").strip().lower()
    return RoadSign(
        highway=(tags.get("highway") or "").split(";")[0].strip().lower(),
        ref=along("ref"),
        destination=along("destination"),
        destination_ref=along("destination:ref"),
        junction=junction if junction in ("roundabout", "circular") else "",
        exit_ref=along("junction:ref"),
        lanes=_lanes(tags, direction, oneway=oneway),
        turn_lanes=turn_lanes.strip(),
        names=_names(tags),
    )


def _lanes(tags: Mapping[str, str], direction: str, *, oneway: bool) -> int:
    for key, share in ((f"lanes:{direction}", 1), ("lanes", 1 if oneway else 2)):
        digits = tags.get(key, "").strip()
        if digits.isascii() and digits.isdigit() and len(digits) <= 2 and 0 < int(digits) <= MOST_LANES:
            return max(int(digits) // share, 1)
    return 0


def _names(tags: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    found = []
    for key, name in tags.items():
        if key == "int_name":
            found.append(("int", name))
        elif (match := _LANGUAGE.fullmatch(key)) and match[1] not in _NO_LANGUAGES and name != tags.get("name"):
            found.append((match[1], name))
    return tuple(sorted(found))


def exit_ref_of(tags: Mapping[str, str]) -> str:
    """The number of the exit at a node, or empty."""
    return tags.get("ref", "").strip() if tags.get("highway") == "motorway_junction" else ""


def is_mini_roundabout(tags: Mapping[str, str]) -> bool:
    """Whether a node is a roundabout without an island."""
    return "mini_roundabout" in (value.strip() for value in tags.get("highway", "").lower().split(";"))


def drives_left(
    tagged: Mapping[str, int],
    country: str | None,
    ways: Ways,
    lon_e7: NDArray[np.int32],
    lat_e7: NDArray[np.int32],
) -> bool:
    """Whether traffic keeps to the left.

    As boundaries of countries are tagged (`driving_side`; on a way it marks an exception and is not read); without it,
    as rings of roundabouts turn, if there are a few that agree; else as in the country that was found; else as any ring
    turns. Without all of them, to the right.
    tagged: how often each value was read. country: its code, also with a region, or None.
    """
    if tagged.get("left", 0) != tagged.get("right", 0):
        return tagged.get("left", 0) > tagged.get("right", 0)
    clockwise, counter = _rings(ways, lon_e7, lat_e7)
    if max(clockwise, counter) >= FEWEST_RINGS and max(clockwise, counter) >= 2 * min(clockwise, counter):
        return clockwise > counter
    return country.split("-")[0] in DRIVES_LEFT if country else clockwise > counter


def _rings(ways: Ways, lon_e7: NDArray[np.int32], lat_e7: NDArray[np.int32]) -> tuple[int, int]:
    """Ways of rings that turn to the right, as they do where traffic keeps to the left, and those that turn left."""
    clockwise = counter = 0
    for way in np.flatnonzero(ways.roundabout & (ways.forward != ways.backward)).tolist():
        point = ways.point[ways.way_first[way] : ways.way_first[way + 1]]
        lon, lat = lon_e7[point] / 1e7, lat_e7[point] / 1e7
        east, north = np.diff(lon) * np.cos(np.radians(lat[0])), np.diff(lat)
        turned = float((east[:-1] * north[1:] - north[:-1] * east[1:]).sum())
        if turned != 0.0:
            is_clockwise = (turned < 0.0) == bool(ways.forward[way])
            clockwise, counter = clockwise + is_clockwise, counter + (not is_clockwise)
    return clockwise, counter
