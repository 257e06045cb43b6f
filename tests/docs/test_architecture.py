"""The picture and the table of docs/architecture.md show the rooms and imports that the code has."""

from __future__ import annotations

from itertools import pairwise

import pytest

from docs.draw_architecture import PICTURE, layout_of, picture_of
from docs.rooms import PAGE, Rooms, arrows_of, read_rooms, table_in, table_of, with_table

pytestmark = pytest.mark.nojit

MEND = "run `python -m docs.draw_architecture`, look at docs/images/architecture.svg, and commit both"


@pytest.fixture(scope="module")
def rooms() -> Rooms:
    return read_rooms()


def test_page_has_the_imports_between_rooms_that_the_code_has(rooms: Rooms) -> None:
    shown = arrows_of(PAGE.read_text(encoding="utf-8"))
    new, gone = sorted(rooms.arrows - shown), sorted(shown - rooms.arrows)
    assert shown == rooms.arrows, f"rooms import others than docs/architecture.md shows, new {new}, gone {gone}: {MEND}"
    assert len(shown) > 100


def test_page_says_of_rooms_what_their_docstrings_say(rooms: Rooms) -> None:
    assert table_in(PAGE.read_text(encoding="utf-8")) == table_of(rooms), f"rooms or their docstrings changed: {MEND}"


def test_picture_is_the_one_drawn_from_the_imports(rooms: Rooms) -> None:
    assert PICTURE.read_text(encoding="utf-8") == picture_of(rooms), f"rooms or their imports changed: {MEND}"


def test_layers_hold_every_package_once_and_imports_go_down(rooms: Rooms) -> None:
    depth = {package: k for k, layer in enumerate(rooms.layers) for package in layer}
    assert len(depth) == sum(len(layer) for layer in rooms.layers)
    assert {name.partition(".")[0] for name in rooms.names} == set(depth)
    for importer, imported in rooms.arrows:
        assert depth[importer.partition(".")[0]] <= depth[imported.partition(".")[0]]


def test_layout_leaves_out_implied_arrows_and_goes_to_the_right() -> None:
    rooms = Rooms(
        (("a",),), frozenset({"a.x", "a.y", "a.z"}), frozenset({("a.x", "a.y"), ("a.y", "a.z"), ("a.x", "a.z")})
    )
    layout = layout_of("a", rooms)
    assert [layout.cells[name][0] for name in ("a.x", "a.y", "a.z")] == [0, 1, 2]
    assert len(layout.ways) == 2


def test_layout_puts_no_two_rooms_in_one_place_and_no_arrow_through_a_room(rooms: Rooms) -> None:
    for package in (package for layer in rooms.layers for package in layer):
        layout = layout_of(package, rooms)
        taken = set(layout.cells.values())
        assert len(taken) == len(layout.cells)
        for way in layout.ways:
            assert not taken & set(way[1:-1])
            assert all(after[0] == before[0] + 1 for before, after in pairwise(way))


def test_layout_of_rooms_in_a_circle_is_refused() -> None:
    rooms = Rooms((("a",),), frozenset({"a.x", "a.y"}), frozenset({("a.x", "a.y"), ("a.y", "a.x")}))
    with pytest.raises(ValueError, match="circle"):
        layout_of("a", rooms)


@pytest.mark.parametrize("page", ["", "<!-- rooms -->\n", "<!-- /rooms --><!-- rooms -->\n"])
def test_page_without_one_place_for_the_table_is_refused(page: str) -> None:
    with pytest.raises(ValueError, match="one place"):
        with_table(page, "table")
