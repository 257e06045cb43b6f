"""What OSRM is asked: coordinates and options, out of an address, a JSON body or a form."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from app.http.faces.answering import number_from, read, whole_from
from app.http.faces.electric import (
    OWN_PARAMETERS,
    PROFILE_FORM,
    Electric,
    ElectricParameters,
    electric_from,
    profile_fields,
)
from app.http.faces.osrm.errors import OsrmCode, OsrmError
from app.http.faces.polylines import decoded

if TYPE_CHECKING:
    from collections.abc import Mapping

PLAIN: Final = frozenset({"driving", "car"})
GENERAL: Final = frozenset(
    {
        *("bearings", "radiuses", "generate_hints", "hints", "approaches", "exclude", "snapping", "skip_waypoints"),
        "format",
    }
)
FORMATS: Final = ("json", "flatbuffers")
LONGEST: Final = 200  # of a text that a message repeats
A_PLACE: Final = {"bearings": "value,range", "radiuses": "a number from 0, or unlimited", "approaches": "unrestricted"}


@dataclass(frozen=True, slots=True)
class OsrmRequest:
    """One request: places as longitude, latitude [deg], and options by name as an address has them."""

    profile: str
    places: tuple[tuple[float, float], ...]
    options: Mapping[str, str]
    own: Any = field(default=None)

    def electric(self, usual_soc: float) -> Electric:
        """What profile and options say of vehicle, charge and weather."""
        said = profile_fields(self.profile, PLAIN)
        if said is None:
            allowed = f"driving, car, {PROFILE_FORM}"
            raise OsrmError(OsrmCode.INVALID_VALUE, "profile", self.profile[:LONGEST], allowed)
        sent = self.own
        if sent is None:
            given = {name: value for name, value in self.options.items() if name in OWN_PARAMETERS}
            sent = read(ElectricParameters, given).long_form() if given else None
        return electric_from(said, sent, usual_soc)

    def check_options(self, further: frozenset[str]) -> None:
        """Refuse options that there are not, or that can't be heeded; further: those of the service."""
        for name, value in self.options.items():
            if name not in GENERAL | OWN_PARAMETERS | further:
                known = ", ".join(sorted(GENERAL | further))
                raise OsrmError(OsrmCode.INVALID_QUERY, name[:LONGEST], value[:LONGEST], f"one of {known}")
        if self.options.get("format", "json") != "json":
            raise OsrmError(OsrmCode.NOT_IMPLEMENTED, "format", self.options["format"][:LONGEST], "json")
        self.choice("snapping", ("default", "any"), "default")
        self.flag("generate_hints", default=True)
        if self.options.get("exclude"):
            raise OsrmError(OsrmCode.INVALID_VALUE, "exclude", self.options["exclude"][:LONGEST], "left out")
        self._by_place("hints")
        for value in self._by_place("bearings"):
            if value:
                raise OsrmError(OsrmCode.NOT_IMPLEMENTED, "bearings", value[:LONGEST], "left out")
        for value in self._by_place("approaches"):
            if value not in ("", "unrestricted"):
                raise OsrmError(OsrmCode.NOT_IMPLEMENTED, "approaches", value[:LONGEST], "unrestricted")

    def radiuses(self) -> list[float]:
        """How far each place may be moved to a road [m]."""
        limits = []
        for value in self._by_place("radiuses"):
            limit = math.inf if value in ("", "unlimited") else number_from(value)
            if limit is None or limit < 0.0:
                raise OsrmError(OsrmCode.INVALID_QUERY, "radiuses", value[:LONGEST], A_PLACE["radiuses"])
            limits.append(limit)
        return limits

    def check_moved(self, moved_m: list[float]) -> None:
        """Refuse places that are farther from a road than radiuses allow; moved_m: how far each is [m]."""
        for k, (limit_m, distance_m) in enumerate(zip(self.radiuses(), moved_m, strict=False)):
            if distance_m > limit_m:
                allowed = f"at most {limit_m:g} m from a road"
                raise OsrmError(OsrmCode.NO_SEGMENT, f"coordinate {k}", f"{distance_m:.1f} m from a road", allowed)

    def flag(self, name: str, *, default: bool = False) -> bool:
        """An option that is true or false."""
        return self.choice(name, ("true", "false"), str(default).lower()) == "true"

    def choice(self, name: str, allowed: tuple[str, ...], default: str) -> str:
        """An option that is one of some words."""
        value = self.options.get(name, default)
        if value not in allowed:
            raise OsrmError(OsrmCode.INVALID_QUERY, name, value[:LONGEST], f"one of {', '.join(allowed)}")
        return value

    def number(self, name: str) -> float | None:
        """An option that is a number above 0, None where it is left out."""
        text = self.options.get(name)
        if text is None:
            return None
        value = number_from(text)
        if value is None or value <= 0.0:
            raise OsrmError(OsrmCode.INVALID_QUERY, name, text[:LONGEST], "a number above 0")
        return value

    def indices(self, name: str) -> list[int]:
        """An option that names places by their positions, all of them where it is left out."""
        text = self.options.get(name, "all")
        if text == "all":
            return list(range(len(self.places)))
        chosen = []
        for part in text.split(";", len(self.places) + 1):
            index = whole_from(part)
            if index is None or index >= len(self.places):
                allowed = f"all, or positions from 0 to {len(self.places) - 1}, separated by ;"
                raise OsrmError(OsrmCode.INVALID_OPTIONS, name, part[:LONGEST], allowed)
            chosen.append(index)
        if len(chosen) > len(self.places):
            raise OsrmError(OsrmCode.INVALID_OPTIONS, name, f"{len(chosen)} positions", "each place once at most")
        return chosen

    def _by_place(self, name: str) -> list[str]:
        """An option that has a value for each place, [] where it is left out."""
        text = self.options.get(name, "")
        if not text:
            return []
        parts = text.split(";", len(self.places) + 1)
        if len(parts) != len(self.places):
            allowed = f"{len(self.places)} values separated by ;, as many as coordinates"
            raise OsrmError(OsrmCode.INVALID_OPTIONS, name, f"{len(parts)} values", allowed)
        return parts


def places_from(text: str, most: int) -> tuple[tuple[float, float], ...]:
    """The places of an address; most: of them."""
    for name, decimals in (("polyline6(", 6), ("polyline(", 5)):
        if text.startswith(name):
            try:
                line = decoded(text.removeprefix(name).removesuffix(")"), decimals)
            except ValueError as error:
                raise OsrmError(OsrmCode.INVALID_QUERY, "coordinates", text[:LONGEST], str(error)) from error
            return _checked([tuple(place) for place in line[: most + 1].tolist()], most)
    if text.count(";") >= most:
        raise OsrmError(OsrmCode.TOO_BIG, "coordinates", f"{text.count(';') + 1}", f"at most {most}")
    places = []
    for part in text.split(";"):
        numbers = [number_from(number) for number in part.split(",", 2)]
        if len(numbers) != 2 or None in numbers:
            allowed = "longitude,latitude;longitude,latitude… or polyline(…) or polyline6(…)"
            raise OsrmError(OsrmCode.INVALID_QUERY, "coordinates", part[:LONGEST], allowed)
        places.append((numbers[0], numbers[1]))
    return _checked(places, most)


def _checked(places: list[Any], most: int) -> tuple[tuple[float, float], ...]:
    if len(places) > most:
        raise OsrmError(OsrmCode.TOO_BIG, "coordinates", f"more than {most}", f"at most {most}")
    for lon, lat in places:
        if not (abs(lon) <= 180.0 and abs(lat) <= 90.0):
            allowed = "longitudes of -180..180, then latitudes of -90..90"
            raise OsrmError(OsrmCode.INVALID_VALUE, "coordinates", f"{lon:g},{lat:g}", allowed)
    return tuple(places)


def options_from_json(body: object) -> dict[str, str]:
    """The options of a JSON body as an address has them; `ev`, an object, is left to the caller."""
    if not isinstance(body, dict):
        raise OsrmError(OsrmCode.INVALID_QUERY, "the body", type(body).__name__, "a JSON object")
    return {str(name): _text(str(name), value) for name, value in body.items() if name != "ev"}


def _text(name: str, value: object) -> str:
    """A value of a JSON body as an address has it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (str, int, float)):
        return str(value)
    if isinstance(value, list):
        between = "," if name in ("annotations", "exclude") else ";"
        return between.join(_element(name, element) for element in value)
    allowed = "a number, a text, true, false or a list of such"
    raise OsrmError(OsrmCode.INVALID_QUERY, name[:LONGEST], type(value).__name__, allowed)


def _element(name: str, element: object) -> str:
    if element is None:
        return ""
    if isinstance(element, list):
        return ",".join("" if part is None else str(part)[:LONGEST] for part in element[:LONGEST])
    if isinstance(element, (str, int, float)):
        return str(element)
    raise OsrmError(OsrmCode.INVALID_QUERY, name[:LONGEST], type(element).__name__, "numbers and texts")
