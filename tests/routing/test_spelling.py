"""What may be meant by names that are not known."""

from __future__ import annotations

import pytest

from energy.charging.charging import Connector
from routing.spelling import question, similar, similar_choice

PLUGS = tuple(plug.value for plug in Connector)


@pytest.mark.parametrize("plug", PLUGS)
def test_a_choice_is_meant_by_its_name_in_other_letters_and_with_spaces(plug: str) -> None:
    for wrong in (plug.upper(), f" {plug}", "-".join(plug), plug.replace("_", " ").title()):
        assert similar_choice(wrong, PLUGS) == [plug]


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [("ccs", ["ccs2", "ccs1"]), ("chadeom", ["chademo"]), ("x", []), ("", []), ("ccs2" * 50, [])],
)
def test_choices_near_a_wrong_one_are_meant_and_nothing_far_from_all(wrong: str, meant: list[str]) -> None:
    assert similar_choice(wrong, PLUGS) == meant


def test_a_question_names_what_is_meant_or_is_empty() -> None:
    assert question(["a", "b"]) == "; did you mean 'a' or 'b'?"
    assert question([]) == ""


def test_of_many_names_those_beside_the_wrong_one_are_looked_through() -> None:
    known = [f"station {k:05d}" for k in range(5000)]
    assert "station 04999" in similar("station 4999", known[-1500:])
    assert similar("Station 02500", known)[0].startswith("station ")
    assert similar("station 02500x", known)[0] == "station 02500"
