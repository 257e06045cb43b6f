from __future__ import annotations

import pytest

from routing.stations.formats import entries, gathering, tables
from routing.stations.notes import StationFileError
from tests.routing.stations.formats.conftest import Reading

ROWS = "lat,lon,connectors\n" + "".join(f"48.{k},11.5,CCS2\n" for k in range(1, 9))


def test_more_rows_than_may_be_read_are_refused(read_text: Reading, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "MOST_ROWS", 5)
    with pytest.raises(StationFileError, match="the file is more than 5 rows, allowed: at most 5"):
        read_text(ROWS)


def test_more_stations_than_may_be_kept_are_refused(read_text: Reading, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gathering, "MOST_STATIONS", 5)
    with pytest.raises(StationFileError, match="the file is more than 5 stations, allowed: at most 5"):
        read_text(ROWS)


@pytest.mark.parametrize("text", ["[%s]", "%s"])
def test_more_entries_than_may_be_read_are_refused(
    read_text: Reading, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    monkeypatch.setattr(entries, "MOST_ENTRIES", 5)
    point = '{"ID": 1, "AddressInfo": {}, "Connections": []}'
    with pytest.raises(StationFileError, match="the file is more than 5 entries, allowed: at most 5"):
        read_text(text % ",\n".join([point] * 8))


def test_names_of_unknown_plugs_are_told_apart_up_to_a_number(
    read_text: Reading, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gathering, "MOST_NAMES", 2)
    rows = "".join(f"48.{k},11.5,CCS2; Magic {k}\n" for k in range(1, 6))
    assert read_text("lat,lon,connectors\n" + rows).unknown_plugs == {"Magic 1": 1, "Magic 2": 1, "others": 3}


def test_only_the_first_messages_of_a_reason_are_kept(read_text: Reading) -> None:
    read = read_text("lat,lon,connectors\n48.1,11.5,CCS2\n" + "0,0,CCS2\n" * 10)
    assert read.left_out == {"place 0, 0": 10}
    assert len(read.examples["place 0, 0"]) == 3
