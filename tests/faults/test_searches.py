"""Searches that once could not be stopped: they end at their limit, and answer what they know."""

from __future__ import annotations

import json
import time
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import pytest

from app.schemas.route import RouteRequest
from app.service.service import Service
from app.settings import Settings
from benchmarks.answers import LORRY
from routing.errors import TimeUpError
from routing.time_budget import TimeBudget, within
from tests.app.expected import database_in

if TYPE_CHECKING:
    from collections.abc import Callable

# its losses make slack so great that no label dominates another of another speed, and cold tyres that of another time
CROWDED: dict[str, Any] = {
    "graph": "coquimbo",
    "start": {"lat": -29.921, "lon": -71.2514},
    "goal": {"lat": -29.9435, "lon": -71.3466},
    "soc": 1.0,
    "vehicle": LORRY,
    "effects": {"drive_loss_w_per_n2": 4e-4},
    "links": False,
}
# the fastest way takes more than the charge, so that pairs of cost and energy are searched
SHORT_OF_CHARGE: dict[str, Any] = {
    "graph": "highlands",
    "start": {"lat": 44.1808, "lon": -36.8369},
    "goal": {"lat": 44.2653, "lon": -35.4589},
    "soc": 0.4,
    "weights": {"time": 1},
    "links": False,
}


class WatchedBudget(TimeBudget):
    """A budget that keeps when it was asked."""

    def __init__(self, limit_s: float) -> None:
        super().__init__(limit_s)
        self.asked_s = [time.monotonic()]

    @property
    def is_over(self) -> bool:
        """Whether work on it is to stop."""
        self.asked_s.append(time.monotonic())
        return super().is_over


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Service:
    """The use cases on the bundled graphs."""
    return Service(Settings(database_url=database_in(tmp_path_factory.mktemp("searches"))))


def asked(service: Service, body: dict[str, Any], budget: TimeBudget) -> dict[str, Any]:
    """The answer to a route request within a budget."""
    with within(budget):
        answer: dict[str, Any] = json.loads(service.route_json(RouteRequest.model_validate(body)))
    return answer


@pytest.mark.fault("crowded-search")
def test_search_whose_labels_crowd_gives_up_its_proof_and_answers(
    service: Service, record_property: Callable[[str, object], None]
) -> None:
    """Without a limit on comparisons it took a minute and more: 7,000 labels on one link, each compared with all."""
    began = time.monotonic()
    answer = asked(service, CROWDED, TimeBudget())
    record_property("now", f"answered in {time.monotonic() - began:.1f} s, with what it may be short of the best by")
    assert answer["routes"][0]["feasible"]
    assert any("warm" in warning for warning in answer["warnings"])


@pytest.mark.fault("crowded-search")
def test_search_whose_labels_crowd_asks_as_often_as_any_other(service: Service) -> None:
    budget = WatchedBudget(600.0)
    asked(service, CROWDED, budget)
    most_s = max(later - earlier for earlier, later in pairwise(budget.asked_s))
    assert len(budget.asked_s) > 30
    assert most_s < 1.0


@pytest.mark.fault("crowded-search", "long-search")
@pytest.mark.parametrize("body", [CROWDED, SHORT_OF_CHARGE], ids=["crowded", "short of charge"])
@pytest.mark.parametrize("limit_s", [0.005, 0.3])
def test_search_ends_within_a_second_of_its_limit(
    service: Service, body: dict[str, Any], limit_s: float, record_property: Callable[[str, object], None]
) -> None:
    asked(service, body, TimeBudget())  # what a vehicle needs is made
    began = time.monotonic()
    try:
        answered = bool(asked(service, body, TimeBudget(limit_s))["routes"])
    except TimeUpError:
        answered = False
    seconds = time.monotonic() - began
    record_property("now", f"{'answered' if answered else 'ended'} {max(seconds - limit_s, 0.0):.2f} s after its limit")
    assert seconds < limit_s + 1.0
