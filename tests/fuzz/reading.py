"""One file given to the reader of its kind: an answer, a refusal in the project's own words, or a failure."""

from __future__ import annotations

import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from diagnosis.recordings.notes import RecordingError
from diagnosis.recordings.reading import read_recordings
from routing.errors import GraphFormatError, ImportFailedError
from routing.importers.region import import_region
from tests.fuzz.samples import samples

MAPS = (".osm", ".pbf", ".graphml")
TILES = (".tif",)


@dataclass(frozen=True, slots=True)
class Ending:
    """How reading a file ended; text: the refusal, or the traceback of a failure."""

    kind: Literal["read", "refused", "failed"]
    text: str = ""


def ending_of(path: Path) -> Ending:
    """Read a file by its name's ending: maps and heights are imported, all else is a recording."""
    try:
        if path.name.endswith(MAPS):
            import_region(path, [], "map")
        elif path.name.endswith(TILES):
            street = path.with_name("under.osm")
            street.write_bytes(samples()["map.osm"])
            import_region(street, [path], "map")
        else:
            _, errors = read_recordings([path])
            if errors:
                return Ending("refused", str(errors[0]))
    except (ImportFailedError, GraphFormatError, RecordingError) as refusal:
        return Ending("refused", str(refusal))
    except Exception:
        return Ending("failed", traceback.format_exc())
    return Ending("read")
