"""Lines as texts, and with fewer points."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest

from app.conversions.lean.lines import OVERVIEW_PIXELS, drawn, kept_points, polyline
from app.conversions.route import route_query
from app.schemas.lean.form import Overview
from app.schemas.route import RouteRequest
from routing.graph.earth import METRE_PER_DEGREE

if TYPE_CHECKING:
    from app.service.service import Service
    from routing.route.route import Route


def decoded(text: str, decimals: int) -> list[tuple[float, float]]:
    """Latitude and longitude of each point, by the description of the encoding, bit by bit."""
    numbers, number, shift = [], 0, 0
    for character in text.encode("ascii"):
        chunk = character - 63
        number |= (chunk & 0x1F) << shift
        shift += 5
        if chunk < 0x20:
            numbers.append(~(number >> 1) if number & 1 else number >> 1)
            number, shift = 0, 0
    places = np.cumsum(np.array(numbers).reshape(-1, 2), axis=0) / 10**decimals
    return [(lat, lon) for lat, lon in places.tolist()]


def test_polyline_of_the_example_of_its_description_is_the_text_there() -> None:
    line = np.array([[-120.2, 38.5], [-120.95, 40.7], [-126.453, 43.252]])
    assert polyline(line, 5) == "_p~iF~ps|U_ulLnnqC_mqNvxq`@"


@pytest.mark.parametrize("decimals", [5, 6])
def test_polylines_are_read_as_the_places_that_they_were_made_of(decimals: int) -> None:
    dice = np.random.default_rng(3)
    ends = np.array([[-180.0, -90.0], [180.0, 90.0], [0.0, 0.0], [0.0, 0.0], [-180.0, 90.0]])
    line = np.vstack((dice.uniform((-180, -90), (180, 90), (300, 2)), ends)).round(decimals)
    read = np.array(decoded(polyline(line, decimals), decimals))
    assert np.abs(read[:, ::-1] - line).max() < 1e-9


@pytest.fixture(scope="module")
def route(service: Service) -> Route:
    """A route around the grid over a via point."""
    sent = RouteRequest.model_validate(
        {"start": [8.001, 46.5], "via": [[8.02, 46.505]], "goal": [8.0, 46.515], "soc": 0.5}
    )
    planner, chosen, understood = service._understood(sent)
    return planner.route(route_query(understood, chosen.vehicle)).routes[0]


def test_simplified_line_keeps_ends_of_legs_and_the_rest_within_its_tolerance(route: Route) -> None:
    kept = kept_points(route)
    assert (kept[0], kept[-1]) == (0, len(route.geometry) - 1)
    assert (np.diff(kept) > 0).all()
    ends = [route.links.geometry_end_idx[leg.last_link] for leg in route.legs if leg.last_link is not None]
    assert set(ends) <= set(kept.tolist())
    scale = METRE_PER_DEGREE * np.array((np.cos(np.radians(46.5)), 1.0))
    flat = route.geometry * scale
    most_m = np.ptp(flat, axis=0).max() / OVERVIEW_PIXELS
    for begin, end in pairwise(kept.tolist()):
        along = flat[end] - flat[begin]
        off = flat[begin : end + 1] - flat[begin]
        assert np.abs(off[:, 0] * along[1] - off[:, 1] * along[0]).max() / np.hypot(*along) < 1.01 * most_m


def test_links_of_a_simplified_line_end_at_its_points(route: Route) -> None:
    simple, kept = drawn(route, Overview.SIMPLIFIED)
    assert kept is not None
    assert len(simple.geometry) < len(route.geometry)
    for was, now in zip(route.links.geometry_end_idx, simple.links.geometry_end_idx, strict=True):
        assert kept[now] >= was
        assert now == 0 or kept[now - 1] < was
    assert drawn(route, Overview.FULL) == (route, None)
