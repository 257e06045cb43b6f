"""The page docs/source-tables.md is what its script computes, and its prose says what the tables show."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from docs import source_tables
from reproduction.checks import source_checks
from reproduction.derived import Rounded, percent_factor, pooled, real_averages, rounded
from reproduction.published import TABLE_IV, TABLE_IX_COMPLEX, TABLE_VI, TABLE_X_COMPLEX, TABLE_X_SIMPLE, RouteType

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def page() -> str:
    return (ROOT / "docs" / "source-tables.md").read_text(encoding="utf-8")


def rows(page: str, name: str) -> list[list[str]]:
    block = page.split(f"<!-- {name} -->\n")[1].split(f"<!-- /{name} -->")[0]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in block.splitlines()]


def test_tables_of_the_page_are_those_of_the_script(page):
    assert page == source_tables.with_tables(page), "run `python -m docs.source_tables`"


def test_page_without_a_place_for_a_table_is_refused():
    with pytest.raises(ValueError, match="one place for the table 'iv'"):
        source_tables.with_tables("nothing")


def test_printed_time_meets_table_iv_and_the_kinematic_one_is_slower(page):
    found = {row[0]: row[1:] for row in rows(page, "plain-town")}
    assert found["source, table IV"] == ["9356", "31.9"]
    assert found["plain town, `printed`"][1] == "32.4"
    assert found["plain town, `integrated`"][1] == "26.3"
    assert found["difference of the two models over what the source lacks"][0] == "59 %"


def test_prose_repeats_the_figures_of_the_tables(page):
    prose = " ".join(page.split("## What comes out")[1].split("## Table IV")[0].split())
    blocks: list[list[list[str]]] = []
    for row in rows(page, "iv"):
        if row[0].startswith("**"):
            blocks.append([])
        elif len(row) > 1:
            blocks[-1].append([re.sub(r" \(.*", "", cell) for cell in row])
    by_type = {kind: {line[0]: line[1:] for line in block} for kind, block in zip(RouteType, blocks, strict=True)}
    speeds = {kind: by_type[kind]["mean speed [km/h]"] for kind in RouteType}
    urban, country = speeds[RouteType.URBAN], speeds[RouteType.COUNTRY]
    assert f"in town {urban[0]} km/h, `printed` {urban[1]}, `integrated` {urban[2]}" in prose
    assert f"on country roads {country[0]}, {country[1]}, {country[2]}" in prose
    published, printed, integrated = (
        [by_type[kind]["energy [kWh]"][column] for kind in RouteType] for column in range(3)
    )
    for energies in (published, integrated, printed):
        assert f"{', '.join(energies[:3])} and {energies[3]}" in prose
    complex_town = rows(page, "complex-town")
    assert complex_town[2][4] == "6.75"
    assert complex_town[3][4].startswith("6.79")
    assert "takes 6.79 kWh" in prose
    assert "come to 6.75 kWh" in prose


def test_rounded_numbers_meet_where_their_intervals_do():
    assert rounded(3.6, 1) == Rounded(pytest.approx(3.55), pytest.approx(3.65))
    assert rounded(1.0).meets(Rounded(1.4, 2.0))
    assert not rounded(1.0).meets(Rounded(1.6, 2.0))
    assert percent_factor(-28.0) == Rounded(pytest.approx(0.715), pytest.approx(0.725))
    assert rounded(10.0) / rounded(2.0) == Rounded(pytest.approx(9.5 / 2.5), pytest.approx(10.5 / 1.5))


def test_real_averages_undo_the_published_errors():
    # urban: 9356 s / 0.72 and 9.1 kWh / 0.97
    urban = real_averages(RouteType.URBAN)
    assert urban.duration_s == pytest.approx(12_994.4, abs=0.1)
    assert urban.energy_kwh == pytest.approx(9.38, abs=0.005)
    assert urban.stops == TABLE_IV[RouteType.URBAN].stops


def test_all_trips_follow_from_the_routes_whose_deviations_divide_by_n():
    # simple: mean (5·8.6 - 4·1.3 + 4·17.7 - 4·1.6 - 6·3.1)/23 = 83.6/23
    # within 5·6.9² + 4·(0.8² + 7.6² + 2.1²) + 6·9.2² = 997, between 1394, √(2391/22) = 10.42
    simple, complex_ = pooled(TABLE_VI), pooled(TABLE_IX_COMPLEX)
    assert simple.mean == pytest.approx(83.6 / 23.0)
    assert simple.sd_from_population_sds == pytest.approx(TABLE_X_SIMPLE.sd, abs=0.05)
    assert abs(simple.sd_from_sample_sds - TABLE_X_SIMPLE.sd) > 0.3
    assert complex_.sd_from_population_sds == pytest.approx(TABLE_X_COMPLEX.sd, abs=0.05)
    assert abs(complex_.sd_from_sample_sds - TABLE_X_COMPLEX.sd) > 0.2


def test_what_does_not_add_up_is_exactly_what_the_page_lists():
    assert [check.where for check in source_checks() if not check.holds] == [
        "IV, highway: speed",
        "IV, mountain: speed",
        "IV, highway: consumption",
        "IV, country road: consumption",
        "IV, urban area: consumption",
        "IV and V, mountain: time of a real stop",
        "III, lengths: longest route",
        "V, country road: consumption",
        "V, urban area: consumption",
        "Text, VI: the complex algorithm takes less",
        "Text, VI: the complex algorithm in town",
    ]


def test_urban_consumption_of_table_iv_exceeds_any_mean_of_its_trips():
    # 9.1 kWh over 82.9 km are 11.0 kWh/100 km; with every trip at least 77 km long no mean of ratios exceeds 9.15/0.77
    check = next(check for check in source_checks() if check.where == "IV, urban area: consumption")
    assert check.follows == "energy/distance: 10.9 to 11.0"
    assert check.remark.endswith("can exceed 11.9")
    assert TABLE_IV[RouteType.URBAN].specific_kwh_per_100km - 0.05 > 9.15 / 0.77
