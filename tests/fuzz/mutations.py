"""Damaged copies of a file, each the same for the same seed: bytes, numbers, words, lines and cells changed."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from typing import Any

_BINARY = (".pbf", ".tif", ".parquet")
_JSON = (".json",)
_XML = (".osm", ".graphml", ".gpx")
_BYTES = (
    b"\x00",
    b"\xff",
    b"\x7f\xff\xff\xff",
    b"\x80\x00\x00\x00",
    b"\xff" * 8,
    b"\x00" * 8,
    b"\xef\xbb\xbf",
    b"\xff\xfe",
)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_:]{2,}")
_XML_VALUE = re.compile(rb"(?<=[\"'])[^\"'<>=\n]*(?=[\"'])|(?<=>)[^<>\n]+(?=<)")
_CELL = re.compile(rb"[^,;\n\"<>=]+")
_VALUES = (
    *(b"", b" ", b"0", b"-1", b"1", b"0.0001", b"1e308", b"-1e308", b"1e400", b"nan", b"NaN", b"inf", b"-Infinity"),
    *(b"9223372036854775807", b"-9223372036854775808", b"18446744073709551616", b"2147483648", b"9" * 400, b"None"),
    *(
        b"<NA>",
        b"null",
        b"true",
        b"[]",
        b"[[[[",
        b"{}",
        b"{[]}",
        b"()",
        b"'",
        b'"',
        b"&amp;",
        b"&x;",
        b"-",
        b"1,5",
        b"1;2;3",
    ),
    *(b"50 mph", b"@", b"12:61", b"24:00-48:00", b"2023-13-45 99:99:99", b"0001-01-01", b"9999-12-31 23:59:59"),
    *(b"POINT (1 2)", b"LINESTRING EMPTY", b"LINESTRING (1 2)", b"\xff\xfe", b"\x00", "½ ٣ ² 车".encode(), b"x" * 5000),
    *(
        b"180",
        b"-180",
        b"181",
        b"90",
        b"91",
        b"360",
        b"1e-320",
        b"\r",
        b"\n",
        b"\t",
        b"1_000",
        b"0x10",
        b"+5",
        b"1.5.2",
    ),
)


def mutant(content: bytes, name: str, seed: int) -> bytes:
    """A copy of a file with one to four changes; the same content, name and seed always give the same copy."""
    dice = random.Random(f"{name}:{seed}")
    if name.endswith(_BINARY):
        steps = _OF_BYTES
    elif dice.random() < 0.1:
        steps = (*_OF_BYTES, _word, _cut_short)
    else:
        steps = _OF_XML if name.endswith(_XML) else _OF_JSON if name.endswith(_JSON) else _OF_TABLES
    for _ in range(dice.choice((1, 1, 1, 2, 3, 4))):
        content = dice.choice(steps)(content, dice)
    return content


def _place(content: bytes, dice: random.Random) -> int:
    return dice.randrange(len(content)) if content else 0


def _bit(content: bytes, dice: random.Random) -> bytes:
    if not content:
        return content
    at = _place(content, dice)
    return content[:at] + bytes([content[at] ^ 1 << dice.randrange(8)]) + content[at + 1 :]


def _overwritten(content: bytes, dice: random.Random) -> bytes:
    at, put = _place(content, dice), dice.choice(_BYTES)
    return content[:at] + put + content[at + len(put) :]


def _inserted(content: bytes, dice: random.Random) -> bytes:
    at = _place(content, dice)
    return content[:at] + dice.choice((*_BYTES, dice.randbytes(8))) + content[at:]


def _without_a_part(content: bytes, dice: random.Random) -> bytes:
    at = _place(content, dice)
    return content[:at] + content[at + dice.choice((1, 2, 4, 16, 64, 256)) :]


def _with_a_part_twice(content: bytes, dice: random.Random) -> bytes:
    at = _place(content, dice)
    part = content[at : at + dice.choice((1, 4, 16, 64, 256))]
    return content[:at] + part * dice.choice((2, 3, 50)) + content[at + len(part) :]


def _cut_short(content: bytes, dice: random.Random) -> bytes:
    return content[: _place(content, dice)] if dice.random() < 0.3 else _bit(content, dice)


def _replaced(pattern: re.Pattern[bytes], content: bytes, dice: random.Random) -> bytes:
    """With one match, or all that are the same, replaced by an odd value or by another match."""
    found = list(pattern.finditer(content))
    if not found:
        return content
    match = dice.choice(found)
    put = dice.choice(_VALUES) if dice.random() < 0.7 else dice.choice(found)[0]
    if dice.random() < 0.1:
        return content.replace(match[0], put)
    return content[: match.start()] + put + content[match.end() :]


def _number(content: bytes, dice: random.Random) -> bytes:
    return _replaced(_NUMBER, content, dice)


def _word(content: bytes, dice: random.Random) -> bytes:
    return _replaced(_WORD, content, dice)


def _cell(content: bytes, dice: random.Random) -> bytes:
    return _replaced(_CELL, content, dice)


def _lines(content: bytes, dice: random.Random) -> bytes:
    lines = content.split(b"\n")
    at, other = dice.randrange(len(lines)), dice.randrange(len(lines))
    what = dice.choice(("leave out", "twice", "swap", "many out", "first again"))
    if what == "leave out":
        del lines[at]
    elif what == "twice":
        lines.insert(other, lines[at])
    elif what == "swap":
        lines[at], lines[other] = lines[other], lines[at]
    elif what == "many out":
        del lines[min(at, other) : max(at, other)]
    else:
        lines.insert(at, lines[0])
    return b"\n".join(lines)


def _xml_value(content: bytes, dice: random.Random) -> bytes:
    """With one value of an attribute or element, or all that are the same, another one; the file stays XML."""
    found = list(_XML_VALUE.finditer(content))
    if not found:
        return content
    match = dice.choice(found)
    put = dice.choice(found)[0]
    if dice.random() < 0.6:
        put = dice.choice(_VALUES).replace(b"&", b"&amp;").replace(b"<", b"&lt;").replace(b'"', b"&quot;")
        put = put.replace(b"'", b"&apos;").replace(b"\x00", b"").replace(b"\xff\xfe", b"")
    if dice.random() < 0.2:
        return content.replace(match[0], put) if len(match[0]) > 2 else content
    return content[: match.start()] + put + content[match.end() :]


def _json_value(content: bytes, dice: random.Random) -> bytes:
    """With one value or name another one, odd or from elsewhere in the file, or left out; the file stays JSON."""
    try:
        whole: Any = [json.loads(content)]
    except ValueError:
        return content
    found: list[tuple[Any, Any]] = []
    containers: list[Any] = [whole]
    while containers:
        inside = containers.pop()
        for key in list(inside) if isinstance(inside, dict) else range(len(inside)):
            found.append((inside, key))
            if isinstance(inside[key], dict | list):
                containers.append(inside[key])
    (inside, key), (other, elsewhere) = dice.choice(found), dice.choice(found)
    put = json.loads(json.dumps(other[elsewhere])) if dice.random() < 0.3 else dice.choice(_ODD)
    what = dice.random()
    if what < 0.1 and inside is not whole:
        del inside[key]
    elif what < 0.2 and isinstance(inside, dict):
        inside[str(put)[:50]] = inside.pop(key)
    else:
        inside[key] = put
    return json.dumps(whole[0], indent=0).encode("utf-8", "surrogatepass")


def _scaled(content: bytes, dice: random.Random) -> bytes:
    """With a number by a factor, as in another unit, with another sign, or out of all bounds."""
    found = list(_NUMBER.finditer(content))
    if not found:
        return content
    match = dice.choice(found)
    put = f"{float(match[0]) * dice.choice(_FACTORS):.10g}".encode()
    return content[: match.start()] + put + content[match.end() :]


def _swapped_bytes(content: bytes, dice: random.Random) -> bytes:
    """With a word put where another of its length stands, which keeps lengths of binary files right."""
    found = list(_WORD.finditer(content))
    if not found:
        return content
    match = dice.choice(found)
    fitting = [other[0] for other in found if len(other[0]) == len(match[0])]
    return content[: match.start()] + dice.choice(fitting) + content[match.end() :]


def _rows(content: bytes) -> tuple[bytes, list[list[bytes]]]:
    delimiter = b";" if content.count(b";") > content.count(b",") else b","
    return delimiter, [line.split(delimiter) for line in content.split(b"\n")]


def _column(content: bytes, dice: random.Random) -> bytes:
    """With the same cell of every line but the first changed, as of a sensor that is absent or in another unit."""
    delimiter, rows = _rows(content)
    at, put, factor = dice.randrange(max(map(len, rows))), dice.choice(_VALUES), dice.choice(_FACTORS)
    what = dice.choice(("constant", "scaled", "held", "sparse"))
    for number, row in enumerate(rows[1:]):
        if at >= len(row):
            continue
        if what == "constant":
            row[at] = put
        elif what == "sparse":
            row[at] = row[at] if number % 7 == 0 else b""
        elif what == "held" and number and at < len(rows[number]):
            row[at] = rows[number][at] if number % 5 else row[at]
        elif what == "scaled" and _NUMBER.fullmatch(row[at]):
            row[at] = f"{float(row[at]) * factor:.10g}".encode()
    return b"\n".join(delimiter.join(row) for row in rows)


def _renamed(content: bytes, dice: random.Random) -> bytes:
    """With one name of the header another's, or none."""
    delimiter, rows = _rows(content)
    at = dice.randrange(len(rows[0]))
    rows[0][at] = dice.choice((*rows[0], b"", b"speed_kmh", b"lat", b"soc", b"note"))
    return b"\n".join(delimiter.join(row) for row in rows)


_FACTORS = (0.0, -1.0, 0.1, 10.0, 1000.0, 0.001, 1e7, 1e-7, 3.6, 1.609344, -100.0, 1e30, 1e300)
_Step = Callable[[bytes, random.Random], bytes]
_OF_BYTES: tuple[_Step, ...] = (
    *(_bit, _bit, _bit, _overwritten, _inserted, _without_a_part, _with_a_part_twice, _cut_short),
    *(_swapped_bytes, _swapped_bytes),
)
_OF_TABLES: tuple[_Step, ...] = (_number, _scaled, _cell, _lines, _column, _column, _renamed)
_ODD: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1.5, 1e308, -1e308, 10**30, float("nan"), float("inf"), "", " ", "x", "0", "-1"),
    *("1,5", "1e999", "\ud800", "\x00\x1b[31m", "\u202e", "9" * 400, "a" * 5000, [], {}, [[]], [None], [{}], {"a": {}}),
    *([1.0, 2.0], "Infinity", "24/7", "150 kW", "48.1", 48.1, 200),
)
_OF_JSON: tuple[_Step, ...] = (*(_json_value,) * 6, _number, _scaled, _cell, _lines)
_OF_XML: tuple[_Step, ...] = (_xml_value, _xml_value, _xml_value, _scaled, _number, _lines)
