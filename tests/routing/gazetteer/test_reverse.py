"""What is at a place of a drawn town."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from routing.gazetteer.entries import Kind
from routing.gazetteer.gazetteer import Gazetteer
from tests.routing.gazetteer.drawn_town import RUA, drawn_town, opened


@pytest.fixture
def town(draw_map: Any, tmp_path: Path) -> Gazetteer:
    return opened(drawn_town(draw_map), tmp_path)


def at(east_m: float, north_m: float) -> tuple[float, float]:
    return 42.0 + north_m / 111_073.38, 1.5 + east_m / 82_850.76


def test_a_house_beside_a_place_is_its_address(town: Gazetteer) -> None:
    found = town.reverse(*at(22, 6))[0]
    assert (found.kind, found.street, found.number) == (Kind.HOUSE, RUA, "12")
    assert found.distance_m == pytest.approx(4.5, abs=0.2)


def test_away_from_houses_the_nearest_point_of_the_street_is_the_address(town: Gazetteer) -> None:
    found = town.reverse(*at(300, 280))[0]
    assert (found.kind, found.name) == (Kind.STREET, "Sendlinger Straße")
    assert (found.lat, found.lon) == pytest.approx(at(300, 300), abs=2e-6)
    assert found.distance_m == pytest.approx(20.0, abs=0.2)


def test_further_answers_are_ordered_by_distance(town: Gazetteer) -> None:
    away = [place.distance_m or 0.0 for place in town.reverse(*at(300, 280), limit=6)][1:]
    assert away == sorted(away)


def test_beyond_the_radius_there_is_nothing(town: Gazetteer) -> None:
    assert town.reverse(*at(3000, 3000), radius_m=500.0) == []
    assert town.reverse(0.0, -170.0, radius_m=1e6) == []
    assert town.reverse(90.0, 180.0) == []


def test_a_far_place_is_answered_within_a_wide_radius(town: Gazetteer) -> None:
    assert town.reverse(*at(3000, 3000), radius_m=20_000.0)
