"""Words and numbers of the report: plain text, rounded to what its interval carries; nothing here is markup."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Final

from diagnosis.answer.regimes import EDGES, Axis
from diagnosis.causes.families import Family
from diagnosis.fit.axes import AXES
from diagnosis.fit.selection import LEAST_TRIPS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from diagnosis.answer.regimes import RegimeResidual
    from diagnosis.answer.results import Diagnosis, Finding, FitScore, Interval, ParameterError, Unexplained

NONE: Final = "–"
SPACE: Final = "\N{NO-BREAK SPACE}"
MINUS: Final = "\N{MINUS SIGN}"
INTERVAL_DIGITS: Final = 2  # of an interval's half width
VALUE_DIGITS: Final = 3  # of a value without an interval
SMALL_KWH: Final = 0.5  # of 10 kWh
PLAIN_DIGITS: Final = 5
MOST_PLACES: Final = 4  # that a sentence lists

FAMILY_NAMES: Final[Mapping[str, str]] = {
    Family.THERMAL: "heating and cooling",
    Family.ROLLING: "rolling resistance",
    Family.AERODYNAMIC: "air drag",
    Family.WIND: "wind",
    Family.MASS: "load",
    Family.GRADE: "slopes",
    Family.DRIVETRAIN: "losses of the drivetrain",
    Family.RECUPERATION: "recuperation",
    Family.BATTERY: "losses of the battery",
    Family.AUXILIARY: "auxiliaries",
    Family.PROFILE: "way of driving",
    Family.UNEXPLAINED: "unexplained",
}
FAMILY_WORDS: Final[Mapping[str, str]] = {
    Family.THERMAL: "heating or cooling the cabin and the battery",
    Family.ROLLING: "tyres that roll harder on their road",
    Family.AERODYNAMIC: "the drag of the air",
    Family.WIND: "wind",
    Family.MASS: "moving a load",
    Family.GRADE: "slopes",
    Family.DRIVETRAIN: "losses of motor and gears",
    Family.RECUPERATION: "limits of recuperation",
    Family.BATTERY: "losses in the battery",
    Family.AUXILIARY: "lights, electronics and other auxiliaries",
    Family.PROFILE: "the way of driving, that is speeds and stops",
    Family.UNEXPLAINED: "something unknown",
}
PARAMETER_NAMES: Final[Mapping[str, str]] = {
    "mass_kg": "mass",
    "road_load_a_n": "rolling resistance (A)",
    "road_load_b_n_per_mps": "road load that grows with speed (B)",
    "road_load_c_n_per_mps2": "air drag (C)",
    "drive_eff": "efficiency of the drive",
    "recuperation_eff": "efficiency of recuperation",
    "aux_power_w": "power of the auxiliaries",
    "usable_capacity_wh": "usable capacity",
}
AXIS_NAMES: Final[Mapping[str, tuple[str, str]]] = {
    axis: (AXES[axis].label, AXES[axis].unit)
    for axis in (Axis.AMBIENT, Axis.SINCE_START, Axis.SPEED, Axis.POWER, Axis.STANDSTILL, Axis.GRADE, Axis.SOC)
}
_UNIT: Final = re.compile("(_(w|n|kg))?_per_[a-z0-9_]+$|_(km|m|s|min|h|kmh|mps|kw|w|kwh|c|k|deg|rad|frac|kg|n|pa)$")


def decimals(value: float, interval: Interval = None) -> int:
    """Decimals to show: INTERVAL_DIGITS of the interval's half width, else VALUE_DIGITS of the value; −1 means tens."""
    half = 0.0 if interval is None else 0.5 * abs(interval[1] - interval[0])
    if math.isfinite(half) and half > 0.0:
        return INTERVAL_DIGITS - 1 - math.floor(math.log10(half))
    if math.isfinite(value) and value != 0.0:
        return VALUE_DIGITS - 1 - math.floor(math.log10(abs(value)))
    return 0


def fixed(value: float, places: int, *, signed: bool = False) -> str:
    """A number with so many decimals (negative: rounded to tens and so on), a true minus, no minus before zero."""
    if not math.isfinite(value):
        return NONE
    text = f"{round(value, places):.{max(places, 0)}f}"
    if float(text) == 0.0:
        return text.removeprefix("-")
    if text.startswith("-"):
        return f"{MINUS}{text[1:]}"
    return f"+{text}" if signed else text


def number(value: float, interval: Interval = None, *, signed: bool = False) -> str:
    """A number as its interval carries it."""
    return fixed(value, decimals(value, interval), signed=signed)


def plain(value: float) -> str:
    """A number that was chosen or that nothing says the precision of: up to PLAIN_DIGITS digits, none for show."""
    return f"{value:.{PLAIN_DIGITS}g}".replace("-", MINUS) if math.isfinite(value) else NONE


def with_unit(text: str, unit: str) -> str:
    """A number's text with its unit; dimensionless ones have none."""
    return text if unit in ("", "1", "-") or text == NONE else f"{text}{SPACE}{unit}"


def quantity(value: float, interval: Interval, unit: str) -> str:
    """A value with unit and interval as a sentence has it."""
    shown = with_unit(number(value, interval), unit)
    if interval is None or shown == NONE:
        return shown
    low, high = (fixed(bound, decimals(value, interval)) for bound in interval)
    return f"{shown} (95{SPACE}%: {low} to {high})"


def percents(interval: Interval) -> Interval:
    """An interval of shares in percent."""
    return None if interval is None else (100.0 * interval[0], 100.0 * interval[1])


def spoken(name: str) -> str:
    """A name of the library as a reader says it."""
    return name.replace("_", " ")


def count(number_of: int, noun: str) -> str:
    """So many of a thing whose plural has an s."""
    return f"{number_of} {noun}{'' if number_of == 1 else 's'}"


def span(low: float, high: float, unit: str = "") -> str:
    """From low to high, open where a bound is infinite."""
    if math.isinf(low) and math.isinf(high):
        return "everywhere"
    if math.isinf(low):
        return f"below {with_unit(plain(high), unit)}"
    if math.isinf(high):
        return f"above {with_unit(plain(low), unit)}"
    return f"{plain(low)} to {with_unit(plain(high), unit)}"


def regime_range(axis: Axis, low: float, high: float) -> str:
    """A regime's range with its unit; the outermost ranges of `EDGES` are open."""
    if axis is Axis.STANDSTILL:
        return "standing" if low > 0.0 else "driving"
    edges = EDGES[axis]
    first = -math.inf if low <= edges[0] and low < 0.0 else low
    last = math.inf if high >= edges[-1] else high
    return span(first, last, AXIS_NAMES[axis][1])


def places(regimes: Sequence[RegimeResidual]) -> tuple[str, ...]:
    """Where regimes lie, in words; ranges that touch are one."""
    found: list[str] = []
    for axis in Axis:
        ranges: list[list[float]] = []
        for low, high in sorted((regime.low, regime.high) for regime in regimes if regime.axis is axis):
            if ranges and low <= ranges[-1][1]:
                ranges[-1][1] = max(high, ranges[-1][1])
            else:
                ranges.append([low, high])
        found += [_place(axis, low, high) for low, high in ranges]
    return tuple(found)


def share_interval(finding: Finding) -> Interval:
    """Interval of a finding's share of the energy, from that of its energy."""
    if finding.energy_kwh_ci95 is None or finding.energy_kwh == 0.0:
        return None
    scale = finding.energy_share_frac / finding.energy_kwh
    return finding.energy_kwh_ci95[0] * scale, finding.energy_kwh_ci95[1] * scale


def heaviest_first(findings: Sequence[Finding]) -> list[Finding]:
    """Findings by the size of their energy."""
    return sorted(findings, key=lambda finding: -abs(finding.energy_kwh))


def finding_sentence(finding: Finding) -> str:
    """What a finding costs of every 10 kWh, and where it shows, for a driver."""
    rivals = dict.fromkeys(FAMILY_WORDS[rival.family] for rival in finding.ambiguous_with)
    causes = " or ".join([FAMILY_WORDS[finding.family], *rivals])
    interval = share_interval(finding)
    tenth = None if interval is None else (10.0 * interval[0], 10.0 * interval[1])
    size = 10.0 * finding.energy_share_frac
    if size < 0.0:
        size, tenth = -size, None if tenth is None else (-tenth[1], -tenth[0])
        text = (
            f"For every 10{SPACE}kWh that your car took, the model expects {_tenth(size, tenth)} too much: "
            f"it leaves out {causes}"
        )
    else:
        text = (
            f"Of every 10{SPACE}kWh that your car took, {_tenth(size, tenth)} went into "
            f"{'either ' if rivals else ''}{causes}, which the model leaves out"
        )
    where = places(finding.located)
    shown = f" It shows {listed(where[:MOST_PLACES])}." if where else ""
    return f"{text}; {quantity(finding.energy_kwh, finding.energy_kwh_ci95, 'kWh')} in all.{shown}"


def rivals_sentence(finding: Finding) -> str:
    """What a finding cannot be told from."""
    rivals = listed(
        [f"{effect_name(rival.effect)} ({FAMILY_NAMES[rival.family]})" for rival in finding.ambiguous_with], "or"
    )
    return f"These drives cannot tell {effect_name(finding.effect)} ({FAMILY_NAMES[finding.family]}) from {rivals}."


def rivals_sentences(finding: Finding) -> str:
    """What a finding costs, what it cannot be told from, and what drive would tell, for a driver."""
    separating = finding.separating_recording
    advice = "" if separating is None else f" What would tell them apart: {separating.rstrip('.')}."
    return f"{finding_sentence(finding)} {rivals_sentence(finding)}{advice}"


def parameter_sentence(error: ParameterError) -> str:
    """A parameter as the drives have it and as the vehicle file has it."""
    fitted = quantity(error.fitted, error.ci95, error.unit)
    return (
        f"The drives speak for another {parameter_name(error.parameter)}: {fitted}; the vehicle file says "
        f"{with_unit(number(error.nameplate, error.ci95), error.unit)}."
    )


def unexplained_sentence(place: Unexplained) -> str:
    """Where power stays unexplained, and how much."""
    more = "more" if place.mean_w >= 0.0 else "less"
    size, interval = abs(place.mean_w), place.ci95_w
    if interval is not None and place.mean_w < 0.0:
        interval = (-interval[1], -interval[0])
    return (
        f"Where {axis_name(place.axis).lower()} is {span(place.low, place.high, place.unit)}, your car takes "
        f"{quantity(size, interval, 'W')} {more} than on the rest of its drives, "
        f"{with_unit(number(abs(place.energy_kwh)), 'kWh')} in all, and no effect that this tool knows explains it."
    )


def too_few_sentence(diagnosis: Diagnosis) -> str:
    """How many drives there are and how many it takes."""
    trips = len(diagnosis.fitted_trips) or len(diagnosis.trips)
    if not trips:
        return f"No drive could be used; it takes at least {_least(diagnosis)} to name a cause."
    verb = "is" if trips == 1 else "are"
    return f"{count(trips, 'drive')} {verb} too few to name a cause: at least {_least(diagnosis)} are needed."


def fit_sentence(before: FitScore | None, after: FitScore | None, held_out: int) -> str:
    """How far drives are missed before and after, for a driver."""
    kind = "drives that it was not fitted to" if held_out else "drives left out of the fit one at a time"
    if before is None or after is None:
        return "There are too few drives to say how well the model meets one that it has not seen."
    if before == after:
        return f"On {kind}, the model misses a drive's energy by {_mape(before)} on average."
    return (
        f"On {kind}, the model missed a drive's energy by {_mape(before)} on average; "
        f"with what was learned it misses by {_mape(after)}."
    )


def axis_name(axis: str) -> str:
    """What an axis is called."""
    return AXIS_NAMES[axis][0] if axis in AXIS_NAMES else spoken(_UNIT.sub("", axis)).capitalize()


def effect_name(effect: str) -> str:
    """What an effect of the library is called."""
    return spoken(_UNIT.sub("", effect))


def parameter_name(parameter: str) -> str:
    """What a field of the vehicle is called."""
    return PARAMETER_NAMES.get(parameter, spoken(_UNIT.sub("", parameter)))


def listed(texts: Sequence[str], word: str = "and") -> str:
    """Texts as a sentence lists them."""
    if len(texts) < 2:
        return "".join(texts)
    return f"{', '.join(texts[:-1])} {word} {texts[-1]}"


def probability(p: float) -> str:
    """A chance, never rounded to 0."""
    if not math.isfinite(p):
        return NONE
    return "< 0.001" if p < 0.001 else fixed(p, 3 if p < 0.1 else 2)


def _mape(score: FitScore) -> str:
    return quantity(100.0 * score.mape, percents(score.mape_ci95), "%")


def _least(diagnosis: Diagnosis) -> int:
    """Trips that it takes to name a cause, as the diagnosis was made or else as selection has it."""
    least = diagnosis.model.get("least_trips")
    return least if isinstance(least, int) else LEAST_TRIPS


def _tenth(kwh: float, interval: Interval) -> str:
    """A part of 10 kWh as a driver wants it: to a tenth, small ones to a hundredth."""
    places = 1 if kwh >= SMALL_KWH else 2
    shown = with_unit(fixed(kwh, places), "kWh")
    if interval is None:
        return shown
    return f"{shown} (95{SPACE}%: {fixed(interval[0], places)} to {fixed(interval[1], places)})"


def _place(axis: Axis, low: float, high: float) -> str:
    reach = regime_range(axis, low, high)
    if axis is Axis.STANDSTILL:
        return f"while {reach}"
    if axis is Axis.SINCE_START:
        return f"{reach} after the start"
    if axis is Axis.POWER:
        return f"where the model expects {reach}"
    return reach if reach.startswith(("below", "above")) else f"at {reach}"
