"""Drives matched to one graph, each once, whoever asks for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from diagnosis.matching.map_matcher import MapMatcher

if TYPE_CHECKING:
    from diagnosis.matching.map_matcher import Match
    from diagnosis.recordings.reading import Recording
    from routing.graph.road_graph import RoadGraph


class MatchedDrives:
    """Matches of recordings to a graph by their ids, which are not to be those of other drives."""

    def __init__(self, graph: RoadGraph) -> None:
        self.graph = graph
        self._matcher: MapMatcher | None = None
        self._known: dict[str, Match] = {}

    def match(self, recording: Recording) -> Match:
        """The likeliest way of a recording over the graph; raises as MapMatcher.match does."""
        known = self._known.get(recording.id)
        if known is None:
            if self._matcher is None:
                self._matcher = MapMatcher(self.graph)  # its index takes a while
            known = self._known[recording.id] = self._matcher.match(recording)
        return known
