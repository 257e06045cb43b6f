"""Numbers as people write them in tags: outputs, counts, voltages, currents."""

from __future__ import annotations

import math
import re
from typing import Final

from energy.charging.charging import MOST_POWER_W
from routing.stations.formats.numbers import LEAST_POWER_W

MOST_PARTS: Final = 20  # of a list
# what a number without a unit is: no car charges at less than a kilowatt, no station has an output of a megawatt
_BARE_WATT: Final = 1000.0
_OUTPUT: Final = re.compile(
    r"(?:(?P<count>\d{1,3})\s*[x×*]\s*)?(?P<number>\d{1,7}(?:[.,]\d{1,3})?)\s*(?P<unit>k\s?w|k\s?va|mw|mva|w|va)?(?![a-z])",
)
_UNITS_W: Final = {"kw": 1e3, "kva": 1e3, "mw": 1e6, "mva": 1e6, "w": 1.0, "va": 1.0}
_GROUPED: Final = re.compile(r"[1-9]\d{0,2}[.,]\d{3}")
_SIGN: Final = re.compile(r"[.,]")
_NUMBER: Final = re.compile(r"\d{1,6}(?:[.,]\d{1,3})?")
_COUNT: Final = re.compile(r"\d{1,4}")


def outputs_w(text: str) -> list[float]:
    """Outputs that a tag names [W], each as often as it says: `22 kW`, `22 kVA`, `50;22`, `2x11 kW`, `22000`, `7,4`.

    A number without a unit is in kilowatts below 1000, else in watts. What is no power that a plug could have is passed
    over.
    """
    found: list[float] = []
    for part in re.split(r"[;/|+&]|,\s+", text.casefold())[:MOST_PARTS]:
        match = _OUTPUT.search(part)
        if match is None:
            continue
        unit = (match["unit"] or "").replace(" ", "")
        # three digits behind a sign are thousands of watts, as no output is told in thousandths of one
        is_grouped = unit in ("w", "va") and _GROUPED.fullmatch(match["number"]) is not None
        number = float(_SIGN.sub("" if is_grouped else ".", match["number"]))
        power_w = number * _UNITS_W[unit] if unit else number * (1.0 if number >= _BARE_WATT else 1e3)
        if LEAST_POWER_W <= power_w <= MOST_POWER_W:
            found += [power_w] * min(int(match["count"] or 1), MOST_PARTS)
    return found


def count_of(text: str) -> int | None:
    """How many a tag says that there are: its number, 1 for `yes`, 0 for `no`; None where it says nothing."""
    value = text.strip().casefold()
    if value in ("yes", "true"):
        return 1
    if value in ("no", "none", "false"):
        return 0
    numbers = [int(match[0]) for part in value.split(";")[:MOST_PARTS] if (match := _COUNT.match(part.strip()))]
    return sum(numbers) if numbers else None


def greatest(text: str) -> float | None:
    """The greatest number in a text, None where there is none."""
    found = [float(number.replace(",", ".")) for number in _NUMBER.findall(text)[:MOST_PARTS]]
    return max(found, default=None)


def alternating_w(volt: float, ampere: float, phases: int) -> float:
    """Power of alternating current [W] from the voltage between its lines: three phases above 300 V."""
    return volt * ampere * (math.sqrt(3.0) if phases == 3 else 1.0)
