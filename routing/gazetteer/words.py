"""Names and queries as words: folded, split, and what stands for what."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from itertools import pairwise
from typing import Final

MOST_QUERY_CHARS: Final = 200
MOST_QUERY_WORDS: Final = 12
MOST_WORD_CHARS: Final = 40
LEAST_JOINED: Final = 4  # characters of what stands before a kind of street that is written together with it

_LETTERS: Final = str.maketrans({"æ": "ae", "ø": "o", "œ": "oe", "ł": "l", "đ": "d", "ð": "d", "þ": "th", "ı": "i"})
_POSTCODE: Final = re.compile(r"\b(\d{4,5})-(\d{3,4})\b")
_ASCII_WORD: Final = re.compile(r"[a-z0-9]+")
_NUMBER: Final = re.compile(r"\d{1,5}[a-z]?\Z")
_IDEOGRAPH: Final = re.compile(r"([\u3040-\u30ff\u3400-\u9fff\uf900-\ufaff])")
_UMLAUTS: Final = (("ae", "a"), ("oe", "o"), ("ue", "u"))

# abbreviations on signs and in addresses, each with what it may stand for; several on a line
_TABLE: Final = """
r rua rue, av avenida avenue avinguda, ave avenue avenida, avda avenida avinguda, avd avenida, avgda avinguda
al alameda, tv travessa, trav travessa, tr travessa, pc praca, pca praca placa, pr praca, pl placa plaza place platz
lg largo, lgo largo, estr estrada, est estrada estacao, rod rodovia, bc beco, c calle carrer, cl calle
ctra carretera, crta carretera, bd boulevard, blvd boulevard, bvd boulevard, bld boulevard, str strasse, pltz platz
hbf hauptbahnhof, bhf bahnhof, st saint sankt street sant santo, ste sainte, sta santa, sto santo
s sao san santo santa sant, snt sankt, d dom dona, da dona, dr doutor doktor doctor drive, dra doutora
eng engenheiro, prof professor, profa professora, gen general, gal general, cel coronel, mal marechal
cap capitao, com comendador, cons conselheiro, pe padre, fr frei, vis visconde, pres presidente, gov governador
sen senador, dep deputado, min ministro, alm almirante, ten tenente, sra senhora, sr senhor, n nossa, ns nossa
vl vila, jd jardim, rd road, ln lane, sq square, ct court, hwy highway, pkwy parkway, hosp hospital
univ universidade university universitat, aerop aeroporto, v via, vle viale, p piazza, pza plaza piazza, ul ulica
"""
SHORT_FORMS: Final = {
    short: tuple(longs) for short, *longs in (entry.split() for entry in _TABLE.replace("\n", ",").split(",") if entry)
}
_LONG_FORMS: Final = {long: short for short, longs in SHORT_FORMS.items() for long in longs if len(short) > 1}

_CONNECTORS: Final = """
a o as os e de da do das dos d del della delle dei di du des le la les el els los las l y i en na no am an der die das
den dem und zu zur zum im in the of and at on van het
"""
_STREETS: Final = """
rua avenida travessa praca largo alameda estrada beco viela calcada rodovia via caminho escadas ladeira rue avenue
boulevard place chemin quai impasse carrer calle avinguda placa plaza passeig carretera cami passatge strasse weg platz
gasse allee ring ufer street road lane drive square court highway piazza viale corso ulica vicolo strada straat laan
plein
"""
# words that names and queries have or lack without meaning anything else by it
CONNECTORS: Final = frozenset(_CONNECTORS.split())
# kinds of streets, which are often left out or wrong
STREET_WORDS: Final = frozenset(_STREETS.split())
_JOINED_ENDS: Final = ("strasse", "platz", "weg", "gasse", "allee", "ring", "ufer", "markt", "straat", "laan", "plein")


@lru_cache(maxsize=65536)
def folded(text: str) -> str:
    """A text in small letters without marks: what is the same to who types it."""
    if text.isascii():
        return text.lower()
    small = unicodedata.normalize("NFKD", text.casefold()).translate(_LETTERS)
    return "".join(c for c in small if not unicodedata.combining(c))


@lru_cache(maxsize=65536)
def words_of(text: str) -> tuple[str, ...]:
    """The words of a name or a query, folded, in their order; a postal code is one word."""
    plain = folded(text)
    if "-" in plain:
        plain = _POSTCODE.sub(r"\1\2", plain)
    if plain.isascii():
        words = _ASCII_WORD.findall(plain)
    else:
        plain = _IDEOGRAPH.sub(r" \1 ", plain)
        words = "".join(c if c.isalnum() or unicodedata.category(c)[0] == "M" else " " for c in plain).split()
    return tuple(_spelled_out(word[:MOST_WORD_CHARS]) for word in words)


def _spelled_out(word: str) -> str:
    """Leopoldstr as Leopoldstrasse; str by itself stays."""
    return word[:-3] + "strasse" if word.endswith("str") and len(word) > LEAST_JOINED else word


def joined_words(words: tuple[str, ...]) -> tuple[str, ...]:
    """What may be written as a single word of a name: `sendlinger strasse` as `sendlingerstrasse`, `a 28` as `a28`."""
    return tuple(
        first + second
        for first, second in pairwise(words)
        if (second in _JOINED_ENDS and len(first) >= LEAST_JOINED)
        or (second.isdigit() and len(first) < LEAST_JOINED and len(words) < LEAST_JOINED)
    )


def is_number(word: str) -> bool:
    """Whether a word may be a house number."""
    return bool(_NUMBER.match(word))


def house_number(text: str) -> str:
    """A house number as it is looked up: `12 A` as `12a`."""
    return "".join(words_of(text))[:MOST_WORD_CHARS]


def number_value(number: str) -> int | None:
    """The whole number that a house number begins with."""
    digits = re.match(r"\d{1,6}", number)
    return int(digits[0]) if digits else None


def meant_by(word: str) -> dict[str, float]:
    """Words that are meant by one, beside itself, with how surely, 0..1."""
    meant = dict.fromkeys(SHORT_FORMS.get(word, ()), 0.96)
    if word in _LONG_FORMS:
        meant[_LONG_FORMS[word]] = 0.96
    for long, short in _UMLAUTS:
        if long in word:
            meant.setdefault(word.replace(long, short), 0.98)
    return meant


def grams_of(word: str) -> set[str]:
    """The trigrams of a word, with a mark at its begin."""
    marked = f"^{word}"
    return {marked[k : k + 3] for k in range(len(marked) - 2)}
