"""Exports of Leaf Spy, TeslaMate, Torque and OVMS, and GPX tracks: made ones, read into the same drive."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from diagnosis.engine import diagnose
from diagnosis.errors import DiagnosisError
from diagnosis.recordings.notes import NoteKind, RecordingError
from diagnosis.recordings.reading import read_recordings
from diagnosis.recordings.recording import Detail
from energy.vehicle.files import load_vehicle
from tests.diagnosis.planted_drives import drive as planted
from tests.diagnosis.recorded_drives import drive
from tests.diagnosis.test_engine_input import ROOT

BEGIN = datetime(2026, 3, 1, 8, 0, 0, tzinfo=UTC)
UTC_S = BEGIN.timestamp()
VOLT = 380.0


def stamps(driven, form):
    return [datetime.fromtimestamp(UTC_S + time, tz=UTC).strftime(form) for time in driven.time_s]


def csv_of(columns):
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n"


def minutes(values_deg):
    return [f"{int(value)} {60.0 * (value - int(value)):.6f}" for value in values_deg]


def leaf_spy(driven, *, miles, position=minutes):
    to_user = 1.0 / 1.609344 if miles else 1.0
    n = driven.time_s.size
    return (
        csv_of(
            {
                "Date/Time": stamps(driven, "%m/%d/%Y %H:%M:%S"),
                "Lat": position(driven.lat_deg),
                "Long": position(driven.lon_deg),
                "Elv": np.round(np.linspace(500.0, 520.0, n) / (0.3048 if miles else 1.0), 2),
                "Speed": np.round(3.6 * driven.speed_mps * to_user, 3),
                "Gids": [300] * n,
                "SOC": np.linspace(869_720, 860_000, n).round().astype(int),
                "Pack Volts": [VOLT] * n,
                "Pack Amps": np.round(driven.power_w / VOLT, 4),
                "Pack T1 F": [50.0] * n,
                "Pack T1 C": [10.0] * n,
                "Pack T3 C": ["none"] * n,
                "Odo(km)": np.full(n, 82_363.0),
                "Ambient": [41.0 if miles else 5.0] * n,
                "epoch time": [f"{UTC_S + time:.3f}" for time in driven.time_s],
                "Est Pwr A/C(50w)": [4] * n,
                "Est Pwr Htr(250w)": [0] * n,
                "Debug": [1] * n,
            }
        )
        .replace("Debug\n", "Debug,Debug\n", 1)
        .replace(",1\n", ",1,1\n")
    )


@pytest.mark.parametrize("miles", [True, False])
@pytest.mark.parametrize("position", [minutes, list])
def test_leaf_spy_is_read_whatever_units_its_user_has_set(read, miles, position):
    driven = drive()
    recording = read(leaf_spy(driven, miles=miles, position=position))
    assert recording.speed_mps == pytest.approx(driven.speed_mps, abs=0.01)
    assert recording.power_w == pytest.approx(driven.power_w, abs=0.1)
    assert recording.elevation_m[-1] == pytest.approx(520.0, abs=0.1)
    assert float(recording.ambient_k[0]) == pytest.approx(278.15)
    assert float(recording.soc_frac[0]) == pytest.approx(0.86972)
    assert float(recording.aircon_w[0]) == 200.0
    assert recording.longitude_deg == pytest.approx(driven.lon_deg, abs=1e-6)
    unit = "miles an hour and feet" if miles else "km/h and metres"
    assert any(unit in note.text for note in recording.notes if note.kind is NoteKind.READ)


def test_leaf_spy_without_positions_says_that_its_units_are_assumed(read):
    driven = drive()
    recording = read(leaf_spy(driven, miles=False, position=lambda values: ["0 0.0"] * len(values)))
    assert recording.latitude_deg is None
    assert any("assumed" in note.text for note in recording.notes if note.channel == "speed_mps")


def teslamate(driven, ids, shift=(0.0, 4000.0)):
    columns = {name: [] for name in ("id", "drive_id", "date", "speed", "power", "odometer", "latitude", "longitude",
                                     "elevation", "battery_level", "usable_battery_level", "outside_temp")}  # fmt: skip
    for drive_id, later_s in zip(ids, shift, strict=False):
        later = replace(driven, time_s=driven.time_s + later_s)
        columns["drive_id"] += [drive_id] * driven.time_s.size
        columns["date"] += stamps(later, "%Y-%m-%d %H:%M:%S.%f")
        columns["speed"] += np.round(3.6 * driven.speed_mps).astype(int).tolist()
        columns["power"] += np.round(driven.power_w / 1000.0).astype(int).tolist()
        columns["odometer"] += [f"{12_000.0 + 0.01 * k:.3f}" for k in range(driven.time_s.size)]
        columns["latitude"] += driven.lat_deg.tolist()
        columns["longitude"] += driven.lon_deg.tolist()
        columns["elevation"] += [500 + k // 100 for k in range(driven.time_s.size)]
        columns["battery_level"] += [80] * driven.time_s.size
        columns["usable_battery_level"] += [79] * driven.time_s.size
        columns["outside_temp"] += [8.5] * driven.time_s.size
    columns["id"] = range(len(columns["date"]))
    return columns


def test_teslamate_positions_are_a_drive_an_id_whatever_their_order(tmp_path):
    driven = drive()
    columns = teslamate(driven, ("7", "8", ""), (0.0, 4000.0, 9000.0))
    order = np.random.default_rng(1).permutation(len(columns["date"]))
    shuffled = {name: [values[k] for k in order] for name, values in columns.items()}
    path = tmp_path / "positions.csv"
    path.write_text(csv_of(shuffled), encoding="utf-8")
    found, errors = read_recordings([path])
    assert errors == []
    assert sorted(recording.id for recording in found) == ["positions-7", "positions-8"]
    for recording in found:
        assert recording.speed_mps == pytest.approx(driven.speed_mps, abs=0.15)
        assert recording.power_w == pytest.approx(driven.power_w, abs=501.0)
        assert float(recording.displayed_frac[0]) == pytest.approx(0.8)
        assert float(recording.ambient_k[0]) == pytest.approx(281.65)


def test_one_bad_drive_of_teslamate_is_left_out_with_its_reason(tmp_path):
    columns = teslamate(drive(), ("7", "8"))
    half = len(columns["date"]) // 2
    columns["power"] = [*columns["power"][:half], *[-value for value in columns["power"][half:]]]
    path = tmp_path / "positions.csv"
    path.write_text(csv_of(columns), encoding="utf-8")
    found, (error,) = read_recordings([path])
    assert [recording.id for recording in found] == ["positions-7"]
    assert "turn the sign of power" in str(error)


def test_teslamate_without_a_drive_is_refused(read):
    columns = teslamate(drive(), ("",))
    with pytest.raises(RecordingError, match="drive_id is empty in each row"):
        read(csv_of(columns))


def test_torque_is_read_with_its_own_clock_units_and_gaps(read):
    driven = drive()
    n = driven.time_s.size
    columns = {
        "GPS Time": ["Sun Mar 01 08:00:00 GMT 2026"] * n,
        " Device Time": stamps(driven, "%d-%b-%Y %H:%M:%S.000"),
        " Longitude": driven.lon_deg,
        " Latitude": driven.lat_deg,
        "GPS Speed (Meters/second)": np.round(driven.speed_mps, 2),
        " Altitude": np.linspace(500.0, 520.0, n).round(2),
        " Bearing": [90.0] * n,
        "Speed (OBD)(km/h)": np.round(3.6 * driven.speed_mps, 2),
        "HV Battery Current(A)": np.round(driven.power_w / VOLT, 3),
        "HV Battery Voltage(V)": [VOLT] * n,
        "Ambient air temp(°C)": ["-", *["7"] * (n - 1)],
    }
    recording = read(csv_of(columns), "trackLog.csv")
    assert recording.speed_mps == pytest.approx(driven.speed_mps, abs=0.01)
    assert recording.power_w == pytest.approx(driven.power_w, abs=1.0)
    assert recording.elevation_m[-1] == pytest.approx(520.0)
    assert recording.heading_rad[0] == pytest.approx(np.pi / 2.0)
    assert recording.time_s[0] == UTC_S
    assert float(recording.ambient_k[-1]) == pytest.approx(280.15)


@pytest.mark.parametrize("clock", ["timestamp", "m.time.utc"])
def test_ovms_metrics_are_read(read, clock):
    driven = drive()
    n = driven.time_s.size
    times = stamps(driven, "%Y-%m-%dT%H:%M:%SZ") if clock == "timestamp" else (UTC_S + driven.time_s).astype(int)
    columns = {
        clock: times, "v.p.speed": 3.6 * driven.speed_mps, "v.b.power": driven.power_w / 1000.0, "v.b.soc": [55.5] * n,
        "v.p.latitude": driven.lat_deg, "v.p.longitude": driven.lon_deg, "v.p.altitude": np.linspace(400.0, 420.0, n),
        "v.e.temp": ["", *["-3"] * (n - 1)], "v.b.temp": [4] * n, "v.p.odometer": np.full(n, 10.0),
        "v.e.on": ["yes"] * n,
    }  # fmt: skip
    recording = read(csv_of(columns))
    assert recording.speed_mps == pytest.approx(driven.speed_mps)
    assert recording.power_w == pytest.approx(driven.power_w)
    assert recording.time_s[0] == UTC_S
    assert float(recording.soc_frac[0]) == pytest.approx(0.555)
    assert any("v.e.on" in note.text for note in recording.notes if note.kind is NoteKind.IGNORED)


@pytest.mark.parametrize("name", ["v.p.speed", "metric/v/p/speed"])
def test_ovms_readings_a_row_are_read(read, name):
    driven = drive(200.0)
    rows = []
    for time, speed, power in zip(driven.time_s, driven.speed_mps, driven.power_w, strict=True):
        rows += [(UTC_S + time, name, 3.6 * speed), (UTC_S + time + 0.1, "v.b.power", power / 1000.0),
                 (UTC_S + time + 0.2, "v.e.on", "yes")]  # fmt: skip
    recording = read(csv_of(dict(zip(("time", "metric", "value"), zip(*rows, strict=True), strict=True))))
    assert recording.speed_mps == pytest.approx(driven.speed_mps[1:])
    inside = slice(5, -5)
    expected = np.interp(recording.time_s, UTC_S + driven.time_s + 0.1, driven.power_w)
    assert recording.power_w[inside] == pytest.approx(expected[inside])
    assert any("v.e.on" in note.text for note in recording.notes if note.kind is NoteKind.IGNORED)


def gpx(driven, extra=lambda k: "", head=""):
    points = "".join(
        f'<trkpt lat="{lat:.8f}" lon="{lon:.8f}"><ele>{500.0 + 0.1 * k:.1f}</ele><time>{stamp}</time>'
        f"{extra(k)}</trkpt>\n"
        for k, (lat, lon, stamp) in enumerate(
            zip(driven.lat_deg, driven.lon_deg, stamps(driven, "%Y-%m-%dT%H:%M:%SZ"), strict=True)
        )
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n{head}<gpx version="1.1" creator="made"'
        f' xmlns="http://www.topografix.com/GPX/1/1"><trk><name>x</name><trkseg>\n{points}</trkseg></trk></gpx>\n'
    )


def test_gpx_track_is_a_profile_of_its_positions_without_power(read):
    driven = drive()
    recording = read(gpx(driven), "tour.gpx")
    assert recording.id == "tour"
    assert recording.detail is Detail.PROFILE
    assert recording.distance_m() == pytest.approx(float(np.trapezoid(driven.speed_mps, driven.time_s)), rel=0.01)
    assert recording.speed_mps == pytest.approx(driven.speed_mps, abs=1.1)
    assert recording.elevation_m[10] == pytest.approx(501.0)
    assert any(note.channel == "power_w" and note.kind is NoteKind.MISSING for note in recording.notes)


def test_track_whose_declared_encoding_is_none_is_read_as_its_text(read):
    assert read(gpx(drive()).replace("UTF-8", "none"), "a.gpx").detail is Detail.PROFILE


def test_speed_that_points_of_a_track_carry_counts(read):
    driven = drive()
    recording = read(gpx(driven, lambda k: f"<extensions><speed>{driven.speed_mps[k]}</speed></extensions>"), "a.gpx")
    assert recording.speed_mps == pytest.approx(driven.speed_mps)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("<gpx><trk></trk></gpx>", "the track is 0 points with a time"),
        ("<gpx><trk>", "the file is broken XML"),
        ('<!DOCTYPE gpx [<!ENTITY a "b">]><gpx></gpx>', "the file is XML with a document type"),
        ('<gpx><trkpt lat="91" lon="1"><time>2026-01-01T00:00:00Z</time></trkpt>'
         '<trkpt lat="1" lon="1"><time>2026-01-01T00:00:01Z</time></trkpt></gpx>', "row 1: lat is 91"),
    ],
)  # fmt: skip
def test_gpx_that_is_no_track_says_what_is_wrong(read, text, found):
    with pytest.raises(RecordingError, match=found):
        read(text, "a.gpx")


def test_track_beside_drives_is_unfit_and_alone_is_refused(read):
    car = load_vehicle(ROOT / "data" / "vehicles" / "bmw-i3-60ah.toml")
    track = read(gpx(drive()), "tour.gpx")
    found = diagnose([track, planted(car, 1)], car)
    assert [(note.trip_id, note.channel) for note in found.data_quality if note.kind == "unfit"] == [
        ("tour", "power_w")
    ]
    assert [account.id for account in found.trips] == ["T1"]
    with pytest.raises(DiagnosisError, match="power_w was recorded on no drive"):
        diagnose([track], car)


@pytest.mark.parametrize(
    "write",
    [
        lambda value, sign: f"{sign}{int(value)} {60.0 * (value % 1.0):.6f}",
        lambda value, sign: f"{sign}{int(value)}\u00b0{60.0 * (value % 1.0):.6f}'",
        lambda value, sign: f"{int(value)} {60.0 * (value % 1.0):.6f} {sign}",
        lambda value, sign: f"{int(value)}\u00b0{int(60.0 * (value % 1.0))}'{value * 3600.0 % 60.0:.4f}{sign}",
        lambda value, sign: f"{sign}{int(value)} {60.0 * (value % 1.0):.6f}".replace(".", ","),
    ],
    ids=["N48 8", "N48 degrees", "48 8 N", "seconds", "comma"],
)
@pytest.mark.parametrize("west", [False, True])
def test_positions_in_degrees_and_minutes_are_read_with_their_letters(read, write, west):
    driven = drive()
    text = leaf_spy(driven, miles=False, position=lambda values: ["0 0.0"] * len(values)).replace(",", ";")
    rows = [line.split(";") for line in text.splitlines()]
    for row, latitude, longitude in zip(rows[1:], driven.lat_deg, driven.lon_deg, strict=True):
        row[1], row[2] = write(latitude, "S" if west else "N"), write(longitude, "W" if west else "E")
    recording = read("\n".join(";".join(row) for row in rows))
    sign = -1.0 if west else 1.0
    assert recording.latitude_deg == pytest.approx(sign * driven.lat_deg, abs=2e-6)
    assert recording.longitude_deg == pytest.approx(sign * driven.lon_deg, abs=2e-6)


def test_leaf_spy_with_other_temperatures_percent_and_miles_is_read_in_their_units(read):
    text = leaf_spy(drive(), miles=False).replace("Pack T1 C", "Pack T9 C").replace("Odo(km)", "Odo(mi)")
    rows = [line.split(",") for line in text.splitlines()]
    charge, ambient = rows[0].index("SOC"), rows[0].index("Ambient")
    for k, row in enumerate(rows[1:]):
        row[charge], row[ambient] = f"{86.97 - 0.01 * k:.2f}", "41"
    recording = read("\n".join(",".join(row) for row in rows))
    assert float(recording.soc_frac[0]) == pytest.approx(0.8697)
    assert float(recording.battery_k[0]) == pytest.approx(283.15)  # of Pack T1 F
    assert float(recording.ambient_k[0]) == pytest.approx(278.15)
    assert float(recording.odometer_m[0]) == pytest.approx(82_363.0 * 1609.344)


def test_one_bad_time_leaves_the_other_drives_of_teslamate(tmp_path):
    columns = teslamate(drive(), ("7", "8"))
    columns["date"][3] = "soon"
    (tmp_path / "positions.csv").write_text(csv_of(columns), encoding="utf-8")
    (found,), (error,) = read_recordings([tmp_path])
    assert found.id == "positions-8"
    assert "drive positions-7, row 5: date is soon" in str(error)


@pytest.mark.parametrize("topic", ["metric/{}", "ovms/me/car/metric/{}"])
@pytest.mark.parametrize("names", ["time,metric,value", "time,topic,payload"])
def test_ovms_readings_of_a_broker_are_read_with_their_units(read, names, topic):
    driven = drive()
    lines = [names]
    for time, speed, power in zip(driven.time_s, driven.speed_mps, driven.power_w, strict=True):
        lines.append(f"{time},{topic.format('v/p/speed')},{speed / 0.44704:.6f}Mph")
        lines.append(f"{time},{topic.format('v/b/power')},{power / 1000.0:.6f}kW")
    recording = read("\n".join(lines))
    assert recording.speed_mps == pytest.approx(driven.speed_mps, abs=1e-5)
    assert recording.power_w == pytest.approx(driven.power_w, abs=0.01)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("2026-03-01 08:00:00,RT-GPS-Log,0,86400,48.1,11.5\n" * 3, "records of OVMS' history have none"),
        ("id,start_date,end_date,distance\n1,2026-03-01 08:00:00,2026-03-01 08:30:00,20\n" * 2, "table of positions"),
        ("<kml><Document/></kml>\n" * 3, "XML or HTML .* allowed: GPX"),
        ("$GPRMC,080000,A\n$GPRMC,080001,A\n$GPRMC,080002,A\n", "NMEA has no power"),
    ],
)
def test_exports_that_are_no_log_say_what_to_export(read, text, word):
    with pytest.raises(RecordingError, match=word):
        read(text)


def one_bad_place(text):
    at = text.index("<trkpt", len(text) // 2)
    return f"{text[:at]}{text[at:].replace(chr(34) + '48.', chr(34) + '0.', 1)}"


@pytest.mark.parametrize(
    ("change", "noted"),
    [
        (lambda text: "\ufeff\n" + text, None),
        (lambda text: text[:-60], "ends in the midst"),
        (one_bad_place, "points left out"),
        (lambda text: text.replace('lat="48.00000000"', 'lat="98.0"', 1), "points left out"),
        (lambda text: text.replace('lat="48.', 'lat="48,'), None),
        (lambda text: text.replace("<trkseg>", "").replace("</trkseg>", ""), None),
        (lambda text: text.replace("<?xml", "?xml").replace("<", "<g:").replace("<g:/", "</g:").replace("?xml", "<?xml")
         .replace("<g:<", "<").replace("xmlns=", "xmlns:g="), None),
    ],
    ids=["mark", "cut off", "stray", "out of range", "comma", "no segment", "prefix"],
)  # fmt: skip
def test_tracks_with_small_faults_are_read_and_what_was_left_out_is_told(read, change, noted):
    driven = drive()
    recording = read(change(gpx(driven)), "a.gpx")
    assert recording.time_s.size >= driven.time_s.size - 2
    assert recording.speed_mps.max() < 20.5
    assert noted is None or any(noted in note.text for note in recording.notes if note.kind is NoteKind.REPAIRED)


def test_tracks_of_a_file_are_put_in_the_order_of_their_begin(read):
    driven = drive()
    text = gpx(driven)
    begin, end = text.index("<trkpt"), text.index("</trkseg>")
    half = text.index("<trkpt", (begin + end) // 2)
    swapped = f"{text[:begin]}{text[half:end]}</trkseg><trkseg>{text[begin:half]}{text[end:]}"
    recording = read(swapped, "a.gpx")
    assert recording.time_s - UTC_S == pytest.approx(driven.time_s)
    assert any("order of their begin" in note.text for note in recording.notes)
