from __future__ import annotations

import pytest

from energy.charging.charging import Connector
from routing.stations.station import Access, Socket
from tests.routing.stations.formats.conftest import Reading

OLD = (
    "Betreiber;Straße;Hausnummer;Adresszusatz;Postleitzahl;Ort;Bundesland;Kreis/kreisfreie Stadt;Breitengrad;"
    "Längengrad;Inbetriebnahmedatum;Anschlussleistung;Art der Ladeeinrichung;Anzahl Ladepunkte;Steckertypen1;P1 [kW];"
    "Public Key1;Steckertypen2;P2 [kW];Public Key2\r\n"
)
OLD_ROW = (
    "Werk AG;Weg;1;;50569;Köln;NRW;Köln;50,937417;6,97069;22.07.21;72;Schnellladeeinrichtung;2;"
    "AC Steckdose Typ 2, DC Kupplung Combo, DC CHAdeMO;50;;AC Steckdose Typ 2, AC Schuko;22;\r\n"
)
PREAMBLE = (
    "Ladesäulenregister Bundesnetzagentur;;;\r\n;;;\r\nHinweis: ;;;\r\nLetzte Aktualisierung vom: 01.09.2026;;;\r\n"
    "Allgemeine Informationen;;;1. Ladepunkt;;;;\r\n"
)
NEW = (
    "Ladeeinrichtungs-ID;Betreiber;Anzeigename (Karte);Status;Art der Ladeeinrichtung;Anzahl Ladepunkte;"
    "Nennleistung Ladeeinrichtung [kW];Straße;Hausnummer;Ort;Breitengrad;Längengrad;Standortbezeichnung;Öffnungszeiten;"
    "Öffnungszeiten: Wochentage;Öffnungszeiten: Tageszeiten;Steckertypen1;Nennleistung Stecker1;EVSE-ID1;Public Key1;"
    "Steckertypen2;Nennleistung Stecker2;EVSE-ID2;Public Key2\r\n"
)


def new_row(
    own_id: str = "1010338",
    status: str = "In Betrieb",
    place: str = "48,442398;9,659075",
    hours: str = "247;;",
    plugs: str = 'AC Typ 2 Steckdose;22;DE1;K;"AC Typ 2 Steckdose; AC Schuko";"11; 3,7";DE2;K',
) -> str:
    return f"{own_id};Werk AG;Werk;{status};Normalladeeinrichtung;2;22;Am Berg;1;Ort;{place};;{hours};{plugs}\r\n"


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252"])
def test_the_older_form_is_read(read_text: Reading, encoding: str) -> None:
    read = read_text(OLD + OLD_ROW, encoding=encoding)
    (station,) = read.stations
    assert (station.at.lat_deg, station.at.lon_deg) == (50.937417, 6.97069)
    assert station.sockets == (
        Socket(Connector.TYPE2, 43_700.0, 1, 3),  # the 50 kW are those of direct current
        Socket(Connector.CCS2, 50_000.0),
        Socket(Connector.CHADEMO, 50_000.0),
        Socket(Connector.TYPE2, 22_000.0, 1, 3),
        Socket(Connector.DOMESTIC, 3_700.0, 1, 1),
    )
    assert (station.name, station.operator, station.capacity) == ("Weg 1, Köln", "Werk AG", 2)
    assert (station.access, station.operational) == (Access.PUBLIC, None)
    assert read.source.licence == "CC BY 4.0"


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252"])
def test_the_present_form_is_read_below_its_preamble(read_text: Reading, encoding: str) -> None:
    read = read_text(PREAMBLE + NEW + new_row(), encoding=encoding)
    (station,) = read.stations
    assert station.id == "bnetza:1010338"
    assert station.sockets == (
        Socket(Connector.TYPE2, 22_000.0, 1, 3),
        Socket(Connector.TYPE2, 11_000.0, 1, 3),
        Socket(Connector.DOMESTIC, 3_700.0, 1, 1),
    )
    assert (station.network, station.opening_hours, station.operational) == ("Werk", "24/7", True)
    assert read.source.retrieved == "2026-09-01"


@pytest.mark.parametrize(
    ("hours", "expected"),
    [
        ('Eingeschränkt;"Montag; Dienstag; Mittwoch";"08:00-20:00; 08:00-20:00; 10:00-18:00"',
         "Mo-Tu 08:00-20:00; We 10:00-18:00"),
        ('Eingeschränkt;"Montag; Dienstag; Mittwoch; Donnerstag; Freitag; Samstag; Sonntag";"00:00-23:59"', "24/7"),
        ('Eingeschränkt;"Montag; Dienstag";"08:00-20:00; 08:00-20:00; 10:00-18:00"', None),
        ('Eingeschränkt;Montag;"morgens"', None),
        ("Keine Angabe;;", None),
    ],
)  # fmt: skip
def test_opening_hours_of_three_columns_become_rules(read_text: Reading, hours: str, expected: str | None) -> None:
    assert read_text(PREAMBLE + NEW + new_row(hours=hours)).stations[0].opening_hours == expected


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        (new_row("2", place="9,659075;48,442398"), "latitude and longitude swapped"),
        (new_row("2", place="0;0"), "place 0, 0"),
        (new_row("2", place=";"), "no place"),
        (new_row("2", status="In Planung"), "planned"),
        (new_row("2", plugs="Sonstige;22;;;;;;"), "no plug that is known"),
        (new_row("2", plugs=";;;;;;;"), "no plug given"),
        (new_row(), "id that is there already"),
    ],
)
def test_a_row_that_is_no_station_is_left_out_by_its_reason(read_text: Reading, row: str, reason: str) -> None:
    read = read_text(PREAMBLE + NEW + new_row() + row)
    assert len(read.stations) == 1
    assert read.left_out == {reason: 1}
    assert read.examples[reason][0].startswith("row 8: ")


def test_each_device_at_a_place_is_a_station_of_its_own_for_merging(read_text: Reading) -> None:
    read = read_text(OLD + OLD_ROW * 3)
    assert len({station.id for station in read.stations}) == 3


def test_a_single_point_without_a_power_has_that_of_the_device(read_text: Reading) -> None:
    read = read_text(PREAMBLE + NEW + new_row(plugs="AC Typ 2 Steckdose;;;;;;;"))
    assert read.stations[0].sockets == (Socket(Connector.TYPE2, 22_000.0, 1, 3),)
    assert any("that of the device" in note for note in read.notes)


def test_cells_of_blanks_are_read_at_once(read_text: Reading) -> None:
    blank = " " * 40_000
    row = new_row(hours=f"x;Montag{blank}x;x", plugs=f"x{blank}x;22{blank}x;;;AC Typ 2 Steckdose;22;;")
    read = read_text(PREAMBLE + NEW + row)
    assert read.stations[0].sockets == (Socket(Connector.TYPE2, 22_000.0, 1, 3),)
    assert read.unknown_plugs == {"x": 1}  # what is beyond the longest cell is cut


def test_a_portal_that_publishes_it_with_plain_names_and_decimal_points_is_read(read_text: Reading) -> None:
    read = read_text(
        "betreiber,art_der_ladeeinrichung,anzahl_ladepunkte,nennleistung_ladeeinrichtung_kw,steckertypen1,"
        "steckertypen2,p1_kw,p2_kw,ort,strasse,hausnummer,breitengrad,laengengrad\n"
        'OpA,Normalladeeinrichtung,2,33.5,"AC Steckdose Typ 2, AC / CEE",Typ 2 / Tesla,22.0,11.5,Burg,W,1,50.25,9.12\n'
    )
    (station,) = read.stations
    assert (station.at.lat_deg, station.at.lon_deg, station.name) == (50.25, 9.12, "W 1, Burg")
    assert [(socket.connector, socket.output_w) for socket in station.sockets] == [
        (Connector.TYPE2, 22_000.0),
        (Connector.CEE, 22_000.0),
        (Connector.TESLA_EU, 11_500.0),
    ]
