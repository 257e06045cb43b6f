"""What roads are called, and when two are one road to a driver."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

from routing.graph.signs import NO_SIGN

if TYPE_CHECKING:
    from routing.graph.road_graph import RoadGraph
    from routing.graph.signs import RoadSign


_WORD: Final = re.compile(r"\w+")
_NUMBER: Final = re.compile(r"[a-z]{1,2}\d{1,4}[a-z]?")
_SMALL_WORDS: Final = frozenset(
    (
        *("a", "o", "e", "y", "d", "de", "da", "do", "das", "dos", "del", "della", "delle", "di", "du", "des", "dal"),
        *("el", "il", "la", "le", "les", "lo", "los", "las", "of", "the", "van", "von", "der", "die", "den", "dem"),
    )
)


class Label(NamedTuple):
    """A road's name and number, empty where it has none; folded, refs: the same to compare by."""

    name: str
    ref: str
    folded: str
    refs: frozenset[str]

    @property
    def known(self) -> bool:
        """Whether the road has either."""
        return bool(self.name or self.ref)


class Labels:
    """Labels and signs of the links of a graph, each made once.

    language: in which names are told where they are tagged in it, as `de`; empty for those on the signs.
    """

    def __init__(self, graph: RoadGraph, language: str = "") -> None:
        self._language = language
        self._names = graph.names
        self._name_idx = graph.name_idx
        self._signs = graph.signs
        self._known: dict[tuple[int, int], Label] = {}

    def sign(self, link: int) -> RoadSign:
        """What is read on a link."""
        signs = self._signs
        return NO_SIGN if signs is None else signs.signs[signs.sign_idx[link]]

    def label(self, link: int) -> Label:
        """A link's name and number."""
        signs = self._signs
        key = (int(self._name_idx[link]), -1 if signs is None else int(signs.sign_idx[link]))
        known = self._known.get(key)
        if known is None:
            sign = self.sign(link)
            name = self._names[key[0]] if self._names else ""
            if self._language:
                name = next((text for language, text in sign.names if language == self._language), name)
            known = self._known[key] = label_of(name, sign.ref)
        return known


@lru_cache(maxsize=1 << 16)
def label_of(name: str, ref: str) -> Label:
    """A label; a name that is the number is none, as the import writes it for roads without a name."""
    name = "" if name == ref else name.strip()
    folded = _folded(name)
    numbers = {_number(text) for text in ref.split(";")} - {""}
    shown = ", ".join(part for text in ref.split(";") if (part := text.strip()))
    if _NUMBER.fullmatch(_number(name)):  # a number that is written as the name, with the number or without it
        return Label(name if not numbers else "", shown, "", frozenset({*numbers, _number(name)}))
    return Label(name, shown, folded, frozenset(numbers))


def _number(text: str) -> str:
    return "".join(c for c in text.casefold() if c.isalnum())


def _folded(name: str) -> str:
    """A name without accents, capitals and small words, which maps write now and then: what two of one road share."""
    plain = "".join(c for c in unicodedata.normalize("NFD", name.casefold()) if not unicodedata.combining(c))
    words = _WORD.findall(plain)
    return " ".join([word for word in words if word not in _SMALL_WORDS] or words)


def same_road(label: Label, other: Label) -> bool:
    """Whether two labels are of one road.

    They have the same name; or one is without a name, or its name is part of the other's, and a number is the same.
    """
    if label.folded and other.folded and label.folded != other.folded:
        within = f" {label.folded} " in f" {other.folded} " or f" {other.folded} " in f" {label.folded} "
        return within and not label.refs.isdisjoint(other.refs)
    return bool(label.folded and other.folded) or not label.refs.isdisjoint(other.refs)
