"""`python -m tests.fuzz.api SECONDS [SEED]`: generated and hand-made requests to a running service."""

from __future__ import annotations

import asyncio
import gzip
import json
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any, Final

from app.errors.problems import KINDS, PROBLEM_TYPE
from tests.faults.asking import Answer, Service
from tests.faults.served import ROOT, Served, served
from tests.fuzz.bodies import hand_made

KEPT: Final = ROOT / "fuzz-failures"
AT_ONCE: Final = 4
HAND_MADE_FRAC: Final = 0.2  # of the time
TIME_LIMIT_S: Final = 10.0
REST_S: Final = 0.5  # that one waits for an answer to a part of a request
HANG_S: Final = 3.0 * TIME_LIMIT_S  # without an answer
# uvicorn answers a HEAD whose chunks are none with a body, which h11 refuses
OF_THE_SERVER: Final = ("illegal chunk header", "Too much data for declared Content-Length")
# what a schema can't say (reserve_soc ≤ soc, weights not all 0) is refused with 422
CONFIG: Final = """
[checks]
positive_data_acceptance.enabled = false

[[operations]]
include-path = "/diagnoses"
include-method = "POST"
[operations.checks]
negative_data_rejection.enabled = false # a form sends every field as text

[[operations]]
include-path = "/diagnoses/{id}"
[operations.checks]
use_after_free.enabled = false # DELETE of one that runs stops it, and it can still be read
"""


def main(seconds: float, seed: int) -> int:
    """Print what was sent and what failed; the exit status is 1 where something failed."""
    with tempfile.TemporaryDirectory() as folder, served(Path(folder), {"time_limit_s": TIME_LIMIT_S}) as service:
        failed = _hand_made(service, HAND_MADE_FRAC * seconds, seed)
        failed += _generated(service, Path(folder), (1.0 - HAND_MADE_FRAC) * seconds, seed)
        log = service.log.read_text(encoding="utf-8", errors="replace")
        if not service.alive or faults_in(log):
            print(f"the service {'logged a fault' if service.alive else 'died'}:", *faults_in(log)[:3], sep="\n")
            failed += 1
    return 1 if failed else 0


def faults_in(log: str) -> list[str]:
    """Records with a traceback in the log of a service, but for those of the server that end one connection."""
    records = re.split(r"^(?=[A-Z]+: )", log, flags=re.MULTILINE)
    return [
        record for record in records if "Traceback" in record and not all(known in record for known in OF_THE_SERVER)
    ]


def fault_of(answer: Answer) -> str:
    """What is wrong with an answer to any request whatever, "" for nothing."""
    if answer.status >= 500 and answer.status != 503:
        return f"status {answer.status}"
    if not answer.announced:
        return f"status {answer.status} without Retry-After"
    if answer.status < 400 or not answer.body:
        return ""
    if answer.headers.get("content-type") != PROBLEM_TYPE:
        # what is no HTTP is refused before the application sees it
        return "" if answer.status == 400 else f"a {answer.status} that is no problem"
    packed = answer.headers.get("content-encoding") == "gzip"
    code = json.loads(gzip.decompress(answer.body) if packed else answer.body)["code"]
    kinds = {kind.value: known.status for kind, known in KINDS.items()}
    return "" if kinds.get(code) == answer.status else f"code {code!r} with status {answer.status}"


async def hand_made_answers(service: Service, seeds: range) -> Counter[str]:
    """How requests ended: by status, or by what is wrong; the connection may be closed on what is no HTTP."""
    ends: Counter[str] = Counter()
    room = asyncio.Semaphore(AT_ONCE)

    async def ask(seed: int) -> None:
        async with room:
            sent, whole = hand_made(seed)
            answer = Answer(0)
            try:
                answer = await asyncio.wait_for(service.send(sent), HANG_S if whole else REST_S)
                fault = fault_of(answer) if answer.status else ""
            except TimeoutError:  # a service may wait for the rest of a body, as long as its clients let it
                fault = f"no end within {HANG_S:g} s" if whole else ""
            if fault:
                KEPT.mkdir(exist_ok=True)
                (KEPT / f"{seed}-request").write_bytes(sent)
                print(f"request of seed {seed}: {fault}\n{sent[:300]!r}\n{answer.body[:500]!r}", flush=True)
            ends[fault or str(answer.status or "closed")] += 1

    await asyncio.gather(*(ask(seed) for seed in seeds))
    return ends


def _hand_made(service: Served, seconds: float, seed: int) -> int:
    ends: Counter[str] = Counter()
    until = time.monotonic() + seconds
    first = seed * 1_000_000
    while time.monotonic() < until:
        ends += asyncio.run(hand_made_answers(Service(service.url), range(first, first + 200)))
        first += 200
    print(f"{ends.total()} hand-made requests: {dict(ends.most_common())}", flush=True)
    return sum(count for end, count in ends.items() if not re.fullmatch(r"\d+|closed", end))


def _generated(service: Served, folder: Path, seconds: float, seed: int) -> int:
    config, report = folder / "schemathesis.toml", folder / "report.json"
    config.write_text(CONFIG)
    command: list[Any] = [Path(sys.executable).with_name("schemathesis"), "--config-file", config]
    command += ["run", f"{service.url}/openapi.json", "--phases", "examples,coverage,fuzzing,stateful"]
    command += ["--max-time", max(int(seconds), 1), "--seed", seed, "--request-timeout", HANG_S, "--no-color"]
    command += ["--continue-on-failure", "--report", "json", "--report-json-path", report, "--warnings", "off"]
    ended = subprocess.run([str(word) for word in command], cwd=folder, check=False)
    return ended.returncode


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0))
