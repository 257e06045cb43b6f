"""The service itself, asked over HTTP from the first byte sent to the last one read."""

from __future__ import annotations

import http.client
import json
import time
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode, urlsplit

from benchmarks.browser import served
from benchmarks.peers.questions import EngineAnswer, Question
from benchmarks.peers.worker import ONE_THREAD

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

NAME: Final = "joulepath"
VEHICLE: Final = "chevrolet-bolt"
ROUTE_CHARGE_FRAC: Final = 0.9
BANDS: Final = 3
ASK_S: Final = 120.0
HTTP_OK: Final = 200
KEPT_OPEN_S: Final = 2.0  # the service closes connections that nothing was asked on for 5 s


class Ours:
    """One connection to a running service, kept open while it is used."""

    def __init__(self, address: str) -> None:
        self._connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=ASK_S)
        self._asked = -KEPT_OPEN_S

    def ask(self, question: Question) -> EngineAnswer:
        """The answer, which may be a refusal."""
        return self._area(question) if question.goal is None else self._route(question)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def _route(self, question: Question) -> EngineAnswer:
        body = json.dumps({"start": _place(question.start), "goal": _place(question.goal), "soc": ROUTE_CHARGE_FRAC})
        status, said, seconds = self._timed("POST", "/route", body.encode())
        answer = json.loads(said)
        if status != HTTP_OK:
            return EngineAnswer(refused=answer["detail"])
        route = answer["routes"][0]
        if not route["feasible"]:
            return EngineAnswer(refused="not feasible on this charge")
        line = route["geometry"]["coordinates"]
        return EngineAnswer(
            seconds=seconds,
            search_s=sum(search["seconds"] for search in answer["stats"]),
            size_bytes=len(said),
            distance_m=route["distance_m"],
            energy_kwh=route["energy_kwh"],
            ends=((line[0][1], line[0][0]), (line[-1][1], line[-1][0])),
        )

    def _area(self, question: Question) -> EngineAnswer:
        lat, lon = question.start
        asked = urlencode({"lat": lat, "lon": lon, "soc": f"{question.budget:.6f}", "bands": BANDS})
        status, said, seconds = self._timed("GET", f"/range?{asked}", None)
        answer = json.loads(said)
        if status != HTTP_OK:
            return EngineAnswer(refused=answer["detail"])
        widest = next(
            feature for feature in answer["features"] if feature["properties"]["kind"] == "band"
        )  # outermost first
        return EngineAnswer(
            seconds=seconds,
            search_s=answer["stats"]["seconds"],
            size_bytes=len(said),
            shape=widest["geometry"]["coordinates"],
        )

    def _timed(self, method: str, path: str, body: bytes | None) -> tuple[int, bytes, float]:
        """Status, body, and how long the whole exchange took [s]."""
        if time.monotonic() - self._asked > KEPT_OPEN_S:
            self._connection.close()
            self._connection.connect()
        began = time.perf_counter()
        self._connection.request(method, path, body, {"Content-Type": "application/json"} if body else {})
        response = self._connection.getresponse()
        said = response.read()
        seconds = time.perf_counter() - began
        self._asked = time.monotonic()
        return response.status, said, seconds


def _place(place: tuple[float, float] | None) -> dict[str, float]:
    assert place is not None
    return {"lat": place[0], "lon": place[1]}


@contextmanager
def ours(graph_folder: Path, scratch: Path) -> Iterator[Ours]:
    """The service on a graph, with one search at a time; raises RuntimeError where it does not come up."""
    home = scratch / "service"
    home.mkdir()
    settings = {
        "JOULEPATH_GRAPH_DIRS": str(graph_folder.parent),
        "JOULEPATH_DEFAULT_GRAPH": graph_folder.name,
        "JOULEPATH_DEFAULT_VEHICLE": VEHICLE,
        "JOULEPATH_SEARCH_THREADS": "1",
    }
    with served(home, **ONE_THREAD, **settings) as address, closing(Ours(address)) as engine:
        yield engine
