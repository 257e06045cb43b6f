"""Colours of the report: readable in light and dark, and one for each family."""

from __future__ import annotations

import re

import pytest

from diagnosis.causes.families import Family
from diagnosis.report.plots import family_class
from diagnosis.report.style import CSS


def _luminance(colour: str) -> float:
    """Relative luminance of #rrggbb (WCAG 2.2)."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _contrast(ink: str, ground: str) -> float:
    bright, dark = sorted((_luminance(ink), _luminance(ground)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("scheme", [0, 1], ids=["light", "dark"])
def test_colours_stand_out_from_the_page(scheme):
    blocks = re.findall(r":root \{(.*?)\}", CSS, re.DOTALL)
    colours = dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6})", blocks[scheme]))
    assert {"paper", "panel", "ink", *(family.value for family in Family)} <= set(colours)
    for name, colour in colours.items():
        if name in {"paper", "panel", "rule", "grid"}:
            continue
        least = 4.5 if name in {"ink", "soft", "after"} else 3.0
        for ground in ("paper", "panel"):
            if ground == "paper" or least > 3.0:
                assert _contrast(colour, colours[ground]) >= least, (name, ground)


def test_each_family_has_a_colour_of_its_own():
    names = [*(family.value for family in Family), "never heard of"]
    rules = dict(re.findall(r"\.(f-[a-z]+) \{ fill: var\(--([a-z]+)\); \}", CSS))
    assert len({rules[family_class(name)] for name in names}) == len(names)
