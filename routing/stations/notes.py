"""What a reader of charging stations says: why a file is refused, why a station of it is left out."""

from __future__ import annotations

from typing import Final

from energy.errors import Refusal
from routing.errors import RoutingError

MOST_SHOWN: Final = 80


class StationFileError(Refusal, RoutingError):
    """A file of charging stations that can't be read: names file, row or entry, field, value and what is allowed."""

    def __init__(self, path: str, where: str, field: str, value: object, allowed: str) -> None:
        self.path = path
        self.where = where
        at = f"{path}, {where}" if where else path
        super().__init__(field, value, allowed, subject=f"{at}: {field}")

    def __reduce__(self) -> tuple[type[StationFileError], tuple[object, ...]]:
        return type(self), (self.path, self.where, self.field, self.value, self.allowed)


class LeftOutError(Refusal, RoutingError):
    """A station of a file that is left out, and the others are read: reason is one of a few, by which they count."""

    def __init__(self, reason: str, field: str, value: object, allowed: str, hint: str = "") -> None:
        self.reason = reason
        self.hint = hint
        super().__init__(field, value, allowed, message=f"{field} is {value}, allowed: {allowed}{hint}")

    def __reduce__(self) -> tuple[type[LeftOutError], tuple[object, ...]]:
        return type(self), (self.reason, self.field, self.value, self.allowed, self.hint)


def shown(value: object) -> str:
    """A value of a file as a message quotes it: printable, at most 80 characters."""
    text = value if isinstance(value, str) else _plain(value)
    printable = "".join(letter if letter.isprintable() else "?" for letter in text[: MOST_SHOWN + 1])
    return printable if len(printable) <= MOST_SHOWN else f"{printable[: MOST_SHOWN - 3]}..."


def _plain(value: object) -> str:
    """A value that is no text; lists and objects by their kind only, as they may be large."""
    if isinstance(value, dict):
        return "an object"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return "nothing" if value is None else repr(value)
