"""What was not recorded, and what was filled in instead."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.answer.missing import filled_text, missing_channels
from tests.diagnosis.heights.ground import eastward


def test_height_that_was_filled_in_is_not_missing_but_told() -> None:
    blind = eastward()
    seen = replace(blind, elevation_m=np.zeros(blind.time_s.size))
    filled = replace(seen, elevation_source="dem.tif")
    assert "elevation_m" in [lack.channel for lack in missing_channels([blind, seen])]
    assert "elevation_m" not in [lack.channel for lack in missing_channels([filled, seen])]
    err = "its grades err by about 1 %."
    assert filled_text([filled, seen]) == f"Height was filled in from dem.tif on 1 of 2 drives; {err}"
    other = replace(seen, elevation_source="graph town")
    assert filled_text([filled, other]) == f"Height was filled in from dem.tif and graph town on all drives; {err}"


def test_recorded_height_is_not_told() -> None:
    assert filled_text([eastward(elevation_m=np.zeros(eastward().time_s.size))]) == ""
