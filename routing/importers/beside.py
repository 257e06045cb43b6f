"""What is read from a map beside its roads, in the same pass over the file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import osmium


class ReadBeside(Protocol):
    """Takes objects of an OpenStreetMap file as they come; deleted ones are passed over before."""

    @property
    def keys(self) -> Sequence[str]:
        """Objects that have one of these keys are of interest to it."""

    def add(self, entity: Any) -> Mapping[str, str] | None:
        """Take an object of those keys or of roads; its tags where they were read, which takes long.

        Ways have the places of their points where these came before.
        """

    def finish(self, file: osmium.io.File | osmium.io.FileBuffer, country: str | None) -> object:
        """All objects have come. file: to be read again where that is needed. country: ISO 3166-1 code, if known."""
