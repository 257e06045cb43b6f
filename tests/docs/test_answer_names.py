"""The page on lean answers."""

from __future__ import annotations

from docs.answer_names import PAGE, with_names


def test_page_lists_every_name_that_fields_take() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert with_names(page) == page, "run `python -m docs.answer_names`"
