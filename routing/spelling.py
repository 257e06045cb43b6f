"""What may be meant by a name that is not known."""

from __future__ import annotations

import re
from bisect import bisect_left
from difflib import get_close_matches
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

LOOKED_AT: Final = 100  # names on either side of a wrong one, in alphabetical order, that may be meant
MOST_LOOKED_THROUGH: Final = 2000  # names that are looked through as a whole
LONGEST_LIKENED: Final = 100  # characters of a wrong name
MEANT: Final = 2
CLOSE: Final = 0.6
BETWEEN_WORDS: Final = re.compile(r"[\s_\-./]+")


def question(names: Sequence[str]) -> str:
    """What is asked where names may have been meant, or nothing."""
    shown = " or ".join(repr(name) for name in names)
    return f"; did you mean {shown}?" if shown else ""


def similar(wrong: str, known: Sequence[str]) -> list[str]:
    """Known names like a wrong one in any case: of all, or, of many in their order, of those beside it."""
    if len(wrong) > LONGEST_LIKENED:
        return []
    if len(known) > MOST_LOOKED_THROUGH:
        at = bisect_left(known, wrong)
        known = known[max(at - LOOKED_AT, 0) : at + LOOKED_AT]
    by_case = {name.casefold(): name for name in known}
    return [by_case[name] for name in get_close_matches(wrong.casefold(), by_case, n=MEANT, cutoff=CLOSE)]


def similar_choice(wrong: str, choices: Sequence[str]) -> list[str]:
    """Choices like a wrong one, whatever is between its words: the one that it is then, or else those near it."""
    if len(wrong) > LONGEST_LIKENED:
        return []
    bare = {BETWEEN_WORDS.sub("", choice.casefold()): choice for choice in choices}
    word = BETWEEN_WORDS.sub("", wrong.casefold())
    if word in bare:
        return [bare[word]]
    return [bare[name] for name in get_close_matches(word, bare, n=MEANT, cutoff=CLOSE)]
