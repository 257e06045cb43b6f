"""One file given to the reader of its kind: an answer, a refusal in the project's own words, or a failure."""

from __future__ import annotations

import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from diagnosis.recordings.notes import RecordingError
from diagnosis.recordings.reading import read_recordings
from energy.charging.charging import MOST_POWER_W
from routing.errors import GraphFormatError, ImportFailedError
from routing.importers.region import import_region
from routing.stations.formats.numbers import LEAST_POWER_W
from routing.stations.formats.osm.station import OSM_KEY
from routing.stations.notes import StationFileError
from routing.stations.reading import ReadStations, read_stations
from tests.fuzz.samples import samples

STATIONS = "stations-"
MAPS = (".osm", ".pbf", ".graphml")
TILES = (".tif",)


@dataclass(frozen=True, slots=True)
class Ending:
    """How reading a file ended; text: the refusal, or the traceback of a failure."""

    kind: Literal["read", "refused", "failed"]
    text: str = ""


def ending_of(path: Path) -> Ending:
    """Read a file by its name: stations by how it begins, maps and heights by its ending, all else as a recording."""
    try:
        if path.name.startswith(STATIONS):
            _check_stations(read_stations(path))
        elif path.name.endswith(MAPS):
            import_region(path, [], "map")
        elif path.name.endswith(TILES):
            street = path.with_name("under.osm")
            street.write_bytes(samples()["map.osm"])
            import_region(street, [path], "map")
        else:
            _, errors = read_recordings([path])
            if errors:
                return Ending("refused", str(errors[0]))
    except (ImportFailedError, GraphFormatError, RecordingError, StationFileError) as refusal:
        return Ending("refused", str(refusal))
    except Exception:
        return Ending("failed", traceback.format_exc())
    return Ending("read")


def _check_stations(read: ReadStations) -> None:
    """Fail for a station that is out of bounds, whatever was in its file."""
    assert len({station.id for station in read.stations}) == len(read.stations) > 0
    for station in read.stations:
        assert abs(station.at.lat_deg) <= 90.0
        assert abs(station.at.lon_deg) <= 180.0
        assert station.source == read.source.key
        assert station.sockets or station.id.startswith(OSM_KEY)
        for socket in station.sockets:
            assert socket.count >= 1
            assert socket.output_w is None or LEAST_POWER_W <= socket.output_w <= MOST_POWER_W
        words = (station.id, station.name, station.operator, station.network, station.opening_hours or "")
        price = station.price
        assert all(word.isprintable() for word in (*words, "" if price is None else price.text))
    for text in (*read.notes, *read.left_out, *read.unknown_plugs, read.source.licence, *read.examples):
        assert text.isprintable()
        assert len(text) < 1000
