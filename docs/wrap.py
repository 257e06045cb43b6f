"""Paragraphs of the pages wrapped at 120 characters: `python -m docs.wrap [FILE]...`, without files all pages.

Tables, code, headings, what scripts write between two marks, and paragraphs whose lines are short enough stay.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
WIDTH: Final = 120
ITEM: Final = re.compile(r"(?P<indent> *)(?P<mark>(?:[-*+]|\d+[.)]) +)?")
NOT_PROSE: Final = re.compile(r" *(?:\||#|<|!?\[[^]]*\]:|>|```|~~~|    )")
MARK: Final = re.compile(r"<!-- (/?)[\w -]+ -->")  # around what a script writes
GLUED: Final = re.compile(r"(?:[-*+]|#+|=+|-+|\d+[.)])$|[>|]|```|~~~")  # begins no line, where it would mean something


def pages() -> list[Path]:
    """All pages that people write, but for the licence; those of the reference are written from the code."""
    found = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("deploy/*.md"), *ROOT.glob("data/**/*.md")]
    return sorted(page for page in found if page.parent != ROOT / "docs" / "reference")


def wrapped(page: str) -> str:
    """The page with those of its paragraphs wrapped anew that have a line longer than WIDTH."""
    lines: list[str] = []
    paragraph: list[str] = []
    fenced = written = False

    def close() -> None:
        lines.extend(_wrapped(paragraph) if any(len(line) > WIDTH for line in paragraph) else paragraph)
        paragraph.clear()

    for line in page.split("\n"):
        fence = line.lstrip().startswith(("```", "~~~"))
        if mark := MARK.fullmatch(line.strip()):
            written = not mark[1]
        if fence or fenced or written or not line.strip():
            close()
            lines.append(line)
            fenced ^= fence
        elif not paragraph and NOT_PROSE.match(line):
            lines.append(line)
        elif paragraph and (_mark(line) or NOT_PROSE.match(line.strip())):
            close()
            (paragraph if _mark(line) else lines).append(line)
        else:
            paragraph.append(line)
            if line.endswith("  "):  # a break that is meant
                close()
    close()
    return "\n".join(lines)


def too_long(page: str) -> list[int]:
    """Numbers of the lines of prose longer than WIDTH."""
    lines = wrapped(page).split("\n")
    if lines != page.split("\n"):
        return [k for k, line in enumerate(page.split("\n"), 1) if len(line) > WIDTH and not line.startswith("|")]
    return []


def _mark(line: str) -> str | None:
    found = ITEM.match(line)
    return found["mark"] if found else None


def _wrapped(paragraph: list[str]) -> list[str]:
    first = ITEM.match(paragraph[0])
    assert first is not None, "matches any line"
    indent = first["indent"] + " " * len(first["mark"] or "")
    words: list[str] = []
    for word in " ".join(line.strip() for line in paragraph)[len(first["mark"] or "") :].split(" "):
        if words and GLUED.match(word):
            words[-1] += f" {word}"
        else:
            words.append(word)
    lines, line = [], f"{first['indent']}{first['mark'] or ''}{words[0]}"
    for word in words[1:]:
        if len(line) + 1 + len(word) > WIDTH:
            lines.append(line)
            line = f"{indent}{word}"
        else:
            line += f" {word}"
    return [*lines, line]


if __name__ == "__main__":
    for path in [Path(name) for name in sys.argv[1:]] or pages():
        text = path.read_text(encoding="utf-8")
        if wrapped(text) != text:
            path.write_text(wrapped(text), encoding="utf-8")
