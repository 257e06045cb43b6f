"""Stretches of a graph's links as the chain that the link models drive."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.chain.chain import Chain
from energy.chain.kernels_chain import REST
from energy.conditions import STILL, Conditions
from energy.errors import LinkError
from energy.stops import USUAL_STOPS, StopSettings
from routing.graph.link_bans import whole_successors
from routing.links import kernels_links
from routing.links.stops import link_stops

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.graph.road_graph import RoadGraph
    from routing.places import LinkSpan

SLACK_FRAC: Final = 1e-6  # of a link's length: places nearer than this are the same


class ChainMaker:
    """Makes chains of one graph's links; reads these links alone, so that a large graph costs no more."""

    def __init__(self, graph: RoadGraph) -> None:
        self.graph = graph
        self._successor_first, self._successor = whole_successors(graph)

    def chain(
        self, spans: tuple[LinkSpan, ...], settings: StopSettings | None = None, conditions: Conditions = STILL
    ) -> Chain:
        """The chain of links that stretches of links make, with altitude and heading, and the limits that hold.

        Raises LinkError where a link does not exist, may not follow the one before, or a stretch leaves it.
        """
        idx = np.array([s.link_idx for s in spans], np.int64)
        from_m, to_m = np.array([s.from_m for s in spans], np.float64), np.array([s.to_m for s in spans], np.float64)
        if not self._whole_links(idx, from_m, to_m):
            self._check(spans)
        chain = self.of_links(idx, to_m - from_m, settings or USUAL_STOPS, conditions)
        rest = np.array([s.rest for s in spans])
        if not rest.any():
            return chain
        return replace(
            chain,
            stop_probability_frac=np.where(rest, 1.0, chain.stop_probability_frac),
            stop_time_s=np.where(rest, 0.0, chain.stop_time_s),
            stop_class=np.where(rest, REST, chain.stop_class).astype(np.int8),
        )

    def _whole_links(self, idx: NDArray[np.int64], from_m: NDArray[np.float64], to_m: NDArray[np.float64]) -> bool:
        """Whether stretches are a way of links that may follow one another, whole but for its ends: as searches find.

        It spares the check of each stretch, which takes as long as all else of a long chain.
        """
        if idx.size == 0 or idx.min() < 0 or idx.max() >= self.graph.road_link_count:
            return False
        way = self._successor_first, self._successor, self.graph.length_m
        return bool(kernels_links.is_whole_way(*way, idx, from_m, to_m))

    def _check(self, spans: tuple[LinkSpan, ...]) -> None:
        graph = self.graph
        for k, span in enumerate(spans):
            if not 0 <= span.link_idx < graph.road_link_count:
                raise LinkError("id", k, span.link_idx, f"0..{graph.road_link_count - 1}")
            length_m = float(graph.length_m[span.link_idx])
            slack = SLACK_FRAC * length_m
            if not -slack <= span.from_m < length_m:
                raise LinkError("from_m", k, span.from_m, f"0..{length_m} (length of the link)")
            if not span.from_m < span.to_m <= length_m + slack:
                raise LinkError("to_m", k, span.to_m, f"above {span.from_m} (from_m), at most {length_m} (length)")
            if k > 0 and not self._goes_on(spans[k - 1], span):
                self._check_follows(k, spans[k - 1], span)

    def _goes_on(self, before: LinkSpan, span: LinkSpan) -> bool:
        """Whether a stretch begins where the vehicle came to rest on the stretch before, ahead or turned round."""
        length_m = float(self.graph.length_m[before.link_idx])
        slack = SLACK_FRAC * length_m
        ahead = span.link_idx == before.link_idx and abs(span.from_m - before.to_m) <= slack
        turned = int(self.graph.reverse_idx[before.link_idx])
        return before.rest and (
            ahead or (span.link_idx == turned and abs(span.from_m - (length_m - before.to_m)) <= slack)
        )

    def _check_follows(self, k: int, before: LinkSpan, span: LinkSpan) -> None:
        graph = self.graph
        begin, end = self._successor_first[before.link_idx : before.link_idx + 2]
        if span.link_idx not in self._successor[begin:end]:
            raise LinkError("id", k, span.link_idx, f"a link that may follow link {before.link_idx}")
        before_m = float(graph.length_m[before.link_idx])
        if before.to_m < before_m * (1.0 - SLACK_FRAC):
            raise LinkError("to_m", k - 1, before.to_m, f"{before_m}: no gap before the next link")
        if span.from_m > SLACK_FRAC * float(graph.length_m[span.link_idx]):
            raise LinkError("from_m", k, span.from_m, "0: no gap after the link before")

    def of_links(
        self,
        idx: NDArray[np.int64],
        length_m: NDArray[np.float64],
        settings: StopSettings,
        conditions: Conditions = STILL,
    ) -> Chain:
        """Links of the graph one after the other, each driven over a length."""
        graph = self.graph
        carried_s = None if graph.ferries is None else graph.ferries.carried_s(idx)
        if carried_s is not None:
            carried_s = carried_s * (length_m / graph.length_m[idx])
        probability, wait = link_stops(graph, settings, links=idx)
        stop_class = 4 * graph.urban[idx].astype(np.int8) + graph.cross[idx]
        return Chain(
            length_m=length_m,
            grade_frac=graph.climb_m(idx) / graph.length_m[idx],
            speed_limit_mps=graph.limit_mps(conditions)[idx],
            stop_probability_frac=probability,
            stop_time_s=wait,
            stop_class=stop_class.astype(np.int8),
            altitude_m=graph.altitude_m(idx),
            heading=graph.heading(idx),
            carried_s=carried_s,
        )
