"""What drivers read along the links of a graph: names of roads, where they lead, numbers of exits, lanes."""

from __future__ import annotations

from dataclasses import asdict, astuple, dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class RoadSign:
    """What is read of a road in one direction, as it is tagged in OpenStreetMap; empty where nothing is.

    highway: the kind of road, with `_link`. destination, destination_ref: where it leads, several apart at `;`.
    junction: `roundabout` or `circular` on a ring. exit_ref: number of the exit that a ramp is (`junction:ref`).
    lanes: their number in this direction, 0 where it is not known. turn_lanes: arrows on them, apart at `|`.
    names: the road's name in other languages, pairs of the language's code and the name.
    """

    highway: str = ""
    ref: str = ""
    destination: str = ""
    destination_ref: str = ""
    junction: str = ""
    exit_ref: str = ""
    lanes: int = 0
    turn_lanes: str = ""
    names: tuple[tuple[str, str], ...] = ()


NO_SIGN = RoadSign()


def _nothing() -> NDArray[np.int32]:
    return np.empty(0, np.int32)


_TEXTS = tuple(f.name for f in fields(RoadSign) if f.name not in ("lanes", "names"))


@dataclass(frozen=True, slots=True)
class RoadSigns:
    """Signs of all links; the same sign is kept once.

    sign_idx: int32 (M,) into signs. exit_node: int32 (E,) ascending, nodes at which exits are numbered; exit_ref: their
    numbers. drives_left: whether traffic keeps to the left. mini_node: int32 (R,) ascending, mini roundabouts.
    left_out_link: int32 (L,) ascending, links of roundabouts that have ways out which are no links, as to a yard or a
    car park; left_out_exits: int32 (L,) how many each has, without those at the node where it begins.
    """

    sign_idx: NDArray[np.int32]
    signs: tuple[RoadSign, ...]
    exit_node: NDArray[np.int32]
    exit_ref: tuple[str, ...]
    drives_left: bool = False
    mini_node: NDArray[np.int32] = field(default_factory=_nothing)
    left_out_link: NDArray[np.int32] = field(default_factory=_nothing)
    left_out_exits: NDArray[np.int32] = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        for array in (self.sign_idx, self.exit_node, self.mini_node, self.left_out_link, self.left_out_exits):
            array.flags.writeable = False

    def of_links(self, links: NDArray[np.int64], node_rank: NDArray[np.int32]) -> RoadSigns:
        """Those of some links in their order; node_rank: int32 (N,) new numbers of nodes, -1 of those left out."""
        used, sign_idx = np.unique(self.sign_idx[links], return_inverse=True)
        node = node_rank[self.exit_node]
        order = np.argsort(node, kind="stable")
        order = order[node[order] >= 0]
        mini = np.sort(node_rank[self.mini_node])
        link_rank = np.full(self.sign_idx.size, -1, np.int32)
        link_rank[links] = np.arange(links.size, dtype=np.int32)
        left_out = link_rank[self.left_out_link]
        by_link = np.argsort(left_out, kind="stable")
        by_link = by_link[left_out[by_link] >= 0]
        return RoadSigns(
            sign_idx.astype(np.int32),
            tuple(self.signs[k] for k in used.tolist()),
            node[order],
            tuple(self.exit_ref[k] for k in order.tolist()),
            self.drives_left,
            mini[mini >= 0],
            left_out[by_link],
            self.left_out_exits[by_link],
        )

    def with_links(self, of: NDArray[np.int64]) -> RoadSigns:
        """These signs, and copies of some links, int64 (C,), which come last."""
        return replace(self, sign_idx=np.concatenate((self.sign_idx, self.sign_idx[of])))

    def columns(self) -> dict[str, Any]:
        """All but sign_idx as JSON takes it; of each sign what is not empty."""
        empty = asdict(NO_SIGN)
        return {
            "signs": [{k: v for k, v in asdict(sign).items() if v != empty[k]} for sign in self.signs],
            "exit_node": self.exit_node.tolist(),
            "exit_ref": list(self.exit_ref),
            "drives_left": self.drives_left,
            **({"mini_node": self.mini_node.tolist()} if self.mini_node.size else {}),
            **(
                {"left_out_link": self.left_out_link.tolist(), "left_out_exits": self.left_out_exits.tolist()}
                if self.left_out_link.size
                else {}
            ),
        }


def signs_from(columns: Mapping[str, Any], sign_idx: NDArray[np.int32], link_count: int, node_count: int) -> RoadSigns:
    """What columns() gave, with the sign of each link.

    Raises KeyError, TypeError, ValueError, AttributeError or OverflowError where they are damaged.
    """
    signs = tuple(_sign(row) for row in columns["signs"])
    node = np.array(columns["exit_node"], np.int32)
    refs = tuple(columns["exit_ref"])
    if sign_idx.shape != (link_count,):
        raise ValueError(f"signs of {sign_idx.size} links, not {link_count}")
    if sign_idx.size and not 0 <= int(sign_idx.min()) <= int(sign_idx.max()) < len(signs):
        raise ValueError("links with unknown signs")
    if node.shape != (len(refs),) or not all(isinstance(ref, str) for ref in refs):
        raise ValueError("exits that do not fit their numbers")
    if not _ascending(node, node_count):
        raise ValueError("exits at unknown nodes, or not ascending")
    mini = np.array(columns.get("mini_node", ()), np.int32)
    left_out = np.array(columns.get("left_out_link", ()), np.int32)
    exits = np.array(columns.get("left_out_exits", ()), np.int32)
    if not _ascending(mini, node_count):
        raise ValueError("mini roundabouts at unknown nodes, or not ascending")
    if not _ascending(left_out, link_count) or exits.shape != left_out.shape or bool((exits <= 0).any()):
        raise ValueError("exits that are left out of unknown links, or not ascending")
    return RoadSigns(sign_idx, signs, node, refs, bool(columns["drives_left"]), mini, left_out, exits)


def _ascending(idx: NDArray[np.int32], count: int) -> bool:
    """Whether indices are below a count and each is above the one before it."""
    if idx.ndim != 1 or not idx.size:
        return idx.ndim == 1
    return bool(idx[0] >= 0 and idx[-1] < count and (np.diff(idx) > 0).all())


def _sign(row: Mapping[str, Any]) -> RoadSign:
    names = tuple((language, name) for language, name in row.get("names", ()))
    sign = RoadSign(**{**row, "names": names})
    texts: list[object] = [getattr(sign, name) for name in _TEXTS] + [text for pair in names for text in pair]
    lanes: object = sign.lanes
    if not all(isinstance(text, str) for text in texts) or not isinstance(lanes, int) or lanes < 0:
        raise ValueError(f"a sign of {astuple(sign)}")
    return sign
