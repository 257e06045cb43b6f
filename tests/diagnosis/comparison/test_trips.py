"""Trip tables: what is read is SI, what is wrong is named with its place."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.comparison.trips import TripRecord, read_trips, write_trips
from diagnosis.errors import DiagnosisError, TripTableError

if TYPE_CHECKING:
    from pathlib import Path

HEADER = "trip,type,series,distance_km,duration_s,stops,standstill_s,energy_kwh"
ROW = "1,urban,measured,10,1800,20.5,300,1.5"


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def refused(path: Path) -> TripTableError:
    with pytest.raises(TripTableError) as caught:
        read_trips([path])
    return caught.value


def test_csv_is_read_into_si(tmp_path: Path) -> None:
    path = write(tmp_path / "trips.csv", HEADER + ",mass_kg", ROW + ",1810", "", "2, urban ,fast,10,1800,0,0,-0.5,")
    first, second = read_trips([path])
    assert first == TripRecord("1", "urban", "measured", 10_000.0, 1800.0, 20.5, 300.0, 5.4e6, 1810.0)
    assert (second.route_type, second.energy_j, second.mass_kg) == ("urban", -1.8e6, None)
    assert first.speed_mps == pytest.approx(10_000.0 / 1800.0)
    assert first.specific_j_per_m == pytest.approx(540.0)  # 15 kWh/100 km · 36


def test_columns_may_come_in_any_order_with_a_byte_order_mark(tmp_path: Path) -> None:
    names = HEADER.split(",")[::-1]
    path = tmp_path / "trips.csv"
    path.write_text("\ufeff" + ",".join(names) + "\r\n" + ",".join(ROW.split(",")[::-1]) + "\r\n", encoding="utf-8")
    assert read_trips([path]) == read_trips([write(tmp_path / "other.csv", HEADER, ROW)])


def test_json_is_read_as_csv_is(tmp_path: Path) -> None:
    entry = dict(zip(HEADER.split(","), [1, "urban", "measured", 10, 1800, 20.5, 300, "1.5"], strict=True))
    path = write(tmp_path / "trips.json", json.dumps([entry | {"mass_kg": None}]))
    assert read_trips([path]) == read_trips([write(tmp_path / "trips.csv", HEADER, ROW)])


@pytest.mark.parametrize(
    ("lines", "line", "column", "value", "allowed"),
    [
        ([HEADER, ROW.replace("10,", "0,", 1)], 2, "distance_km", "'0'", "above 0"),
        ([HEADER, ROW, "", ROW.replace("1800", "nan")], 4, "duration_s", "'nan'", "above 0"),
        ([HEADER, ROW.replace("20.5", "-1")], 2, "stops", "'-1'", "from 0 to 1e+06"),
        ([HEADER, ROW.replace("300", "1801")], 2, "standstill_s", "1801", "at most duration_s, 1800"),
        ([HEADER, ROW.replace("1.5", "lots")], 2, "energy_kwh", "'lots'", "from -100000 to 100000"),
        ([HEADER, ROW.replace("1.5", "")], 2, "energy_kwh", "empty", "a number"),
        ([HEADER, ROW.replace("urban", " ")], 2, "type", "empty", "not empty"),
        ([HEADER, ROW.replace("1.5", "-1e-307")], 2, "energy_kwh", "'-1e-307'", "0, or at least 1e-06 in magnitude"),
        ([HEADER, ROW.replace("20.5", "1e-9")], 2, "stops", "'1e-9'", "0, or at least 1e-06 in magnitude"),
        ([HEADER, ROW.replace("10,", "1e-300,", 1)], 2, "distance_km", "'1e-300'", "at least 1e-06"),
        ([HEADER, ROW.replace("urban", '"ur\nban"')], 2, "type", "'ur\\nban'", "without line breaks"),
        ([HEADER, "", ROW.replace("1,", "a\u2028b,", 1)], 3, "trip", "'a\\u2028b'", "without line breaks"),
        ([HEADER, ROW.replace("measured", "a\x1bb")], 2, "series", "'a\\x1bb'", "control characters"),
        ([HEADER, ROW + ",9"], 2, "the row", "9 cells", "8 cells"),
        ([HEADER + ",mass_kg", ROW + ",-5"], 2, "mass_kg", "'-5'", "above 0"),
        ([HEADER + ",colour", ROW + ",red"], 1, "a column", "'colour'", "mass_kg"),
        ([HEADER + ",type", ROW + ",urban"], 1, "column type", "twice", "trip, type"),
        ([HEADER.replace(",stops", ""), ROW], 1, "column stops", "missing", "stops"),
        ([HEADER.replace(",", ";"), ROW], 1, "a column", "'trip;type", "trip, type"),
        ([HEADER], 1, "the table", "without a trip", "at least one"),
        ([""], 1, "the header", "missing", HEADER),
        ([HEADER, '1,"urban,measured'], 2, "the row", "not CSV", "comma"),
        ([HEADER, ROW, ROW], 3, "trip", "'1'", "already at"),
    ],
)
def test_csv_error_names_file_line_column_value_and_range(
    tmp_path: Path, lines: list[str], line: int, column: str, value: str, allowed: str
) -> None:
    path = write(tmp_path / "trips.csv", *lines)
    error = refused(path)
    assert isinstance(error, DiagnosisError)
    assert (error.path, error.line, error.column) == (str(path), line, column)
    assert error.value.startswith(value) or value in error.value
    assert allowed in error.allowed
    assert str(error) == f"{path}, line {line}: {column} is {error.value}, allowed: {error.allowed}"


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("[{]", 1, "not JSON"),
        ("{}", 1, "not a list of trips"),
        ("[]", 1, "not a list of trips"),
        ("[3]", 1, "entry 1: the entry is 3"),
        ('[{"trip": "1"}]', 1, "entry 1: column type is missing"),
        ("[" * 100_000, 1, "the file is nested too deeply, allowed: a list of trips"),
        (f"[{'1' * 5000}]", 1, "the file is one with a whole number of more than 4300 digits"),
    ],
)
def test_json_error_names_the_entry(tmp_path: Path, text: str, line: int, message: str) -> None:
    error = refused(write(tmp_path / "trips.json", text))
    assert error.line == line
    assert message in str(error)


def test_json_error_in_a_number_that_is_not_one(tmp_path: Path) -> None:
    good = dict(zip(HEADER.split(","), ["1", "urban", "measured", 10, 1800, 20, 300, 1.5], strict=True))
    error = refused(write(tmp_path / "trips.json", json.dumps([good, good | {"trip": "2", "stops": True}])))
    assert (error.line, error.column, error.value) == (2, "stops", "True")


@pytest.mark.parametrize("label", ["\ud800", "a\nb", "a\tb", "a\x00b", "a\u2029b", "a\x85b"])
@pytest.mark.parametrize("name", ["trip", "type", "series"])
def test_label_that_no_table_can_show_is_refused(tmp_path: Path, name: str, label: str) -> None:
    good = dict(zip(HEADER.split(","), ["1", "urban", "measured", 10, 1800, 20, 300, 1.5], strict=True))
    error = refused(write(tmp_path / "trips.json", json.dumps([good, good | {"trip": "2"} | {name: label}])))
    assert (error.line, error.column, error.value) == (2, name, repr(label))
    str(error).encode("utf-8")


def test_file_that_is_not_utf8_is_refused_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "trips.csv"
    path.write_bytes(HEADER.encode() + b"\n\xff\n")
    assert refused(path).line == 2


def test_same_trip_in_two_files_is_refused(tmp_path: Path) -> None:
    first, second = write(tmp_path / "a.csv", HEADER, ROW), write(tmp_path / "b.csv", HEADER, ROW)
    with pytest.raises(TripTableError, match=r"b\.csv, line 2: trip is '1'.*a\.csv, line 2"):
        read_trips([first, second])


NAMES = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1, max_size=8)
SIZES = st.floats(1e-3, 1e4)
ENERGIES = st.floats(-1e9, 1e9).filter(lambda energy_j: energy_j == 0.0 or abs(energy_j) > 3.6)  # 1e-6 kWh


@given(
    st.lists(
        st.builds(TripRecord, NAMES, NAMES, NAMES, SIZES, SIZES, SIZES, st.just(0.0), ENERGIES, st.none() | SIZES),
        min_size=1,
        max_size=5,
        unique_by=lambda record: (record.trip_id, record.series),
    )
)
def test_written_trips_are_read_again(tmp_path_factory: pytest.TempPathFactory, records: list[TripRecord]) -> None:
    path = tmp_path_factory.mktemp("trips") / "trips.csv"
    write_trips(path, records)
    again = read_trips([path])
    assert len(again) == len(records)
    for was, now in zip(records, again, strict=True):
        assert (now.trip_id, now.route_type, now.series, now.mass_kg) == (
            was.trip_id,
            was.route_type,
            was.series,
            was.mass_kg,
        )
        assert now.distance_m == pytest.approx(was.distance_m, rel=1e-15)
        assert now.energy_j == pytest.approx(was.energy_j, rel=1e-15)
        assert (now.duration_s, now.stop_count) == (was.duration_s, was.stop_count)
    assert list(path.parent.iterdir()) == [path]


def test_failed_writing_leaves_the_old_table(tmp_path: Path) -> None:
    path = write(tmp_path / "trips.csv", HEADER, ROW)
    with pytest.raises(AttributeError):
        write_trips(path, [None])  # type: ignore[list-item]
    assert read_trips([path])[0].trip_id == "1"
    assert list(tmp_path.iterdir()) == [path]
