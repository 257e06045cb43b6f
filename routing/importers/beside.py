"""What is read from a map beside its roads, in the same passes over the file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import osmium

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence


class ReadBeside(Protocol):
    """Takes objects of an OpenStreetMap file as they come; deleted ones are passed over before.

    After all objects the areas and lines come that it wants, then it is told that all has come.
    """

    @property
    def keys(self) -> Sequence[str]:
        """Objects that have one of these keys are of interest to it."""

    @property
    def areas(self) -> Collection[int]:
        """Relations whose areas it wants."""

    @property
    def lines(self) -> Collection[int]:
        """Ways that it wants once more."""

    def add(self, entity: Any, tags: Mapping[str, str], places: Sequence[tuple[int, int]] | None) -> None:
        """Take an object of those keys or of roads, and its tags.

        places: lon, lat [1e-7 deg] of the points of a way, those that the map has, where they were read for its road;
        ways have the places of their points themselves where these came before.
        """

    def add_area(self, relation: int, shape_wkb: str) -> None:
        """Take the area of a relation that it wants, as well-known binary in hexadecimal [deg]."""

    def add_line(self, way: Any) -> None:
        """Take a way that it wants."""

    def finish(self, country: str | None) -> object:
        """All has come. country: ISO 3166-1 code, if known."""


class ReadTogether:
    """Several readers as one."""

    def __init__(self, *readers: ReadBeside) -> None:
        self._readers = readers

    @property
    def keys(self) -> Sequence[str]:
        """Of all of them."""
        return list(dict.fromkeys(key for reader in self._readers for key in reader.keys))

    @property
    def areas(self) -> Collection[int]:
        """Of all of them."""
        return {relation for reader in self._readers for relation in reader.areas}

    @property
    def lines(self) -> Collection[int]:
        """Of all of them."""
        return {way for reader in self._readers for way in reader.lines}

    def add(self, entity: Any, tags: Mapping[str, str], places: Sequence[tuple[int, int]] | None) -> None:
        """Hand an object to all of them."""
        for reader in self._readers:
            reader.add(entity, tags, places)

    def add_area(self, relation: int, shape_wkb: str) -> None:
        """Hand an area to all of them."""
        for reader in self._readers:
            reader.add_area(relation, shape_wkb)

    def add_line(self, way: Any) -> None:
        """Hand a way to all of them."""
        for reader in self._readers:
            reader.add_line(way)

    def finish(self, country: str | None) -> object:
        """Tell all of them."""
        for reader in self._readers:
            reader.finish(country)
        return None


def read_wanted(file: osmium.io.File | osmium.io.FileBuffer, beside: ReadBeside) -> None:
    """Read a file again for the areas and ways that are wanted, if any; those that it has in part do not come."""
    areas, lines = [relation for relation in beside.areas if relation >= 0], set(beside.lines)
    ids = [2 * relation + 1 for relation in areas] + [way for way in lines if way >= 0]
    if not ids:
        return
    factory = osmium.geom.WKBFactory()
    processor = (
        osmium.FileProcessor(file)
        .with_areas(osmium.filter.IdFilter(areas))
        .with_filter(osmium.filter.EntityFilter(osmium.osm.AREA | osmium.osm.WAY))
    )
    entity: Any
    try:
        for entity in processor.with_filter(osmium.filter.IdFilter(ids)):
            if entity.is_way():
                if entity.id in lines:
                    beside.add_line(entity)
            elif not entity.from_way():
                try:
                    shape = str(factory.create_multipolygon(entity))
                except (RuntimeError, ValueError):
                    continue
                beside.add_area(entity.orig_id(), shape)
    except (RuntimeError, ValueError, osmium.InvalidLocationError):
        return  # a file that is not sorted
