"""docs/recordings.md: its examples are read as the formats they stand for, and its table has every channel."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from diagnosis.recordings.formats.named_columns import ABRP_COLUMNS, PLAIN_COLUMNS
from diagnosis.recordings.notes import NoteKind
from diagnosis.recordings.reading import Recording, read_recording

PAGE = (Path(__file__).resolve().parents[3] / "docs/recordings.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^### ([^\n]*)\n(?:(?!^#).)*?^```(csv|json)\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_every_format_has_its_example():
    names = [name for name, _, _ in EXAMPLES]
    assert names == [
        "joulepath's own columns",
        "ABRP telemetry",
        "Car Scanner, long",
        "Car Scanner, wide",
        "Torque",
        "Leaf Spy",
        "TeslaMate",
        "OVMS",
        "TUM BMW i3",
    ]


@pytest.mark.parametrize(("name", "kind", "text"), EXAMPLES, ids=[name for name, _, _ in EXAMPLES])
def test_example_is_read(tmp_path, name, kind, text):
    path = tmp_path / ("drive.csv" if kind == "csv" else "drive.jsonl")
    path.write_text(text, encoding="utf-8")
    recording = read_recording(path)
    first_w = {"joulepath's own columns": 380.1 * 2.1, "ABRP telemetry": 9400.0, "TUM BMW i3": 391.4 * 2.2}
    if name in first_w:
        assert recording.power_w[0] == pytest.approx(first_w[name])
    assert recording.time_s.size >= 2
    assert recording.voltage_v is not None or name in ("ABRP telemetry", "TeslaMate", "OVMS")


def test_table_has_every_channel_and_every_column():
    table = PAGE.partition("## Channels")[2].partition("**One clock.**")[0]
    named = set(re.findall(r"`(\w+)`", table))
    assert {field.name for field in fields(Recording)} - {"id", "notes", "gaps", "detail"} <= named
    assert {column.name for column in (*PLAIN_COLUMNS, *ABRP_COLUMNS)} <= named


def test_every_kind_of_note_is_told():
    assert {kind.value for kind in NoteKind} <= set(re.findall(r"`(\w+)`", PAGE))
