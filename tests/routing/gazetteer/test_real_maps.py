"""Real maps are searched as people type."""

from __future__ import annotations

from pathlib import Path

import pytest

from routing.gazetteer.entries import Kind
from routing.gazetteer.gazetteer import Gazetteer
from tests.routing.gazetteer.drawn_town import opened

pytestmark = pytest.mark.shared_data


@pytest.fixture
def munich(real_maps: Path, tmp_path: Path) -> Gazetteer:
    return opened(real_maps / "munich-centre.osm.pbf", tmp_path, "munich")


@pytest.fixture
def andorra(real_maps: Path, tmp_path: Path) -> Gazetteer:
    return opened(real_maps / "andorra.osm.pbf", tmp_path, "andorra")


def test_addresses_of_munich_are_found_however_they_are_written(munich: Gazetteer) -> None:
    for text in (
        "Neuhauser Straße 18, 80331 München, Deutschland",
        "neuhauser str 18 munich germany",
        "München, Neuhauserstr. 18",
        "18 neuhauser strase",
    ):
        found = munich.search(text)[0]
        assert (found.kind, found.street, found.number) == (Kind.HOUSE, "Neuhauser Straße", "18"), text
    assert munich.search("hofbraeuhaus")[0].name == "Hofbräuhaus"
    assert munich.search("80331")[0].kind is Kind.POSTCODE
    assert munich.search("Muenchen")[0].name == "München"
    assert munich.search("frauenkirche", languages=["en"])[0].address[Kind.CITY] == "Munich"


def test_parishes_villages_and_passes_of_andorra_are_found(andorra: Gazetteer) -> None:
    for text, name, kind in (
        ("andorra la vella", "Andorra la Vella", Kind.CITY),
        ("la masana", "La Massana", Kind.CITY),
        ("St. Julià de Lòria", "Sant Julià de Lòria", Kind.CITY),
        ("coll d'ordino", "Coll d'Ordino", Kind.POINT),
        ("carlemany av escaldes", "Avinguda Carlemany", Kind.STREET),
    ):
        found = andorra.search(text)[0]
        assert (found.name, found.kind) == (name, kind), text
    canillo = andorra.search("soldeu")[0]
    assert (canillo.address[Kind.CITY], canillo.country_code) == ("Canillo", "ad")  # by its boundary
