from __future__ import annotations

import numpy as np
import pytest

from proof.worlds.share import ShareError, energy_share, scaled


def test_share_counts_gains_and_losses_of_trips_alike() -> None:
    # trips of 10 and 12 J with the effect, 9 and 13 J without: (1 + 1)/22
    assert energy_share(np.array([10.0, 12.0]), np.array([9.0, 13.0])) == pytest.approx(2.0 / 22.0)


@pytest.mark.parametrize("guess", [0.01, 1.0, 9.0])
def test_scaled_finds_the_strength_of_a_bent_share_from_any_guess(guess: float) -> None:
    strength = scaled(lambda s: 1.0 - np.exp(-0.2 * s), 0.5, 10.0, "any", guess)
    assert strength == pytest.approx(np.log(2.0) / 0.2, rel=1e-3)


def test_scaled_finds_a_share_that_begins_only_at_some_strength() -> None:
    # as recuperation that is capped: nothing happens until the cap is low enough
    assert scaled(lambda s: max(s - 2.0, 0.0) * 0.1, 0.12, 5.0, "any") == pytest.approx(3.2, rel=1e-3)


def test_scaled_names_effect_and_reach_where_the_share_is_out_of_reach() -> None:
    with pytest.raises(ShareError, match=r"share of roof_box is 0\.120, allowed: up to 0\.040, at strength 2") as found:
        scaled(lambda s: 0.02 * s, 0.12, 2.0, "roof_box")
    assert (found.value.effect, found.value.reached) == ("roof_box", pytest.approx(0.04))
