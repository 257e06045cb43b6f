"""Pages name only code that is there, and their prose keeps to the width of a line."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest

from docs.wrap import WIDTH, pages, too_long, wrapped
from tests.docs.named_code import ROOT, named_in

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.nojit

# what was decided, and what changed, keeps the names of its day
PAGES = [page for page in pages() if page.parent.name != "adr" and page.name != "CHANGELOG.md"]
WRITTEN = [page for page in PAGES if page.parent.name in ("docs", "tutorials")]
SENTENCE_END = re.compile(r"(?<=[.:?])\s+(?=[A-Z`*])")
MOST_WORDS = 32
MOST_NAMED = {"architecture.md": 150, "glossary.md": 60}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_and_functions_that_a_page_names_exist(page: Path) -> None:
    named = named_in(page)
    missing = [f"`{each.text}`: there is no {each.missing}" for each in named if each.missing is not None]
    assert not missing, f"mend {page.relative_to(ROOT)}, which names what is gone or renamed:\n" + "\n".join(missing)
    assert len(named) >= MOST_NAMED.get(page.name, 0), "so few are found that the page's notation is no longer read"


@pytest.mark.parametrize(
    "text", ["energy/nowhere.py", "energy/units.py: nothing", "routing/nowhere/", "energy.units.nothing"]
)
def test_what_is_not_there_is_found(tmp_path: Path, text: str) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        f"see `{text}` and `energy/units.py: JOULE_PER_KWH` and `energy.chain.chain.Chain`\n", encoding="utf-8"
    )
    assert [each.text for each in named_in(page) if each.missing is not None] == [text]


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.name)
def test_page_opens_with_what_it_is_for_in_a_few_short_sentences(page: Path) -> None:
    title, opening = page.read_text(encoding="utf-8").split("\n\n")[:2]
    assert title.startswith("# ")
    assert not opening.startswith(("|", "```", "- ", "!", "<", "#")), "it opens with no prose"
    sentences = SENTENCE_END.split(opening)
    assert 2 <= len(sentences) <= 5, sentences
    for sentence in sentences:
        assert len(sentence.split()) <= MOST_WORDS, f"too dense: {sentence}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_prose_of_a_page_keeps_to_the_width(page: Path) -> None:
    lines = too_long(page.read_text(encoding="utf-8"))
    assert not lines, f"lines {lines} are longer than {WIDTH} characters: run `python -m docs.wrap`"


def test_wrapping_leaves_tables_code_and_lists_what_they_are() -> None:
    word = "lorem "
    kept = f"# {word * 30}\n\n| {word * 30} |\n\n```text\n{word * 30}\n```\n\n<!-- x -->\n{word * 30}\n<!-- /x -->\n"
    page = f"{kept}\n- {word * 30}and\n- short\n\n{word * 15}- {word * 10}\n"
    lines = wrapped(page).split("\n")
    assert lines[:12] == kept.split("\n")
    assert lines[12].startswith("- lorem")
    assert lines[13].startswith("  lorem")
    assert "- short" in lines
    assert all(len(line) <= WIDTH for line in lines[12:])
    assert not any(line.startswith("- lorem") for line in lines[13:])
    assert wrapped("\n".join(lines)) == "\n".join(lines)
