"""Where an extract cuts roads, on a drawn town that is cut in the ways of the usual tools."""

from __future__ import annotations

import gzip
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pytest
import rasterio
from rasterio import Affine

from routing.graph.files import load_graph, save_graph
from routing.graph.networkx_graph import from_networkx, to_networkx
from routing.graph.rim import derived_rim, map_rim
from routing.importers.region import import_region

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from routing.graph.road_graph import RoadGraph

SIDE: Final = 9
EAST_DEG, NORTH_DEG = 0.004, 0.003  # between streets
Nodes = dict[int, tuple[float, float]]
Ways = dict[int, tuple[list[int], dict[str, str]]]


def town() -> tuple[Nodes, Ways]:
    """Streets from west to east and from south to north, a point half-way between crossings, a yard at each."""
    nodes: Nodes = {}
    ways: Ways = {}
    for row in range(2 * SIDE - 1):
        for column in range(2 * SIDE - 1):
            if row % 2 == 0 or column % 2 == 0:
                place = (1.5 + 0.5 * EAST_DEG * column, 42.0 + 0.5 * NORTH_DEG * row)
                nodes[100 * row + column + 1] = place
    for line in range(0, 2 * SIDE - 1, 2):
        for begin in range(0, 2 * SIDE - 2, 4):  # a way is two blocks long
            along = range(begin, begin + 5)
            tags = {"highway": "secondary" if line % 8 == 0 else "residential"}
            ways[1000 + 100 * line + begin] = [100 * line + k + 1 for k in along], tags
            ways[5000 + 100 * line + begin] = [100 * k + line + 1 for k in along], tags
            lon, lat = nodes[100 * line + begin + 1]
            nodes[9000 + 100 * line + begin] = lon + 0.0003, lat + 0.0003
            yard = [100 * line + begin + 1, 9000 + 100 * line + begin]
            ways[7000 + 100 * line + begin] = yard, {"highway": "service"}
    return nodes, ways


def xml(nodes: Nodes, ways: Ways, head: str = "", tail: str = "") -> str:
    lines = ['<osm version="0.6">', head]
    lines += [f'<node id="{k}" lat="{lat:.7f}" lon="{lon:.7f}"/>' for k, (lon, lat) in sorted(nodes.items())]
    for k, (refs, tags) in sorted(ways.items()):
        inner = "".join(f'<nd ref="{ref}"/>' for ref in refs)
        inner += "".join(f'<tag k="{key}" v="{value}"/>' for key, value in tags.items())
        lines.append(f'<way id="{k}">{inner}</way>')
    return "\n".join([*lines, tail, "</osm>"])


def cut(kept: set[int], how: str, nodes: Nodes, ways: Ways) -> tuple[Nodes, Ways]:
    """The town cut: `simple` leaves references to points out there, `clip` takes them out, `whole` keeps whole ways."""
    touched = {k: way for k, way in ways.items() if kept.intersection(way[0])}
    if how == "clip":
        touched = {k: ([ref for ref in refs if ref in kept], tags) for k, (refs, tags) in touched.items()}
    held = kept | {ref for refs, _ in touched.values() for ref in refs} if how == "whole" else kept
    return {k: nodes[k] for k in nodes if k in held}, touched


def within(box: Sequence[float], nodes: Nodes) -> set[int]:
    west, south, east, north = box
    return {k for k, (lon, lat) in nodes.items() if west <= lon <= east and south <= lat <= north}


def bounds(box: Sequence[float]) -> str:
    west, south, east, north = box
    return f'<bounds minlat="{south}" minlon="{west}" maxlat="{north}" maxlon="{east}"/>'


def neighbours(ways: Ways) -> dict[int, set[int]]:
    found: dict[int, set[int]] = {}
    for refs, _ in ways.values():
        for a, b in pairwise(refs):
            found.setdefault(a, set()).add(b)
            found.setdefault(b, set()).add(a)
    return found


def lacking(graph: RoadGraph, all_ways: Ways, held: Mapping[int, object], ways: Ways) -> set[int]:
    """Nodes of a graph at which the town has a road that its extract lacks."""
    before, after = (
        neighbours(all_ways),
        neighbours({k: ([r for r in w if r in held], t) for k, (w, t) in ways.items()}),
    )
    return {k for k in graph.node_id.tolist() if before[k] - after.get(k, set())}


@pytest.fixture
def read(tmp_path: Path) -> Callable[[str], RoadGraph]:
    def from_text(text: str) -> RoadGraph:
        path = tmp_path / "town.osm"
        path.write_text(text, encoding="utf-8")
        return import_region(path, [], "town")

    return from_text


def rim_ids(graph: RoadGraph) -> set[int]:
    return set(graph.node_id[map_rim(graph).node_idx].tolist())


# sides run between points: 1/4 of a block from them
BOX: Final = (1.5 + 1.25 * EAST_DEG, 42.0 + 1.25 * NORTH_DEG, 1.5 + 6.3 * EAST_DEG, 42.0 + 5.8 * NORTH_DEG)


@pytest.mark.parametrize("head", ["", bounds(BOX), bounds((-180, -90, 180, 90))], ids=["no box", "box", "planet"])
def test_roads_whose_next_point_the_file_lacks_are_cut_there_and_nowhere_else(
    read: Callable[[str], RoadGraph], head: str
) -> None:
    nodes, ways = town()
    held, touched = cut(within(BOX, nodes), "simple", nodes, ways)
    graph = read(xml(held, touched, head))
    expected = lacking(graph, ways, held, touched)
    assert len(expected) >= 16
    assert rim_ids(graph) == expected
    assert len(expected) > 2 * derived_rim(graph).node.sum()  # minor roads too


def test_roads_that_end_outside_of_the_box_of_an_extract_of_whole_ways_are_cut(
    read: Callable[[str], RoadGraph],
) -> None:
    nodes, ways = town()
    kept = within(BOX, nodes)
    held, touched = cut(kept, "whole", nodes, ways)
    graph = read(xml(held, touched, bounds(BOX)))
    outside = {k for k in lacking(graph, ways, held, touched) if k not in kept}
    assert len(outside) >= 12
    assert rim_ids(graph) == outside
    assert read(xml(held, touched)).cut_node is None  # nothing tells


def test_roads_that_end_before_the_side_of_a_box_that_they_lead_to_are_cut(read: Callable[[str], RoadGraph]) -> None:
    nodes, ways = town()
    kept = within(BOX, nodes)
    held, touched = cut(kept, "clip", nodes, ways)
    graph = read(xml(held, touched, bounds(BOX)))
    dead_end = {k for k, others in neighbours(touched).items() if len(others) == 1}
    assert rim_ids(graph) == dead_end & lacking(graph, ways, held, touched)
    assert any(k >= 9000 for k in dead_end)  # yards end for good


@pytest.mark.parametrize(
    "box",
    [
        (-180, -90, 180, 90),
        (1.0, 41.0, 3.0, 43.0),
        (1.516, 42.011, 1.5161, 42.0111),
        (100.0, 10.0, 101.0, 11.0),
        (1.6, 42.1, 1.4, 41.9),
    ],
)
def test_box_that_is_none_of_these_roads_tells_nothing(
    read: Callable[[str], RoadGraph], box: tuple[float, float, float, float]
) -> None:
    nodes, ways = town()
    held, touched = cut(within(BOX, nodes), "whole", nodes, ways)
    graph = read(xml(held, touched, bounds(box)))
    assert graph.cut_node is None
    assert map_rim(graph).node_idx.tolist() == derived_rim(graph).node_idx.tolist()


def test_box_with_a_margin_on_all_sides_cuts_no_road(read: Callable[[str], RoadGraph]) -> None:
    nodes, ways = town()
    # a road out to a cape, which is outermost: alone it would be taken as cut
    nodes[9999] = 1.5 + 10.0 * EAST_DEG, 42.0 + 4.0 * NORTH_DEG
    ways[9999] = [100 * 8 + 2 * SIDE - 1, 9999], {"highway": "primary"}
    box = (1.495, 41.995, 1.545, 42.03)
    graph = read(xml(nodes, ways, bounds(box)))
    assert graph.cut_node is not None
    assert rim_ids(graph) == set()
    assert derived_rim(graph).node.any()


def test_file_of_several_boxes_is_cut_outside_of_all_of_them(read: Callable[[str], RoadGraph]) -> None:
    nodes, ways = town()
    middle = 1.5 + 4.2 * EAST_DEG
    west, east = (BOX[0], BOX[1], middle, BOX[3]), (middle - 0.0001, BOX[1], BOX[2], BOX[3])
    kept = within(west, nodes) | within(east, nodes)
    held, touched = cut(kept, "whole", nodes, ways)
    graph = read(xml(held, touched, bounds(west) + bounds(east)))
    assert rim_ids(graph) == rim_ids(read(xml(held, touched, bounds(BOX))))


def test_dead_ends_beyond_the_boundary_in_the_file_are_cut_and_those_inside_are_not(
    read: Callable[[str], RoadGraph],
) -> None:
    nodes, ways = town()
    # a valley road that ends for good inside, outermost, and one that ends abroad
    nodes[9991], nodes[9992] = (1.4955, 42.012), (1.5375, 42.012)
    ways[9991] = [801, 9991], {"highway": "secondary"}
    ways[9992] = [800 + 2 * SIDE - 1, 9992], {"highway": "secondary"}
    corners = {9993: (1.495, 41.995), 9994: (1.537, 41.995), 9995: (1.537, 42.029), 9996: (1.495, 42.029)}
    border: Ways = {9993: ([*corners, 9993], {"boundary": "administrative"})}
    relation = (
        '<relation id="1"><member type="way" ref="9993" role="outer"/><tag k="type" v="boundary"/>'
        '<tag k="boundary" v="administrative"/><tag k="admin_level" v="2"/></relation>'
    )
    graph = read(xml({**nodes, **corners}, {**ways, **border}, "", relation))
    assert rim_ids(graph) == {9992}
    assert set(graph.node_id[derived_rim(graph).node_idx].tolist()) >= {9991, 9992}


def test_lanes_that_lead_out_only_are_cut_where_they_leave_the_graph(read: Callable[[str], RoadGraph]) -> None:
    nodes, ways = town()
    end = 800 + 2 * SIDE - 1
    nodes[9991], nodes[9992] = (1.54, 42.0121), (1.54, 42.0119)
    lanes: Ways = {
        9991: ([end, 9991, 99991], {"highway": "motorway"}),
        9992: ([99992, 9992, end], {"highway": "motorway"}),
        9993: ([101, 99993], {"highway": "residential", "oneway": "yes"}),
    }
    graph = read(xml(nodes, {**ways, **lanes}))
    assert not {9991, 9992} & set(graph.node_id.tolist())
    assert rim_ids(graph) == {end, 101}


def test_point_that_was_deleted_cuts_no_road_of_an_extract(read: Callable[[str], RoadGraph]) -> None:
    nodes, ways = town()
    text = xml(nodes, ways)
    assert read(text).cut_node is None
    mark = f'<node id="{9000}" '
    assert mark in text
    assert read(text.replace(mark, mark + 'action="delete" ')).cut_node is None


def test_single_point_that_is_lacking_adds_to_the_rim_that_the_graph_shows(read: Callable[[str], RoadGraph]) -> None:
    nodes, ways = town()
    held, touched = cut(within(BOX, nodes), "whole", nodes, ways)
    shown = rim_ids(read(xml(held, touched)))
    yard = next(k for k in held if k >= 9000 and len([w for w in touched.values() if k in w[0]]) == 1)
    at = next(refs[0] for refs, _ in touched.values() if refs[-1] == yard)
    assert len(shown) >= 4
    assert rim_ids(read(xml({k: v for k, v in held.items() if k != yard}, touched))) == shown | {at}


def test_cut_roads_survive_files_and_exports(read: Callable[[str], RoadGraph], tmp_path: Path) -> None:
    nodes, ways = town()
    held, touched = cut(within(BOX, nodes), "simple", nodes, ways)
    for text in (xml(held, touched), xml(nodes, ways, bounds((1.495, 41.995, 1.54, 42.03))), xml(nodes, ways)):
        graph = read(text)
        save_graph(graph, tmp_path / "stored")
        for again in (load_graph(tmp_path / "stored"), from_networkx(to_networkx(graph))):
            if graph.cut_node is None:
                assert again.cut_node is None
            else:
                assert again.cut_node is not None
                assert again.cut_node.tolist() == graph.cut_node.tolist()
                assert not again.cut_node.flags.writeable


def test_box_of_a_packed_file_counts_alike(read: Callable[[str], RoadGraph], tmp_path: Path) -> None:
    nodes, ways = town()
    held, touched = cut(within(BOX, nodes), "whole", nodes, ways)
    text = xml(held, touched, bounds(BOX))
    (tmp_path / "packed.osm.gz").write_bytes(gzip.compress(text.encode()))
    assert rim_ids(import_region(tmp_path / "packed.osm.gz", [], "packed")) == rim_ids(read(text))


def test_roads_left_out_for_want_of_heights_are_cut_beside_what_the_graph_shows(
    read: Callable[[str], RoadGraph], tmp_path: Path
) -> None:
    nodes, ways = town()
    ends = [400 + 2 * SIDE - 1, 1200 + 2 * SIDE - 1]  # in the east, at 1.532
    for k, end in enumerate(ends):
        nodes[9990 + k] = 1.535, nodes[end][1]
        ways[9990 + k] = [end, 9990 + k], {"highway": "residential"}
    read(xml(nodes, ways))
    west = 1.533
    cells = np.full((30, 40), 100.0, np.float32)
    place = Affine((west - 1.49) / 40, 0.0, 1.49, 0.0, -0.002, 42.04)
    size: dict[str, Any] = {"width": 40, "height": 30, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    with rasterio.open(tmp_path / "dem.tif", "w", driver="GTiff", transform=place, **size) as raster:
        raster.write(cells, 1)
    graph = import_region(tmp_path / "town.osm", [tmp_path / "dem.tif"], "town")
    assert graph.meta.dropped["roads_without_height"] == 2
    assert set(ends) <= rim_ids(graph)
    assert set(ends).isdisjoint(graph.node_id[derived_rim(graph).node_idx].tolist())
    assert set(graph.node_id[derived_rim(graph).node_idx].tolist()) <= rim_ids(graph)
