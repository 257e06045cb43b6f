"""The parts of an answer that are asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, TypeAlias

from pydantic import BaseModel

from app.conversions.lean.digits import compacted
from app.schemas.as_json import fields_of

if TYPE_CHECKING:
    from collections.abc import Iterable

SHOWN: Final = ("name", "kind", "stroke", "fill", "marker-color")  # properties that every feature keeps
# by name what is asked for of each part; None is all of it
Selection: TypeAlias = "dict[str, Selection] | None"


def selection_of(names: Iterable[str] | None) -> Selection:
    """What dotted names ask for; a name stands for all that is below it."""
    if names is None:
        return None
    chosen: dict[str, Selection] = {}
    for name in sorted(names, key=lambda name: name.count(".")):  # wholes before their parts
        at: Selection = chosen
        *path, last = name.split(".")
        for part in path:
            if at is None:
                break
            at = at.setdefault(part, {})
        if at is not None:
            at[last] = None
    return chosen


def lean_answer(answer: Any, names: Iterable[str] | None, compact: bool | None) -> Any:
    """An answer with the members that are asked for, in few digits where those are."""
    document = picked(answer, selection_of(names))
    return compacted(document) if compact else document


def part_of(selection: Selection, *path: str) -> Selection:
    """What is asked for of a part; an empty selection where it is nothing."""
    for name in path:
        if selection is None:
            return None
        selection = selection.get(name, {})
    return selection


def asks_for(selection: Selection, *path: str) -> bool:
    """Whether a part, or something of it, is asked for."""
    return part_of(selection, *path) != {}


def picked_collection(collection: BaseModel, selection: Selection) -> dict[str, Any]:
    """A FeatureCollection with the members that are asked for, which stays one: what is not is null or left out."""
    members = fields_of(collection)
    if selection is None:
        return members
    features = members["features"] if "features" in selection else []
    assert isinstance(features, list)
    chosen = part_of(selection, "features")
    named = part_of(chosen, "properties")
    document = {name: picked(item, selection[name]) for name, item in members.items() if name in selection}
    document["features"] = [
        feature(found.geometry if asks_for(chosen, "geometry") else None, fields_of(found.properties), named)
        for found in features
    ]
    return {"type": members["type"]} | document


def feature(geometry: object, properties: dict[str, Any], selection: Selection) -> dict[str, Any]:
    """A GeoJSON Feature with the properties that are asked for, and those by which maps tell and draw it."""
    if selection is not None:
        properties = {
            name: picked(item, selection.get(name)) for name, item in properties.items() if name in {*selection, *SHOWN}
        }
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def picked(value: Any, selection: Selection) -> Any:
    """A value with the members that are asked for; of a list each item."""
    if selection is None or value is None:
        return value
    if isinstance(value, (list, tuple)):
        return [picked(item, selection) for item in value]
    members = fields_of(value) if isinstance(value, BaseModel) else value
    if not isinstance(members, dict):
        return value
    return {name: picked(item, selection[name]) for name, item in members.items() if name in selection}
