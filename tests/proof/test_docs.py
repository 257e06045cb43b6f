"""docs/proof.md has the rules that the proof goes by, and has one place for its results."""

from __future__ import annotations

from collections import Counter

import pytest

from app.cli.commands.prove import DEFAULT_SEED
from docs.proof_table import PAGE, with_results
from proof.carriers import HIDDEN
from proof.plans import FASTSIM_EACH, full_plan
from proof.scoring import LEAST_OVERLAP_FRAC, NEAR_M
from proof.worlds.orders import WorldOrder

TEXT = PAGE.read_text(encoding="utf-8")


def test_results_are_renewed_between_their_marks_and_nothing_else_is() -> None:
    first = with_results(TEXT, "first results")
    assert with_results(first, "second results") == with_results(TEXT, "second results")
    assert "first results" in first
    assert first.split("<!-- proof -->")[0] == TEXT.split("<!-- proof -->")[0]


@pytest.mark.parametrize("page", ["", "<!-- proof -->\n", "<!-- /proof --><!-- proof -->\n"])
def test_a_page_without_one_place_for_results_is_refused(page: str) -> None:
    with pytest.raises(ValueError, match="one place"):
        with_results(page, "results")


def test_the_page_names_the_seed_the_hidden_columns_and_the_bounds() -> None:
    for said in (str(DEFAULT_SEED), f"within {NEAR_M:.0f} m", f"at least {LEAST_OVERLAP_FRAC}", *HIDDEN):
        assert said in TEXT


def test_the_page_counts_the_worlds_of_the_whole_plan() -> None:
    plan = full_plan()
    kinds = Counter(order.kind.value for order in plan if isinstance(order, WorldOrder))
    rows = {
        "null": kinds["null"],
        "wrong parameters": kinds["null_wrong_parameters"],
        "single": kinds["single"],
        "several": kinds["several"],
        "confounded": f"{kinds['confounded']} + {kinds['confounded_separated']}",
        "outside": kinds["outside"],
        "few trips": kinds["few_trips"],
        "fastsim": f"{FASTSIM_EACH} + {FASTSIM_EACH}",
    }
    for name, count in rows.items():
        assert f"| {name} | {count} |" in TEXT
    assert kinds["null"] >= 100
