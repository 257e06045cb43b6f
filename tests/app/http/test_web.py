"""The web map over HTTP: its page, its files, what a browser may load, and the settings of all that."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from pydantic import ValidationError
from starlette.testclient import TestClient

from app import VERSION
from app.http.web import WEB_FOLDER, library_folder, map_origins, page_policy
from app.main import create_app
from app.settings import Settings
from tests.app.expected import check_problem

if TYPE_CHECKING:
    from app.service.service import Service

STYLE = "https://tiles.example:8443/styles/plain.json"


def directives(policy: str) -> dict[str, list[str]]:
    """Sources that a content security policy allows, by directive."""
    parts = [part.split() for part in policy.split(";")]
    return {name: sources for name, *sources in parts}


def test_page_is_served_at_the_root_with_a_policy_that_names_no_other_host(client: TestClient) -> None:
    response = client.get("/")
    assert response.status_code == 200
    assert response.headers["content-type"].startswith("text/html")
    allowed = directives(response.headers["content-security-policy"])
    assert allowed["default-src"] == ["'none'"]
    assert allowed["script-src"] == allowed["style-src"] == ["'self'"]
    assert allowed["connect-src"] == ["'self'"]
    sources = {source for sources in allowed.values() for source in sources}
    assert sources == {"'none'", "'self'", "data:", "blob:"}


def test_all_that_the_page_and_its_modules_name_is_served(client: TestClient) -> None:
    page = client.get("/").text
    named = set(re.findall(r'(?:src|href)="((?:web|docs)[^"#]*)"', page))
    assert {"web/js/main.js", "web/lib/maplibre-gl.js", "web/lib/maplibre-gl.css"} <= named
    for script in WEB_FOLDER.rglob("*.js"):
        for target in re.findall(r'^import .*? from "(.*?)";$', script.read_text(encoding="utf-8"), re.MULTILINE):
            named.add(str((script.parent / target).resolve().relative_to(WEB_FOLDER.parent)))
    for path in sorted(named):
        assert client.get(f"/{path}").status_code == 200, path


def test_nothing_in_the_page_leads_to_another_host_or_runs_inline() -> None:
    names = {"http://www.w3.org/2000/svg", "http://www.topografix.com/GPX/1/1"}
    for file in WEB_FOLDER.rglob("*.*"):
        text = file.read_text(encoding="utf-8")
        assert not set(re.findall(r"https?://[^\s\"'`)]+", text)) - names, file
        assert not re.search(r"innerHTML|insertAdjacentHTML|\beval\(|<script>|\sstyle=\"|\son[a-z]+=\"", text), file


def test_files_are_kept_by_the_browser_and_asked_for_again(client: TestClient) -> None:
    first = client.get("/web/js/main.js")
    assert first.headers["content-type"].startswith("text/javascript")
    assert first.headers["cache-control"] == "no-cache"
    again = client.get("/web/js/main.js", headers={"if-none-match": first.headers["etag"]})
    assert again.status_code == 304
    assert not again.content


def test_scripts_and_styles_are_compressed_for_those_who_take_it(client: TestClient) -> None:
    packed = client.get("/web/lib/maplibre-gl.js", headers={"accept-encoding": "gzip"})
    assert packed.headers["content-encoding"] == "gzip"
    assert packed.content == (library_folder() / "maplibre-gl.js").read_bytes()
    assert int(packed.headers.get("content-length", 0)) < 0.5 * len(packed.content)


@pytest.mark.parametrize(
    "path", ["/web/lib/pywidget.js", "/web/lib/..%2f__init__.py", "/web/..%2fapp%2fmain.py", "/web/js/none.js", "/web/"]
)
def test_what_is_no_file_of_the_page_is_not_found(client: TestClient, path: str) -> None:
    check_problem(client.get(path), 404, "not_found")


def test_settings_of_the_page_say_version_and_defaults(client: TestClient, settings: Settings) -> None:
    shown = client.get("/web/settings.json").json()
    assert shown == {
        "version": VERSION,
        "map_style_url": None,
        "default_graph": "grid",
        "default_vehicle": settings.default_vehicle,
        "recordings_on_server": False,
    }


def test_named_style_and_its_origins_are_the_only_other_hosts(settings: Settings, service: Service) -> None:
    own = settings.model_copy(update={"map_style_url": STYLE, "map_origins": ("https://fonts.example",)})
    client = TestClient(create_app(own, service))
    assert client.get("/web/settings.json").json()["map_style_url"] == STYLE
    allowed = directives(client.get("/").headers["content-security-policy"])
    outside = ["https://tiles.example:8443", "https://fonts.example"]
    assert allowed["connect-src"] == ["'self'", *outside]
    assert allowed["img-src"] == ["'self'", "data:", "blob:", *outside]
    assert allowed["script-src"] == ["'self'"]


def test_style_on_this_host_needs_no_other_origin() -> None:
    assert map_origins("/styles/plain.json", ()) == []
    assert map_origins(None, ()) == []
    assert map_origins(STYLE, ("https://tiles.example:8443",)) == ["https://tiles.example:8443"]
    assert "example" not in page_policy(map_origins("/styles/plain.json", ()))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("map_style_url", "ftp://tiles.example/style.json"),
        ("map_style_url", "https://tiles.example; script-src *"),
        ("map_style_url", "style.json"),
        ("map_origins", "https://tiles.example/path"),
        ("map_origins", "https://a.example https://b.example"),
        ("map_origins", "'unsafe-inline'"),
    ],
)
def test_setting_that_would_widen_the_policy_is_refused(monkeypatch: pytest.MonkeyPatch, name: str, value: str) -> None:
    monkeypatch.setenv(f"JOULEPATH_{name.upper()}", value)
    with pytest.raises(ValidationError, match=name):
        Settings()


def test_empty_settings_of_the_map_are_as_if_they_were_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOULEPATH_MAP_STYLE_URL", "")
    monkeypatch.setenv("JOULEPATH_MAP_ORIGINS", " https://a.example , https://*.b.example:8080,")
    settings = Settings()
    assert settings.map_style_url is None
    assert settings.map_origins == ("https://a.example", "https://*.b.example:8080")
