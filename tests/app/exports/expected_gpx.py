"""What the schema of GPX 1.1 demands of the elements that we write, after its text."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

SPACE: Final = "{http://www.topografix.com/GPX/1/1}"
POINT: Final = ("ele", "time", "name", "cmt", "desc", "src", "link", "sym", "type")
# children of each type in the order of its xsd:sequence
CHILDREN: Final = {
    "gpx": ("metadata", "wpt", "rte", "trk"),
    "metadata": ("name", "desc", "author", "copyright", "link", "time", "keywords", "bounds"),
    "wpt": POINT,
    "rtept": POINT,
    "trkpt": POINT,
    "rte": ("name", "cmt", "desc", "src", "link", "number", "type", "rtept"),
    "trk": ("name", "cmt", "desc", "src", "link", "number", "type", "trkseg"),
    "trkseg": ("trkpt",),
}
REPEATED: Final = {"wpt", "rte", "trk", "rtept", "trkpt", "trkseg", "link"}
TIME: Final = re.compile(r"-?\d{4,}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?(Z|[+-]\d\d:\d\d)?")
DECIMAL: Final = re.compile(r"-?\d+(\.\d+)?")


def checked_gpx(document: bytes) -> Element:
    """The root of a document that keeps to GPX 1.1."""
    root = ElementTree.fromstring(document)
    assert root.tag == f"{SPACE}gpx"
    assert root.get("version") == "1.1"
    assert root.get("creator")
    _check(root)
    return root


def _check(element: Element) -> None:
    name = element.tag.removeprefix(SPACE)
    order = CHILDREN.get(name)
    if order is None:
        assert len(element) == 0, name
        return
    assert not (element.text or "").strip(), name
    children = [child.tag.removeprefix(SPACE) for child in element]
    places = [order.index(child) for child in children]
    assert places == sorted(places), f"{name}: {children}"
    assert all(child in REPEATED for child in children if children.count(child) > 1), name
    if name in ("wpt", "rtept", "trkpt"):
        assert set(element.attrib) == {"lat", "lon"}
        for axis, most in (("lat", 90.0), ("lon", 180.0)):
            assert DECIMAL.fullmatch(element.attrib[axis])
            assert abs(float(element.attrib[axis])) <= most
    for child in element:
        if child.tag == f"{SPACE}time":
            assert TIME.fullmatch(child.text or "")
        if child.tag == f"{SPACE}ele":
            assert DECIMAL.fullmatch(child.text or "")
        if child.tag == f"{SPACE}bounds":
            assert set(child.attrib) == {"minlat", "minlon", "maxlat", "maxlon"}
        _check(child)


def texts(root: Element, path: str) -> list[str]:
    """Texts of the elements at a path such as trk/trkseg/trkpt/time."""
    return [found.text or "" for found in root.findall("/".join(SPACE + part for part in path.split("/")))]
