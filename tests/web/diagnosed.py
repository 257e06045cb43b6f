"""Diagnoses of recordings that lie on the server."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from tests.web.served import ServedMap

LONGEST_S: Final = 120.0


def done(served: ServedMap, **asked: Any) -> dict[str, Any]:
    """A diagnosis of recordings that lie on the server, done."""
    answer: dict[str, Any] = served.ask("/diagnoses", asked)
    last_s = time.monotonic() + LONGEST_S
    while answer["state"] in ("queued", "running") and time.monotonic() < last_s:
        time.sleep(0.2)
        answer = served.ask(f"/diagnoses/{answer['id']}")
    assert answer["state"] == "done", answer
    return answer
