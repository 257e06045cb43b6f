"""Speed limits: what maxspeed tags say, and what holds where nothing is tagged."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.stops import FunctionalClass
from routing.importers.conditional import ConditionalLimit, conditional_limits
from routing.importers.tags import tag_values

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

KMH: Final = 1.0 / 3.6  # m/s
MPH: Final = 0.44704  # m/s, exact (international mile)
KNOT: Final = 1852.0 / 3600.0  # m/s, exact
NO_LIMIT_KMH: Final = 130.0  # `none`: the German advisory speed (Autobahn-Richtgeschwindigkeits-V)
WALK_KMH: Final = 7.0  # `walk`: German courts read walking speed as 4..7 km/h, up to 10; assumed 7
LOWEST_KMH: Final = 3.0  # a lower tagged limit is a typing error (assumed)
URBAN_MOTORWAY_KMH: Final = 80.0  # `CZ:urban_motorway`: the Czech limit, in Spain the same
HIGHEST_KMH: Final = 160.0  # the highest limit on signs: Abu Dhabi
NEAR_HIGHEST_KMH: Final = 200.0  # up to here a tagged limit is taken as HIGHEST_KMH, above as a typing error (assumed)


@dataclass(frozen=True, slots=True)
class CountryLimits:
    """Limits that hold without a sign [km/h].

    urban: inside built-up areas; collector and local: the same for tertiary and for smaller streets, where the law
    distinguishes them; rural: outside; expressway: trunk roads outside; motorway; living: living streets.
    """

    urban: float
    rural: float
    expressway: float
    motorway: float
    living: float = 20.0
    collector: float | None = None
    local: float | None = None


_MPH: Final = MPH / KMH

# After the OpenStreetMap wiki page "Default speed limits", passenger cars, rounded to one row a country; not checked
# against the laws. Where a country leaves living streets at walking pace the value is WALK_KMH.
COUNTRIES: Final[Mapping[str, CountryLimits]] = {
    "AD": CountryLimits(50, 90, 90, 90),
    "AE": CountryLimits(60, 100, 100, 120, local=40),
    "AL": CountryLimits(40, 80, 90, 110),
    "AM": CountryLimits(60, 90, 90, 110),
    "AR": CountryLimits(60, 110, 120, 130, collector=40, local=40),
    "AT": CountryLimits(50, 100, 100, 130, WALK_KMH),
    "AU": CountryLimits(50, 100, 100, 110, 10),
    "AZ": CountryLimits(60, 90, 90, 110),
    "BA": CountryLimits(50, 80, 100, 130, WALK_KMH),
    "BE": CountryLimits(50, 90, 120, 120),
    "BG": CountryLimits(50, 90, 120, 140),
    "BR": CountryLimits(60, 100, 110, 110, collector=40, local=30),
    "BY": CountryLimits(60, 90, 90, 110),
    "CA": CountryLimits(50, 80, 90, 100),
    "CH": CountryLimits(50, 80, 100, 120),
    "CL": CountryLimits(50, 100, 120, 120),
    "CN": CountryLimits(50, 70, 70, 120),
    "CO": CountryLimits(50, 90, 90, 120, local=30),
    "CZ": CountryLimits(50, 90, 110, 130),
    "DE": CountryLimits(50, 100, 100, NO_LIMIT_KMH, WALK_KMH),
    "DK": CountryLimits(50, 80, 80, 130, 15),
    "EE": CountryLimits(50, 90, 90, 90),
    "ES": CountryLimits(50, 90, 90, 120, collector=30, local=30),
    "FI": CountryLimits(50, 80, 100, 120),
    "FR": CountryLimits(50, 80, 110, 130),
    "GB": CountryLimits(30 * _MPH, 60 * _MPH, 70 * _MPH, 70 * _MPH, 20 * _MPH),
    "GE": CountryLimits(60, 90, 90, 110),
    "GR": CountryLimits(50, 90, 110, 130),
    "HR": CountryLimits(50, 90, 110, 130, 10),
    "HU": CountryLimits(50, 90, 110, 130),
    "IE": CountryLimits(50, 80, 100, 120),
    "IL": CountryLimits(50, 80, 90, 110, 30),
    "IM": CountryLimits(30 * _MPH, 60 * _MPH, 60 * _MPH, 60 * _MPH, 20 * _MPH),
    "IN": CountryLimits(70, 70, 100, 120),
    "IS": CountryLimits(50, 90, 90, 90, 10),
    "IT": CountryLimits(50, 90, 110, 130),
    "JP": CountryLimits(60, 60, 60, 100),
    "KR": CountryLimits(50, 60, 80, 100),
    "KZ": CountryLimits(60, 110, 110, 140),
    "LI": CountryLimits(50, 80, 80, 80),
    "LT": CountryLimits(50, 90, 120, 130),
    "LU": CountryLimits(50, 90, 90, 130),
    "LV": CountryLimits(50, 90, 110, 110),
    "MD": CountryLimits(50, 90, 110, 110),
    "MK": CountryLimits(50, 90, 110, 130),
    "MT": CountryLimits(50, 80, 80, 80),
    "MX": CountryLimits(50, 80, 80, 115, local=30),
    "NL": CountryLimits(50, 80, 100, 100, 15),
    "NO": CountryLimits(50, 80, 80, 110, WALK_KMH),
    "NZ": CountryLimits(50, 100, 100, 100, 10),
    "PE": CountryLimits(40, 60, 100, 100),
    "PL": CountryLimits(50, 90, 100, 140),
    "PT": CountryLimits(50, 90, 100, 120),
    "RO": CountryLimits(50, 90, 100, 130),
    "RS": CountryLimits(50, 80, 100, 120, 10),
    "RU": CountryLimits(60, 90, 90, 110),
    "SE": CountryLimits(50, 70, 70, 110, WALK_KMH),
    "SI": CountryLimits(50, 90, 110, 130, 10),
    "SK": CountryLimits(50, 90, 90, 130),
    "TH": CountryLimits(80, 90, 100, 120),
    "TN": CountryLimits(50, 90, 90, 110),
    "TR": CountryLimits(50, 90, 110, 120),
    "UA": CountryLimits(50, 90, 110, 130),
    "US": CountryLimits(25 * _MPH, 55 * _MPH, 55 * _MPH, 65 * _MPH, 15 * _MPH),
    "UY": CountryLimits(45, 90, 90, 90),
    "XK": CountryLimits(50, 80, 110, 130),
    "ZA": CountryLimits(60, 100, 100, 120),
}
GENERAL: Final = CountryLimits(50, 90, 100, 120)  # the commonest value of each column above


def _state(urban: float, rural: float, motorway: float = 65.0) -> CountryLimits:
    """Limits of a state of the USA from miles an hour."""
    return CountryLimits(urban * _MPH, rural * _MPH, rural * _MPH, motorway * _MPH, 15 * _MPH)


# Regions whose rules differ from their country's, by ISO 3166-2; source and caution as above (revision of 2023). The
# 20 mph of Wales are the Restricted Roads (20 mph Speed Limit) (Wales) Order 2022.
REGIONS: Final[Mapping[str, CountryLimits]] = {
    "AU-NT": replace(COUNTRIES["AU"], rural=110, expressway=110),
    "AU-WA": replace(COUNTRIES["AU"], rural=110, expressway=110),
    "BE-BRU": replace(COUNTRIES["BE"], urban=30, rural=70),
    "BE-VLG": replace(COUNTRIES["BE"], rural=70),
    "BE-WAL": COUNTRIES["BE"],
    "CA-MB": replace(COUNTRIES["CA"], rural=90),
    "CA-NT": replace(COUNTRIES["CA"], rural=90),
    "CA-NU": replace(COUNTRIES["CA"], rural=90),
    "CA-QC": replace(COUNTRIES["CA"], rural=90),
    "GB-WLS": replace(COUNTRIES["GB"], urban=20 * _MPH),
    "US-AL": _state(30, 45, 70),
    "US-AR": _state(30, 65),
    "US-AZ": _state(25, 65),
    "US-CA": _state(25, 55),
    "US-CO": _state(30, 55),
    "US-DC": _state(20, 20),
    "US-DE": _state(25, 50),
    "US-FL": _state(30, 55, 70),
    "US-GA": _state(30, 55),
    "US-IA": _state(25, 55, 70),
    "US-ID": _state(35, 55, 75),
    "US-IL": _state(30, 55, 70),
    "US-IN": _state(30, 55, 70),
    "US-KS": _state(30, 55, 75),
    "US-KY": _state(35, 55),
    "US-LA": _state(25, 55, 70),
    "US-MA": _state(30, 40),
    "US-MD": _state(30, 50),
    "US-ME": _state(25, 45),
    "US-MI": _state(25, 55, 70),
    "US-MN": _state(30, 55),
    "US-MO": _state(25, 60, 70),
    "US-MS": _state(25, 65),
    "US-MT": _state(25, 70, 80),
    "US-NC": _state(35, 55),
    "US-ND": _state(25, 55, 75),
    "US-NE": _state(25, 55, 70),
    "US-NH": _state(30, 55),
    "US-NJ": _state(25, 50),
    "US-NM": _state(30, 55),
    "US-OH": _state(25, 55, 70),
    "US-PA": _state(35, 55),
    "US-RI": _state(25, 50),
    "US-SC": _state(30, 55),
    "US-SD": _state(25, 65, 80),
    "US-TN": _state(25, 65, 70),
    "US-TX": _state(30, 60),
    "US-VA": _state(35, 55, 55),
    "US-VT": _state(25, 50),
    "US-WA": _state(25, 50),
    "US-WI": _state(25, 55, 70),
    "US-WY": _state(30, 65, 75),
}
_ALIASES: Final[Mapping[str, str]] = {"UK": "GB", "EL": "GR"}  # what tags say beside ISO 3166-1
_MPH_COUNTRIES: Final = frozenset(("GB", "US", "IM", "JE", "GG", "PR", "VI", "GU", "AS", "MP", "BS", "LR"))

# What a road carries in practice where the law allows more: assumed, no sign and no source. [km/h]
RURAL_CAPS_KMH: Final = {
    FunctionalClass.TERTIARY: 80.0,
    FunctionalClass.UNCLASSIFIED: 60.0,
    FunctionalClass.RESIDENTIAL: 50.0,
}
SERVICE_KMH: Final = 20.0
RAMP_KMH: Final = {FunctionalClass.TRUNK: 60.0}  # of motorways and trunk roads
RAMP_OTHER_KMH: Final = 50.0

_NUMBER = re.compile(
    r"^\+?(\d+(?:[.,]\d*)?)\s*(km ?[/\\]? ?h(?:r|our)?|kmph|kph|km|км/ч|км|mph|mp/h|mi/h|miles?|knots?|kn|kts?|)\.?$",
    re.IGNORECASE,
)
# between digits a comma is a decimal comma
_APART = re.compile(r"[;|]|,(?!\d)|(?<!\d),|(?<=\d)\s*/\s*(?=\d)")
_IMPLICIT = re.compile(
    r"^([a-z]{2})(?:[-:]([a-z0-9]{1,3}))?\s*:\s*(?:zone[: ]?)?([a-z_]+|\d+)(?:\s*(?:mph|km/h))?$", re.IGNORECASE
)
_ZONE = re.compile(r"^(?:zone[ :_]?(\d+)|(\d+)[ :_]zone)$")
_PLACE = re.compile(r"^([a-z]{2})(?:[-:]([a-z0-9]{1,3}))?$", re.IGNORECASE)
_UNIT_MPS: Final = {
    **dict.fromkeys(("mph", "mp/h", "mi/h", "mile", "miles"), MPH),
    **dict.fromkeys(("knot", "knots", "kn", "kt", "kts"), KNOT),
}
_WALKING: Final = frozenset(("walk", "walking_pace", "walking pace", "walking_speed", "walking speed"))
_RULE_KEYS: Final = ("zone:maxspeed", "maxspeed:type", "source:maxspeed", "zone:traffic")
_RULES_ONLY: Final = frozenset(f"{key}{end}" for key in _RULE_KEYS[1:] for end in ("", ":forward", ":backward"))
_CLASSES: Final = ("motorcar", "motor_vehicle", "vehicle")  # the narrowest wins
_DIRECTIONS: Final = ("", ":forward", ":backward")
_PREFIXES: Final = (*(f"maxspeed:{name}" for name in _CLASSES), "maxspeed")
# for each direction: its own signs, general signs, rules
_LIMIT_KEYS: Final = tuple(
    (
        *(f"{prefix}{end}" for prefix in _PREFIXES),
        *_PREFIXES,
        *(key for rule in _RULE_KEYS for key in (f"{rule}{end}", rule)),
    )
    for end in _DIRECTIONS[1:]
)
_UNLIMITED_HIGHWAYS: Final = frozenset(("motorway", "trunk"))


def country_code(text: str) -> str | None:
    """The country of an address or a rule: `GB` for `UK`, `BE-VLG` where the region's rules are known, else None."""
    match = _PLACE.match(text.strip())
    return _code(match[1], match[2]) if match else None


def _code(country: str, region: str | None) -> str:
    code = _ALIASES.get(country.upper(), country.upper())
    own = f"{code}-{region.upper()}" if region else code
    return own if own in REGIONS else code


def most_named(counts: Mapping[str, int]) -> str:
    """The country that most codes name, its regions counted with it; of it the region that most of them name."""
    by_country: dict[str, int] = {}
    for code, count in counts.items():
        by_country[code[:2]] = by_country.get(code[:2], 0) + count
    country = max(by_country, key=lambda code: by_country[code])
    inside = {code: count for code, count in counts.items() if code[:2] == country}
    first = max(inside, key=lambda code: inside[code])
    return first if 2 * inside[first] > by_country[country] else country


def country_limits(code: str | None) -> CountryLimits:
    """The row of a country or region, the country's for an unknown region, the general one for an unknown country."""
    if code is None:
        return GENERAL
    return REGIONS.get(code) or COUNTRIES.get(_code(code[:2], None), GENERAL)


def may_be_unlimited(tags: Mapping[str, str]) -> bool:
    """Whether a road can be without a limit: motorways, trunk roads and motor roads, not their ramps."""
    highways = tag_values(tags, "highway")
    own = any(tag_values(tags, key) == ["yes"] for key in ("motorroad", "expressway"))
    return bool(_UNLIMITED_HIGHWAYS & set(highways)) or (own and not any(h.endswith("_link") for h in highways))


@dataclass(frozen=True, slots=True)
class TaggedLimits:
    """What the tags of a road say; None where they say nothing.

    forward_mps, backward_mps: limit for either direction of the way [m/s]; urban: inside a built-up area;
    country: the code in a tag such as `DE:urban`; implausible: values that were passed over.
    conditional: limits under a condition for both directions, forward, backward; unread: conditions not understood.
    """

    forward_mps: float | None
    backward_mps: float | None
    urban: bool | None
    country: str | None
    implausible: int
    conditional: tuple[tuple[ConditionalLimit, ...], tuple[ConditionalLimit, ...]] = ((), ())
    unread: int = 0


def limits_from_tags(tags: Mapping[str, str]) -> TaggedLimits:
    """Speed limits of a way from its tags; the direction's own tag wins over the general one, a sign over a rule."""
    unlimited = may_be_unlimited(tags)
    passed_over: set[str] = set()
    limits: list[float | None] = []
    for keys in _LIMIT_KEYS:
        limit: float | None = None
        for key in keys:
            if key in tags:
                if key in _RULES_ONLY and not _has_rule(tags[key]):
                    continue
                limit = limit_mps_from_value(tags[key], unlimited=unlimited)
                if limit is not None:
                    break
                if _is_number(tags[key]) or tags[key].strip().lower() == "none":
                    passed_over.add(key)
        limits.append(limit)
    urban: bool | None = None
    country: str | None = None
    for key in ("zone:traffic", "maxspeed:type", "source:maxspeed", "zone:maxspeed", "maxspeed"):
        for match in _rules(tags[key]) if key in tags else ():
            country = country or _code(match[1], match[2])
            if urban is None:
                named = {"urban": True, "rural": False, "motorway": False, "trunk": False}
                urban = named.get(match[3].lower())
    both, unread = _conditional(tags, unlimited)
    return TaggedLimits(limits[0], limits[1], urban, country, len(passed_over), both, unread)


def _rules(value: str) -> list[re.Match[str]]:
    """Rules of countries among the parts of a value such as `RO:urban; survey`."""
    return [match for part in value.split(";") if (match := _IMPLICIT.match(part.strip()))]


def _has_rule(value: str) -> bool:
    """Whether a value that says where a limit comes from names a rule: numbers in it may be dates."""
    return bool(_rules(value)) or any(_ZONE.match(part.strip().lower()) for part in value.split(";"))


def _conditional(
    tags: Mapping[str, str], unlimited: bool
) -> tuple[tuple[tuple[ConditionalLimit, ...], tuple[ConditionalLimit, ...]], int]:
    """Conditional limits forward and backward, the direction's own key before the general one, and those not read."""
    read: dict[str, tuple[ConditionalLimit, ...]] = {}
    unread = 0
    if not any(key.endswith(":conditional") for key in tags):
        return ((), ()), 0
    for key in (f"{prefix}{end}" for prefix in _PREFIXES for end in _DIRECTIONS):
        if f"{key}:conditional" in tags:
            value = tags[f"{key}:conditional"]
            limits, count = conditional_limits(value, partial(limit_mps_from_value, unlimited=unlimited))
            read[key] = tuple(limits)
            unread += count

    def along(direction: str) -> tuple[ConditionalLimit, ...]:
        keys = (f"{prefix}{end}" for end in (direction, "") for prefix in _PREFIXES)
        return next((read[key] for key in keys if key in read), ())

    return (along(":forward"), along(":backward")), unread


def limit_mps_from_value(value: str, *, unlimited: bool = True) -> float | None:
    """Limit [m/s] of a maxspeed value, None where it names none; the lowest of several (`50; 30`).

    unlimited: whether the road can be without a limit, so that `none` is to be believed.
    """
    parts = [part.strip() for part in _APART.split(value)]
    parts = [p for part in parts for p in (part.split(",") if part.count(",") > 1 else [part])]
    found = [limit for part in parts if (limit := _limit_of_part_mps(part, unlimited)) is not None]
    return min(found) if found else None


def _limit_of_part_mps(value: str, unlimited: bool) -> float | None:
    value = value.lower().strip(" \t\"'")
    if value in ("none", "unlimited"):
        return NO_LIMIT_KMH * KMH if unlimited else None
    if value in _WALKING:
        return WALK_KMH * KMH
    number = _NUMBER.match(value)
    if number:
        limit = float(number[1].replace(",", ".")) * _UNIT_MPS.get(number[2], KMH)
        return min(limit, HIGHEST_KMH * KMH) if LOWEST_KMH * KMH <= limit <= NEAR_HIGHEST_KMH * KMH else None
    zone = _ZONE.match(value)
    if zone:
        return _limit_of_part_mps(zone[1] or zone[2], unlimited)
    implicit = _IMPLICIT.match(value)
    return _rule_mps(_code(implicit[1], implicit[2]), implicit[3]) if implicit else None


def _rule_mps(code: str, rule: str) -> float | None:
    """Limit of a named rule of a country or region such as `DE` and `urban` [m/s], None for an unknown rule."""
    limits = country_limits(code)
    digits = re.fullmatch(r"(?:zone)?(\d+)", rule)
    if digits:
        return _limit_of_part_mps(digits[1] + (" mph" if code[:2] in _MPH_COUNTRIES else ""), unlimited=False)
    by_rule = {
        "urban": limits.urban,
        "rural": limits.rural,
        "nsl_single": limits.rural,
        "nsl_dual": limits.expressway,
        "nsl_restricted": limits.urban,
        "trunk": limits.expressway,
        "expressway": limits.expressway,
        "motorroad": limits.expressway,
        "extra_urban": limits.rural,
        "urban_motorway": min(limits.motorway, URBAN_MOTORWAY_KMH),
        "urban_trunk": min(limits.expressway, URBAN_MOTORWAY_KMH),
        "urban_motorroad": min(limits.expressway, URBAN_MOTORWAY_KMH),
        "motorway": limits.motorway,
        "living_street": limits.living,
        "pedestrian_zone": WALK_KMH,
        "bicycle_road": 30.0,
        "cyclestreet": 30.0,
        "walk": WALK_KMH,
    }
    return by_rule[rule] * KMH if rule in by_rule else None


def _is_number(value: str) -> bool:
    return bool(re.match(r"^-?\d", value.strip()))


def default_limits_mps(
    country: str | None,
    functional_class: NDArray[np.int8],
    ramp: NDArray[np.bool_],
    living_street: NDArray[np.bool_],
    urban: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Limit of roads without a sign, float64 (M,) > 0 [m/s], from the country's row or the general one."""
    limits = country_limits(country)
    collector = limits.collector or limits.urban
    local = limits.local or collector
    table = np.empty((len(FunctionalClass), 2))  # columns: rural, urban
    table[:, 0] = limits.rural
    table[:, 1] = limits.urban
    table[FunctionalClass.MOTORWAY] = limits.motorway
    table[FunctionalClass.TRUNK, 0] = limits.expressway
    for road_class, cap in RURAL_CAPS_KMH.items():
        table[road_class, 0] = min(limits.rural, cap)
    table[FunctionalClass.TERTIARY, 1] = collector
    table[FunctionalClass.UNCLASSIFIED, 1] = table[FunctionalClass.RESIDENTIAL, 1] = local
    table[FunctionalClass.SERVICE] = SERVICE_KMH
    ramps = np.full(len(FunctionalClass), RAMP_OTHER_KMH)
    for road_class, limit in RAMP_KMH.items():
        ramps[road_class] = limit
    kmh = table[functional_class, urban.astype(np.int8)]
    kmh = np.where(ramp, np.minimum(kmh, ramps[functional_class]), kmh)
    return np.where(living_street, limits.living, kmh) * KMH
