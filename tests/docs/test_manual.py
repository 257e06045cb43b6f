"""The manual as a site: built without another host, without a broken link, and served below /manual."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from starlette.applications import Starlette
from starlette.testclient import TestClient

from app.http.web import MANUAL_POLICY, WebFiles
from app.main import create_app
from app.settings import Settings

ROOT = Path(__file__).resolve().parents[2]
LOADED = re.compile(r"<(?:script|img|link|iframe)\b[^>]*?\b(?:src|href)=\"([^\"]+)\"")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The built site; a link that leads nowhere, or a page that no list names, fails it."""
    out = tmp_path_factory.mktemp("manual") / "site"
    done = subprocess.run(
        [sys.executable, "-m", "docs.manual", str(out)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return out


def test_every_page_of_the_documentation_is_in_the_manual(site: Path) -> None:
    for page in (path for folder in ("", "adr", "tutorials") for path in (ROOT / "docs" / folder).glob("*.md")):
        assert (site / page.relative_to(ROOT).with_suffix(".html")).is_file(), page.name


def test_pages_load_nothing_from_another_host(site: Path) -> None:
    loaded = {
        (page.name, address)
        for page in site.rglob("*.html")
        for address in LOADED.findall(page.read_text(encoding="utf-8"))
        if address.startswith(("http:", "https:", "//"))
    }
    assert loaded == set()


def test_reference_is_written_from_the_code(site: Path) -> None:
    operations = (site / "docs/reference/operations.html").read_text(encoding="utf-8")
    for methods in create_app(Settings()).openapi()["paths"].values():
        for operation in methods.values():
            assert operation["operationId"] in operations
    commands = (site / "docs/reference/commands.html").read_text(encoding="utf-8")
    for said in ("joulepath route", "--soc", "joulepath graphs check"):
        assert said in commands
    assert "Graph" in (site / "docs/reference/interface.html").read_text(encoding="utf-8")


def test_pages_are_served_with_a_policy_that_keeps_them_to_this_host(site: Path) -> None:
    served = Starlette()
    served.mount("/manual", WebFiles(site, MANUAL_POLICY))
    client = TestClient(served)
    page = client.get("/manual/docs/index.html")
    assert page.status_code == 200
    assert page.headers["content-security-policy"] == MANUAL_POLICY
    assert client.get("/manual/docs/index.html", headers={"If-None-Match": page.headers["etag"]}).status_code == 304


def test_manual_that_is_not_built_is_not_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("app.http.web.MANUAL_FOLDER", tmp_path / "none")
    answered = TestClient(create_app(Settings())).get("/manual", follow_redirects=False)
    assert (answered.status_code, answered.json()["code"]) == (404, "not_found")
