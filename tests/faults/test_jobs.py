"""Diagnoses that take too much, or whose process is ended: they fail with what is known, and the next one is begun."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from starlette.testclient import TestClient

    Serving = Callable[..., AbstractContextManager[TestClient]]


CAR = "hyundai-kona-64"
LONGEST_WAIT_S = 60.0


def queued(client: TestClient, name: str) -> str:
    """The path of a diagnosis of recordings of this name, which is in the queue."""
    response = client.post("/diagnoses", json={"recordings": [name], "vehicle": CAR})
    assert response.status_code == 202, response.text
    return str(response.headers["location"])


def waited(client: TestClient, path: str, *states: str) -> dict[str, Any]:
    """A diagnosis as soon as it is in one of these states."""
    last_s = time.monotonic() + LONGEST_WAIT_S
    while time.monotonic() < last_s:
        answer: dict[str, Any] = client.get(path).json()
        if answer["state"] in states:
            return answer
        time.sleep(0.05)
    raise AssertionError(f"not {states}: {answer}")


def process_of(path: str) -> int:
    """The process that carries a diagnosis out, which begins soon after it is said to run."""
    name = f"diagnosis {path.rpartition('/')[2]}"
    last_s = time.monotonic() + LONGEST_WAIT_S
    while time.monotonic() < last_s:
        for child in multiprocessing.active_children():
            if child.name == name and child.pid is not None:
                return child.pid
        time.sleep(0.01)
    raise AssertionError(f"no process {name}")


def test_diagnosis_whose_process_is_killed_fails_with_what_is_known_and_the_next_is_begun(serving: Serving) -> None:
    with serving() as client:
        killed, after = queued(client, "long"), queued(client, "bad.csv")
        waited(client, killed, "running")
        os.kill(process_of(killed), signal.SIGKILL)
        problem = waited(client, killed, "failed")["problem"]
        assert problem["code"] == "diagnosis_interrupted"
        assert "its process was ended by SIGKILL, most likely since the system ran out of memory" in problem["detail"]
        assert "% done" in problem["detail"]
        assert waited(client, after, "failed")["problem"]["code"] == "unusable_recordings"


def test_diagnosis_that_takes_too_long_fails_and_the_next_is_begun(serving: Serving) -> None:
    with serving(diagnosis_time_limit_s=0.3) as client:
        problem = waited(client, queued(client, "long"), "failed")["problem"]
    assert problem["code"] == "diagnosis_failed"
    assert "takes more time than 0.3 s, allowed: at most that (JOULEPATH_DIAGNOSIS_TIME_LIMIT_S)" in problem["detail"]


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="memory is limited on Linux")
def test_diagnosis_that_takes_too_much_memory_fails_by_its_limit(serving: Serving, recordings_dir: Any) -> None:
    rows = "".join(f"{k},{k % 90},{k % 700}\n" for k in range(400_000))
    (recordings_dir / "large.csv").write_text(f"time_s,speed_kmh,power_w\n{rows}", encoding="utf-8")
    with serving(diagnosis_memory_bytes=64 * 1024 * 1024) as client:
        failed = waited(client, queued(client, "large.csv"), "failed")
    assert failed["problem"]["code"] in ("unusable_recordings", "diagnosis_failed")
    assert "too large once it is read" in failed["refused"][0]["error"]


def test_recordings_of_one_diagnosis_unpack_to_no_more_than_is_allowed(serving: Serving) -> None:
    with serving(diagnosis_unpacked_bytes=10_000) as client:
        failed = waited(client, queued(client, "long"), "failed")
    assert len(failed["refused"]) == 5
    assert "beyond the 0.01 MB that may be unpacked of all files" in failed["refused"][0]["error"]
