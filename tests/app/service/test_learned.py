"""What is said of learned effects: of causes left open, of nothing, and of ways unlike those they were learned on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from app.conversions.way_limits import WayLimits
from app.schemas.learned_effects import LearnedEffects
from app.service.learned import carries, uncertain_text, warnings_of, warnings_of_way
from tests.app.expected import VEHICLE

if TYPE_CHECKING:
    from starlette.testclient import TestClient

CAR = "hyundai-kona-64"
OPEN = {
    "cause": "Heating the cabin in the cold",
    "rivals": ["Tyres that roll harder in the cold", "Denser air in the cold and at low altitude"],
    "recording": "A recording with ten minutes at standstill.",
}
NAMED = (
    "heating the cabin in the cold could as well be tyres that roll harder in the cold or denser air in the cold and at"
    " low altitude; what would tell: a recording with ten minutes at standstill"
)


def effects(**learned_from: Any) -> LearnedEffects:
    return LearnedEffects.model_validate({"cabin_ua_w_per_k": 150.0, "learned_from": learned_from})


def test_open_causes_are_named_with_the_recording_that_would_tell() -> None:
    found = effects(verdict="cannot_tell", open_causes=[OPEN])
    assert uncertain_text(found) == f"drives that could not tell their causes apart: {NAMED}"
    assert warnings_of(found, CAR) == (
        f"the effects were learned from drives that could not tell their causes apart: {NAMED}",
    )


def test_one_open_cause_beside_clear_ones_is_a_warning_and_nothing_to_refuse() -> None:
    found = effects(verdict="left_out_physics", open_causes=[OPEN])
    assert uncertain_text(found) is None
    (warning,) = warnings_of(found, CAR)
    assert warning == f"the effects were learned from drives that could not tell some of their causes apart: {NAMED}"


@pytest.mark.parametrize(
    ("learned_from", "reason"),
    [
        ({"not_carried": {"all": "they err by 9.0 %"}, "ambient_c": [0.0, 5.0]}, "they err by 9.0 %"),
        ({"verdict": "cannot_tell", "open_causes": [OPEN], "not_carried": {"all": "no better"}}, "no better"),
        ({"verdict": "unexplained", "trips": 7}, "the drives named nothing that routes could use"),
        ({"verdict": "too_few_trips"}, "there were too few drives to learn from"),
    ],
)
def test_nothing_carried_is_said_plainly_and_alone(learned_from: dict[str, Any], reason: str) -> None:
    found = LearnedEffects.model_validate({"learned_from": learned_from})
    assert not carries(found)
    assert uncertain_text(found) is None
    assert warnings_of(found, CAR, -30.0) == (
        f"nothing is carried by the effects, the vehicle is as its file has it: {reason}",
    )
    assert warnings_of_way(found, WayLimits(200.0, (-0.3, 0.3))) == ()


def test_effects_of_unknown_origin_say_nothing() -> None:
    assert warnings_of(LearnedEffects(cabin_ua_w_per_k=100.0), CAR, -30.0) == ()
    assert warnings_of_way(LearnedEffects(cabin_ua_w_per_k=100.0), WayLimits(200.0, (-0.3, 0.3))) == ()


SLOW = "the effects were learned at up to 92 km/h, here up to 130 km/h are driven"


@pytest.mark.parametrize(
    ("limits", "warnings"),
    [
        (WayLimits(97.0, (-0.045, 0.065)), ()),  # near enough
        (WayLimits(130.0, (-0.045, 0.065)), (SLOW,)),
        (
            WayLimits(50.0, (-0.06, 0.12)),
            ("the effects were learned on grades of -4.0 to 6.0 %, here are grades of 12.0 %",),
        ),
        (
            WayLimits(130.0, (-0.11, 0.08)),
            (SLOW, "the effects were learned on grades of -4.0 to 6.0 %, here are grades of -11.0 %"),
        ),
    ],
)
def test_faster_and_steeper_ways_than_those_driven_are_told_once_each(
    limits: WayLimits, warnings: tuple[str, ...]
) -> None:
    assert warnings_of_way(effects(speed_kmh=92.0, grade=[-0.04, 0.06]), limits) == warnings


def test_what_was_not_recorded_warns_of_nothing() -> None:
    assert warnings_of_way(effects(), WayLimits(200.0, (-0.3, 0.3))) == ()


def asked(effects: dict[str, Any]) -> dict[str, tuple[str, dict[str, Any]]]:
    """Requests on the hand-made grid, 50 and 80 km/h, grades up to 60 m on 764 m, by what they ask for."""
    sent = {"vehicle": CAR, "effects": effects}
    return {
        "route": ("/route", {"start": [8.003, 46.5], "goal": [8.02, 46.518], "soc": 0.5, **sent}),
        "range": ("/range", {"origin": [8.003, 46.5], "soc": 0.02, **sent}),
        "links": ("/simulate", {"links": [{"id": 0}], **sent}),
        "chain": ("/simulate", {"chain": [{"length_m": 900, "speed_limit_kmh": 90, "grade": 0.05}], **sent}),
    }


@pytest.mark.parametrize("what", ["route", "range", "links", "chain"])
def test_every_request_is_warned_of_speeds_and_grades_that_were_not_driven(client: TestClient, what: str) -> None:
    learned_from = {"vehicle": CAR, "speed_kmh": 30.0, "grade": [-0.001, 0.001]}
    path, body = asked({"cabin_ua_w_per_k": 150.0, "learned_from": learned_from})[what]
    warnings = client.post(path, json=body).json()["warnings"]
    assert len([text for text in warnings if "learned at up to 30 km/h" in text]) == 1
    assert len([text for text in warnings if "learned on grades of -0.1 to 0.1 %" in text]) == 1
    known = {"vehicle": CAR, "speed_kmh": 90.0, "grade": [-0.2, 0.2]}
    path, body = asked({"cabin_ua_w_per_k": 150.0, "learned_from": known})[what]
    assert not [text for text in client.post(path, json=body).json()["warnings"] if "learned" in text]


def test_conditions_that_slow_a_route_down_take_its_warning_away(client: TestClient) -> None:
    _, body = asked({"cabin_ua_w_per_k": 150.0, "learned_from": {"speed_kmh": 45.0}})["route"]
    told = [
        client.post("/route", json={**body, "conditions": given}).json()["warnings"]
        for given in ({}, {"top_speed_kmh": 40})
    ]
    assert ["here up to 80 km/h" in " ".join(warnings) for warnings in told] == [True, False]


def test_requests_with_effects_of_open_causes_are_answered_with_a_warning_that_names_them(client: TestClient) -> None:
    sent = {"cabin_ua_w_per_k": 150.0, "learned_from": {"verdict": "cannot_tell", "open_causes": [OPEN]}}
    for path, body in asked(sent).values():
        response = client.post(path, json=body)
        assert response.status_code == 200
        assert NAMED in " ".join(response.json()["warnings"])
    inline = client.post("/route", json={**asked(sent)["route"][1], "vehicle": VEHICLE}).json()
    assert NAMED in " ".join(inline["warnings"])
