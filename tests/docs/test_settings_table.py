"""The page of settings is what the settings class says."""

from __future__ import annotations

import re

import pytest
from pydantic import Field

from app.settings import Settings
from docs.settings_table import PAGE, default_of, values_of, with_table

pytestmark = pytest.mark.nojit


def test_page_of_settings_is_what_the_script_writes() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert with_table(page) == page, "run `python -m docs.settings_table`"


def test_page_lists_every_setting_once() -> None:
    page = PAGE.read_text(encoding="utf-8")
    listed = re.findall(r"^\| `JOULEPATH_([A-Z_]+)` \|", page, re.MULTILINE)
    assert [name.lower() for name in listed] == list(Settings.model_fields)


def test_values_say_their_kind_and_bounds() -> None:
    class Some(Settings):
        share: float = Field(default=0.5, gt=0, le=1, description="a share")

    assert values_of(Some.model_fields["share"]) == "number, > 0, ≤ 1"
    assert default_of("share", Some.model_fields["share"]) == "`0.5`"
    assert values_of(Settings.model_fields["graph_dirs"]) == "paths"
    assert default_of("vehicle_dir", Settings.model_fields["vehicle_dir"]) == "the bundled `data/vehicles`"


def test_default_that_differs_between_machines_has_to_be_put_in_words() -> None:
    class Some(Settings):
        made: str = Field(default_factory=lambda: "here", description="made")

    with pytest.raises(ValueError, match="what the default of made is"):
        default_of("made", Some.model_fields["made"])
