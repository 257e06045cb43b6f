"""Requests that no client library makes, each the same for the same seed: bodies, headers, addresses, framing."""

from __future__ import annotations

import gzip
import json
import random
from typing import Any, Final

from app.http.examples.answers import MATRIX_REQUESTS, RANGE_REQUESTS, ROUTE_REQUESTS, SIMULATE_REQUESTS, VEHICLE_BODIES

JSON_TYPE: Final = "application/json"
ADDRESSES: Final = (
    *(("POST", "/route", ROUTE_REQUESTS), ("POST", "/range", RANGE_REQUESTS), ("POST", "/matrix", MATRIX_REQUESTS)),
    *(("POST", "/simulate", SIMULATE_REQUESTS), ("PUT", "/vehicles/fuzzed", VEHICLE_BODIES)),
    ("POST", "/diagnoses", {"named": {"value": {"recordings": ["a.csv"]}}}),
)
PATHS: Final = (
    *("/", "//", "/%2e%2e/%2e%2e/etc/passwd", "/web/..%2f..%2fpyproject.toml", "/web/%00", "/web/lib/../index.html"),
    *("/vehicles/%ff%fe", "/vehicles/" + "x" * 5000, "/vehicles/..%2f", "/vehicles/a%00b", "/vehicles/%F0%9F%9A%97"),
    *("/graphs/%2e%2e", "/graphs/..%2f..%2fdata", "/graphs/highlands/tiles/99999999999999999999/0/0.mvt"),
    *("/graphs/highlands/tiles/-1/0/0.mvt", "/graphs/highlands/tiles/8/1e3/0.mvt", "/graphs/x%0d%0aSet-Cookie:a=b"),
    *(
        "/diagnoses/..%2f..%2f",
        "/diagnoses/%00",
        "/diagnoses/20200101-000000000000/trips/..%2f",
        "/docs/../openapi.json",
    ),
    *("/range?lat=nan&lon=inf", "/range?lat=1e400&lon=0", "/range?lat=1&lat=2&lon=3", "/range?" + "a=b&" * 2000),
    *("/range?lat=%ff&lon=%00&soc=1", "/range?lat=١&lon=٢", "/route?soc=1", "/healthz?" + "x" * 20_000, "/HEALTHZ"),
    *("/healthz/", "/openapi.json/", "/route/", "*", "http://elsewhere.example/healthz", "/;/healthz", "/./healthz"),
)
VALUES: Final = (
    *("null", "true", "[]", "{}", '""', "0", "-0", "1e309", "-1e309", "NaN", "Infinity", "9" * 400, "1" + "0" * 5000),
    *(
        "1e-400",
        "9223372036854775808",
        "0.1e1",
        '"\\ud800"',
        '"\\udfff\\ud800"',
        '"\\u0000"',
        '"' + "x" * 100_000 + '"',
    ),
    *("[" * 300 + "]" * 300, "[" * 100_000, '{"a":' * 100_000, '{"a":' * 300 + "1" + "}" * 300, '"½٣"', "'x'", "1_0"),
    *(
        "[0.0, 0.0, 0.0]",
        '{"lat": 1, "lon": 2, "lat": 3}',
        '{"": 1}',
        '{"lat": "1"}',
        "[[1, 2]]",
        "[" + "0," * 999 + "0]",
    ),
)
TYPES: Final = (
    *(JSON_TYPE, "application/json; charset=utf-16", 'application/json;charset="', "text/plain", "", "application/xml"),
    *("multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=" + "b" * 300),
    *(
        "application/x-www-form-urlencoded",
        "application/problem+json",
        "*/*",
        "application/json, text/html",
        "\xff/\xfe",
    ),
)
HEADERS: Final = (
    *(("X-HTTP-Method-Override", "DELETE"), ("X-Method-Override", "PUT"), ("Content-Encoding", "gzip")),
    *(("Content-Encoding", "br"), ("Accept", "\xff"), ("Accept", "," * 5000), ("Accept", "application/geo+json;q=nan")),
    *(
        ("Accept-Encoding", "gzip;q=0, *"),
        ("Range", "bytes=0-1"),
        ("If-None-Match", '"' * 99),
        ("Expect", "100-continue"),
    ),
    *(("Transfer-Encoding", "gzip"), ("Transfer-Encoding", "chunked, chunked"), ("Content-Length", "-1")),
    *(("Content-Length", "1e3"), ("Content-Length", "99999999999999999999"), ("Connection", "upgrade")),
    *(("Upgrade", "websocket"), ("Host", ""), ("Host", "a b"), ("X-Forwarded-For", "x" * 4000), ("Cookie", ";" * 999)),
    *(
        ("Origin", "null"),
        ("Origin", "https://elsewhere.example"),
        ("X-Filler", "x" * 60_000),
        ("Content-Type", "a\x00b"),
    ),
)
METHODS: Final = ("GET", "POST", "PUT", "DELETE", "HEAD", "OPTIONS", "PATCH", "TRACE", "FOO", "get")


def hand_made(seed: int) -> tuple[bytes, bool]:
    """One request as it is sent, and whether it must be answered: no further part of it may be waited for."""
    dice = random.Random(f"request:{seed}")
    method, path, examples = dice.choice(ADDRESSES)
    body = _body(examples, dice)
    if dice.random() < 0.2:
        method, path = (
            dice.choice(METHODS),
            dice.choice(PATHS),
        )
    version = "1.0" if dice.random() < 0.05 else "1.1"
    headers = {"Host": "127.0.0.1", "Connection": "close", "Content-Type": JSON_TYPE}
    if dice.random() < 0.2:
        headers["Content-Type"] = dice.choice(TYPES)
    if dice.random() < 0.1:
        headers["Content-Encoding"], body = "gzip", gzip.compress(body)
    framing = dice.choice(("length",) * 12 + ("chunked", "chunked", "odd chunks", "none", "empty"))
    if framing == "empty":
        body = b""
    if framing.endswith(("chunked", "chunks")):
        headers["Transfer-Encoding"] = "chunked"
        body = _chunks(body, dice, odd=framing == "odd chunks")
    elif framing != "none":
        headers["Content-Length"] = str(len(body))
    whole = framing != "odd chunks" and version == "1.1"
    if dice.random() < 0.25:
        name, value = dice.choice(HEADERS)
        headers[name] = value
        whole = whole and name not in ("Content-Length", "Transfer-Encoding", "Connection", "Upgrade")
    head = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
    line = f"{method} {path} HTTP/{version}\r\n"
    return line.encode() + head.encode("latin-1") + b"\r\n" + body, whole


def _body(examples: dict[str, Any], dice: random.Random) -> bytes:
    """An example's text with some of its values replaced, or keys twice, or other bytes among it."""
    example = json.loads(json.dumps(dice.choice(list(examples.values()))["value"]))
    marks: list[str] = []
    for _ in range(dice.choice((0, 1, 1, 1, 2, 3))):
        example = _marked(example, dice, marks)
    text = json.dumps(example)
    for mark in marks:
        text = text.replace(json.dumps(mark), dice.choice(VALUES))
    if dice.random() < 0.1 and text.startswith("{") and len(text) > 2:
        text = "{" + ", ".join([text[1:-1]] * 2) + "}"
    content = text.encode("utf-8", "surrogatepass")
    if dice.random() < 0.1:
        content = text.encode(dice.choice(("utf-16", "utf-32", "utf-8-sig", "utf-7")), "replace")
    if dice.random() < 0.1 and content:
        at = dice.randrange(len(content))
        content = content[:at] + dice.randbytes(dice.choice((1, 2, 40))) + content[at + dice.choice((0, 1, 40)) :]
    return content[: dice.randrange(len(content) + 1)] if dice.random() < 0.05 else content


def _marked(value: Any, dice: random.Random, marks: list[str]) -> Any:
    """The same with one member, or the whole, replaced by a mark."""
    if isinstance(value, dict) and value and dice.random() < 0.9:
        key = dice.choice(list(value))
        if dice.random() < 0.1:
            value[f"other_{key}"] = value.pop(key)
        else:
            value[key] = _marked(value[key], dice, marks)
        return value
    if isinstance(value, list) and value and dice.random() < 0.8:
        at = dice.randrange(len(value))
        value[at] = _marked(value[at], dice, marks)
        return value
    marks.append(f"mark-{len(marks)}-{dice.randrange(10**9)}")
    return marks[-1]


def _chunks(body: bytes, dice: random.Random, *, odd: bool) -> bytes:
    parts = [body[k : k + 700] for k in range(0, len(body), 700)]
    framed = b"".join(f"{len(part):x}\r\n".encode() + part + b"\r\n" for part in parts) + b"0\r\n\r\n"
    if not odd:
        return framed
    return dice.choice(
        (framed.replace(b"\r\n", b"\n", 1), b"zz\r\n" + framed, b"ffffffffffffffffff\r\n" + framed, framed[:-5])
    )
