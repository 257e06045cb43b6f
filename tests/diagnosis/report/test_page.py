"""The page: sound HTML that loads nothing, text that stays text, figures as the diagnosis has them, words that fit."""

from __future__ import annotations

import math
import re
from dataclasses import fields, is_dataclass, replace
from html.parser import HTMLParser
from itertools import pairwise

import numpy as np
import pytest

from diagnosis.answer.regimes import EDGES, Axis, RegimeResidual
from diagnosis.answer.results import (
    CapacityEstimate,
    CapacityKind,
    Coefficient,
    Diagnosis,
    Finding,
    FitScore,
    ParameterError,
    ProfileSplit,
    QualityNote,
    Rival,
    TripAccount,
    TripTimeline,
    Unexplained,
    Verdict,
)
from diagnosis.causes.battery import BatteryLoss
from diagnosis.causes.families import Family
from diagnosis.report.page import report_html
from diagnosis.report.style import CSS

VOID = {"meta"}
HOSTILE = "<script>alert(1)</script><img src=\"http://a.example/x\" onerror='x'>&amp;\ud800\x00\u202e"
SHOWN = "<script>alert(1)</script><img src=\"http://a.example/x\" onerror='x'>&amp;?\ufffd\ufffd"


class Page(HTMLParser):
    """A page read strictly: tags must balance; tables by caption as rows of (text, values of <data>)."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.tables: dict[str, list[list[tuple[str, list[float]]]]] = {}
        self.text = ""
        self._rows: list[list[tuple[str, list[float]]]] = []
        self._caption = ""
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert len(attrs) == len(dict(attrs)), f"twice the same attribute: {attrs}"
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self._rows = []
        elif tag == "caption":
            self._caption = ""
        elif tag == "tr":
            self._rows.append([])
        elif tag in ("td", "th"):
            self._rows[-1].append(("", []))
        elif tag == "data":
            self._rows[-1][-1][1].append(float(dict(attrs)["value"] or "nan")) if "td" in self.open else None

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        if tag == "table":
            self.tables[self._caption] = self._rows

    def handle_data(self, data: str) -> None:
        if "style" in self.open:
            return
        self.text += data
        if "caption" in self.open:
            self._caption += data
        elif "td" in self.open or "th" in self.open:
            text, values = self._rows[-1][-1]
            self._rows[-1][-1] = (text + data, values)


def timeline(seconds: float = 1800.0, window_s: float = 10.0) -> TripTimeline:
    begin = np.arange(0.0, seconds, window_s)
    power = 9000.0 + 4000.0 * np.sin(begin / 90.0)
    return TripTimeline(
        begin, np.full(begin.size, window_s), np.full(begin.size, 12.0), power, power * 0.8, power * 0.97
    )


def trip(name: str, held_out: bool = False, ambient_c: float | None = -3.21, **changes: object) -> TripAccount:
    known = TripAccount(
        name, held_out, ambient_c, 21.345, 1800.0, 4.567, 3.211, 3.654, 4.432, 4.521, {"thermal": 0.987}, timeline()
    )
    return replace(known, **changes)


def regimes(scale: float) -> tuple[RegimeResidual, ...]:
    return tuple(
        RegimeResidual(
            axis, low, high, 531.7 * scale + k, 431.2 * scale, 632.2 * scale + 2 * k, 1.234 * scale, 7200.0, 9
        )
        for axis in EDGES
        for k, (low, high) in enumerate(pairwise(EDGES[axis]))
    )


HEATING = Finding(
    "cabin_heating",
    Family.THERMAL,
    "Heating draws power while it is cold.",
    (Coefficient("cabin_ua_w_per_k", "W/K", 98.234, (87.11, 109.36)), Coefficient("shape", "1", 0.5, None)),
    34.213,
    (30.021, 38.405),
    0.1893,
    9.34,
    (RegimeResidual(Axis.AMBIENT, -50.0, -5.0, 800.0, 500.0, 1100.0, 9.0, 9000.0, 4),),
    ("A1",),
)
ALIKE = replace(
    HEATING,
    ambiguous_with=(Rival("rolling_temp", Family.ROLLING),),
    separating_recording="a drive in the cold with long stops.",
)
MASS = ParameterError(
    "mass_kg", Family.MASS, "kg", 1270.0, 1443.2, (1381.4, 1502.9), 6.213, 0.0341, ("payload",), "It is heavier."
)
PLACE = Unexplained("distance_km", "km", 4.2, 5.1, 812.4, (630.2, 994.6), 2.134, 0.0042, ("A1",), "Odd at one place.")
BEFORE = FitScore(0.1748, (0.1391, 0.2143), -0.0712, 0.1934, 1840.4)
AFTER = FitScore(0.0589, (0.0471, 0.0724), 0.0043, 0.0713, 1130.2)
SPLIT = ProfileSplit("A1", 5.123, 4.012, 4.567, 1500.0, 1800.0, 12.4, 15, 4.321)


def diagnosis(verdict: Verdict = Verdict.LEFT_OUT_PHYSICS, **changes: object) -> Diagnosis:
    trips = (trip("A1"), trip("A2", ambient_c=None), trip("B1", held_out=True, after_kwh=4.1))
    known = Diagnosis(
        "i3",
        verdict,
        "What the drives say.",
        (HEATING,),
        (MASS,),
        (PLACE,),
        (QualityNote("A1", "gap", "power_w", "Gap of 12 s."), QualityNote("A2", "gap", "power_w", "Gap of 12 s.")),
        ("A1", "A2"),
        ("B1",),
        BEFORE,
        AFTER,
        None,
        regimes(1.0),
        regimes(0.1),
        trips,
        {"cabin_ua_w_per_k": 98.234},
        {"cabin_ua_w_per_k": (87.11, 109.36)},
        {"mass_kg": 1443.2},
        {"tyre_warm_up": "no time since the start."},
        (SPLIT,),
        {"version": "1.2", "seed": 42, "thresholds": {"t": 3.31}, "terms": ["cabin_heating"], "calibrated": True},
    )
    return replace(known, **changes)


def bare(verdict: Verdict = Verdict.TOO_FEW_TRIPS) -> Diagnosis:
    return Diagnosis("i3", verdict, "", (), (), (), (), (), (), None, None, None, (), (), (), {}, {}, {}, {})


def hostile(thing: object) -> object:
    """The same with HOSTILE in front of every free text, nested ones and keys included."""
    if isinstance(thing, (Family, Verdict, Axis, bool, int, float, np.ndarray)) or thing is None:
        return thing
    if isinstance(thing, str):
        return HOSTILE + thing
    if isinstance(thing, tuple):
        return tuple(hostile(part) for part in thing)
    if isinstance(thing, dict):
        return {hostile(name): hostile(value) for name, value in thing.items()}
    if isinstance(thing, list):
        return [hostile(part) for part in thing]
    assert is_dataclass(thing)
    return type(thing)(*(hostile(getattr(thing, field.name)) for field in fields(thing)))


def shown(value: float) -> float:
    return float(f"{value:.6g}")


def values(row: list[tuple[str, list[float]]]) -> list[float]:
    """Figures of a row, each of which its text must show to half a unit of its last digit that is not a rounding 0."""
    for text, figures in row:
        for said, figure in zip(re.findall(r"[−+]?\d+(?:\.\d+)?", text), figures, strict=True) if figures else ():
            unit = 10.0 ** (-len(said.partition(".")[2]) if "." in said else len(said) - len(said.rstrip("0")))
            assert float(said.replace("−", "-")) == pytest.approx(figure, abs=0.5001 * unit), text
    return [figure for _, figures in row for figure in figures]


@pytest.mark.parametrize("verdict", Verdict)
@pytest.mark.parametrize("make", [diagnosis, bare])
def test_page_is_balanced_whatever_the_verdict_and_however_little_there_is(make, verdict):
    page = Page(report_html(make(verdict)))
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert [tag for tag, _ in page.elements if tag == "h1"] == ["h1"]
    links = [attributes["href"] for tag, attributes in page.elements if tag == "a"]
    assert {f"#{name}" for name in ids} >= set(links)
    assert len(links) == (10 if make is diagnosis else 9)
    assert "nan" not in page.text
    assert "None" not in page.text


@pytest.mark.parametrize("made", [diagnosis(), hostile(diagnosis())], ids=["plain", "hostile"])
def test_page_loads_nothing_and_runs_nothing(made):
    html = report_html(made)
    page = Page(html)
    for tag, attributes in page.elements:
        assert tag not in {"script", "link", "img", "iframe", "object", "embed", "use", "image", "base", "form"}
        assert not {"src", "srcset", "data", "action", "xlink:href", "background"} & set(attributes)
        assert not [name for name in attributes if name.startswith("on")]
        assert (attributes.get("href") or "#").startswith("#")
        assert "url(" not in (attributes.get("style") or "")
    assert "url(" not in CSS
    assert "@import" not in CSS
    assert "://" not in report_html(diagnosis())


def test_page_shows_hostile_texts_as_text_and_has_the_same_elements_as_with_plain_ones():
    html = report_html(hostile(diagnosis()))
    page, plain = Page(html), Page(report_html(diagnosis()))
    assert "<script" not in html
    assert "onerror='" not in html
    assert html.encode("utf-8").decode("utf-8") == html
    assert not re.search("[\x00-\x08\u202a-\u202e]", html)
    assert page.text.count(SHOWN) > 50
    assert page.tables["Drives"][1][0][0] == f"{SHOWN}A1"
    counted = {
        tag: [name for name, _ in page.elements].count(tag) for tag in ("table", "section", "svg", "h2", "article")
    }
    assert counted == {tag: [name for name, _ in plain.elements].count(tag) for tag in counted}


def test_every_table_has_a_caption_and_headers_with_scope_and_every_picture_a_text():
    page = Page(report_html(diagnosis()))
    heads = [attributes for tag, attributes in page.elements if tag == "th"]
    assert heads
    assert {head.get("scope") for head in heads} == {"col", "row"}
    tags = [tag for tag, _ in page.elements]
    assert tags.count("caption") == tags.count("table") > 8
    for tag, attributes in page.elements:
        if tag == "svg":
            said = attributes.get("aria-label")
            assert attributes.get("aria-hidden") == "true" or (said and attributes["role"] == "img")


def test_headings_never_skip_a_level():
    levels = [int(tag[1]) for tag, _ in Page(report_html(diagnosis())).elements if re.fullmatch("h[1-6]", tag)]
    assert all(after <= before + 1 for before, after in pairwise(levels))


def test_trip_table_has_the_figures_of_each_trip_and_their_sums():
    made = diagnosis()
    head, *rows, total = Page(report_html(made)).tables["Drives"]
    assert len({len(row) for row in (head, *rows, total)}) == 1
    for row, account in zip(rows, made.trips, strict=True):
        assert row[0][0] == account.id
        assert row[1][0] == ("yes" if account.held_out else "no")
        energies = (
            account.measured_kwh,
            account.nameplate_kwh,
            account.before_kwh,
            account.after_kwh,
            account.explained_kwh,
        )
        errors = [100.0 * (kwh / account.measured_kwh - 1.0) for kwh in (account.before_kwh, account.after_kwh)]
        known = [] if account.ambient_c is None else [account.ambient_c]
        expected = [*known, account.distance_km, account.duration_s / 60.0, *energies, *errors, 0.987]
        assert values(row) == pytest.approx([shown(value) for value in expected], rel=1e-5)
    # 3 trips: 1 held out, 64.035 km, 90 min; measured 3 · 4.567, after 4.432 + 4.432 + 4.1 = 12.964
    sums = values(total)
    assert sums[:4] == pytest.approx([1, 64.035, 90.0, 13.701])
    assert sums[6] == pytest.approx(12.964)
    assert sums[9] == pytest.approx(100.0 * (12.964 / 13.701 - 1.0), rel=1e-5)


def test_trip_without_positive_energy_has_no_relative_error():
    made = diagnosis(trips=(trip("A1", measured_kwh=-0.4),))
    row = Page(report_html(made)).tables["Drives"][1]
    assert [row[k][0] for k in (10, 11)] == ["–", "–"]


def test_score_table_has_the_scores():
    (rows,) = [rows for name, rows in Page(report_html(diagnosis())).tables.items() if name.startswith("Errors of")]
    assert values(rows[1]) == pytest.approx([17.48, 13.91, 21.43, -7.12, 19.34, 1840.4])
    assert values(rows[2]) == pytest.approx([5.89, 4.71, 7.24, 0.43, 7.13, 1130.2])
    assert [text for text, _ in rows[1]] == ["before", "17.5", "13.9 to 21.4", "−7.1", "19.3", "1840"]


def test_tables_of_causes_have_the_figures_of_the_diagnosis():
    tables = Page(report_html(diagnosis())).tables
    coefficient, shape = tables["Coefficients of cabin heating"][1:]
    assert values(coefficient) == pytest.approx([98.234, 87.11, 109.36])
    assert [text for text, _ in coefficient] == ["cabin_ua_w_per_k", "98", "87 to 109", "W/K"]
    assert [text for text, _ in shape] == ["shape", "0.500", "–", "1"]
    parameter = tables["Parameters that are off"][1]
    assert values(parameter) == pytest.approx([1270.0, 1443.2, 1381.4, 1502.9, 6.213, 3.41])
    place = tables["Structure that no effect explains"][1]
    assert values(place) == pytest.approx([812.4, 630.2, 994.6, 2.134, 0.0042])
    assert [text for text, _ in place[:2]] == ["Distance", "4.2 to 5.1\N{NO-BREAK SPACE}km"]
    learned = tables["Coefficients of effects"][1]
    assert values(learned) == pytest.approx([98.234, 87.11, 109.36])
    assert values(tables["Numbers of the vehicle"][1]) == pytest.approx([1443.2])


def test_regime_table_has_each_regime_before_and_after():
    made = diagnosis()
    rows = Page(report_html(made)).tables["Measured power less the model's by range"][1:]
    assert len(rows) == len(made.regimes_before)
    pairs = {
        (before.axis, before.low): (before, after)
        for before, after in zip(made.regimes_before, made.regimes_after, strict=True)
    }
    order = (Axis.AMBIENT, Axis.SINCE_START, Axis.SPEED, Axis.POWER, Axis.STANDSTILL, Axis.GRADE, Axis.SOC)
    expected = [pair for axis in order for (known, _), pair in pairs.items() if known is axis]
    for row, (before, after) in zip(rows, expected, strict=True):
        powers = [value for regime in (before, after) for value in (regime.mean_w, regime.low_w, regime.high_w)]
        assert values(row) == pytest.approx([9, 2.0, *powers, before.energy_kwh], rel=1e-5)


def test_planning_is_split_from_the_vehicle_model_in_percent_of_the_measured_energy():
    page = Page(report_html(diagnosis()))
    row = page.tables["Planning and vehicle model"][1]
    errors = [100.0 * (5.123 - 4.012) / 4.567, 100.0 * (4.012 - 4.567) / 4.567]
    assert values(row) == pytest.approx([5.123, 4.012, 4.567, *errors, 25.0, 30.0, 12.4, 15, 4.321], rel=1e-5)
    assert "planning errs by +24.3 %" in page.text
    assert "Planning and vehicle model apart" not in Page(report_html(diagnosis(profile=()))).text


@pytest.mark.parametrize(
    ("verdict", "changes", "words"),
    [
        (Verdict.LEFT_OUT_PHYSICS, {}, "1.9\xa0kWh (95\xa0%: 1.7 to 2.1) went into heating or cooling the cabin"),
        (Verdict.LEFT_OUT_PHYSICS, {}, "34.2\xa0kWh (95\xa0%: 30.0 to 38.4) in all. It shows below −5\xa0°C."),
        (
            Verdict.CANNOT_TELL,
            {"findings": (ALIKE,)},
            "These drives cannot tell cabin heating (heating and cooling) from",
        ),
        (Verdict.CANNOT_TELL, {"findings": (ALIKE,)}, "tell them apart: a drive in the cold with long stops."),
        (
            Verdict.PARAMETER_ERROR,
            {"findings": ()},
            "another mass: 1443\xa0kg (95\xa0%: 1381 to 1503); the vehicle file",
        ),
        (Verdict.UNEXPLAINED, {"findings": ()}, "Where distance is 4.2 to 5.1\xa0km, your car takes 810\xa0W"),
        (Verdict.NOTHING_MISSING, {"findings": ()}, "Your car takes what the model says it should"),
        (Verdict.TOO_FEW_TRIPS, {"model": {"least_trips": 8}}, "2 drives are too few to name a cause: at least 8"),
    ],
)
def test_verdict_opens_with_the_sentence_that_it_rests_on(verdict, changes, words):
    text = Page(report_html(diagnosis(verdict, **changes))).text
    opening = text[: text.index("What the drives say.")]
    assert words in opening


def test_saved_energy_is_told_as_what_the_model_expects_too_much():
    saved = replace(HEATING, energy_kwh=-12.0, energy_kwh_ci95=(-15.0, -9.0), energy_share_frac=-0.06)
    text = Page(report_html(diagnosis(findings=(saved,)))).text
    # a share of −0.06 [−0.075, −0.045] is 0.6 kWh [0.45, 0.75] of 10 kWh; halves round to even
    assert "the model expects 0.6\xa0kWh (95\xa0%: 0.4 to 0.8) too much" in text


def test_a_battery_that_holds_less_is_a_number_that_is_off_and_ranges_are_not_called_right():
    aged = CapacityEstimate(
        CapacityKind.LESS, 16_500.0, (16_000.0, 17_000.0), 18_800.0, ("A1", "A2"), 0.4, True, 18.0, None, True, "Aged."
    )
    page = Page(report_html(replace(bare(Verdict.PARAMETER_ERROR), capacity=aged)))
    assert "The vehicle's numbers are off" in page.text
    assert page.text.index("Aged.") < page.text.index("Contents" if "Contents" in page.text else "How well drives")
    assert "Ranges with effects.json are those of the battery as it is." in page.text
    assert "routes and ranges are right as they are" not in page.text
    assert values(page.tables["Usable capacity by energy over the fall of the charge"][1]) == pytest.approx(
        [18.8, 16.5, 16.0, 17.0, 2.0, 40.0]
    )
    agreeing = replace(aged, kind=CapacityKind.AS_IN_FILE, text="", is_carried=False)
    calm = Page(report_html(replace(bare(Verdict.NOTHING_MISSING), capacity=agreeing))).text
    assert "The battery holds what its file says" in calm


@pytest.mark.parametrize(
    ("share", "words"),
    [
        (None, "doubles with each 19\xa0K colder."),
        (0.02, "is that at its terminals, without what that loses"),
        (0.97, "holds what that loses"),
    ],
)
def test_a_resistance_by_the_voltage_is_told_with_where_the_power_is_taken(share: float | None, words: str):
    battery = BatteryLoss(0.081, (0.0795, 0.0825), 18.7, 376.6, share, None if share is None else 0.05, 40)
    text = Page(report_html(replace(bare(Verdict.NOTHING_MISSING), battery=battery))).text
    assert "81 ± 2 mΩ at 23 °C" in text.replace("\xa0", " ")
    assert words.replace("\xa0", " ") in text.replace("\xa0", " ")


def test_what_standstill_shows_of_a_heat_stands_among_its_facts():
    seen = replace(HEATING, standing_ratio=0.83, standing_ratio_ci95=(0.66, 0.99))
    text = Page(report_html(diagnosis(findings=(seen,)))).text
    assert "Seen at standstill" in text
    assert "Seen at standstill" not in Page(report_html(diagnosis(findings=(HEATING,)))).text


def test_too_few_trips_never_read_as_nothing_missing():
    text = Page(report_html(bare())).text
    assert "No drive could be used; it takes at least" in text
    assert text.count("Not concluded: there are too few drives.") == 3
    for claim in ("No effect that the model leaves out", "No parameter of the vehicle is off", "what the model says"):
        assert claim not in text


def test_trips_left_out_one_at_a_time_are_not_called_held_out():
    made = diagnosis(held_out_trips=(), trips=(trip("A1"), trip("A2")))
    page = Page(report_html(made))
    assert "Errors of drives' energy on drives left out of the fit one at a time" in page.tables


def test_model_that_stayed_as_it_was_is_scored_once():
    text = Page(report_html(diagnosis(Verdict.NOTHING_MISSING, findings=(), after=BEFORE))).text
    assert "the model misses a drive's energy by 17.5\xa0% (95\xa0%: 13.9 to 21.4) on average." in text
    assert "with what was learned" not in text


def test_notes_with_the_same_words_share_a_row():
    page = Page(report_html(diagnosis()))
    assert [text for text, _ in page.tables["Notes: gap"][1]] == ["power_w", "Gap of 12 s.", "A1, A2"]
    assert "Gap (2 notes)" in page.text


def test_figures_that_are_not_finite_are_dashes():
    odd = trip("A1", before_kwh=math.nan, by_family_kwh={"wind": math.nan})
    still = replace(HEATING, t=math.inf, energy_kwh=0.0, energy_share_frac=0.0, coefficients=())
    page = Page(report_html(diagnosis(trips=(odd,), findings=(still,), after=replace(AFTER, rmse_w=math.nan))))
    assert page.tables["Drives"][1][7][0] == "–"
    assert "nan" not in page.text.lower()
    assert "nan" not in " ".join(str(value) for _, attributes in page.elements for value in attributes.values()).lower()


def test_page_of_forty_long_trips_is_small_and_the_same_bytes_twice():
    trips = tuple(trip(f"T{k:02d}", k % 3 == 0, timeline=timeline(10_800.0, 5.0)) for k in range(40))
    notes = tuple(QualityNote(account.id, "gap", "power_w", f"Gap of {k} s.") for account in trips for k in range(5))
    made = diagnosis(trips=trips, data_quality=notes)
    html = report_html(made)
    assert len(html.encode()) < 500_000
    assert html == report_html(made)
