"""Drives over drawn maps, and what is told on them."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from energy.folders import ROOT
from energy.vehicle.files import load_vehicle
from routing.guidance.steps import Step, steps_of
from routing.importers.region import import_region
from routing.links.spans import ChainMaker
from routing.places import LinkSpan, Point
from routing.queries import RouteQuery
from routing.route.answer import route_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from routing.graph.road_graph import RoadGraph
    from routing.route.route import Route

STREET = {"highway": "residential"}


def street(name: str, **tags: str) -> dict[str, str]:
    return {**STREET, "name": name, **{k.replace("__", ":"): v for k, v in tags.items()}}


def drawn(draw_map: Any, points: Mapping[int, Any], ways: Mapping[int, Any], **more: Any) -> RoadGraph:
    return import_region(draw_map(points, ways, **more), [], "drawn")


def links_over(graph: RoadGraph, *node_ids: int) -> list[int]:
    """The links of the shortest permitted way over nodes, by their ids in the map; the way ends at the last one."""
    heads, tails = graph.node_id[graph.head], graph.node_id[graph.tail]
    found = [[int(k)] for k in np.flatnonzero(tails == node_ids[0]) if k < graph.road_link_count]
    for wanted in node_ids[1:]:
        waiting, seen = deque(found), set()
        found = []
        while waiting and not found:
            way = waiting.popleft()
            if heads[way[-1]] == wanted:
                found = [way]
                break
            for following in graph.successors(way[-1]).tolist():
                if following not in seen:
                    seen.add(following)
                    waiting.append([*way, following])
        assert found, f"no way to {wanted}"
    return list(graph.originals(found[0]))


def driven(graph: RoadGraph, *node_ids: int, via: Sequence[int] = (), short_m: float = 0.0) -> Route:
    """The route over nodes; via: places among its links, by their number, at whose ends a leg ends.

    short_m: by how much it begins after the first node and ends before the last one.
    """
    links = links_over(graph, *node_ids)
    spans = [LinkSpan(k, 0.0, float(graph.length_m[k]), i in via) for i, k in enumerate(links)]
    spans[0] = replace(spans[0], from_m=short_m)
    spans[-1] = replace(spans[-1], to_m=spans[-1].to_m - short_m)
    query = RouteQuery(
        start=Point(0.0, 0.0),
        goal=Point(0.0, 0.0),
        soc_frac=0.8,
        vehicle=load_vehicle(ROOT / "data/vehicles/hyundai-kona-64.toml"),
    )
    firsts = (0, *(k + 1 for k in via), len(links))
    return route_of(ChainMaker(graph), "drive", None, query, tuple(spans), firsts)


def said(graph: RoadGraph, *node_ids: int) -> list[str]:
    """What is told between departure and arrival: type, modifier and road of each step."""
    return [text_of(step) for step in steps_of(graph, driven(graph, *node_ids))[1:-1]]


def text_of(step: Step) -> str:
    number = "" if step.exit is None else f" {step.exit}"
    return f"{step.type}{number} {step.modifier} {step.name or step.ref}".strip()
