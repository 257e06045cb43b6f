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

    def add(self, entity: Any, tags: Mapping[str, str], places: Sequence[tuple[int, int]] | None) -> None:
        """Take an object of those keys or of roads, and its tags.

        places: lon, lat [1e-7 deg] of the points of a way, those that the map has, where they were read for its road;
        ways have the places of their points themselves where these came before.
        """

    def finish(self, file: osmium.io.File | osmium.io.FileBuffer, country: str | None) -> object:
        """All objects have come. file: to be read again where that is needed. country: ISO 3166-1 code, if known."""
