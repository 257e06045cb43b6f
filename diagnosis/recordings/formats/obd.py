"""Logs of Car Scanner ELM OBD2, long and wide, and of Torque: columns are parameters by their names in plain words.

Long: a reading a row, SECONDS of the day, PID, VALUE, UNITS and mostly LATITUDE and LONGTITUDE (so spelt).
Wide: a "time" column and one for each parameter, "name (unit)", with a value where it was read.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from diagnosis.recordings.formats.clocks import Series, recording_of_series, series_of
from diagnosis.recordings.formats.named_columns import MOST_KMH, MOST_W
from diagnosis.recordings.formats.tables import Column, LogTable, is_hidden
from diagnosis.recordings.formats.times import past_midnight
from diagnosis.recordings.formats.units import UNITS, is_unit, plain_unit
from diagnosis.recordings.notes import Note, NoteKind, OrderError, RecordingError, shown
from diagnosis.recordings.soundness.signs import power_sign
from energy.units import KMH_PER_MPS, ZERO_CELSIUS_K

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from diagnosis.recordings.recording import Recording

LONG: Final = ("SECONDS", "PID", "VALUE", "UNITS")
POSITIONS: Final = ("LATITUDE", "LONGTITUDE", "LONGITUDE")
DEVICE_TIME: Final = Column("Device Time", "time_s", 0.0, 1e10)
GPS_TIME: Final = Column("GPS Time", "time_s", 0.0, 1e10)
TORQUE_UNITS: Final = {"Altitude": "m", "Bearing": "°"}  # of columns that Torque writes without one
OBD_NAMES: Final = frozenset((*LONG, *POSITIONS, "time", "Device Time", "GPS Time", *TORQUE_UNITS))
SECONDS: Final = Column("SECONDS", "time_s", 0.0, 1e10)
TIME: Final = Column("time", "time_s", 0.0, 1e10)
LEAST_PACK_V: Final = 48.0  # below it is the battery of the lights
NAMED_MOST: Final = 12
LONGEST_NAME: Final = 300  # letters; a longer one is of no parameter

DISCHARGED: Final = r"(?:energy discharged|discharged? energy)"
CHARGED: Final = r"(?:energy charged|charged? energy)"
PACK: Final = r"(?:(?:hv|h\.v\.|high[- ]voltage|traction|main|drive|ev) )?(?:battery|pack)(?: pack)?"
OF_PACK: Final = (
    r"(?: (?:de la|del|della|da|der|de|van de|hv|вв))* (?:hv[- ]?)?"
    r"(?:batterie|bateria|batteria|batterij|accu|akku|батареи|аккумулятора)(?: hv| de traction)?"
)
PACK_COMPOUND: Final = r"(?:(?:hv|hochvolt)[- ]?)?(?:batterie|batterij|akku|accu)[- ]?"


def _of_pack(compounds: str, words: str) -> str:
    """A quantity of the battery in German and Dutch in one word, in these and others in several."""
    return rf"{PACK_COMPOUND}(?:{compounds})|(?:{compounds}|{words}){OF_PACK}"


@dataclass(frozen=True, slots=True)
class LoggedParameter:
    """Which names a channel goes by, the surer ones first, its kind of unit, and its range in SI units."""

    channel: str
    patterns: tuple[str, ...]
    units: str
    low: float
    high: float


LOGGED_PARAMETERS: Final = (
    LoggedParameter(
        "speed_mps",
        (
            r"vehicle speed",
            r"(?:vehicle |car |real |actual |wheel )?speed(?: sensor)?",
            r"speed \((?:gps|obd)\)|gps speed",
            r"(?:fahrzeug)?geschwindigkeit|(?:voertuig)?snelheid|vitesse(?: du vehicule)?|velocidad(?: del vehiculo)?"
            r"|velocidade(?: do veiculo)?|velocita(?: del veicolo| veicolo)?|скорость(?: автомобиля)?",
        ),
        "speed",
        0.0,
        MOST_KMH / KMH_PER_MPS,
    ),
    LoggedParameter(
        "power_w",
        (rf"{PACK}(?: dc)? power(?: \(hv\))?", _of_pack("leistung|vermogen", "puissance|potencia|potenza|мощность")),
        "power",
        -MOST_W,
        MOST_W,
    ),
    LoggedParameter(
        "voltage_v",
        (
            rf"{PACK}(?: dc)? voltage(?: \(hv\))?",
            _of_pack("spannung|spanning", "tension|voltaje|tensao|tensione|voltaggio|напряжение"),
        ),
        "voltage",
        0.0,
        2000.0,
    ),
    LoggedParameter(
        "current_a",
        (rf"{PACK}(?: dc)? current(?: \(hv\))?", _of_pack("strom|stroom", "courant|corriente|corrente|ток")),
        "current",
        -5000.0,
        5000.0,
    ),
    LoggedParameter(
        "soc_frac",
        (
            rf"(?:{PACK} |hv )?(?:state of charge|soc)(?: \(?(?:bms|real)\)?)?",
            r"(?:ladezustand|ladestand|laadtoestand|etat de charge|estado de carga|stato di carica"
            rf"|(?:степень|уровень) заряда)(?:{OF_PACK})?",
        ),
        "share",
        0.0,
        1.0,
    ),
    LoggedParameter(
        "displayed_frac",
        (rf"(?:{PACK} |hv )?(?:state of charge|soc) \(?(?:display|displayed|dash|user)\)?",),
        "share",
        0.0,
        1.0,
    ),
    LoggedParameter(
        "ambient_k",
        (
            r"(?:ambient|outside|outdoor|external|exterior)(?: air)? temp(?:erature|\.)?",
            r"(?:aussen|umgebungs)(?:luft)?temperatur|(?:buiten|omgevings)temperatuur"
            r"|temperature (?:exterieure|ambiante)|temperatura (?:exterior|externa|esterna|ambiente)(?: del aire)?"
            r"|температура (?:наружного воздуха|окружающ\w+ (?:среды|воздуха))",
        ),
        "temperature",
        ZERO_CELSIUS_K - 50.0,
        ZERO_CELSIUS_K + 56.0,
    ),
    LoggedParameter(
        "battery_k",
        (
            rf"{PACK}(?: average| avg| mean)? temp(?:erature|\.)?",
            rf"{PACK}(?: module)? temp(?:erature|\.)?(?: sensor)? \d+",
            rf"{PACK} (?:max|min)(?:imum|\.)? temp(?:erature|\.)?",
        ),
        "temperature",
        ZERO_CELSIUS_K - 50.0,
        ZERO_CELSIUS_K + 100.0,
    ),
    LoggedParameter("odometer_m", (r"odometer(?: reading)?|total (?:distance|mileage)",), "way", 0.0, 1e10),
    LoggedParameter(
        "used_j", (r"(?:trip |total |net )?(?:energy used|used energy|energy consumption)",), "energy", -1e13, 1e13
    ),
    LoggedParameter(
        "regen_j",
        (r"(?:trip |total )?(?:regen(?:erated|eration)?|recuperated|recuperation)(?: energy)?",),
        "energy",
        -1e13,
        1e13,
    ),
    LoggedParameter("drawn_j", (rf"(?:cumulative|accumulated) {DISCHARGED}",), "energy", 0.0, 1e13),
    LoggedParameter("fed_j", (rf"(?:cumulative|accumulated) {CHARGED}",), "energy", 0.0, 1e13),
    LoggedParameter("heater_w", (r"(?:ptc |cabin |coolant )?heater power", r"ptc power"), "power", 0.0, 100_000.0),
    LoggedParameter(
        "aircon_w", (r"(?:a/?c|air ?con(?:ditioning|ditioner)?)(?: compressor)? power",), "power", 0.0, 100_000.0
    ),
    LoggedParameter("elevation_m", (r"(?:altitude|elevation)(?: \(gps\))?|gps altitude",), "height", -500.0, 9000.0),
    LoggedParameter("heading_rad", (r"(?:heading|bearing|course)(?: \(gps\))?|gps bearing",), "angle", -7.0, 7.0),
    LoggedParameter("latitude_deg", (r"latitude",), "position", -90.0, 90.0),
    LoggedParameter("longitude_deg", (r"longt?itude",), "position", -180.0, 180.0),
)


@dataclass(frozen=True, slots=True)
class Readings:
    """All readings of one parameter as the file has them: rows are those of the table."""

    name: str
    unit: str
    time_s: NDArray[np.float64]
    cells: Sequence[str | float]
    rows: Sequence[int]


def is_wide(names: Sequence[str]) -> bool:
    """Whether a header is that of the wide form: a time, and a speed with its unit."""
    return TIME.name in names and any(_is_speed(name) for name in names)


def is_torque(names: Sequence[str]) -> bool:
    """Whether a header is that of Torque: the time of the device, and a speed with its unit."""
    return (DEVICE_TIME.name in names or GPS_TIME.name in names) and any(_is_speed(name) for name in names)


def read_torque(table: LogTable) -> Recording:
    """A track log of Torque, by the time of the device, or else of its receiver."""
    return read_wide(table, DEVICE_TIME if DEVICE_TIME.name in table.names else GPS_TIME)


def is_parameter(name: str) -> bool:
    """Whether a column of the wide form is read as a channel, by its name and unit."""
    plain, unit = _name_andplain_unit(name)
    found = _parameter(plain)
    return found is not None and plain_unit(unit) in UNITS[found[0].units]


def read_long(table: LogTable, hidden: Sequence[str]) -> Recording:
    """The long form; hidden are also patterns of the parameters' names."""
    time_s = past_midnight(table.values(SECONDS, required=True))
    back = np.diff(time_s) < 0.0
    if bool(back.any()):
        row = int(np.argmax(back)) + 1
        before, time = (str(table.cells(SECONDS.name)[k]).strip() for k in (row - 1, row))
        raise OrderError(table.path, table.lines[row], SECONDS.name, time, f"at least that of the row before, {before}")
    cells = table.cells("VALUE")
    rows_of: dict[tuple[str, str], list[int]] = {}
    for row, (name, unit) in enumerate(zip(table.cells("PID"), table.cells("UNITS"), strict=True)):
        rows_of.setdefault((str(name).strip(), str(unit).strip()), []).append(row)
    readings = [
        Readings(name, unit, time_s[rows], [cells[row] for row in rows], rows)
        for (name, unit), rows in rows_of.items()
        if not is_hidden(name, hidden)
    ]
    return _recording(table, [*readings, *_positions(table, time_s)])


def read_wide(table: LogTable, clock: Column = TIME) -> Recording:
    """The wide form; times are times of day, date-times or seconds."""
    time_s, _ = table.times(clock)
    rows = range(time_s.size)
    readings = []
    for name in dict.fromkeys(table.names):
        if name and name != clock.name:
            plain, unit = _name_andplain_unit(name)
            unit = TORQUE_UNITS.get(name, unit) if clock is not TIME else unit
            readings.append(Readings(plain, unit, time_s, list(table.cells(name)), rows))
    return _recording(table, readings)


def _positions(table: LogTable, time_s: NDArray[np.float64]) -> Iterator[Readings]:
    for name in POSITIONS:
        if name in table.names:
            yield Readings(name.lower(), "", time_s, list(table.cells(name)), range(time_s.size))


@dataclass(frozen=True, slots=True)
class Found:
    """A parameter that was found in a log, with the rank of the name that it goes by."""

    parameter: LoggedParameter
    rank: int
    series: Series
    unit: str


def _recording(table: LogTable, readings: Sequence[Readings]) -> Recording:
    """The recording of all readings that a channel is known for; power's sign is found from the drive."""
    found: list[Found] = []
    ignored: list[str] = []
    channels = {named[0].channel for reading in readings if (named := _parameter(reading.name)) is not None}
    needed = {"speed_mps", "power_w"} if "power_w" in channels else {"speed_mps", "voltage_v", "current_a"}
    for reading in readings:
        known = _found(table, reading, needed)
        if isinstance(known, str):
            ignored.append(f"{reading.name} [{reading.unit}]{known}")
        elif known.series.values.size:
            found.append(known)
    found.sort(key=lambda known: (LOGGED_PARAMETERS.index(known.parameter), known.rank))
    notes = [_read_note(known.series, known.unit) for known in found]
    if ignored:
        notes.append(Note(NoteKind.IGNORED, "", f"PIDs not used: {', '.join(ignored)}"))
    try:
        series = _net([known.series for known in found])
        recording = recording_of_series(table.path, table.id, series, notes)
    except RecordingError as error:
        if error.value != "missing":
            raise
        names = [reading.name for reading in readings]
        more = f" and {len(names) - NAMED_MOST} more" if len(names) > NAMED_MOST else ""
        value = f"missing among {', '.join(shown(name) for name in names[:NAMED_MOST])}{more}"
        raise RecordingError(error.path, error.row, error.column, value, error.allowed) from error
    return _discharge_positive(recording)


def _net(series: Sequence[Series]) -> list[Series]:
    """The series with cumulative energies discharged and charged as one counter of what left the battery in all."""
    drawn = next((record for record in series if record.channel == "drawn_j"), None)
    fed = next((record for record in series if record.channel == "fed_j"), None)
    others = [record for record in series if record.channel not in ("drawn_j", "fed_j")]
    if drawn is None or fed is None or not (drawn.values.size and fed.values.size):
        return others
    back = fed.previous_at(drawn.time_s)
    known = ~np.isnan(back)
    name = f"{drawn.source} less {fed.source}"
    return [*others, Series("used_j", name, drawn.time_s[known], drawn.values[known] - back[known])]


def _found(table: LogTable, reading: Readings, needed: set[str]) -> Found | str:
    """A parameter that is known, or why it is left aside, "" where nothing goes by its name."""
    known = _parameter(reading.name)
    if known is None:
        return ""
    parameter, rank = known
    if plain_unit(reading.unit) not in UNITS[parameter.units]:
        return f" (unit not one of {', '.join(filter(None, UNITS[parameter.units]))})"
    series = _series(table, reading, parameter, strict=parameter.channel in needed)
    if parameter.channel == "voltage_v" and series.values.size and float(np.median(series.values)) < LEAST_PACK_V:
        return " (not the drive's battery)"
    return Found(parameter, rank, series, reading.unit)


def _discharge_positive(recording: Recording) -> Recording:
    """The recording with the signs of current and power turned where the drive shows them upside down."""
    if power_sign(recording) != -1:
        return recording
    current = None if recording.current_a is None else -recording.current_a
    text = "sign turned, since the car gains speed while it is negative; positive is discharge now"
    note = Note(NoteKind.REPAIRED, "power_w", text)
    return replace(recording, power_w=-recording.power_w, current_a=current, notes=(*recording.notes, note))


def _read_note(series: Series, unit: str) -> Note:
    rate_s = float(np.median(np.diff(series.time_s))) if series.time_s.size > 1 else 0.0
    text = f"from {series.source!r} [{unit}], {series.values.size} values {rate_s:.2g} s apart"
    return Note(NoteKind.READ, series.channel, text)


def _name_andplain_unit(name: str) -> tuple[str, str]:
    """A wide column's name in two: its unit is in the last brackets, or behind a comma, a slash, "in" or "_"."""
    if len(name) > LONGEST_NAME:
        return name, ""
    match = re.fullmatch(r"(.*\S)\s*[(\[]([^()\[\]]*)[)\]]", name)
    if match is None:
        match = re.fullmatch(r"(.*\w)(?:,? in | / |, ?|_)(\S+)", name)
        match = match if match is not None and is_unit(match[2]) else None
    return (match[1], match[2]) if match else (name, "")


def _plain(name: str) -> str:
    """A name as patterns have it: in small letters without accents, and without its control unit such as [BMS]."""
    letters = unicodedata.normalize("NFKD", name.casefold())
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return " ".join(re.sub(r"^\s*\[[^\]]*\]", "", plain).replace("_", " ").split())


def _is_speed(name: str) -> bool:
    plain, unit = _name_andplain_unit(name)
    found = _parameter(plain)
    return found is not None and found[0].channel == "speed_mps" and plain_unit(unit) in UNITS["speed"]


def _parameter(name: str) -> tuple[LoggedParameter, int] | None:
    """The parameter that goes by a name, with the rank of the pattern that fits."""
    if len(name) > LONGEST_NAME:
        return None
    for parameter in LOGGED_PARAMETERS:
        for rank, pattern in enumerate(parameter.patterns):
            if re.fullmatch(pattern, _plain(name)):
                return parameter, rank
    return None


def _series(table: LogTable, reading: Readings, parameter: LoggedParameter, *, strict: bool) -> Series:
    """Values of a parameter in SI units; empty ones are left out, and so are positions of exactly 0."""
    to_si, offset = UNITS[parameter.units][plain_unit(reading.unit)]
    low, high = ((limit - offset) / to_si for limit in (parameter.low, parameter.high))
    column = Column(reading.name, parameter.channel, round(low, 3), round(high, 3), to_si, offset)
    cells = reading.cells if isinstance(reading.cells, list) else list(reading.cells)
    texts = [cell if isinstance(cell, str) else f"{cell!r}" for cell in cells]
    lines = [table.lines[row] for row in reading.rows]
    part = LogTable(table.path, table.id, (reading.name,), (texts,), lines, table.notes)
    values = part.values(column, strict=strict)
    if parameter.units == "position":
        values = np.where(values == 0.0, np.nan, values)
    return series_of(column, reading.time_s, values, reading.name)
