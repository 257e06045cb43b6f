"""What each request needs: a role, and units of what a client may ask for."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class Role(StrEnum):
    """What a key allows, each with all before it."""

    READ = "read"
    WRITE = "write"
    ADMIN = "admin"

    def allows(self, needed: Role) -> bool:
        """Whether it allows what needs another role."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


@dataclass(frozen=True, slots=True)
class Need:
    """What a request needs; role: None for what anybody may ask."""

    role: Role | None
    units: float


READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})
HEALTH: Final = frozenset({"/healthz", "/readyz"})
PAGE_UNITS: Final = 0.2  # of files and tiles, of which a page asks for dozens
SEARCH_UNITS: Final = 4.0
LARGE_UNITS: Final = 20.0
PUBLIC: Final = frozenset({"/", "/docs", "/redoc", "/openapi.json", "/favicon.ico"})
PUBLIC_BELOW: Final = ("/web/", "/docs/", "/static-offline-docs/")
SEARCHES: Final = frozenset({"/route", "/range", "/simulate"})
FACES: Final = ("/osrm/", "/ors/v2/", "/valhalla/")  # other engines' addresses
FACE_MATRICES: Final = ("/osrm/table/", "/ors/v2/matrix/", "/valhalla/sources_to_targets")
FACE_STATES: Final = frozenset({"/ors/v2/health", "/ors/v2/status", "/valhalla/status"})

_ANYBODY: Final = Need(None, PAGE_UNITS)
_READ: Final = Need(Role.READ, 1.0)
_TILE: Final = Need(Role.READ, PAGE_UNITS)
_SEARCH: Final = Need(Role.READ, SEARCH_UNITS)
_LARGE_SEARCH: Final = Need(Role.READ, LARGE_UNITS)
_WRITE: Final = Need(Role.WRITE, 1.0)
_LARGE_WRITE: Final = Need(Role.WRITE, LARGE_UNITS)
_ADMIN: Final = Need(Role.ADMIN, 1.0)


def need_of(method: str, path: str) -> Need:
    """What a request needs; what is not known here and changes something is for admins."""
    if path in SEARCHES:
        return _SEARCH
    if path.startswith(FACES) and (method in READING or method == "POST"):
        if path in FACE_STATES:
            return _READ
        return _LARGE_SEARCH if path.startswith(FACE_MATRICES) else _SEARCH
    if method in READING:
        if path in PUBLIC or path.startswith(PUBLIC_BELOW):
            return _ANYBODY
        is_tile = path.startswith("/graphs/") and path.count("/") > 2 and not path.endswith("/stations")
        return _TILE if is_tile else _READ
    if method == "POST" and path == "/matrix":
        return _LARGE_SEARCH
    if method == "POST" and path == "/diagnoses":
        return _LARGE_WRITE
    if method in ("PUT", "DELETE") and path.startswith(("/vehicles/", "/diagnoses/")):
        return _WRITE
    return _ADMIN
