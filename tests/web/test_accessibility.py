"""Nothing that axe-core finds against WCAG 2.2 A and AA, in any state of the plan."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.web.accessible import check_accessible
from tests.web.map_page import PHONE

if TYPE_CHECKING:
    from tests.web.conftest import Visit

ROUTE = "?start=43.872,-36.433&goal=43.697,-35.19&soc=60"
STATES = {
    "first page": "",
    "routes": f"{ROUTE}&via=43.77,-35.9&uncertainty=1",
    "out of reach": "?start=43.872,-36.433&goal=43.697,-35.19&soc=25&colour=consumption",
    "range": "?tab=range&start=43.872,-36.433&soc=30&conditions=road:snow&by=time&minutes=9,30&outline=filled",
    "new diagnosis": "?tab=diagnosis",
}


@pytest.mark.parametrize("state", STATES)
def test_page_keeps_the_rules_of_wcag_light_dark_and_on_a_phone(visit: Visit, state: str):
    page = visit(STATES[state])
    expect(page.page.locator(".busy-line")).to_have_count(0)
    for folded in page.page.locator("#panel details > summary:visible").all():
        folded.click()
    check_accessible(page.page)
    page.page.get_by_role("button", name="Use dark colours").click()
    page.drawn()
    check_accessible(page.page)
    page.page.set_viewport_size(PHONE)
    check_accessible(page.page)
    assert page.width_px() <= PHONE["width"]
    page.page.get_by_role("button", name="Use light colours").click()
    page.drawn()
    check_accessible(page.page)
