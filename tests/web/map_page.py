"""The map's page in a browser: what it asks the service for, and what goes wrong on it."""

from __future__ import annotations

import io
import re
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qs, urlsplit

import numpy as np
from matplotlib.image import imread
from playwright.sync_api import expect

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray
    from playwright.sync_api import ConsoleMessage, Locator, Page, Request, Response

LOADED: Final = "Failed to load resource"  # what the browser says of every answer from 400 on
OVERTAKEN: Final = "net::ERR_ABORTED"  # a request that the page took back
STARTING_MS: Final = 30_000
LOOKS: Final = 40
LOOK_AGAIN_MS: Final = 150
PHONE: Final = {"width": 390, "height": 844}

Place = tuple[float, float]  # latitude, longitude [deg]


@dataclass
class Exchange:
    """One request of the page: the body sent, and the answer read as JSON."""

    body: Any = None
    answer: Any = None


@dataclass
class MapPage:
    """A page that is watched. `faults` are what no page may show; `sent` are all bodies posted, by their path."""

    page: Page
    address: str
    faults: list[str] = field(default_factory=list)
    sent: list[tuple[str, Any]] = field(default_factory=list)
    refused: set[int] = field(default_factory=set)  # statuses that the test provokes, 0 for no answer at all

    def __post_init__(self) -> None:
        self.page.on("console", self._heard)
        self.page.on("pageerror", lambda error: self.faults.append(f"error in the page: {error}"))
        self.page.on("request", self._asked)
        self.page.on("requestfailed", self._failed)

    def _heard(self, message: ConsoleMessage) -> None:
        if message.type not in ("error", "warning"):
            return
        provoked = ("net::ERR" if status == 0 else f"status of {status} " for status in self.refused)
        if message.text.startswith(LOADED) and any(part in message.text for part in provoked):
            return
        self.faults.append(f"console {message.type}: {message.text}")

    def _asked(self, request: Request) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in ("blob", "data") and not request.url.startswith(f"{self.address}/"):
            self.faults.append(f"request to another host: {request.url}")
        if request.method == "POST" and parts.path in ("/route", "/range"):
            self.sent.append((parts.path, request.post_data_json))

    def _failed(self, request: Request) -> None:
        if request.failure != OVERTAKEN and 0 not in self.refused:
            self.faults.append(f"failed request: {request.url}: {request.failure}")

    def open(self, query: str = "") -> None:
        """Go to an address of the page, and wait for the map and for what the address asks for."""
        asked = parse_qs(query.removeprefix("?"))
        if "start" not in asked or asked.get("tab") == ["diagnosis"]:
            self.page.goto(f"{self.address}/{query}")
        else:
            path = "/route" if "goal" in asked and "tab" not in asked else "/range"
            with self.asking(path):
                self.page.goto(f"{self.address}/{query}")
        self.drawn()

    def drawn(self) -> None:
        """Wait until the map is drawn."""
        expect(self.page.locator("#map")).to_have_attribute("data-state", "drawn", timeout=STARTING_MS)

    @contextmanager
    def asking(self, path: str) -> Iterator[Exchange]:
        """What the page asks for with POST because of what is done meanwhile; waits for the answer.

        A request that the page takes back for a newer one has no answer, and is passed over.
        """
        exchange = Exchange()
        meanwhile: list[Request] = []

        def asked(request: Request) -> None:
            meanwhile.append(request)

        def fits(response: Response) -> bool:
            request = response.request
            return request in meanwhile and urlsplit(request.url).path == path and request.method == "POST"

        self.page.on("request", asked)
        with self.page.expect_response(fits) as caught:
            yield exchange
        self.page.remove_listener("request", asked)
        response = caught.value
        assert response.status < 400 or response.status in self.refused, response.text()
        exchange.body = response.request.post_data_json
        exchange.answer = response.json()

    def type_place(self, title: str, place: Place) -> None:
        """Type a place's coordinates, and leave the field."""
        box = self.place_box(title)
        box.fill(f"{place[0]}, {place[1]}")
        box.press("Enter")

    def place_box(self, title: str) -> Locator:
        """The text field of a place: Start, Goal, Place or Via point N."""
        return self.page.get_by_label(f"{title}, latitude and longitude", exact=True)

    def marker(self, title: str) -> Locator:
        """The marker of a place on the map."""
        return self.page.get_by_role("button", name=f"{title}: drag it")

    def place(self, title: str) -> Place:
        """Where a place is, by its text field."""
        lat, lon = self.place_box(title).input_value().split(",")
        return float(lat), float(lon)

    def address_query(self) -> dict[str, str]:
        """What the page's address says."""
        return {key: values[0] for key, values in parse_qs(urlsplit(self.page.url).query).items()}

    def width_px(self) -> int:
        """Width of all that the page holds; more than the window's where it would scroll sideways."""
        width: int = self.page.evaluate("document.documentElement.scrollWidth")
        return width

    def picture(self) -> NDArray[np.float64]:
        """What the map looks like once it is still: red, green, blue in 0..1, shape (height, width, 3)."""
        last = self._snapshot()
        for _ in range(LOOKS):
            self.page.wait_for_timeout(LOOK_AGAIN_MS)
            now = self._snapshot()
            if np.array_equal(last, now):
                return now
            last = now
        raise AssertionError("the map never came to rest")

    def changed_frac(self, before: NDArray[np.float64], least: float) -> float:
        """Share of the map's pixels that differ from a picture; waits for at least so many."""
        changed = 0.0
        for _ in range(LOOKS):
            changed = changed_frac(before, self._snapshot())
            if changed >= least:
                return changed_frac(before, self.picture())
            self.page.wait_for_timeout(LOOK_AGAIN_MS)
        raise AssertionError(f"{changed} of the map changed, expected at least {least}")

    def _snapshot(self) -> NDArray[np.float64]:
        return picture_of(self.page.locator("#map").screenshot())


def picture_of(png: bytes) -> NDArray[np.float64]:
    """Red, green and blue in 0..1 of a picture, shape (height, width, 3)."""
    return np.asarray(imread(io.BytesIO(png), format="png"), np.float64)[:, :, :3]


def changed_frac(before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Share of pixels that differ by more than what a screenshot's noise makes."""
    return float(np.mean(np.abs(before - after).max(axis=2) > 0.02))


def shown_number(text: str, unit: str) -> tuple[float, float]:
    """The number before a unit in a text, and half of its last digit."""
    found = re.search(rf"(?<![\d/,.])(−?[\d,]+(?:\.(\d+))?)\s*{re.escape(unit)}", text)
    assert found, f"no number of {unit} in {text!r}"
    return float(found.group(1).replace(",", "").replace("−", "-")), 0.5 * 10.0 ** -len(found.group(2) or "")


def check_shown(text: str, unit: str, value: float) -> None:
    """A text shows this value of a unit, rounded to the digits that it shows."""
    shown, half_digit = shown_number(text, unit)
    assert abs(shown - value) <= half_digit * (1.0 + 1e-9), f"{text!r} shows {shown} {unit}, expected {value}"


def places_as_sent(*places: Place) -> Sequence[dict[str, float]]:
    """Places as request bodies write them."""
    return [{"lat": lat, "lon": lon} for lat, lon in places]
