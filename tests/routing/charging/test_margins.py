"""What is learnt of the margins of arcs: after a charge, and after stations that are passed."""

from __future__ import annotations

import pytest

from routing.charging.margins import Margins, Taken
from routing.charging.network import Arc, Part
from routing.charging.ways import Way

CAPACITY_J = 1e6
WAY = Way(60.0, 1e5, 1e5, 0.0, 1e5)
ARC = Arc(2, WAY, 60.0, 1e3, (Part(1, 2, WAY, margin_j=1e3),))


def taken(margin_j: float, *, kept_frac: float = 0.9, passes: bool = False) -> Taken:
    return Taken(ARC, 2e5, 2e5 + margin_j, kept_frac, 1.0, passes)


def learnt(margins: Margins, drive: Taken) -> bool:
    return margins.learn([drive], 0.9, CAPACITY_J)


def test_margins_are_a_factor_of_the_least_until_they_are_learnt() -> None:
    margins = Margins()
    margins.factor = 1.5
    assert margins.of(ARC) == 1.5e3
    assert not learnt(margins, taken(4e3))
    assert margins.of(ARC) == 4e3
    assert margins.is_known(ARC)
    assert margins.places() == {1}
    assert learnt(margins, taken(4e3))


def test_an_arc_that_passes_a_station_keeps_the_more_of_both_so_that_plans_settle() -> None:
    margins = Margins()
    learnt(margins, taken(3e3))
    assert not learnt(margins, taken(7e3, kept_frac=0.7, passes=True))
    assert margins.of(ARC) == 7e3
    assert learnt(margins, taken(3e3))  # after a charge it needs less, and does not go back and forth
    assert margins.of(ARC) == 7e3
    assert learnt(margins, taken(7e3, passes=True))
    assert margins.may_be_too_large


def test_relaxed_margins_are_no_larger_than_an_arc_needs_after_a_charge() -> None:
    margins = Margins()
    learnt(margins, taken(7e3, kept_frac=0.7, passes=True))
    margins.is_relaxed = True
    assert margins.of(ARC) == 1e3
    learnt(margins, taken(3e3))
    assert margins.of(ARC) == 3e3
    margins.is_relaxed = False
    assert margins.of(ARC) == 7e3


def test_an_arc_that_is_not_sure_enough_with_its_margin_gets_more() -> None:
    margins = Margins()
    learnt(margins, taken(3e3))
    assert not learnt(margins, taken(3e3, kept_frac=0.89))
    assert margins.of(ARC) == pytest.approx(5e3)
