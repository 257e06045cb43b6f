"""Elements of a page: whatever is not markup already is escaped where it enters one."""

from __future__ import annotations

import html
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from diagnosis.report.text import NONE, decimals, fixed, number

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from diagnosis.answer.results import Interval

VALUE_DIGITS: Final = 6
_VOID: Final = frozenset({"meta", "link", "br", "hr", "img", "input"})
_NO_TEXT: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ufffe\uffff]")


class Html(str):
    """Markup that is safe as it stands; any other string is text and is escaped."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Header:
    """Head of a table's column, and whether numbers stand below it, which are aligned to the right."""

    text: str
    numeric: bool = False


def element(tag: str, /, *children: str | None, **attributes: str | float | None) -> Html:
    """One element; None among children or attributes is left out, class_ gives class, data_x gives data-x."""
    opening = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{_attribute(value)}"'
        for key, value in attributes.items()
        if value is not None
    )
    if tag in _VOID:
        return Html(f"<{tag}{opening}>")
    return Html(f"<{tag}{opening}>{joined(children)}</{tag}>")


def joined(children: Iterable[str | None]) -> Html:
    """Markup and texts one after another."""
    return Html(
        "".join(child if isinstance(child, Html) else escaped(child) for child in children if child is not None)
    )


def escaped(text: str) -> Html:
    """A text as markup shows it; characters that are not text, or that turn its direction, become �."""
    plain = _NO_TEXT.sub("\ufffd", text).encode("utf-8", "replace").decode("utf-8")
    return Html(html.escape(plain, quote=True))


def data(value: float, text: str) -> Html:
    """A number as text, with its value to VALUE_DIGITS beside it for machines; the text alone if it is not finite."""
    if not math.isfinite(value):
        return escaped(text)
    return element("data", text, value=f"{value:.{VALUE_DIGITS}g}")


def cell(value: float, interval: Interval = None, *, signed: bool = False) -> Html:
    """A number for a table, rounded to its interval."""
    return data(value, number(value, interval, signed=signed))


def interval_cell(value: float, interval: Interval, *, signed: bool = False) -> Html:
    """The interval of a value for a table, rounded alike; a dash where there is none."""
    if interval is None:
        return escaped(NONE)
    places = decimals(value, interval)
    low, high = (data(bound, fixed(bound, places, signed=signed)) for bound in interval)
    return joined((low, " to ", high))


def headers(*texts: str) -> list[Header]:
    """Heads of a table whose first column names the row and whose others hold numbers."""
    return [Header(text, numeric=k > 0) for k, text in enumerate(texts)]


def paragraphs(*texts: str | None, class_: str | None = None) -> Html:
    """One paragraph for each text that says something."""
    return joined(element("p", text, class_=class_) for text in texts if text)


def items(texts: Iterable[str]) -> Html:
    """A list with bullets."""
    return element("ul", *(element("li", text) for text in texts))


def table(
    caption: str, headers: Sequence[Header], rows: Iterable[Sequence[str]], total: Sequence[str] | None = None
) -> Html:
    """A table that scrolls by itself where it is too wide; the first cell of each row, and of the total, heads it."""
    head = element(
        "tr", *(element("th", one.text, scope="col", class_="n" if one.numeric else None) for one in headers)
    )
    body = [_row(row, headers) for row in rows]
    whole = element(
        "table",
        element("caption", caption),
        element("thead", head),
        element("tbody", *body),
        None if total is None else element("tfoot", _row(total, headers)),
    )
    return element("div", whole, class_="scroll", tabindex="0", role="region", aria_label=caption)


def folded(summary: str, *children: str | None) -> Html:
    """What opens on demand, without a script."""
    return element("details", element("summary", summary), *children)


def _row(cells: Sequence[str], headers: Sequence[Header]) -> Html:
    first, *others = cells
    return element(
        "tr",
        element("th", first, scope="row"),
        *(
            element("td", cell, class_="n" if header.numeric else None)
            for cell, header in zip(others, headers[1:], strict=True)
        ),
    )


def _attribute(value: str | float) -> str:
    """Coordinates to a tenth of a pixel keep pictures small."""
    if isinstance(value, str):
        return escaped(value)
    text = f"{value:.1f}".removesuffix(".0")
    return "0" if text == "-0" else text
