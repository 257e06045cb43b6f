"""What Valhalla is asked: a JSON object, whose unknown fields are left alone as Valhalla does."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from app.errors.problems import shortened
from app.http.faces.electric import PROFILE_FORM, Electric, electric_from, profile_fields
from app.http.faces.polylines import decoded
from app.http.faces.valhalla.errors import ValhallaError
from routing.weights import SHORTEST

if TYPE_CHECKING:
    from collections.abc import Mapping

    from routing.weights import Weights

PLAIN: Final = frozenset({"auto"})
MILES: Final = ("mi", "miles")
UNITS: Final = ("km", "kilometers", "kilometres", *MILES)
KM_A_MILE: Final = 1.609344
LONGEST: Final = 200
HARD: Final = ("exclude_tolls", "exclude_highways", "exclude_ferries", "exclude_tunnels", "exclude_bridges")
HEEDED: Final = frozenset({"shortest", "top_speed", "ev"})
DATE: Final = "%Y-%m-%dT%H:%M"
DECIMALS: Final = {"polyline6": 6, "polyline5": 5}
HARD_IGNORED: Final = "Hard exclusions are not allowed on this server, ignoring hard excludes"


@dataclass(slots=True)
class ValhallaRequest:
    """One request: its fields as they were sent, and warnings that its answer has."""

    fields: Mapping[str, Any]
    warnings: list[dict[str, object]] = field(default_factory=list)

    def warn(self, code: int, text: str) -> None:
        """Note something for the answer."""
        self.warnings.append({"code": code, "description": text})

    def electric(self, usual_soc: float) -> Electric:
        """What costing and fields of our own say of vehicle, charge, weather and time."""
        costing = self.fields.get("costing")
        if costing is None:
            raise ValhallaError(124)
        said = profile_fields(costing, PLAIN) if isinstance(costing, str) else None
        if said is None:
            raise ValhallaError(125, f"'{str(costing)[:LONGEST]}', but auto, {PROFILE_FORM}")
        options = self._options(costing)
        own = self.fields.get("ev", options.get("ev"))
        electric = electric_from(said, own, usual_soc)
        weather = electric.drive.get("conditions") or {}
        if not isinstance(weather, dict):
            return electric  # which is refused as it is
        departure, top_speed = self._departure(), options.get("top_speed")
        if departure is not None:
            weather = {"departure": departure, **weather}
        if top_speed is not None:
            weather = {"top_speed_kmh": top_speed, **weather}
        return replace(electric, drive={**electric.drive, **({"conditions": weather} if weather else {})})

    def weights(self) -> Weights | None:
        """The shortest way where that is asked for."""
        return SHORTEST if self._options(str(self.fields["costing"])).get("shortest") is True else None

    def check_heeded(self) -> None:
        """Refuse what would change the way and can't be heeded; warn of what is only left out."""
        for name in ("exclude_locations", "avoid_locations"):
            if self.fields.get(name):
                raise ValhallaError(157, f"{name} of at most 0")
        for name in ("exclude_polygons", "avoid_polygons"):
            if self.fields.get(name):
                raise ValhallaError(167, f"0, in {name}")
        options = self._options(str(self.fields.get("costing")))
        if any(options.get(name) is True for name in HARD):
            self.warn(208, HARD_IGNORED)
        unheeded = sorted(shortened(name, LONGEST) for name in options if name not in HEEDED and name not in HARD)
        if unheeded:
            self.warn(299, f"costing options without effect: {', '.join(unheeded[:20])}")

    def _options(self, costing: str) -> Mapping[str, Any]:
        every = self.fields.get("costing_options")
        if every is None:
            return {}
        options = every.get(costing, {}) if isinstance(every, dict) else None
        if options is None or not isinstance(options, dict):
            raise ValhallaError(100, "costing_options of objects")
        return options

    def _departure(self) -> str | None:
        """The local time of departure, None where it is left out, or now."""
        sent = self.fields.get("date_time")
        if sent is None:
            return None
        kind = sent.get("type") if isinstance(sent, dict) else None
        if kind in (0, "0") and not isinstance(kind, bool):
            return None
        if kind not in (1, 3, "1", "3") or isinstance(kind, bool):
            raise ValhallaError(163, f"{str(kind)[:LONGEST]}, but 0, 1 or 3: there is no arriving at a time")
        try:
            return datetime.strptime(str(sent.get("value"))[:16], DATE).isoformat()
        except ValueError as error:
            raise ValhallaError(162) from error

    @property
    def asked_id(self) -> dict[str, str]:
        """The name that a request is given."""
        name = self.fields.get("id")
        return {} if name is None else {"id": shortened(str(name)[:LONGEST], LONGEST)}

    @property
    def km_a_unit(self) -> float:
        """What a unit of length is [km]."""
        return KM_A_MILE if self.units == "miles" else 1.0

    @property
    def units(self) -> str:
        """Kilometres or miles, by Valhalla's name."""
        units = self.fields.get("units", self._directions("units"))
        if units is not None and units not in UNITS:
            raise ValhallaError(100, f"units '{str(units)[:LONGEST]}', but kilometers or miles")
        return "miles" if units in MILES else "kilometers"

    @property
    def directions_type(self) -> str:
        """What is said of turns: none, maneuvers or instructions."""
        return str(self.fields.get("directions_type", self._directions("directions_type")) or "instructions")

    @property
    def language(self) -> str:
        """The language in which roads are named, "" for that of the signs."""
        language = str(self.fields.get("language", self._directions("language")) or "")[:2].lower()
        return language if language.isascii() and language.isalpha() and language != "en" else ""

    def _directions(self, name: str) -> object:
        """A field as older clients send it."""
        options = self.fields.get("directions_options")
        return options.get(name) if isinstance(options, dict) else None

    def flag(self, name: str, *, default: bool = False) -> bool:
        """A field that is true or false."""
        value = self.fields.get(name)
        if value is None:
            return default
        if not isinstance(value, bool):
            raise ValhallaError(100, f"{name} of true or false")
        return value

    def number(self, name: str, low: float, high: float) -> float | None:
        """A field that is a number, None where it is left out."""
        value = self.fields.get(name)
        if value is None:
            return None
        if not is_number(value) or not low <= value <= high:
            raise ValhallaError(100, f"{name} of {low:g}..{high:g}")
        return float(value)

    def places(self, name: str, most: int, *, few: int, missing: int, bad: int, least: int = 1) -> list[Any]:
        """A list of locations, each an object with lat and lon; few, missing, bad: numbers of what may be wrong."""
        sent = self.fields.get(name)
        if not isinstance(sent, list):
            raise ValhallaError(missing)
        if len(sent) < least:
            raise ValhallaError(few)
        if len(sent) > most:
            raise ValhallaError(150, f"{most}")
        for k, place in enumerate(sent):
            if not isinstance(place, dict) or not _is_place(place.get("lat"), place.get("lon")):
                raise ValhallaError(bad, f"{name}[{k}] has lat of -90..90 and lon of -180..180")
        return sent

    def shape(self, most: int) -> tuple[list[tuple[float, float]], dict[str, Any]]:
        """The places of a shape, as longitude, latitude [deg], and the field that they were sent in."""
        text = self.fields.get("encoded_polyline")
        if text is None:
            places = [lonlat_sent(place) for place in self.places("shape", most, few=123, missing=114, bad=134)]
            return places, {"shape": [{"lon": lon, "lat": lat} for lon, lat in places]}
        form = self.fields.get("shape_format", "polyline6")
        if form not in tuple(DECIMALS) or not isinstance(text, str):
            raise ValhallaError(164, f"'{str(form)[:LONGEST]}', but {', '.join(DECIMALS)}")
        try:
            line = decoded(text, DECIMALS[form])
        except ValueError as error:
            raise ValhallaError(134, f"encoded_polyline of {error}") from error
        if line.shape[0] > most:
            raise ValhallaError(314, f"at most {most}")
        if not bool((np.abs(line) <= (180.0, 90.0)).all()):
            raise ValhallaError(134, "encoded_polyline beyond -180..180 and -90..90")
        return [(lon, lat) for lon, lat in line.tolist()], {"encoded_polyline": text}


def lonlat_sent(place: Mapping[str, Any]) -> tuple[float, float]:
    """A location as longitude, latitude [deg]."""
    return float(place["lon"]), float(place["lat"])


def is_number(value: object) -> bool:
    """Whether a value of JSON is a finite number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < math.inf


def _is_place(lat: object, lon: object) -> bool:
    return is_number(lat) and is_number(lon) and abs(lat) <= 90.0 and abs(lon) <= 180.0  # type: ignore[arg-type]
