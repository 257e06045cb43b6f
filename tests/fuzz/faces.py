"""`python -m tests.fuzz.faces SECONDS [SEED]`: odd requests to the faces of other engines.

Each request is the same for the same seed: a good one with a few values, names and characters changed.
"""

from __future__ import annotations

import copy
import json
import random
import sys
import tempfile
import time
import traceback
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote, urlencode

from starlette.testclient import TestClient

from app.errors.problems import PROBLEM_TYPE
from app.http.faces.osrm.errors import OsrmCode
from app.http.faces.valhalla.errors import TEXTS
from app.main import create_app
from app.service.service import Service
from app.settings import Settings
from tests.fuzz.bodies import VALUES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from httpx2 import Response

# three places on `highlands`, longitude and latitude
PLACES: Final = ([-36.78, 44.44], [-36.1817, 44.1088], [-36.779, 44.441])
EV: Final = {"soc": 0.7, "vehicle": "vw-id4", "weighting": "fastest", "conditions": {"ambient_c": -5.0}}
ODD: Final[Sequence[Any]] = (
    *(None, True, [], {}, "", 0, -1, 1e308, 10**30, 0.5, "x" * 500, "\udfff", "\0", "½", "1_0", [[]], {"a": 1}),
    *([None], [1, 2], [181, 91], [1e999], -0.0, "2026-12-01T08:00", "all", "geojson", ["soc", 1], {"lat": "1"}, 1e-300),
)
NAMES: Final = ("ev", "id", "units", "options", "type", "soc", "range", "x" * 300, "", "\udfff", "alternates", "json")
PROFILES: Final = (
    *("driving", "car", "driving-car", "auto", "ev", "ev@0.5", "ev:vw-id4@0.8", "ev:", "ev@", "ev@.", "ev:@", "ev@9"),
    *("ev:nothing", "foot", "ev:a@b@c", "e" * 300, "ev@1e3", "ev:vw-id4@0.8\n", "EV", "..", "ev@٣"),
    *(
        "ev,ambient_c=-5",
        "ev@0.5,soc=0.6,charging=true",
        "ev,",
        "ev,soc",
        "ev,soc=nan",
        "ev,=",
        "ev,no=1,",
    ),
)
OSRM_OPTIONS: Final = (
    *("alternatives", "steps", "annotations", "geometries", "overview", "continue_straight", "waypoints", "bearings"),
    *("radiuses", "generate_hints", "hints", "approaches", "exclude", "snapping", "skip_waypoints", "format", "number"),
    *(
        "sources",
        "destinations",
        "fallback_speed",
        "fallback_coordinate",
        "scale_factor",
        "soc",
        "ambient_c",
        "vehicle",
    ),
    *("charging", "departure", "graph", "weighting", "effects", "no_such_option"),
)
OSRM_VALUES: Final = (
    *("true", "false", "1", "0", "-1", "3", "1e5", "nan", "inf", "", ";", ";;", "0;1", "all", "0;9", "1;unlimited"),
    *("polyline", "polyline6", "geojson", "full", "simplified", "by_legs", "duration,distance", "energy,soc", "nodes"),
    *("0,90;10,20", "curb;curb", "motorway", "json", "x" * 3000, "٣", "\udfff", "0.5", "highlands", "2026-12-01T08:00"),
)
COORDINATES: Final = (
    "polyline(_p~iF~ps|U_ulLnnqC)",
    "polyline6(x)",
    "polyline(",
    "polyline()",
    "1,2",
    "",
    ";",
    "1,2;3",
    "1,2,3;4,5",
    "200,0;0,0",
    "nan,nan;1,1",
    "1e400,0;0,0",
)


def good_bodies(places: Sequence[list[float]]) -> Sequence[tuple[str, dict[str, Any]]]:
    """Addresses, with a place for the profile, and bodies that are answered."""
    named = tuple({"lon": lon, "lat": lat} for lon, lat in places)
    return (
        ("/ors/v2/directions/{}", {"coordinates": list(places[:2]), "preference": "shortest", "units": "km", "ev": EV}),
        (
            "/ors/v2/directions/{}/geojson",
            {
                "coordinates": list(places),
                "elevation": True,
                "maneuvers": True,
                "radiuses": [50, 50, -1],
                "attributes": ["avgspeed", "detourfactor"],
                "alternative_routes": {"target_count": 2},
                "options": {"avoid_features": [], "ev": EV},
                "geometry_simplify": True,
            },
        ),
        ("/ors/v2/directions/{}/gpx", {"coordinates": list(places[::2]), "language": "de"}),
        ("/ors/v2/directions/{}/pdf", {"coordinates": list(places[:2])}),
        (
            "/ors/v2/isochrones/{}",
            {
                "locations": [places[0]],
                "range": [300, 600],
                "range_type": "time",
                "attributes": ["area"],
                "smoothing": 5,
            },
        ),
        ("/ors/v2/isochrones/{}/geojson", {"locations": [places[0]], "range": [0.65, 0.6], "range_type": "charge"}),
        ("/ors/v2/isochrones/{}", {"locations": [places[0]], "range": [900], "interval": 300, "units": "Wh"}),
        (
            "/ors/v2/matrix/{}",
            {"locations": list(places), "sources": [0], "destinations": ["1", 2], "metrics": ["soc"]},
        ),
        (
            "/valhalla/route",
            {
                "locations": [dict(place, type="break") for place in named],
                "costing": "auto",
                "costing_options": {"auto": {"top_speed": 90, "shortest": True, "ev": EV}},
                "date_time": {"type": 1, "value": "2026-12-01T08:00"},
                "units": "miles",
                "alternates": 1,
                "elevation_interval": 100,
                "shape_format": "polyline5",
                "turn_lanes": True,
            },
        ),
        (
            "/valhalla/isochrone",
            {
                "locations": [named[0]],
                "costing": "ev@0.5",
                "contours": [{"time": 5, "color": "ff0000"}, {"charge": 0.4}, {"energy": 1}, {"distance": 3}],
                "polygons": True,
                "denoise": 0.5,
                "generalize": 50,
                "show_locations": True,
            },
        ),
        ("/valhalla/sources_to_targets", {"sources": list(named[:1]), "targets": list(named), "costing": "auto"}),
        ("/valhalla/height", {"shape": list(named), "range": True, "resample_distance": 5000, "height_precision": 2}),
        ("/valhalla/height", {"encoded_polyline": "_p~iF~ps|U_ulLnnqC", "shape_format": "polyline5"}),
        ("/valhalla/locate", {"locations": list(named), "costing": "auto"}),
        (
            "/osrm/route/v1/{}",
            {"coordinates": list(places), "steps": True, "annotations": True, "radiuses": [None, 9, 9], "ev": EV},
        ),
        ("/osrm/table/v1/{}", {"coordinates": list(places), "sources": [0], "annotations": ["duration"]}),
    )


def odd_request(seed: int, places: Sequence[list[float]] = PLACES) -> tuple[str, str, bytes, str]:
    """Method, address, body and media type."""
    draw = random.Random(seed)
    if draw.random() < 0.4:
        return "GET", _osrm_address(draw, places), b"", ""
    address, good = draw.choice(good_bodies(places))
    body: Any = copy.deepcopy(good)
    for _ in range(draw.randint(0, 3)):
        body = _changed(body, draw)
    text = json.dumps(body)
    if draw.random() < 0.1:
        text = text.replace(draw.choice(("0", "1", '"', "[", "true")), draw.choice(VALUES), 1)
    if draw.random() < 0.05:
        text = text[: draw.randrange(len(text))]
    profile = quote(draw.choice(PROFILES) if draw.random() < 0.3 else "ev@0.7", safe="")
    sent = text.encode("utf-8", "replace")
    if address.startswith("/valhalla") and draw.random() < 0.2:
        return "GET", f"{address}?{urlencode({'json': text[:2000]}, errors='replace')}", b"", ""
    return draw.choice(("POST",) * 9 + ("PUT",)), address.format(profile), sent, "application/json"


def _osrm_address(draw: random.Random, known: Sequence[list[float]]) -> str:
    service = draw.choice(("route", "route", "table", "nearest", "match", "no_such"))
    profile = quote(draw.choice(PROFILES) if draw.random() < 0.3 else "driving", safe="")
    places = known[: 1 if service == "nearest" else draw.randint(1, 3)]
    text = ";".join(f"{lon},{lat}" for lon, lat in places)
    if draw.random() < 0.3:
        text = draw.choice(COORDINATES)
    if draw.random() < 0.2:
        at = draw.randrange(len(text) + 1)
        text = text[:at] + draw.choice(("/", ".", "%", "\0", "ü", "x", ",", ";", "-", "e9", ".json")) + text[at + 1 :]
    options = [(draw.choice(OSRM_OPTIONS), draw.choice(OSRM_VALUES)) for _ in range(draw.randint(0, 3))]
    version = "v1" if draw.random() < 0.95 else "v9"
    return f"/osrm/{service}/{version}/{profile}/{quote(text)}?{urlencode(options, errors='replace')}"


def _changed(value: Any, draw: random.Random) -> Any:
    """A value with something in it replaced, left out, added or doubled."""
    if isinstance(value, dict) and value and draw.random() < 0.85:
        name = draw.choice(list(value))
        kind = draw.random()
        if kind < 0.15:
            return {other: kept for other, kept in value.items() if other != name}
        if kind < 0.3:
            return {**value, draw.choice(NAMES): draw.choice(ODD)}
        return {**value, name: _changed(value[name], draw)}
    if isinstance(value, list) and value and draw.random() < 0.8:
        at = draw.randrange(len(value))
        if draw.random() < 0.2:
            return value * draw.choice((2, 30))
        return [*value[:at], _changed(value[at], draw), *value[at + 1 :]]
    return draw.choice(ODD)


def fault_of(address: str, answer: Response) -> str:
    """What is wrong with an answer to any request whatever, "" for nothing."""
    if answer.status_code >= 500 and answer.status_code != 503:
        return f"status {answer.status_code}"
    if answer.status_code < 400:
        return ""
    if answer.headers["content-type"] == PROBLEM_TYPE and (answer.status_code == 413 or "%0A" in address):
        return ""  # what no face has seen
    said = answer.json()
    if address.startswith("/osrm"):
        known = said.get("code") in set(OsrmCode) and isinstance(said.get("message"), str)
    elif address.startswith("/valhalla"):
        known = said.get("error_code") in TEXTS and said.get("status_code") == answer.status_code
    else:
        error = said.get("error", {})
        known = (
            isinstance(error.get("code"), int) and bool(error.get("message")) and "timestamp" in said.get("info", {})
        )
    return "" if known else f"a {answer.status_code} in another form: {answer.text[:200]}"


def ask(client: TestClient, seed: int, places: Sequence[list[float]] = PLACES) -> tuple[str, str]:
    """The request of a seed as text, and how it ended: its status, or what is wrong with the answer."""
    method, address, body, media_type = odd_request(seed, places)
    headers = {"Content-Type": media_type} if media_type else {}
    request = f"{method} {address[:300]} {body[:1000]!r}"
    try:
        answer = client.request(method, address, content=body, headers=headers)
    except Exception as error:  # a fault of the service comes through
        at = traceback.extract_tb(error.__traceback__)[-1]
        return request, f"{error!r} at {at.filename}:{at.lineno}"
    return request, fault_of(address, answer) or str(answer.status_code)


def main(seconds: float, seed: int) -> int:
    """Print how requests ended; the exit status is 1 where something is wrong."""
    ends: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        settings = Settings(database_url=f"sqlite:///{Path(folder)}/vehicles.sqlite", time_limit_s=10.0)
        service = Service(settings)
        service.load_all()
        with TestClient(create_app(settings, service)) as client:
            until, at = time.monotonic() + seconds, seed * 1_000_000
            while time.monotonic() < until:
                request, end = ask(client, at)
                if not end.isdecimal():
                    print(f"request of seed {at}: {end}\n{request}", flush=True)
                ends[end] += 1
                at += 1
    print(f"{ends.total()} requests: {dict(ends.most_common())}")
    return int(any(not end.isdecimal() for end in ends))


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0))
