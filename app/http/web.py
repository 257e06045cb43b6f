"""The web map: its page and modules out of web/, MapLibre GL out of its package, and how to draw the map."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING, Final
from urllib.parse import urlsplit

from fastapi import Request, Response
from fastapi.responses import JSONResponse, RedirectResponse
from starlette.exceptions import HTTPException
from starlette.staticfiles import StaticFiles

from app import VERSION
from energy.folders import bundled_folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fastapi import FastAPI

    from app.settings import Settings

WEB_FOLDER: Final = bundled_folder("web")
MANUAL_FOLDER: Final = bundled_folder("manual")  # which `make manual` makes
# pages of the manual: its theme has scripts and styles in the page; nothing may come from another host
MANUAL_POLICY: Final = (
    "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "font-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'"
)
LIBRARY_FILES: Final = frozenset({"maplibre-gl.js", "maplibre-gl.css"})
READING: Final = ["GET", "HEAD"]
REVALIDATED: Final = "no-cache"  # kept by the browser, which asks each time whether it changed


class WebFiles(StaticFiles):
    """Files that a browser keeps and asks again for: an ETag, and 304 where nothing changed.

    The tag is weak, since a file is sent compressed or not (RFC 9110 section 8.8.3.3). Pages come with their policy.
    """

    def __init__(self, directory: Path, policy: str) -> None:
        super().__init__(directory=directory)
        self._policy = policy

    def file_response(self, *args: object, **kwargs: object) -> Response:
        """The answer for one file."""
        response = super().file_response(*args, **kwargs)  # type: ignore[arg-type]  # passed on as they are
        response.headers["Cache-Control"] = REVALIDATED
        response.headers["ETag"] = f"W/{response.headers['ETag']}"
        response.headers["Content-Security-Policy"] = self._policy
        return response


def library_folder() -> Path:
    """Where the package `maplibre` keeps the scripts that it ships; the package itself is not imported."""
    found = importlib.util.find_spec("maplibre")
    if found is None or found.origin is None:
        raise RuntimeError("the package maplibre is not installed; `make serve` installs it")
    return Path(found.origin).parent / "srcjs"


def map_origins(style_url: str | None, further: Sequence[str]) -> list[str]:
    """Origins outside of this service that the page may talk to: those that the settings name, else none."""
    parts = urlsplit(style_url or "")
    own = [f"{parts.scheme}://{parts.netloc}"] if parts.netloc else []
    return list(dict.fromkeys([*own, *further]))


def page_policy(origins: Sequence[str]) -> str:
    """The page's content security policy (W3C CSP level 3): nothing from other hosts, but for a named tile server."""
    outside = "".join(f" {origin}" for origin in origins)
    return "; ".join(
        (
            "default-src 'none'",
            "script-src 'self'",
            "style-src 'self'",
            f"img-src 'self' data: blob:{outside}",
            f"connect-src 'self'{outside}",
            "worker-src blob:",  # MapLibre makes its worker of its own text
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'self'",
        )
    )


def install_web(app: FastAPI, settings: Settings) -> None:
    """Serve the map at /, and what it is made of below /web."""
    policy = page_policy(map_origins(settings.map_style_url, settings.map_origins))
    library, files = WebFiles(library_folder(), policy), WebFiles(WEB_FOLDER, policy)

    @app.api_route("/", methods=READING, include_in_schema=False)
    async def page(request: Request) -> Response:
        return await files.get_response("index.html", request.scope)

    @app.api_route("/web/lib/{name}", methods=READING, include_in_schema=False)
    async def library_file(name: str, request: Request) -> Response:
        if name not in LIBRARY_FILES:
            raise HTTPException(404)
        return await library.get_response(name, request.scope)

    @app.api_route("/web/settings.json", methods=READING, include_in_schema=False)
    def web_settings() -> Response:
        shown = {
            "version": VERSION,
            "map_style_url": settings.map_style_url,
            "default_graph": settings.default_graph,
            "default_vehicle": settings.default_vehicle,
            "recordings_on_server": settings.recordings_dir is not None,
        }
        return JSONResponse(shown, headers={"Cache-Control": REVALIDATED})

    app.mount("/web", files, name="web")
    _install_manual(app)


def _install_manual(app: FastAPI) -> None:
    """Serve the manual below /manual, where it was built."""

    @app.api_route("/manual", methods=READING, include_in_schema=False)
    async def manual(request: Request) -> Response:
        if not MANUAL_FOLDER.is_dir():
            raise HTTPException(404)
        return RedirectResponse(f"{request.scope.get('root_path', '')}/manual/docs/index.html")

    if MANUAL_FOLDER.is_dir():
        app.mount("/manual", WebFiles(MANUAL_FOLDER, MANUAL_POLICY), name="manual")
