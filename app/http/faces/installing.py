"""Which faces the application has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.http.faces.ors.routes import router as ors
from app.http.faces.osrm.routes import router as osrm
from app.http.faces.valhalla.routes import router as valhalla

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fastapi import APIRouter, FastAPI

    from app.settings import FaceName, Settings

FACES: Final[Mapping[FaceName, APIRouter]] = {
    "osrm": osrm,
    "ors": ors,
    "valhalla": valhalla,
}


def install_faces(app: FastAPI, settings: Settings) -> None:
    """Serve the faces that the settings name."""
    for name in settings.faces:
        app.include_router(FACES[name])
