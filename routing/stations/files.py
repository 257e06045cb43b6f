"""Stations on disk: stations.json beside a graph's own files, as docs/stations.md describes it."""

from __future__ import annotations

import hashlib
import math
import os
import stat
import sys
import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import orjson

from energy.charging.charging import MOST_POWER_W, Connector
from routing.errors import GraphFormatError
from routing.places import LinkPosition, Point
from routing.stations.placing import place_stations
from routing.stations.station import Access, Price, Socket, Station, Stations, StationSource

if TYPE_CHECKING:
    from collections.abc import Mapping

    from routing.graph.road_graph import RoadGraph

STATIONS_FILE: Final = "stations.json"
FORMAT_VERSION: Final = 1
MOST_BYTES: Final = 256 * 1024 * 1024  # of a file that is read: 600,000 stations
MOST_SOCKETS: Final = 100_000  # of one kind, or vehicles at a time
LONGEST_TEXT: Final = 2000  # characters, of what is written
MOST_PRICE: Final = 1e6
NO_STATIONS: Final = Stations((), ())

_ACCESSES: Final = tuple(access.value for access in Access)
_CONNECTORS: Final = tuple(connector.value for connector in Connector)
_KW: Final = 1000.0
_DIGEST_BYTES: Final = 16
_DIGESTED: Final = ("length_m", "functional_class", "structure", "reverse_idx", "geometry_first")
_DIGESTED_POINTS: Final = ("geometry_lon_e7", "geometry_lat_e7")


def load_stations(folder: Path, graph: RoadGraph) -> Stations:
    """The stations beside a graph, on its links; none where there is no file.

    Where the graph is not the one that they were placed on, or the file has no positions, they are placed anew. Raises
    GraphFormatError, which names field, value and what is allowed.
    """
    return load_stations_version(folder, graph)[0]


def load_stations_version(folder: Path, graph: RoadGraph) -> tuple[Stations, str]:
    """The stations as load_stations reads them, and the version of their file, "" where there is none."""
    content = _content(folder)
    if content is None:
        return NO_STATIONS, ""
    return _stations(folder, content, graph), _version(content)


def stations_version(folder: Path) -> str:
    """A name for the content of a graph's stations as they are now, "" where there are none.

    Raises GraphFormatError where the file can't be read.
    """
    content = _content(folder)
    return "" if content is None else _version(content)


def save_stations(folder: Path, graph: RoadGraph, stations: Stations) -> None:
    """Write stations, which are placed on the graph, beside it, whole or not at all; raises OSError."""
    content = stations_bytes(graph, stations)
    descriptor, scratch = tempfile.mkstemp(prefix=f".{STATIONS_FILE}.", dir=folder)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
        os.chmod(scratch, 0o644)
        os.replace(scratch, folder / STATIONS_FILE)
    except BaseException:
        with suppress(OSError):
            os.unlink(scratch)
        raise


def stations_bytes(graph: RoadGraph, stations: Stations) -> bytes:
    """What the file of stations that are placed on a graph holds: a station a line, by id; the same for the same."""
    head = {
        "format_version": FORMAT_VERSION,
        "graph_digest": graph_digest(graph),
        "sources": [_source_fields(source) for source in sorted(stations.sources, key=lambda source: source.key)],
        "left_out": dict(sorted(stations.left_out.items())),
    }
    content = bytearray(orjson.dumps(head, option=orjson.OPT_INDENT_2).removesuffix(b"\n}"))
    content += b',\n  "stations": ['
    for k, station in enumerate(sorted(stations.stations, key=lambda station: station.id)):
        content += b",\n    " if k else b"\n    "
        content += orjson.dumps(_station_fields(station))
    content += b"\n  ]\n}\n"
    return bytes(content)


def graph_digest(graph: RoadGraph) -> str:
    """A name for all that positions of stations depend on: 0.1 s a million links."""
    digest = hashlib.blake2b(digest_size=_DIGEST_BYTES)
    for name in (*_DIGESTED, *_DIGESTED_POINTS):
        digest.update(getattr(graph, name).data)
    if graph.copies is not None:
        digest.update(graph.copies.of.data)
    if graph.ferries is not None:
        digest.update(graph.ferries.link.data)
    return digest.hexdigest()


def _content(folder: Path) -> bytes | None:
    path = folder / STATIONS_FILE
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # a pipe would be waited for
            raise _damaged(folder, "", "no file", "a file written by `joulepath stations`")
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise _damaged(folder, "", f"unreadable ({error})", "a file written by `joulepath stations`") from error
    if len(content) > MOST_BYTES:
        raise _damaged(folder, "", f"over {MOST_BYTES >> 20} MiB large", f"at most {MOST_BYTES >> 20} MiB")
    return content


def _version(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def _damaged(folder: Path, field: str, value: object, allowed: str) -> GraphFormatError:
    shown = value if isinstance(value, str | int | float | bool) or value is None else type(value).__name__
    text = str(shown)
    return GraphFormatError(
        str(folder),
        f"{STATIONS_FILE}{f' {field}' if field else ''}",
        text if len(text) <= 200 else f"{text[:200]}…",
        allowed,
    )


def _stations(folder: Path, content: bytes, graph: RoadGraph) -> Stations:
    try:
        raw = orjson.loads(content)
    except ValueError as error:
        raise _damaged(folder, "", f"no JSON ({error})", "the format of docs/stations.md") from error
    reader = _Reader(folder, graph)
    stations = reader.stations(raw)
    if not reader.needs_placing:
        return stations
    placed = place_stations(graph, stations.stations)
    left_out = {**stations.left_out}
    for reason, count in placed.left_out.items():
        left_out[reason] = left_out.get(reason, 0) + count
    return replace(stations, stations=placed.stations, left_out=left_out)


class _Reader:
    """Reads one file's content, naming the field that is wrong."""

    def __init__(self, folder: Path, graph: RoadGraph) -> None:
        self._folder = folder
        self._graph = graph
        self._sockets: dict[tuple[Socket, ...], tuple[Socket, ...]] = {}
        self.needs_placing = False

    def refuse(self, field: str, value: object, allowed: str) -> GraphFormatError:
        return _damaged(self._folder, field, value, allowed)

    def stations(self, raw: Any) -> Stations:
        fields = self._table("", raw)
        version = fields.get("format_version")
        if version != FORMAT_VERSION or isinstance(version, bool):
            raise self.refuse("format_version", version, f"{FORMAT_VERSION}; import the stations again")
        self.needs_placing = fields.get("graph_digest") != graph_digest(self._graph)
        sources = tuple(self._source(f"sources[{k}]", source) for k, source in enumerate(self._rows("sources", fields)))
        keys = {source.key for source in sources}
        left_out = self._table("left_out", fields.get("left_out", {}))
        counts = {reason: self._count(f"left_out.{reason}", count, 0, 2**53) for reason, count in left_out.items()}
        stations: dict[str, Station] = {}
        for k, row in enumerate(self._rows("stations", fields)):
            station = self._station(f"stations[{k}]", row, keys)
            if station.id in stations:
                raise self.refuse(f"stations[{k}].id", station.id, "each id once")
            stations[station.id] = station
        return Stations(tuple(stations[key] for key in sorted(stations)), sources, counts)

    def _table(self, field: str, value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self.refuse(field, value, "an object")
        return value

    def _rows(self, field: str, fields: Mapping[str, Any], key: str | None = None) -> list[Any]:
        value = fields.get(key or field, [])
        if not isinstance(value, list):
            raise self.refuse(field, value, "a list")
        return value

    def _read(self, at: str, fields: Mapping[str, Any], key: str, default: str | None = "") -> str:
        value = fields.get(key, default)
        if not isinstance(value, str):
            raise self.refuse(f"{at}.{key}", value, "a text")
        return sys.intern(value)

    def _number(self, at: str, fields: Mapping[str, Any], key: str, low: float, high: float, unit: str) -> float:
        value = fields.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise self.refuse(f"{at}.{key}", value, f"{low:g}..{high:g}{f' {unit}' if unit else ''}")
        return float(value)

    def _count(self, field: str, value: Any, low: int, high: int) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.refuse(field, value, f"a whole number, {low}..{high}")
        return value

    def _flag(self, at: str, fields: Mapping[str, Any], key: str) -> bool | None:
        value = fields.get(key)
        if value is not None and not isinstance(value, bool):
            raise self.refuse(f"{at}.{key}", value, "true, false or null")
        return value

    def _source(self, at: str, raw: Any) -> StationSource:
        fields = self._table(at, raw)
        return StationSource(
            key=self._named(at, fields, "key"),
            name=self._named(at, fields, "name"),
            licence=self._named(at, fields, "licence"),
            url=self._read(at, fields, "url"),
            retrieved=self._read(at, fields, "retrieved"),
        )

    def _named(self, at: str, fields: Mapping[str, Any], key: str) -> str:
        text = self._read(at, fields, key, None)
        if not text:
            raise self.refuse(f"{at}.{key}", "empty", "a text")
        return text

    def _station(self, at: str, raw: Any, sources: set[str]) -> Station:
        fields = self._table(at, raw)
        place = Point(
            self._number(at, fields, "lat", -90.0, 90.0, "deg"), self._number(at, fields, "lon", -180.0, 180.0, "deg")
        )
        access = self._read(at, fields, "access", Access.UNKNOWN.value)
        if access not in _ACCESSES:
            raise self.refuse(f"{at}.access", access, ", ".join(_ACCESSES))
        source = self._read(at, fields, "source", None)
        if source not in sources:
            raise self.refuse(f"{at}.source", source, f"a key of sources: {', '.join(sorted(sources))}")
        sockets = tuple(
            self._socket(f"{at}.sockets[{k}]", row)
            for k, row in enumerate(self._rows(f"{at}.sockets", fields, "sockets"))
        )
        capacity = fields.get("capacity")
        hours = fields.get("opening_hours")
        price = fields.get("price")
        merged = self._rows(f"{at}.merged", fields, "merged")
        if not all(isinstance(other, str) for other in merged):
            raise self.refuse(f"{at}.merged", merged, "a list of texts")
        return Station(
            id=self._named(at, fields, "id"),
            at=place,
            sockets=self._sockets.setdefault(sockets, sockets),
            name=self._read(at, fields, "name"),
            operator=self._read(at, fields, "operator"),
            network=self._read(at, fields, "network"),
            capacity=None if capacity is None else self._count(f"{at}.capacity", capacity, 1, MOST_SOCKETS),
            access=Access(access),
            fee=self._flag(at, fields, "fee"),
            price=None if price is None else self._price(f"{at}.price", price),
            opening_hours=None if hours is None else self._read(at, fields, "opening_hours"),
            operational=self._flag(at, fields, "operational"),
            source=source,
            position=self._positions(at, fields),
            snap_m=self._number(at, fields, "snap_m", 0.0, 1e7, "m") if "snap_m" in fields else 0.0,
            merged=tuple(merged),
        )

    def _socket(self, at: str, raw: Any) -> Socket:
        fields = self._table(at, raw)
        connector = self._read(at, fields, "connector", None)
        if connector not in _CONNECTORS:
            raise self.refuse(f"{at}.connector", connector, ", ".join(_CONNECTORS))
        output_w = None
        if fields.get("output_kw") is not None:
            most_kw = MOST_POWER_W / _KW
            output_w = round(self._number(at, fields, "output_kw", 0.0, most_kw, "kW") * _KW, 6)
            if output_w == 0.0:
                raise self.refuse(f"{at}.output_kw", 0, f"above 0, up to {most_kw:g} kW")
        phases = fields.get("phases")
        return Socket(
            connector=Connector(connector),
            output_w=output_w,
            count=self._count(f"{at}.count", fields.get("count", 1), 1, MOST_SOCKETS),
            phases=None if phases is None else self._count(f"{at}.phases", phases, 1, 3),
        )

    def _price(self, at: str, raw: Any) -> Price:
        fields = self._table(at, raw)

        def number(key: str) -> float | None:
            return self._number(at, fields, key, 0.0, MOST_PRICE, "") if fields.get(key) is not None else None

        return Price(
            text=self._read(at, fields, "text"),
            currency=self._read(at, fields, "currency"),
            per_kwh=number("per_kwh"),
            per_min=number("per_min"),
            per_session=number("per_session"),
        )

    def _positions(self, at: str, fields: Mapping[str, Any]) -> tuple[LinkPosition, ...]:
        rows = self._rows(f"{at}.links", fields, "links")
        found = []
        for k, row in enumerate(rows):
            field = f"{at}.links[{k}]"
            if not isinstance(row, list) or len(row) != 2:
                raise self.refuse(field, row, "a link and an offset [m]")
            link, offset_m = row
            is_number = isinstance(offset_m, int | float) and not isinstance(offset_m, bool)
            if not is_number or not 0.0 <= offset_m < math.inf:
                raise self.refuse(f"{field}[1]", offset_m, "an offset, at least 0 m")
            self._count(f"{field}[0]", link, 0, 2**31 - 1)
            if not self.needs_placing:
                self._count(f"{field}[0]", link, 0, self._graph.link_count - 1)
                length_m = float(self._graph.length_m[link])
                if offset_m > length_m:
                    raise self.refuse(f"{field}[1]", offset_m, f"0..{length_m:g} m, the link's length")
            found.append(LinkPosition(link, float(offset_m)))
        if not found:
            self.needs_placing = True
        return tuple(found)


def _source_fields(source: StationSource) -> dict[str, str]:
    fields = {
        "key": source.key,
        "name": source.name,
        "licence": source.licence,
        "url": source.url,
        "retrieved": source.retrieved,
    }
    return {key: value for key, value in fields.items() if value}


def _station_fields(station: Station) -> dict[str, Any]:
    """The fields of a station in the order of the file, without those of which nothing is known."""
    return {
        "id": _text(station.id),
        "lat": station.at.lat_deg,
        "lon": station.at.lon_deg,
        **({"name": _text(station.name)} if station.name else {}),
        **({"operator": _text(station.operator)} if station.operator else {}),
        **({"network": _text(station.network)} if station.network else {}),
        "sockets": [_socket_fields(socket) for socket in station.sockets],
        **({} if station.capacity is None else {"capacity": station.capacity}),
        **({} if station.access is Access.UNKNOWN else {"access": station.access.value}),
        **({} if station.fee is None else {"fee": station.fee}),
        **({} if station.price is None else {"price": _price_fields(station.price)}),
        **({} if station.opening_hours is None else {"opening_hours": _text(station.opening_hours)}),
        **({} if station.operational is None else {"operational": station.operational}),
        "source": station.source,
        **({"merged": [_text(other) for other in station.merged]} if station.merged else {}),
        "links": [[place.link_idx, place.offset_m] for place in station.position],
        "snap_m": station.snap_m,
    }


def _text(text: str) -> str:
    """A text as it can be written, cut where it is very long."""
    return text[:LONGEST_TEXT].encode("utf-8", "replace").decode()


def _socket_fields(socket: Socket) -> dict[str, Any]:
    return {
        "connector": socket.connector.value,
        **({} if socket.output_w is None else {"output_kw": round(socket.output_w / _KW, 9)}),
        "count": socket.count,
        **({} if socket.phases is None else {"phases": socket.phases}),
    }


def _price_fields(price: Price) -> dict[str, Any]:
    fields = {
        "text": _text(price.text),
        "currency": price.currency,
        "per_kwh": price.per_kwh,
        "per_min": price.per_min,
        "per_session": price.per_session,
    }
    return {key: value for key, value in fields.items() if value is not None and value != ""}
