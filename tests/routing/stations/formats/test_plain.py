from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from energy.charging.charging import Connector
from routing.stations.formats.numbers import number_of
from routing.stations.notes import StationFileError
from routing.stations.reading import read_stations
from routing.stations.station import Access, Price, Socket
from tests.routing.stations.formats.conftest import Reading

HEADER = "id,name,lat,lon,connectors,power_kw,operator,access,price,opening_hours,status\n"


def test_a_plain_table_is_read(read_text: Reading) -> None:
    rows = 'a1,Inn,48.1,11.5,"CCS2; Type 2",150;22,EnBW,customers,0.59 EUR/kWh,Mo-Fr 08:00-18:00,open\n'
    read = read_text(HEADER + rows)
    (station,) = read.stations
    assert station.id == "file-stations:a1"
    assert station.sockets == (Socket(Connector.CCS2, 150_000.0), Socket(Connector.TYPE2, 22_000.0, phases=3))
    assert (station.name, station.operator, station.access) == ("Inn", "EnBW", Access.CUSTOMERS)
    assert station.price == Price("0.59 EUR/kWh", "EUR", 0.59)
    assert (station.fee, station.opening_hours, station.operational) == (True, "Mo-Fr 08:00-18:00", True)


@pytest.mark.parametrize(
    "text",
    [
        "Latitude;Longitude;Plugs;Power (kW)\r\n48,1;11,5;CCS2;150,0\r\n",
        "lat\tlon\tplug\tpower_w\n48.1\t11.5\tCCS2\t150000\n",
        "\ufefflat,lon,connectors,power\n48.1,11.5,CCS2,150 kW\n",
        "lat|lon|connectors|power_kw\n48.1|11.5|ccs 2|150\n",
        '"lat","lon","connectors","power_w"\n"48.1","11.5","CCS2","150,000"\n',
        "lat;lon;connectors;power_w\n48,1;11,5;CCS2;150.000\n",
        "Stations of our club\n\nlng;lat;connectors\n11.5;48.1;CCS2 150 kW\n",
        "lat,lon,connectors\r48.1,11.5,CCS 2 (150 kW)\r",
        "lat,lon,connectors,power\n48.1,11.5,CCS2,0.15 MW\n",
        "lat,lon,connectors,power\n48.1,11.5,CCS2,150 kVA\n",
    ],
)
def test_delimiters_decimals_thousands_units_and_preambles_of_any_spreadsheet_are_read(
    read_text: Reading, text: str
) -> None:
    (station,) = read_text(text).stations
    assert (station.at.lat_deg, station.at.lon_deg) == (48.1, 11.5)
    assert station.sockets == (Socket(Connector.CCS2, 150_000.0),)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_letters_of_any_encoding_are_read(read_text: Reading, encoding: str) -> None:
    text = "Breitengrad;Längengrad;Connectors;Name\n48,1;11,5;Typ 2;Köln – Süd\n"
    assert read_text(text, encoding=encoding).stations[0].name == "Köln – Süd"


def test_counts_and_powers_stand_beside_plugs(read_text: Reading) -> None:
    row = 'x,x,48.1,11.5,"2x CCS2 150 kW, CHAdeMO 50kW, Type 2 x3 (3,7 kW)",,,,,,\n'
    assert read_text(HEADER + row).stations[0].sockets == (
        Socket(Connector.CCS2, 150_000.0, 2),
        Socket(Connector.CHADEMO, 50_000.0),
        Socket(Connector.TYPE2, 3_700.0, 3),
    )


def test_ccs_is_type_1_in_america_and_type_2_elsewhere(read_text: Reading) -> None:
    read = read_text("lat,lon,connectors\n40.7,-74,CCS\n48.1,11.5,CCS\n-33.8,151.2,CCS\n")
    kinds = [station.sockets[0].connector for station in read.stations]
    assert kinds == [Connector.CCS1, Connector.CCS2, Connector.CCS2]


def test_a_plug_of_alternating_current_gives_no_more_than_it_carries(read_text: Reading) -> None:
    read = read_text("lat,lon,connectors,power_kw\n48.1,11.5,CCS2;Type 2,50\n".replace("CCS2;Type 2", '"CCS2, Type 2"'))
    assert [socket.output_w for socket in read.stations[0].sockets] == [50_000.0, 43_700.0]


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("91,181,CCS2,50", "place out of range"),
        ("139.7,35.7,CCS2,50", "latitude and longitude swapped"),
        ("0.0,0,CCS2,50", "place 0, 0"),
        (",11.5,CCS2,50", "no place"),
        ("48°N,11.5,CCS2,50", "place that is no number"),
        ("nan,11.5,CCS2,50", "place that is no number"),
        ("48.1,11.5,magic,50", "no plug that is known"),
        ("48.1,11.5,,50", "no plug given"),
        ("48,1,11,5,CCS2,50", "more cells than the header"),
    ],
)
def test_a_bad_row_is_left_out_with_its_reason_and_the_others_are_read(
    read_text: Reading, row: str, reason: str
) -> None:
    read = read_text(f"lat,lon,connectors,power_kw\n48.1,11.5,CCS2,50\n{row}\n48.2,11.6,CCS2,50\n")
    assert len(read.stations) == 2
    assert read.left_out == {reason: 1}
    assert read.examples[reason][0].startswith("row 3: ")


def test_powers_out_of_bounds_are_unknown_and_noted(read_text: Reading) -> None:
    read = read_text("lat,lon,connectors,power_kw\n48.1,11.5,CCS2,22000\n48.2,11.5,CCS2,0\n48.3,11.5,CCS2,fast\n")
    assert [station.sockets[0].output_w for station in read.stations] == [None, None, None]
    (note,) = read.notes
    assert note == "powers that are no number or not 0.5..4000 kW, taken as not known: 3, first row 2: 22000"


def test_stations_without_an_id_have_one_of_their_place(read_text: Reading) -> None:
    read = read_text("lat,lon,connectors\n48.1,11.5,CCS2\n48.1,11.5,Type 2\n48.1,11.5,CCS2\n")
    begin = "file-stations:48.100000,11.500000"
    assert [station.id for station in read.stations] == [begin, f"{begin}#2", f"{begin}#3"]


def test_a_file_packed_with_gzip_is_read_and_a_cut_one_refused(tmp_path: Path) -> None:
    path = tmp_path / "stations.csv.gz"
    packed = gzip.compress(b"lat,lon,connectors\n48.1,11.5,CCS2\n")
    path.write_bytes(packed)
    assert len(read_stations(path).stations) == 1
    path.write_bytes(packed[:-10])
    with pytest.raises(StationFileError, match="not gzip"):
        read_stations(path)


def test_what_unpacks_to_more_than_may_be_read_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "stations.csv.gz"
    with gzip.open(path, "wb", compresslevel=1) as file:
        for _ in range(151):
            file.write(b" " * 1_000_000)
    with pytest.raises(StationFileError, match="larger than 150 MB"):
        read_stations(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "header is empty"),
        (b"a,b,c\n1,2,3\n", "the header is a,b,c, allowed: a format of charging stations"),
        (b"PK\x03\x04....", "zip or Excel"),
        (b"<html></html>", "XML or HTML"),
        (b"lat,lon\0\n1,2\n", "binary"),
        (b"\xff\xfea", "broken UTF-16"),
        (b"lat,lon,connectors\n", "without stations"),
        (
            b"lat,lon,power\n48.1,11.5,50\n",
            "line 1: the header is without a column of plugs, allowed: one of connectors",
        ),
        (b'{"a" 1}', "broken JSON"),
        (b'{"a": 1 "b": 2}', "broken JSON"),
        (b"{" + b",".join(b'"%d": 1' % k for k in range(1100)) + b"}", "more than 1000 members"),
        (b'{"ID": "' + b"x" * 5_000_000 + b'"}', "more than 4194304 letters"),
        (b'[{"ID": 1, "AddressInfo": {}}] x', "broken JSON"),
        (b"[" + b"1," * 60 + b"1]", "first entry has no members"),
        (b'lat,lon,connectors\n48.1,11.5,"CCS2\n' + b"48.1,11.5,CCS2\n" * 9000, "row .*quotes that are closed"),
        (b"lat,lon,connectors\n" + b"x" * 300_000, "line 2: the line is more than 200000 letters long"),
        (b"[]", "the file is empty"),
        (b'[{"a": 1}]', "first entry has a, allowed"),
        (b'[{"ID": 1, "AddressInfo": {}, "Connections": []}', "broken JSON"),
        (b'[{"ID": 1' + b"0" * 5000 + b"}]", "a number that is too long"),
        (b"[" * 100_000, "nested too deep"),
        (b'{"a": ' * 100_000, "nested too deep"),
    ],
)
def test_a_file_that_is_none_of_stations_is_refused_in_words(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "stations"
    path.write_bytes(content)
    with pytest.raises(StationFileError, match=message):
        read_stations(path)


def test_a_file_that_is_not_there_is_an_error_of_the_system(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_stations(tmp_path / "none.csv")


def test_a_place_that_is_swapped_beside_others_that_are_not_is_left_out_with_a_question(read_text: Reading) -> None:
    rows = [f"{48 + k / 10},{11 + k / 10},CCS2" for k in range(5)]
    read = read_text("\n".join(["lat,lon,connectors", *rows, "11.5,48.1,CCS2"]))
    assert len(read.stations) == 5
    assert read.left_out == {"latitude and longitude swapped": 1}
    assert "did you mean lat 48.1, lon 11.5?" in read.examples["latitude and longitude swapped"][0]


def test_places_all_over_the_world_are_kept(read_text: Reading) -> None:
    rows = ["48,11,CCS2", "11,48,CCS2", "-33,151,CCS2", "35,139,CCS2", "40,-74,CCS1"]
    assert len(read_text("\n".join(["lat,lon,connectors", *rows])).stations) == 5


def test_prices_in_numbers_have_their_currency(read_text: Reading) -> None:
    read = read_text(
        "lat;lon;connectors;price_kwh;price_session;currency\n48,1;11,5;CCS2;0,59;1;EUR\n48,2;11,5;CCS2;1;;?\n"
    )
    first, second = read.stations
    assert first.price == Price("0.59 EUR/kWh + 1 EUR/session", "EUR", 0.59, None, 1.0)
    assert (first.fee, second.price) == (True, None)


def test_text_in_utf_8_with_a_few_broken_letters_stays_utf_8(tmp_path: Path) -> None:
    path = tmp_path / "stations.csv"
    path.write_bytes("Breitengrad;Längengrad;Connectors;Name\n48,1;11,5;Typ 2;Köln".encode() + b" S\xfcd\n")
    assert read_stations(path).stations[0].name == "Köln S\ufffdd"


@pytest.mark.parametrize(
    ("text", "number"),
    [("1.234,5", 1234.5), ("1,234.5", 1234.5), ("1 234,5", 1234.5), ("1'234.5", 1234.5), ("1,2.3", None), ("1e3", 1e3)],
)
def test_signs_that_are_sure_are_read_whatever_the_file_writes_else(text: str, number: float | None) -> None:
    assert [number_of(text, decimal_comma=decimal_comma) for decimal_comma in (False, True)] == [number, number]


@pytest.mark.parametrize(
    "plug",
    ["2x CCS2 150 kW", "CCS2 x2 150 kW", "CCS2 150kW x2", "2 x 150 kW CCS2", "CCS2 (150 kW) x 2", "2× 150kW - CCS 2"],
)
def test_count_and_power_stand_before_or_behind_a_plug(read_text: Reading, plug: str) -> None:
    (station,) = read_text(f"lat,lon,connectors\n48.1,11.5,{plug}\n").stations
    assert station.sockets == (Socket(Connector.CCS2, 150_000.0, 2),)


def test_a_quote_that_is_never_closed_is_named_with_its_row_and_does_not_swallow_the_others(read_text: Reading) -> None:
    rows = [f"48.{k},11.5,CCS2,n{k}" for k in range(100, 200)]
    rows[5] = '48.9,11.5,CCS2,"broken'
    with pytest.raises(StationFileError, match=r"row 7.*95 lines long, allowed: at most 50; quotes that are closed"):
        read_text("\n".join(["lat,lon,connectors,name", *rows]) + "\n")


def test_what_is_not_taken_as_it_stands_is_noted_with_its_first_row_and_value(read_text: Reading) -> None:
    read = read_text(
        "lat,lon,connectors,count,capacity,status,access,opening_hours\n"
        "48.1,11.5,CCS2,-1,many,open,public,24/7\n"
        "48.2,11.5,CCS2 150000 kW,2,2,who knows,staff only,8 to 6\n"
        "48.3,11.5,CCS2,2.5,2,on strike,,24/7\n"
    )
    assert [station.sockets[0].count for station in read.stations] == [1, 2, 1]
    assert set(read.notes) == {
        "counts of sockets that are no whole number of 1..2000, taken as not known: 2, first row 2: -1",
        "capacities that are no whole number of 1..2000, taken as not known: 1, first row 2: many",
        "powers that are no number or not 0.5..4000 kW, taken as not known: 1, first row 3: CCS2 150000 kW",
        "words of status that are not known, taken as nothing said: 2, first row 3: who knows",
        "words of access that are not known, taken as unknown: 1, first row 3: staff only",
        "opening hours that are not in OpenStreetMap's syntax, not kept: 1, first row 3: 8 to 6",
    }


@pytest.mark.parametrize(
    ("status", "reason"),
    [
        ("Permanently closed", "removed"),
        ("permanently_closed", "removed"),
        ("dauerhaft geschlossen", "removed"),
        ("Under construction", "planned"),
        ("In Planung", "planned"),
    ],
)
def test_a_station_that_is_gone_or_not_there_yet_is_left_out(read_text: Reading, status: str, reason: str) -> None:
    read = read_text(f"lat,lon,connectors,status\n48.1,11.5,CCS2,{status}\n48.2,11.5,CCS2,temporarily closed\n")
    assert read.left_out == {reason: 1}
    assert [station.operational for station in read.stations] == [False]


def test_a_plug_that_there_is_none_of_is_no_socket(read_text: Reading) -> None:
    read = read_text('lat,lon,connectors\n48.1,11.5,"0x CCS2; 2x Type 2"\n48.2,11.5,0x CCS2\n')
    assert [(socket.connector, socket.count) for socket in read.stations[0].sockets] == [(Connector.TYPE2, 2)]
    assert read.left_out == {"no plug given": 1}


def test_a_quote_that_takes_the_rows_behind_it_is_refused_with_its_row(read_text: Reading) -> None:
    rows = 'lat,lon,connectors,name\n48.1,11.5,CCS2,a\n48.2,11.5,"CCS2,b\n48.3,11.5,CCS2,c\n48.4,11.5,CCS2,d\n'
    with pytest.raises(
        StationFileError, match=r"row 3: the row is 3 lines long with 3 cells, allowed: 4 cells; quotes"
    ):
        read_text(rows)


def test_a_byte_of_zero_is_named_with_its_line(read_text: Reading) -> None:
    with pytest.raises(StationFileError, match="line 3: the file is binary"):
        read_text("lat,lon,connectors\n48.1,11.5,CCS2\n48.2,11.5,C\0S2\n48.3,11.5,CCS2\n")
