"""What is asked: the words of a text, what each may mean, and how well names fit them."""

from __future__ import annotations

import operator
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from rapidfuzz.distance import OSA

from routing.gazetteer.words import (
    CONNECTORS,
    MOST_QUERY_CHARS,
    MOST_QUERY_WORDS,
    STREET_WORDS,
    grams_of,
    is_number,
    meant_by,
    words_of,
)

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Sequence

_NUMERO: Final = re.compile(r"\b[nN](?:\.?\s?[º°]|\.\s?o|[rR]|[uU][mM]|\.)\.?\s?(?=\d)|#(?=\d)")  # as in n.º 12
JOINED: Final = 0.97  # of two words that were typed apart and are one
LEAST_OPEN: Final = 3  # characters of a word before the last that may be the beginning of one
REGION: Final = 0.9  # how well a word that names the whole map fits what lies on it
LEAST_PREFIX: Final = 0.7  # how well a word fits that only begins as another does; more, the more of it is there
OTHER_NAME: Final = 0.985  # of a match with a name that is not the thing's own
AROUND: Final = 0.94  # of what a word adds that is found in what a thing is part of, against one of its name
MOST_LIKE: Final = 12  # words like one that was typed
MOST_BY_GRAMS: Final = 60
WEIGHT: Final = {"connector": 0.12, "street": 0.45, "number": 0.5, "short": 0.35}
NAME_SHARE: Final = 0.25  # how much it counts that a name has nothing beside what was asked


@dataclass(slots=True)
class Word:
    """A word of a text.

    forms: whole words that it may stand for, with how surely, 0..1. open: it may be the beginning of a word. is_known:
    the index has it, or a word that begins with it. is_light: things need not have it. is_region: it names the whole
    map. has_likes: the index has words that are spelled alike.
    """

    text: str
    weight: float
    forms: dict[str, float] = field(default_factory=dict)
    open: bool = False
    is_number: bool = False
    is_light: bool = False
    is_known: bool = False
    is_region: bool = False
    has_likes: bool = False


class Question:
    """The words of a text and how well other words fit them.

    Words that the index has not are looked for by their spelling.
    """

    def __init__(self, database: sqlite3.Connection, text: str, region_words: Sequence[str] = ()) -> None:
        self._database = database
        texts = list(words_of(_NUMERO.sub(" ", text[:MOST_QUERY_CHARS])))[:MOST_QUERY_WORDS]
        ended = text[-1:].isspace() or text[-1:] in ",;."
        self.words = [_word(word) for word in texts]
        if self.words and not ended:
            self.words[-1].open = not self.words[-1].is_number
        self._fits: dict[str, list[tuple[int, float]]] = {}
        for k, word in enumerate(self.words):
            word.forms |= {word.text: 1.0, **meant_by(word.text)}
            if k + 1 < len(texts) and not word.is_number and (not texts[k + 1].isdigit() or len(word.text) < 4):
                word.forms[word.text + texts[k + 1]] = JOINED
            if k and not texts[k - 1].isdigit() and (not word.is_number or len(texts[k - 1]) < 4):
                word.forms[texts[k - 1] + word.text] = JOINED
        for k, parts in enumerate(zip(texts, texts[1:], texts[2:], strict=False)):
            if not any(part.isdigit() for part in parts):
                for word in self.words[k : k + 3]:
                    word.forms["".join(parts)] = JOINED
        for word in self.words:
            word.is_known = self._is_known(word)
            word.is_region = word.text in region_words
            if not word.is_known and not word.is_number and not word.is_region:
                word.open = word.open or len(word.text) >= LEAST_OPEN
                word.is_known = word.open and self._is_known(word)
                if not word.is_known:
                    self.look_for_spelling(word)

    def _is_known(self, word: Word) -> bool:
        for form in word.forms:
            if self._database.execute("SELECT 1 FROM vocabulary WHERE word = ?", (form,)).fetchone():
                return True
        if not word.open:
            return False
        last = word.text + "\U0010ffff"
        found = self._database.execute("SELECT 1 FROM vocabulary WHERE word BETWEEN ? AND ?", (word.text, last))
        return found.fetchone() is not None

    def look_for_spelling(self, word: Word) -> None:
        """Add words of the index that are spelled alike to what a word may stand for."""
        text = word.text
        if len(text) < 3 or word.is_number:
            return
        grams = sorted(grams_of(text))
        marks = ",".join("?" * len(grams))
        rows = self._database.execute(
            f"SELECT v.word, v.count FROM (SELECT word, count(*) AS n FROM grams WHERE gram IN ({marks}) "
            "GROUP BY word ORDER BY n DESC LIMIT ?) AS g JOIN vocabulary AS v ON v.id = g.word",
            (*grams, MOST_BY_GRAMS),
        ).fetchall()
        most = 1 if len(text) < 6 else 2 if len(text) < 10 else 3
        alike = []
        for other, count in rows:
            away = OSA.distance(text, other, score_cutoff=most)
            quality = 1.0 - 0.9 * away / len(text) if away <= most else 0.0
            if word.open and len(other) > len(text) > 3:
                cut = min(OSA.distance(text, other[: len(text) + k], score_cutoff=most) for k in (-1, 0, 1))
                if cut <= most:
                    whole = len(text) / len(other)
                    quality = max(quality, (1.0 - 0.9 * cut / len(text)) * (LEAST_PREFIX + 0.25 * whole))
            if quality > 0.5:
                alike.append((quality, count, other))
        for quality, _, other in sorted(alike, reverse=True)[:MOST_LIKE]:
            if quality > word.forms.get(other, 0.0):
                word.forms[other] = quality
                word.has_likes = True
        self._fits = {}

    def look_for_all_spellings(self) -> None:
        """The same for every word that may be mistyped though the index has it."""
        for word in self.words:
            if word.is_known and not word.is_light:
                self.look_for_spelling(word)

    def fits(self, word: str) -> list[tuple[int, float]]:
        """The words asked that another one fits, by position, each with how well, 0..1."""
        known = self._fits.get(word)
        if known is None:
            known = []
            for k, asked in enumerate(self.words):
                quality = asked.forms.get(word, 0.0)
                if asked.open and len(word) > len(asked.text) and word.startswith(asked.text):
                    whole = len(asked.text) / len(word)
                    quality = max(quality, LEAST_PREFIX + (1.0 - LEAST_PREFIX) * whole**0.5)
                if quality > 0.0:
                    known.append((k, quality))
            self._fits[word] = known
        return known

    def match(self, names: str, around: str) -> tuple[float, list[float]]:
        """How well a thing fits, 0..1, and how well it fits each word; names: its names, split by bars."""
        nearby = [REGION if word.is_region else 0.0 for word in self.words]
        for word in around.split():
            for k, quality in self.fits(word):
                nearby[k] = max(nearby[k], quality * AROUND)
        best, best_each = 0.0, nearby
        total = sum(word.weight for word in self.words)
        for position, name in enumerate(names.split("|")):
            own = name.split()
            each = list(nearby)
            weights, fitting = [_weight(text) for text in own], [0.0] * len(own)
            for at, text in enumerate(own):
                for k, quality in self.fits(text):
                    each[k] = max(each[k], quality)
                    fitting[at] = max(fitting[at], quality)
                if at:
                    for k, quality in self.fits(own[at - 1] + text):
                        each[k] = max(each[k], quality * JOINED)
                        fitting[at - 1 : at + 1] = (max(fitting[at - 1], quality), max(fitting[at], quality))
            has_weight, matched = sum(weights), sum(map(operator.mul, weights, fitting))
            if matched == 0.0 or total == 0.0:
                continue
            asked = sum(word.weight * quality for word, quality in zip(self.words, each, strict=True)) / total
            match = asked * (1.0 - NAME_SHARE + NAME_SHARE * matched / has_weight) * (OTHER_NAME if position else 1.0)
            if match > best:
                best, best_each = match, each
        return best, best_each

    def needed(self) -> list[int]:
        """Positions of words that things must have: all but numbers, connectors and what is not known."""
        asked = [k for k, word in enumerate(self.words) if word.is_known or word.has_likes]
        heavy = [k for k in asked if not (self.words[k].is_number or self.words[k].is_light)]
        return [k for k in heavy if not self.words[k].is_region] or heavy or asked

    def numbers(self) -> list[int]:
        """Positions of words that may be house numbers or parts of names."""
        return [k for k, word in enumerate(self.words) if word.is_number]

    def expression(self, positions: Sequence[int]) -> str:
        """What the index is asked for: things with all of some words."""
        parts = []
        for k in positions:
            word = self.words[k]
            forms = [f'"{form}"' for form in word.forms]
            if word.open:
                forms.append(f'"{word.text}"*')
            parts.append(f"({' OR '.join(forms)})")
        return " AND ".join(parts)


def _word(text: str) -> Word:
    number = is_number(text) or (text.isdigit() and len(text) < 9)
    return Word(text, _weight(text), is_number=number, is_light=text in CONNECTORS or (len(text) < 3 and not number))


def _weight(text: str) -> float:
    if text in CONNECTORS:
        return WEIGHT["connector"]
    if text in STREET_WORDS:
        return WEIGHT["street"]
    if is_number(text):
        return WEIGHT["number"]
    return WEIGHT["short"] if len(text) < 3 else 1.0
