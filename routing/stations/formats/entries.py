"""Entries of a JSON file one by one, without all of it in memory at once."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from routing.stations.notes import StationFileError, shown

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

LISTS: Final = frozenset(("features", "data", "locations", "fuel_stations", "elements", "stations", "results", "pois"))
FIRST_SLICE: Final = 1 << 14  # letters that are tried for one entry, then eight times as many until
MOST_ENTRY: Final = 1 << 22  # letters; takes up to 100 MB once it is read
MOST_ENTRIES: Final = 1_000_000
MOST_MEMBERS: Final = 1000  # of the object round the list
BETWEEN: Final = re.compile(r"[\s,]*")
BLANK: Final = re.compile(r"\s*")
ALLOWED: Final = "whole JSON: a list of objects, an object with one, or an object a line"


@dataclass(slots=True)
class Entries:
    """Objects of a JSON text. members: of the object round the list, as far as it was read.

    Raises StationFileError while it goes on, for broken JSON, and for entries that are too large, too deep or too many.
    """

    path: str
    text: str
    members: dict[str, Any] = field(default_factory=dict)

    def __iter__(self) -> Iterator[Any]:
        """The entries in order, of any kind."""
        at = self._blank(0)
        if self.text[at : at + 1] == "[":
            at = yield from self._list(at)
            self._check_end(at)
            return
        count = 0
        while self.text[at : at + 1] == "{":
            at = yield from self._object(at)
            at = _end(BETWEEN, self.text, at)
            count += 1
            if count > MOST_ENTRIES:
                raise self._too_many()
        self._check_end(at)

    def _object(self, at: int) -> Generator[Any, None, int]:
        """The entries of the list in an object, or the object itself where no member of it is one; the place behind."""
        members: dict[str, Any] = {}
        listed = False
        begin = at
        at = self._blank(at + 1)
        while self.text[at : at + 1] != "}":
            if len(members) >= MOST_MEMBERS:
                raise self._error(at, f"an object of more than {MOST_MEMBERS} members", ALLOWED)
            name, at = self._value(at)
            at = self._blank(at)
            if not isinstance(name, str) or self.text[at : at + 1] != ":":
                raise self._error(at, "broken JSON", ALLOWED)
            at = self._blank(at + 1)
            if name in LISTS and self.text[at : at + 1] == "[":
                listed = True
                self.members |= members
                at = yield from self._list(at)
            else:
                members[name], at = self._value(at)
                if at - begin > MOST_ENTRY and not listed:
                    raise self._error(begin, f"an object of more than {MOST_ENTRY} letters", ALLOWED)
            at = self._blank(at)
            if self.text[at : at + 1] == ",":
                at = self._blank(at + 1)
            elif self.text[at : at + 1] != "}":
                raise self._error(at, "broken JSON", ALLOWED)
        if listed:
            self.members |= members
        else:
            inner = members.get("data")
            yield inner if isinstance(inner, dict) and "status_code" in members else members
        return at + 1

    def _list(self, at: int) -> Generator[Any, None, int]:
        """The entries of a list; the place behind it."""
        count = 0
        at = self._blank(at + 1)
        while self.text[at : at + 1] != "]":
            value, at = self._value(at)
            count += 1
            if count > MOST_ENTRIES:
                raise self._too_many()
            yield value
            at = self._blank(at)
            if self.text[at : at + 1] == ",":
                at = self._blank(at + 1)
            elif self.text[at : at + 1] != "]":
                raise self._error(at, "broken JSON", ALLOWED)
        return at + 1

    def _value(self, at: int) -> tuple[Any, int]:
        """The value at a place, and the place behind it."""
        size = FIRST_SLICE
        while True:
            part = self.text[at : at + size]
            whole = at + len(part) == len(self.text)
            try:
                value, end = _DECODER.raw_decode(part)
            except RecursionError as error:
                raise self._error(
                    at, "nested too deep", "lists and objects within each other as the formats have them"
                ) from error
            except ValueError as error:
                if whole or size >= MOST_ENTRY:
                    found = f"broken JSON ({_reason(error)})" if whole else f"more than {MOST_ENTRY} letters, or broken"
                    raise self._error(at, found, ALLOWED) from error
            else:
                if end < len(part) or whole:
                    return value, at + end
            size = min(size * 8, MOST_ENTRY) if size < MOST_ENTRY else size + 1

    def _blank(self, at: int) -> int:
        return _end(BLANK, self.text, at)

    def _check_end(self, at: int) -> None:
        at = self._blank(at)
        if at < len(self.text):
            raise self._error(at, f"broken JSON ({shown(self.text[at : at + 40])})", ALLOWED)

    def _too_many(self) -> StationFileError:
        return StationFileError(
            self.path, "", "the file", f"more than {MOST_ENTRIES} entries", f"at most {MOST_ENTRIES}"
        )

    def _error(self, at: int, found: str, allowed: str) -> StationFileError:
        line = self.text.count("\n", 0, at) + 1
        column = at - self.text.rfind("\n", 0, at)
        return StationFileError(self.path, f"line {line}, column {column}", "the text", found, allowed)


def is_json(text: str) -> bool:
    """Whether a text begins as JSON does."""
    return re.match(r"\s*[\[{]", text) is not None


def dicts(value: object, most: int = 1000) -> list[dict[str, Any]]:
    """The objects in a list, at most so many; none where it is no list."""
    return [item for item in value[:most] if isinstance(item, dict)] if isinstance(value, list) else []


def member(value: object, *names: str) -> Any:
    """A value within objects; None where one of them is no object or has no such member."""
    for name in names:
        value = value.get(name) if isinstance(value, dict) else None
    return value


def _end(pattern: re.Pattern[str], text: str, at: int) -> int:
    match = pattern.match(text, at)
    return at if match is None else match.end()


def _reason(error: ValueError) -> str:
    return error.msg if isinstance(error, json.JSONDecodeError) else "a number that is too long"


_DECODER: Final = json.JSONDecoder(parse_constant=lambda _: None)
