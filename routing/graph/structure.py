"""Whether the arrays of a graph fit each other: directions in pairs, turns where links meet, places on the earth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from routing.errors import GraphFormatError
from routing.graph.earth import E7

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from routing.graph.link_copies import LinkCopies

END_E7: Final = 10  # how far the ends of a line may be from its nodes, which are rounded otherwise


def check_structure(path: str, arrays: Mapping[str, NDArray[Any]], copies: LinkCopies | None = None) -> None:
    """Raise GraphFormatError naming the first link or node that does not fit; the values are within their ranges."""
    _check_places(path, arrays)
    _check_pairs(path, arrays, np.empty(0, np.int64) if copies is None else copies.of)
    _check_turns(path, arrays)
    _check_lines(path, arrays)


def _check_places(path: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    limits = {"node_lat_deg": 90.0, "node_lon_deg": 180.0, "geometry_lat_e7": 90.0 * E7, "geometry_lon_e7": 180.0 * E7}
    for name, most in limits.items():
        wrong = ~(np.abs(arrays[name].astype(np.float64)) <= most)
        if wrong.any():
            k = int(wrong.argmax())
            raise GraphFormatError(path, f"{name}.npy", f"{arrays[name][k]} at {k}", f"{-most:g}..{most:g}")


def _check_pairs(path: str, arrays: Mapping[str, NDArray[Any]], of: NDArray[np.int64]) -> None:
    """of: what the last links are copies of, which have the other direction of those and are that of none."""
    tail, head, reverse = arrays["tail"], arrays["head"], arrays["reverse_idx"]
    whole = tail.size - of.size
    original = np.concatenate((np.arange(whole), of))
    link = np.flatnonzero(reverse >= 0)
    other = reverse[link]
    meets = (tail[other] == head[link]) & (head[other] == tail[link])
    wrong = (other >= whole) | (reverse[other] != original[link]) | ~meets
    if wrong.any():
        k = int(link[wrong.argmax()])
        allowed = "the same road the other way, which names this link in turn"
        raise GraphFormatError(path, "reverse_idx.npy", f"{reverse[k]} of link {k}", allowed)


def _check_turns(path: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    count = np.diff(arrays["successor_first"])
    link = np.repeat(np.arange(count.size), count)
    wrong = arrays["tail"][arrays["successor"]] != arrays["head"][link]
    if wrong.any():
        k = int(wrong.argmax())
        value = f"link {arrays['successor'][k]} after link {link[k]}"
        raise GraphFormatError(path, "successor.npy", value, "links that begin where the one before ends")


def _check_lines(path: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    first = arrays["geometry_first"]
    short = np.diff(first) < 2
    if short.any():
        k = int(short.argmax())
        raise GraphFormatError(path, "geometry_first.npy", f"a line of {first[k + 1] - first[k]} points", "at least 2")
    for at, node in ((first[:-1], arrays["tail"]), (first[1:] - 1, arrays["head"])):
        lat = arrays["geometry_lat_e7"][at] - arrays["node_lat_deg"][node] * E7
        lon = arrays["geometry_lon_e7"][at] - arrays["node_lon_deg"][node] * E7
        lon = np.abs(lon) % (360.0 * E7)
        off = np.maximum(np.abs(lat), np.minimum(lon, 360.0 * E7 - lon)) > END_E7
        if off.any():
            k = int(off.argmax())
            value = f"the line of link {k}, which ends {float(np.hypot(lat[k], lon[k])) / E7:.6f}° off its node"
            raise GraphFormatError(path, "geometry_lat_e7.npy", value, "lines from the link's tail to its head")
