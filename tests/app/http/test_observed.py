"""What is said of each request: its id, times in the answer, one line in the log, spans where tracing is set up."""

from __future__ import annotations

import json
import logging
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from starlette.datastructures import State
from starlette.responses import Response
from starlette.testclient import TestClient

from app.http.metrics import Metrics
from app.http.observed import Observed
from app.logs import ACCESS, AtMost, JsonFormatter, RequestLine, TextFormatter
from app.main import create_app
from app.observation import Observation
from tests.app.expected import VEHICLE

if TYPE_CHECKING:
    from fastapi import FastAPI
    from starlette.types import Receive, Scope, Send

    from app.service.service import Service
    from app.settings import Settings

ROOT = Path(__file__).resolve().parents[3]
ROUTE: dict[str, Any] = {"start": [8.0, 46.5], "goal": [8.02, 46.52], "soc": 0.5}
# prints the spans of GET /range, and of one that has its place in the path, by a service with OpenTelemetry set up
TRACED = """
import json, sys
from opentelemetry import trace
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from starlette.testclient import TestClient
from app.main import create_app
from app.settings import Settings

exporter = InMemorySpanExporter()
provider = TracerProvider()
provider.add_span_processor(SimpleSpanProcessor(exporter))
trace.set_tracer_provider(provider)
graphs, database = sys.argv[1:]
settings = Settings(graph_dirs=(graphs,), default_graph="grid", database_url=database)
with TestClient(create_app(settings)) as client:
    parent = {"traceparent": "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01", "X-Request-Id": "mine"}
    client.get("/range?lat=46.5&lon=8&soc=0.5", headers=parent)
    client.get("/osrm/nearest/v1/driving/8,46.5", headers=parent)
spans = [(s.name, f"{s.context.trace_id:032x}", dict(s.attributes or {})) for s in exporter.get_finished_spans()]
print(json.dumps(spans, default=str))
"""


def access_lines(caplog: pytest.LogCaptureFixture) -> list[dict[str, Any]]:
    """The lines of requests, as JSON has them."""
    return [json.loads(JsonFormatter().format(record)) for record in caplog.records if record.name == ACCESS]


def test_answer_says_the_id_that_was_sent_and_its_times(client: TestClient) -> None:
    answer = client.post("/route", json=ROUTE, headers={"X-Request-Id": "client-7.a_b:c"})
    assert answer.headers["x-request-id"] == "client-7.a_b:c"
    timing = dict(re.findall(r"(\w+);dur=([0-9.]+)", answer.headers["server-timing"]))
    assert list(timing) == ["wait", "search", "write", "total"]
    assert sum(float(timing[name]) for name in ("wait", "search", "write")) <= float(timing["total"]) + 0.2


@pytest.mark.parametrize("sent", ["", "two words", "a\x0bb", "x" * 65, "é", '"quoted"', "-dash", "{}"])
def test_id_that_is_not_plain_is_replaced(client: TestClient, sent: str) -> None:
    answer = client.get("/healthz", headers={"X-Request-Id": sent.encode("utf-8")})
    assert re.fullmatch("[0-9a-f]{16}", answer.headers["x-request-id"])


def test_errors_and_faults_have_an_id_too(app: FastAPI, client: TestClient) -> None:
    assert client.get("/nothing").headers["x-request-id"]
    patient = TestClient(create_app(), raise_server_exceptions=False)

    @patient.app.get("/broken")  # type: ignore[attr-defined]  # an application of FastAPI
    def broken() -> None:
        raise RuntimeError("broken")

    answer = patient.get("/broken", headers={"X-Request-Id": "mine"})
    assert (answer.status_code, answer.headers["x-request-id"]) == (500, "mine")


def test_line_of_a_request_says_what_it_was_about(client: TestClient, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, ACCESS)
    answer = client.post("/route", json={**ROUTE, "vehicle": "vw-id4"}, headers={"X-Request-Id": "mine"})
    (line,) = access_lines(caplog)
    expected = {
        "level": "info",
        "request_id": "mine",
        "method": "POST",
        "endpoint": "/route",
        "status": 200,
        "graph": "grid",
        "vehicle": "vw-id4",
        "labels_settled": sum(stats["labels_settled"] for stats in answer.json()["stats"]),
    }
    assert {name: line[name] for name in expected} == expected
    assert line["duration_ms"] >= line["search_ms"] >= 0.0
    assert "client" not in line


def test_line_of_a_refused_request_names_the_problem(client: TestClient, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, ACCESS)
    client.post("/route", json={**ROUTE, "vehicle": "delorean"})
    (line,) = access_lines(caplog)
    assert (line["status"], line["problem"]) == (404, "unknown_vehicle")
    assert "vehicle" not in line


def test_log_holds_no_place_key_vehicle_number_or_sent_name(
    client: TestClient, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    headers = {"Authorization": "Bearer s3cret", "X-Api-Key": "s3cret", "Cookie": "s3cret", "User-Agent": "s3cret"}
    car = {**VEHICLE, "mass_kg": 1511.25, "name": "s3cret"}
    client.post("/route", json={**ROUTE, "vehicle": car}, headers=headers)
    client.get("/range?lat=46.5&lon=8.0125&soc=0.5&vehicle=s3cret", headers=headers)
    client.get("/vehicles/s3cret", headers=headers)
    client.get("/s3cret", headers=headers)
    client.get("/graphs/grid/tiles/11/1070/723.mvt")
    text = "\n".join(
        f"{TextFormatter().format(record)}\n{JsonFormatter().format(record)}"
        for record in caplog.records
        if record.name.startswith(("app", "requests", "uvicorn", "fastapi"))
    )
    assert text.count("/route") == 2
    assert '"vehicle": "inline"' in text
    for secret in ("46.5", "8.0125", "1511.25", "s3cret", "1070"):
        assert secret not in text


def test_client_is_logged_where_that_is_set(
    settings: Settings, service: Service, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, ACCESS)
    with TestClient(create_app(settings.model_copy(update={"log_client": True}), service)) as client:
        client.get("/healthz")
    assert access_lines(caplog)[0]["client"] == "testclient"


def test_name_of_the_key_that_let_a_request_in_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, ACCESS)

    async def let_in(scope: Scope, receive: Receive, send: Send) -> None:
        scope.setdefault("state", {})["key_name"] = "dispatch"
        await Response("ok")(scope, receive, send)

    TestClient(Observed(let_in, Metrics(State()), log_client=False)).get("/", headers={"X-Api-Key": "s3cret"})
    (line,) = access_lines(caplog)
    assert line["key"] == "dispatch"


def test_more_lines_a_second_than_allowed_are_counted_instead() -> None:
    now = [5.0]
    at_most = AtMost(3, lambda: now[0])

    def record() -> logging.LogRecord:
        line = RequestLine("GET", "/healthz", 200, 0.001, Observation("mine"))
        return logging.LogRecord(ACCESS, logging.INFO, "", 0, "%s", (line,), None)

    assert [at_most.filter(record()) for _ in range(10)] == [True] * 3 + [False] * 7
    now[0] = 6.0
    later = record()
    assert at_most.filter(later)
    assert json.loads(JsonFormatter().format(later))["dropped"] == 7
    assert TextFormatter().format(later) == ("INFO:     GET /healthz 200 request_id=mine duration_ms=1.0 dropped=7")
    after = record()
    assert at_most.filter(after)
    assert "dropped" not in json.loads(JsonFormatter().format(after))


@pytest.mark.parametrize(("form", "first"), [("JSON", "{"), ("text", "WARNING: ")])
def test_log_is_written_as_the_environment_says(form: str, first: str) -> None:
    says = "\n".join(
        (
            "import logging",
            "from app.logs import configure_logs",
            "from app.settings import Settings",
            "configure_logs(Settings())",
            "logging.getLogger('app.x').warning('a word')",
            "logging.getLogger('app.x').info('less')",
            "logging.getLogger('other').info('less')",
        )
    )
    environment = {**os.environ, "JOULEPATH_LOG_FORMAT": form, "JOULEPATH_LOG_LEVEL": "WARNING"}
    ran = subprocess.run(
        [sys.executable, "-c", says], cwd=ROOT, env=environment, capture_output=True, text=True, check=True
    )
    (line,) = ran.stderr.splitlines()
    assert line.startswith(first)
    assert "a word" in line


def test_json_line_of_an_exception_is_one_line_of_json() -> None:
    try:
        raise ValueError("lone \ud800 surrogate\nand a line")
    except ValueError:
        record = logging.LogRecord("app.x", logging.ERROR, "", 0, "failed: %s", ("\ud800\n",), sys.exc_info())
    line = JsonFormatter().format(record)
    assert "\n" not in line
    assert json.loads(line)["exception"].startswith("Traceback")


def test_requests_are_traced_where_opentelemetry_is_set_up_without_the_places_in_them(
    graph_dir: Path, tmp_path: Path
) -> None:
    command = [sys.executable, "-c", TRACED, str(graph_dir), f"sqlite:///{tmp_path / 'x.sqlite'}"]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    spans = json.loads(ran.stdout)
    names = {name for name, _, _ in spans}
    assert {"search", "write", "GET /range"} <= names
    assert {trace for _, trace, _ in spans} == {"0af7651916cd43dd8448eb211c80319c"}
    (request,) = (attributes for name, _, attributes in spans if name == "GET /range")
    assert request["url.query"] == "REDACTED"
    assert request["request_id"] == "mine"
    assert "46.5" not in ran.stdout
