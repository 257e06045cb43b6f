"""Recordings in, causes out: followed from the upload to the route that counts what was learned."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from tests.web.accessible import check_accessible
from tests.web.map_page import PHONE, check_shown

if TYPE_CHECKING:
    from tests.web.conftest import Visit
    from tests.web.map_page import MapPage
    from tests.web.served import ServedMap

LONGEST_MS = 120_000
UNFINISHED = ("queued", "running")


@pytest.fixture(scope="module")
def diagnosed(served: ServedMap) -> dict[str, Any]:
    """A diagnosis of the recordings that lie on the server, done."""
    asked = {"recordings": ["winter/*.csv"], "vehicle": "hyundai-kona-64", "holdout_fraction": 0.3}
    answer: dict[str, Any] = served.ask("/diagnoses", asked)
    last_s = time.monotonic() + LONGEST_MS / 1000
    while answer["state"] in UNFINISHED and time.monotonic() < last_s:
        time.sleep(0.2)
        answer = served.ask(f"/diagnoses/{answer['id']}")
    assert answer["state"] == "done", answer
    return answer


def open_tab(page: MapPage) -> None:
    page.page.get_by_role("tab", name="Diagnosis").click()


def test_uploaded_recordings_are_diagnosed_and_what_is_learned_reaches_the_next_route(
    page: MapPage, recordings: Path, served: ServedMap
):
    shown = page.page
    open_tab(page)
    begin = shown.get_by_role("button", name=re.compile("^Diagnose"))
    expect(begin).to_be_disabled()
    files = sorted((recordings / "winter").glob("*.csv"))
    with shown.expect_file_chooser() as chooser:
        shown.get_by_role("button", name="Choose files").click()
    chooser.value.set_files(files)
    expect(begin).to_have_text(f"Diagnose {len(files)} recordings")
    begin.click()
    expect(shown.get_by_role("progressbar")).to_be_visible()
    expect(shown.get_by_role("heading", name="Under way")).to_be_visible()
    verdict = shown.get_by_role("region", name="Verdict")
    expect(verdict).to_be_visible(timeout=LONGEST_MS)

    diagnosis_id = page.address_query()["diagnosis"]
    result = served.ask(f"/diagnoses/{diagnosis_id}")["result"]
    assert {finding["family"] for finding in result["findings"]} == {"thermal"}
    findings = shown.get_by_role("article")
    expect(findings).to_have_count(len(result["findings"]))
    expect(shown.locator("#announcer")).to_contain_text(verdict.get_by_role("heading").inner_text())

    shown.get_by_role("button", name="Apply to the next route").click()
    expect(shown.get_by_role("tab", name="Route")).to_have_attribute("aria-selected", "true")
    expect(shown.locator("#vehicle")).to_contain_text(diagnosis_id)
    shown.get_by_text("Weather and load").click()
    shown.get_by_label("Count the air temperature").check()
    shown.get_by_label("Air temperature", exact=True).fill("-10")
    page.type_place("Start", (43.872, -36.433))
    with page.asking("/route") as learned:
        page.type_place("Goal", (43.8, -35.9))
    assert learned.body["effects"] == diagnosis_id
    with page.asking("/route") as plain:
        shown.get_by_role("button", name="Leave out").click()
    assert "effects" not in plain.body
    parts_kwh = [found.answer["routes"][0]["energy_parts_kwh"]["cabin"] for found in (learned, plain)]
    assert parts_kwh[0] > 1.5 * parts_kwh[1]  # 150 W/K of a heater were driven, the file's heat pump takes 55 W/K


def test_result_shows_findings_fit_and_drives_as_the_service_has_them(visit: Visit, diagnosed: dict[str, Any]):
    page = visit(f"?tab=diagnosis&diagnosis={diagnosed['id']}")
    result = diagnosed["result"]
    cards = page.page.get_by_role("article")
    expect(cards).to_have_count(len(result["findings"]))
    by_energy = sorted(result["findings"], key=lambda finding: -abs(finding["energy_kwh"]))
    for card, finding in zip(cards.all(), by_energy, strict=True):
        expect(card).to_contain_text(finding["text"])
        check_shown(card.inner_text(), "%", 100 * finding["energy_share"])
    drives = page.page.locator(".trip-button")
    expect(drives).to_have_count(len(result["trips"]))
    rows = {
        row.locator(".trip-button").get_attribute("data-trip"): row
        for row in page.page.locator("tr:has(.trip-button)").all()
    }
    for trip in result["trips"]:
        assert f"{trip['measured_kwh']:.2f}" in rows[trip["id"]].inner_text()


def test_drive_is_shown_along_time_with_a_cursor_for_keys(visit: Visit, diagnosed: dict[str, Any]):
    page = visit(f"?tab=diagnosis&diagnosis={diagnosed['id']}")
    page.page.get_by_role("button", name=re.compile("^winter-00")).click()
    chart = page.page.get_by_role("region", name="One drive along time")
    slider = chart.get_by_role("slider")
    expect(slider).to_be_visible()
    slider.focus()
    page.page.keyboard.press("PageDown")
    expect(slider).to_have_attribute("aria-valuetext", re.compile(r"Measured −?[\d.]+ kW"))
    page.page.keyboard.press("End")
    assert float(slider.get_attribute("aria-valuenow") or "") > 9.0
    chart.get_by_role("button", name="Close").click()
    expect(chart).to_have_count(0)


def test_files_of_a_result_hold_what_the_service_answers(visit: Visit, diagnosed: dict[str, Any], served: ServedMap):
    page = visit(f"?tab=diagnosis&diagnosis={diagnosed['id']}")
    with page.page.expect_download() as caught:
        page.page.get_by_role("button", name="diagnosis.json").click()
    assert json.loads(Path(caught.value.path()).read_text(encoding="utf-8")) == diagnosed["result"]
    with page.page.expect_download() as caught:
        page.page.get_by_role("link", name="effects.json").click()
    effects = json.loads(Path(caught.value.path()).read_text(encoding="utf-8"))
    assert effects == served.ask(f"/diagnoses/{diagnosed['id']}/effects")


def test_earlier_diagnosis_is_opened_and_removed_after_a_question(
    visit: Visit, diagnosed: dict[str, Any], served: ServedMap
):
    queued = served.ask("/diagnoses", {"recordings": ["winter/winter-00.csv"], "vehicle": "hyundai-kona-64"})
    while served.ask(f"/diagnoses/{queued['id']}")["state"] in UNFINISHED:
        time.sleep(0.1)
    page = visit("?tab=diagnosis")
    entries = page.page.get_by_role("region", name="Earlier diagnoses").get_by_role("listitem")
    count = len(served.ask("/diagnoses")["diagnoses"])
    expect(entries).to_have_count(count)
    newest = entries.first
    newest.get_by_role("button", name=re.compile("^Remove:")).click()
    page.page.keyboard.press("Escape")
    expect(entries).to_have_count(count)
    newest.get_by_role("button", name=re.compile("^Remove:")).click()
    newest.get_by_role("button", name=re.compile("^Remove for good")).click()
    expect(entries).to_have_count(count - 1)
    remaining = {diagnosis["id"] for diagnosis in served.ask("/diagnoses")["diagnoses"]}
    assert queued["id"] not in remaining
    assert diagnosed["id"] in remaining


def test_file_of_another_kind_is_left_aside_and_an_unreadable_recording_is_named(page: MapPage, tmp_path: Path):
    open_tab(page)
    notes, broken = tmp_path / "notes.txt", tmp_path / "broken.csv"
    notes.write_text("no recording", encoding="utf-8")
    broken.write_text("time_s,speed_kmh,power_w\n0,10,500\n1,ten,500\n2,11,500\n", encoding="utf-8")
    with page.page.expect_file_chooser() as chooser:
        page.page.get_by_role("button", name="Choose files").click()
    chooser.value.set_files([notes, broken])
    expect(page.page.locator("#toast")).to_contain_text("1 file left aside")
    page.page.get_by_role("button", name="Diagnose 1 recording").click()
    expect(page.page.get_by_role("heading", name="It could not be carried out")).to_be_visible(timeout=LONGEST_MS)
    expect(page.page.locator("#pane-diagnosis")).to_contain_text("row 3")
    page.page.get_by_role("button", name="Start another").click()
    expect(page.page.get_by_role("button", name="Choose files")).to_be_visible()


def test_unknown_diagnosis_of_an_address_is_named_with_a_way_back(visit: Visit):
    page = visit(opened=False)
    page.refused.add(404)
    page.open("?tab=diagnosis&diagnosis=nowhere")
    expect(page.page.locator("#pane-diagnosis").get_by_role("alert")).to_contain_text("nowhere")
    page.page.get_by_role("button", name="All diagnoses").click()
    expect(page.page.get_by_role("button", name="Choose files")).to_be_visible()
    assert page.address_query() == {"tab": "diagnosis"}


def test_result_keeps_the_rules_of_wcag_light_dark_and_on_a_phone(visit: Visit, diagnosed: dict[str, Any]):
    page = visit(f"?tab=diagnosis&diagnosis={diagnosed['id']}")
    page.page.get_by_role("button", name=re.compile("^winter-00")).click()
    expect(page.page.get_by_role("region", name="One drive along time").get_by_role("slider")).to_be_visible()
    check_accessible(page.page)
    page.page.get_by_role("button", name="Use dark colours").click()
    page.drawn()
    check_accessible(page.page)
    page.page.set_viewport_size(PHONE)
    check_accessible(page.page)
    assert page.width_px() <= PHONE["width"]
