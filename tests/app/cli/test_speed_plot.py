"""The picture of speeds is a PNG that shows both drives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from app.cli.speed_plot import COLOURS, DOTS_PER_INCH, SIZE_INCH, draw_speeds
from app.schemas.simulation import SimulateRequest, SimulationModel

if TYPE_CHECKING:
    from pathlib import Path

    from app.service.service import Service

CHAIN = [
    {"length_m": 800, "speed_limit_kmh": 80},
    {"length_m": 30, "speed_limit_kmh": 50, "cross": "medium"},
    {"length_m": 700, "speed_limit_kmh": 30},
]


def has_colour(pixels: np.ndarray, colour: str) -> bool:
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    return bool((np.abs(pixels[..., :3].astype(int) - wanted).max(axis=-1) < 12).any())


def test_plot_of_both_models_shows_both(service: Service, tmp_path: Path) -> None:
    course, drawn = service.speed_drawing(SimulateRequest.model_validate({"chain": CHAIN}))
    assert list(drawn) == [SimulationModel.FAST, SimulationModel.TIMESTEP]
    assert {profile.stop_rule.value for profile in drawn.values()} == {"counted"}
    draw_speeds(tmp_path / "speed.png", drawn, course.chain.length_m, course.chain.speed_limit_mps, "title")
    with Image.open(tmp_path / "speed.png") as picture:
        assert picture.size == tuple(round(inch * DOTS_PER_INCH) for inch in SIZE_INCH)
        pixels = np.asarray(picture)
    for model in SimulationModel:
        assert has_colour(pixels, COLOURS[model])


def test_plot_of_equations_as_printed_shows_the_fast_model_alone(service: Service, tmp_path: Path) -> None:
    sent = SimulateRequest.model_validate({"chain": CHAIN, "link_model": "printed", "stops": "none"})
    course, drawn = service.speed_drawing(sent)
    assert list(drawn) == [SimulationModel.FAST]
    draw_speeds(tmp_path / "speed.png", drawn, course.chain.length_m, course.chain.speed_limit_mps)
    with Image.open(tmp_path / "speed.png") as picture:
        assert not has_colour(np.asarray(picture), COLOURS[SimulationModel.TIMESTEP])


def test_plot_into_no_folder_is_an_error_of_the_file(service: Service, tmp_path: Path) -> None:
    course, drawn = service.speed_drawing(SimulateRequest.model_validate({"chain": CHAIN}))
    with pytest.raises(OSError, match="nowhere"):
        draw_speeds(tmp_path / "nowhere" / "s.png", drawn, course.chain.length_m, course.chain.speed_limit_mps)
