"""When recorded columns are all of the cabin's climate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.causes.climate import climate_w
from diagnosis.recordings.recording import Detail, Recording

pytestmark = pytest.mark.nojit

N = 100
HEATER_W, COOLER_W = np.full(N, 900.0), np.full(N, 300.0)


def drive(celsius: float | None, **columns: np.ndarray | Detail) -> Recording:
    ambient_k = None if celsius is None else np.full(N, 273.15 + celsius)
    return replace(Recording("a", np.arange(float(N)), np.ones(N), np.ones(N), ambient_k=ambient_k), **columns)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("celsius", "columns", "mean_w"),
    [
        (None, {"hvac_w": HEATER_W}, 900.0),
        (15.0, {"heater_w": HEATER_W, "aircon_w": COOLER_W}, 1200.0),
        (5.0, {"heater_w": HEATER_W}, 900.0),
        (15.0, {"heater_w": HEATER_W}, None),
        (None, {"heater_w": HEATER_W}, None),
        (30.0, {"aircon_w": COOLER_W}, 300.0),
        (15.0, {"aircon_w": COOLER_W}, None),
        (5.0, {}, None),
        (5.0, {"hvac_w": np.where(np.arange(N) < 50, np.nan, 900.0)}, None),
        (5.0, {"hvac_w": HEATER_W, "detail": Detail.CHARGE}, None),
    ],
)
def test_climate_is_known_only_where_its_columns_are_all_of_it(
    celsius: float | None, columns: dict[str, np.ndarray], mean_w: float | None
) -> None:
    found = climate_w(drive(celsius, **columns))
    assert (None if found is None else float(found.mean())) == mean_w


def test_single_missing_samples_are_bridged() -> None:
    column = HEATER_W.copy()
    column[40:43] = np.nan
    found = climate_w(drive(5.0, hvac_w=column))
    assert found is not None
    assert float(found.min()) == 900.0
