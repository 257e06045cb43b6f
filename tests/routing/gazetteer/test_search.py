"""A drawn town is searched as people type."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest

from routing.errors import GraphFormatError
from routing.gazetteer.building import content_of
from routing.gazetteer.entries import Kind
from routing.gazetteer.files import PLACES_FILE, index_bytes, save_index
from routing.gazetteer.found import Near
from routing.gazetteer.gazetteer import Gazetteer
from routing.gazetteer.osm import PlaceReader
from routing.importers.osm import read_osm
from tests.routing.gazetteer.drawn_town import RUA, drawn_town, opened


@pytest.fixture
def town(draw_map: Any, tmp_path: Path) -> Gazetteer:
    return opened(drawn_town(draw_map), tmp_path)


@pytest.mark.parametrize(
    "text",
    [
        "Rua de Santa Catarina, Vila Nova",
        "vila nova rua de santa catarina",
        "R. Sta. Catarina, Vila Nova",
        "RUA SANTA CATARINA VILA NOVA",
        "rua de santa ctarina vila nova",
        "Rua de Santa Katarina vila nva",
        "vila nova, santa cat",
        "saint catherine street",
        "rua santa catarina 4000-447",
    ],
)
def test_a_street_is_found_however_it_is_spelled_and_in_whatever_order(town: Gazetteer, text: str) -> None:
    found = town.search(text)[0]
    assert (found.kind, found.name) == (Kind.STREET, RUA)
    assert found.address[Kind.CITY] == "Vila Nova"
    assert (found.lat, found.lon) == (pytest.approx(42.0, abs=1e-4), pytest.approx(1.5 + 300 / 82_850, abs=3e-3))


def test_a_street_in_pieces_is_one_in_each_town(town: Gazetteer) -> None:
    found = [place for place in town.search("rua de santa catarina") if place.name == RUA]
    assert [place.address[Kind.CITY] for place in found] == ["Vila Nova", "Outra Vila"]


def test_nearness_decides_between_streets_of_one_name(town: Gazetteer) -> None:
    other = Near(42.0 + 8000 / 111_073, 1.5 + 8000 / 82_850)
    assert town.search("rua de santa catarina", near=other)[0].address[Kind.CITY] == "Outra Vila"


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("Rua de Santa Catarina 12, Vila Nova", "12"),
        ("12 Rua de Santa Catarina Vila Nova", "12"),
        ("Porto, Rua de Santa Catarina 12", "12"),
        ("santa catarina 24 vila nova", "24"),  # between 20 and 30, where the map says that all even ones are
        ("santa catarina 112a vila nova", "112A"),
        ("santa catarina 112 a vila nova", "112A"),
        ("rua santa catarina n.º 12", "12"),
        ("rua santa catarina Nr. 12", "12"),
        ("rua santa catarina #12, 4000-447 Vila Nova", "12"),
    ],
)
def test_a_house_number_is_found_in_any_order(town: Gazetteer, text: str, number: str) -> None:
    found = town.search(text)[0]
    assert (found.kind, found.street, found.number) == (Kind.HOUSE, RUA, number)


def test_interpolated_numbers_lie_along_the_way_that_says_so(town: Gazetteer) -> None:
    found = town.search("rua santa catarina 26")[0]
    assert found.number == "26"
    assert found.lon == pytest.approx(1.5 + (120 + 0.6 * 100) / 82_850.76, abs=1e-6)  # 20 at 120 m, 30 at 220 m


def test_a_number_that_is_not_there_answers_the_street_with_the_nearest_one(town: Gazetteer) -> None:
    found = town.search("rua de santa catarina 15")[0]
    assert (found.kind, found.asked_number, found.nearest_number) == (Kind.STREET, "15", "12")
    assert found.lon == pytest.approx(1.5 + 20 / 82_850.76, abs=1e-6)


def test_numbers_that_are_part_of_a_name_are_no_house_numbers(town: Gazetteer) -> None:
    found = town.search("25 abril")[0]
    assert (found.name, found.asked_number) == ("Rua 25 de Abril", "")


@pytest.mark.parametrize(
    "text", ["Sendlinger Str.", "sendlingerstrasse", "Sendlinger-Str", "sendlingerstr", "send linger str"]
)
def test_streets_are_found_written_as_one_word_or_two(town: Gazetteer, text: str) -> None:
    assert town.search(text)[0].name == "Sendlinger Straße"


@pytest.mark.parametrize("text", ["EN14", "en 14", "av liberdade", "aveni da liberdade"])
def test_roads_are_found_by_their_number_and_by_abbreviations(town: Gazetteer, text: str) -> None:
    assert town.search(text)[0].name == "Avenida da Liberdade"


@pytest.mark.parametrize(
    ("text", "name", "kind"),
    [
        ("vila n", "Vila Nova", Kind.CITY),
        ("majestic", "Café Majestic", Kind.POINT),
        ("cafe majstic", "Café Majestic", Kind.POINT),
        ("farmacia s joao", "Farmácia São João", Kind.POINT),
        ("mobi um", "Mobi Um", Kind.STATION),
        ("Neustadt", "Vila Nova", Kind.CITY),
        ("pharmacy vila nova", "Farmácia São João", Kind.POINT),
        ("charging station", "Mobi Um", Kind.STATION),
    ],
)
def test_places_and_points_of_interest_are_found(town: Gazetteer, text: str, name: str, kind: Kind) -> None:
    found = town.search(text)[0]
    assert (found.name, found.kind) == (name, kind)


def test_typing_a_name_letter_by_letter_always_has_it_among_the_answers(town: Gazetteer) -> None:
    for size in range(3, len("majestic") + 1):
        assert "Café Majestic" in [place.name for place in town.search("majestic"[:size])]


def test_names_are_in_the_first_language_that_the_map_has(town: Gazetteer) -> None:
    asked = {(): "Vila Nova", ("en",): "New Town", ("fr", "de-AT", "en"): "Neustadt", ("fr",): "Vila Nova"}
    for languages, name in asked.items():
        assert town.search("vila nova", languages=languages)[0].name == name
        assert town.search("avenida liberdade", languages=languages)[0].address[Kind.CITY] == name


@pytest.mark.parametrize(
    "text", ["42.0, 1.5", "42 1.5", "42.0N 1.5E", "lat: 42 lon: 1.5", "42°00'00\"N 1°30'00\"E", "E1.5 N42"]
)
def test_coordinates_are_taken_as_they_are_typed(town: Gazetteer, text: str) -> None:
    found = town.search(text)[0]
    assert (found.kind, found.lat, found.lon) == (Kind.COORDINATES, 42.0, 1.5)
    assert found.street in (RUA, "Avenida da Liberdade")  # which begin there


def test_the_town_has_the_extent_of_its_boundary_and_is_there_once(town: Gazetteer) -> None:
    found = [place for place in town.search("vila nova") if place.name == "Vila Nova"]
    assert len(found) == 1
    assert found[0].box is not None
    assert found[0].box[0] == pytest.approx(1.5 - 900 / 82_850.76, abs=1e-5)


def test_words_of_the_maps_own_name_are_taken_as_said_of_all_on_it(draw_map: Any, tmp_path: Path) -> None:
    town = opened(drawn_town(draw_map), tmp_path, "ultramar-2025")
    assert town.search("sendlinger strasse, ultramar")[0].match > 0.95


@pytest.mark.parametrize(
    "text",
    [
        *("", " ", "'", '"', '"a" OR "b"', "a AND NOT b", "NEAR(a b)", "name:x", "*", "a*", "^a", "-", "--", "; DROP"),
        *(
            "\0",
            "a\0b",
            "\ud800",
            "🦊🚗",
            "e" * 10_000,
            "rua " * 3000,
            "شارع",
            "\u202eabc",
            "東京都",
            "1" * 300,
            "%_\\",
            "(",
            "{}",
        ),
        *(
            "12",
            "12 13 14",
            "a b c d e f g h i j k l m n o p",
            "'; --",
            "rua\n\t\r12",
            "NaN, NaN",
            "999, 999",
            "91 181",
        ),
    ],
)
def test_hostile_texts_are_answered_like_any_other(town: Gazetteer, text: str) -> None:
    assert len(town.search(text, limit=5)) <= 5


def test_limits_kinds_and_extents_hold(town: Gazetteer) -> None:
    assert len(town.search("vila", limit=1)) == 1
    only = town.search("vila", kinds=frozenset([Kind.CITY]))
    assert {place.name for place in only} == {"Vila Nova", "Outra Vila"}
    within = town.search("rua de santa catarina", within=(1.55, 42.0, 2.0, 43.0))
    assert [place.address[Kind.CITY] for place in within] == ["Outra Vila"]


def test_threads_search_at_the_same_time(town: Gazetteer) -> None:
    wrong: list[object] = []

    def ask() -> None:
        try:
            wrong.extend(place for place in [town.search("cafe majestic")[0]] * 20 if place.name != "Café Majestic")
        except Exception as error:
            wrong.append(error)

    threads = [threading.Thread(target=ask) for _ in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


@pytest.mark.parametrize("content", [b"", b"no database", b"SQLite format 3\0" + b"x" * 5000])
def test_a_damaged_index_is_told_by_its_file(tmp_path: Path, content: bytes) -> None:
    (tmp_path / PLACES_FILE).write_bytes(content)
    with pytest.raises(GraphFormatError, match=r"places\.sqlite"):
        Gazetteer(tmp_path)


def test_an_index_cut_short_is_told_when_it_is_read(town: Gazetteer, tmp_path: Path) -> None:
    content = (tmp_path / PLACES_FILE).read_bytes()
    other = tmp_path / "other"
    other.mkdir()
    (other / PLACES_FILE).write_bytes(content[: len(content) // 3])
    with pytest.raises(GraphFormatError, match=r"places\.sqlite"):
        Gazetteer(other).search("rua de santa catarina 12")


def test_who_names_the_region_means_its_middle(draw_map: Any, tmp_path: Path) -> None:
    """Most things lie in Vila Nova, so that `ultramar` is rather there than in the other town."""
    town = opened(drawn_town(draw_map), tmp_path, "ultramar")
    first, second = (place for place in town.search("rua de santa catarina, ultramar") if place.name == RUA)
    assert first.address[Kind.CITY] == "Vila Nova"
    assert first.score - second.score > 0.05


def test_the_index_is_bounded_and_says_what_it_left_out(draw_map: Any) -> None:
    reader = PlaceReader()
    read_osm(drawn_town(draw_map), beside=reader)
    content = content_of(reader.found, None, "town", most_entries=5, most_houses=2)
    assert (len(content.entries), len(content.houses)) == (5, 2)
    assert content.entries[0].name == "Vila Nova"  # the most important stay
    assert content.left_out["the least important things beyond 5"] > 0
    assert content.left_out["house numbers beyond 2"] > 0


def test_house_numbers_without_a_street_and_odd_interpolations_are_counted(draw_map: Any) -> None:
    tags = {
        1: {"addr:housenumber": "1"},
        2: {"addr:housenumber": "x", "addr:street": "A"},
        3: {"addr:housenumber": "9"},
    }
    ways = {
        10: ([1, 2, 3], {"highway": "residential", "name": "A"}),
        11: ([2, 3], {"addr:interpolation": "odd"}),
        12: ([1, 2], {"addr:interpolation": "sometimes"}),
    }
    reader = PlaceReader()
    read_osm(draw_map({1: (0, 0), 2: (100, 0), 3: (200, 0)}, ways, tags), beside=reader)
    assert reader.found.left_out == {
        "house numbers without a street": 2,
        "interpolations of house numbers that are not understood": 2,
    }


def test_the_country_is_named_though_the_map_has_no_boundary_of_it(draw_map: Any, tmp_path: Path) -> None:
    reader = PlaceReader()
    read_osm(drawn_town(draw_map), beside=reader)
    reader.found.country = "pt"
    save_index(tmp_path, index_bytes(content_of(reader.found, None, "town"), "drawn"))
    town = Gazetteer(tmp_path)
    found = town.search("sendlinger strasse, portugal", languages=["en"])[0]
    assert (found.name, found.address[Kind.COUNTRY], found.country_code) == ("Sendlinger Straße", "Portugal", "pt")
    assert found.match > 0.9
