"""Speed limits: what maxspeed tags say, and what holds where nothing is tagged."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.stops import FunctionalClass

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

KMH: Final = 1.0 / 3.6  # m/s
MPH: Final = 0.44704  # m/s, exact (international mile)
KNOT: Final = 1852.0 / 3600.0  # m/s, exact
NO_LIMIT_KMH: Final = 130.0  # `none`: the German advisory speed (Autobahn-Richtgeschwindigkeits-V)
WALK_KMH: Final = 7.0  # `walk`: German courts read walking speed as 4..7 km/h, up to 10; assumed 7
LOWEST_KMH: Final = 3.0  # a tagged limit outside these two is a typing error (assumed bounds)
HIGHEST_KMH: Final = 150.0


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
    "AR": CountryLimits(60, 110, 120, 130, collector=40, local=40),
    "AT": CountryLimits(50, 100, 100, 130, WALK_KMH),
    "AU": CountryLimits(50, 100, 100, 110, 10),
    "BE": CountryLimits(50, 90, 120, 120),
    "BG": CountryLimits(50, 90, 120, 140),
    "BR": CountryLimits(60, 100, 110, 110, collector=40, local=30),
    "CA": CountryLimits(50, 80, 90, 100),
    "CH": CountryLimits(50, 80, 100, 120),
    "CL": CountryLimits(50, 100, 120, 120),
    "CZ": CountryLimits(50, 90, 110, 130),
    "DE": CountryLimits(50, 100, 100, NO_LIMIT_KMH, WALK_KMH),
    "DK": CountryLimits(50, 80, 80, 130, 15),
    "ES": CountryLimits(50, 90, 90, 120, collector=30, local=30),
    "FI": CountryLimits(50, 80, 100, 120),
    "FR": CountryLimits(50, 80, 110, 130),
    "GB": CountryLimits(30 * _MPH, 60 * _MPH, 70 * _MPH, 70 * _MPH, 20 * _MPH),
    "GR": CountryLimits(50, 90, 110, 130),
    "HR": CountryLimits(50, 90, 110, 130, 10),
    "HU": CountryLimits(50, 90, 110, 130),
    "IE": CountryLimits(50, 80, 100, 120),
    "IT": CountryLimits(50, 90, 110, 130),
    "LU": CountryLimits(50, 90, 90, 130),
    "NL": CountryLimits(50, 80, 100, 100, 15),
    "NO": CountryLimits(50, 80, 80, 110, WALK_KMH),
    "NZ": CountryLimits(50, 100, 100, 100, 10),
    "PL": CountryLimits(50, 90, 100, 140),
    "PT": CountryLimits(50, 90, 100, 120),
    "RO": CountryLimits(50, 90, 100, 130),
    "RU": CountryLimits(60, 90, 90, 110),
    "SE": CountryLimits(50, 70, 70, 110, WALK_KMH),
    "SI": CountryLimits(50, 90, 110, 130, 10),
    "SK": CountryLimits(50, 90, 90, 130),
    "TR": CountryLimits(50, 90, 110, 120),
    "UA": CountryLimits(50, 90, 110, 130),
    "US": CountryLimits(25 * _MPH, 55 * _MPH, 55 * _MPH, 65 * _MPH, 15 * _MPH),
}
GENERAL: Final = CountryLimits(50, 90, 100, 120)  # the commonest value of each column above

# What a road carries in practice where the law allows more: assumed, no sign and no source. [km/h]
RURAL_CAPS_KMH: Final = {
    FunctionalClass.TERTIARY: 80.0,
    FunctionalClass.UNCLASSIFIED: 60.0,
    FunctionalClass.RESIDENTIAL: 50.0,
}
SERVICE_KMH: Final = 20.0
RAMP_KMH: Final = {FunctionalClass.TRUNK: 60.0}  # of motorways and trunk roads
RAMP_OTHER_KMH: Final = 50.0

_NUMBER = re.compile(r"^(\d+(?:\.\d+)?)\s*(km/?h|kph|mph|knots?|)$", re.IGNORECASE)
_IMPLICIT = re.compile(r"^([A-Z]{2})(?:-[A-Z0-9]{2,3})?:(?:zone:?)?([a-z_]+|\d+)$")
_UNIT_MPS: Final = {"mph": MPH, "knot": KNOT, "knots": KNOT}
_RULE_KEYS: Final = ("zone:maxspeed", "maxspeed:type", "source:maxspeed", "zone:traffic")


@dataclass(frozen=True, slots=True)
class TaggedLimits:
    """What the tags of a road say; None where they say nothing.

    forward_mps, backward_mps: limit for either direction of the way [m/s]; urban: inside a built-up area;
    country: the code in a tag such as `DE:urban`; implausible: values that were passed over.
    """

    forward_mps: float | None
    backward_mps: float | None
    urban: bool | None
    country: str | None
    implausible: int


def limits_from_tags(tags: Mapping[str, str]) -> TaggedLimits:
    """Speed limits of a way from its tags; the direction's own tag wins over the general one, a sign over a rule."""
    implausible = 0
    limits: list[float | None] = []
    for direction in ("forward", "backward"):
        limit: float | None = None
        own = (f"maxspeed:motorcar:{direction}", f"maxspeed:{direction}")
        for key in (*own, "maxspeed:motorcar", "maxspeed", *_RULE_KEYS):
            if key in tags:
                limit = limit_mps_from_value(tags[key])
                if limit is not None:
                    break
                implausible += direction == "forward" and _is_number(tags[key])
        limits.append(limit)
    urban: bool | None = None
    country: str | None = None
    for key in ("zone:traffic", "maxspeed:type", "source:maxspeed", "zone:maxspeed", "maxspeed"):
        match = _IMPLICIT.match(tags.get(key, ""))
        if match:
            country = country or match[1]
            if urban is None:
                urban = {"urban": True, "rural": False, "motorway": False, "trunk": False}.get(match[2])
    return TaggedLimits(limits[0], limits[1], urban, country, implausible)


def limit_mps_from_value(value: str) -> float | None:
    """Limit [m/s] of one maxspeed value, None where it names none; the lowest of several (`50; 30`)."""
    found = [limit for part in re.split(r"[;|,]", value) if (limit := _one_limit_mps(part.strip())) is not None]
    return min(found) if found else None


def _one_limit_mps(value: str) -> float | None:
    if value == "none":
        return NO_LIMIT_KMH * KMH
    if value == "walk":
        return WALK_KMH * KMH
    number = _NUMBER.match(value)
    if number:
        limit = float(number[1]) * _UNIT_MPS.get(number[2].lower(), KMH)
        return limit if LOWEST_KMH * KMH <= limit <= HIGHEST_KMH * KMH else None
    implicit = _IMPLICIT.match(value)
    return _rule_mps(implicit[1], implicit[2]) if implicit else None


def _rule_mps(country: str, rule: str) -> float | None:
    """Limit of a named rule such as `DE:urban` or `GB:nsl_dual` [m/s], None for an unknown rule."""
    limits = COUNTRIES.get("GB" if country == "UK" else country, GENERAL)
    digits = re.fullmatch(r"(?:zone)?(\d+)", rule)
    if digits:
        return _one_limit_mps(digits[1] + (" mph" if country in ("GB", "UK", "US") else ""))
    by_rule = {
        "urban": limits.urban,
        "rural": limits.rural,
        "nsl_single": limits.rural,
        "nsl_dual": limits.expressway,
        "nsl_restricted": limits.urban,
        "trunk": limits.expressway,
        "motorway": limits.motorway,
        "living_street": limits.living,
        "pedestrian_zone": WALK_KMH,
        "bicycle_road": 30.0,
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
    limits = COUNTRIES.get(country or "", GENERAL)
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
