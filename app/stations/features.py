"""Stations of a graph as GeoJSON."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import quote, urlencode

import orjson

from app.conversions.stations.facts import kilowatts, price_fields, socket_fields, source_fields
from app.stations.answer import StationCollection
from routing.stations.opening import Opening, is_understood, opening_at
from routing.stations.selection import power_w

if TYPE_CHECKING:
    from datetime import datetime
    from typing import Any

    from app.stations.parameters import StationParameters
    from routing.stations.selection import StationIndex
    from routing.stations.station import Station

LINK_DECIMALS = 2


@dataclass(frozen=True, slots=True)
class GraphStations:
    """The stations of one graph, ready to be asked; version: of the graph with its stations."""

    graph_name: str
    version: str
    index: StationIndex

    def tag(self, sent: StationParameters) -> str:
        """A name for an answer."""
        asked = f"{self.version} {sent.model_dump_json()}"
        return hashlib.blake2b(asked.encode("utf-8", "replace"), digest_size=8).hexdigest()

    def collection(self, sent: StationParameters) -> StationCollection:
        """One page of the stations that are asked for."""
        return StationCollection.model_validate(_collection(self.index, self.graph_name, sent, ""))

    def json(self, sent: StationParameters, path_prefix: str = "") -> bytes:
        """The JSON of what collection returns, made without an object for each station; path_prefix: of `next`."""
        return orjson.dumps(_collection(self.index, self.graph_name, sent, path_prefix))


def _collection(index: StationIndex, graph_name: str, sent: StationParameters, path_prefix: str) -> dict[str, Any]:
    stations = index.stations
    matching = [stations.stations[k] for k in index.matching(sent.as_filter()).tolist()]
    rest = matching if sent.after is None else [station for station in matching if station.id > sent.after]
    page = rest[: sent.limit]
    following = None
    if len(rest) > len(page):
        asked = sent.model_dump(mode="json", exclude_none=True, exclude_defaults=True) | {"after": page[-1].id}
        following = f"{path_prefix}/graphs/{quote(graph_name, safe='')}/stations?{urlencode(asked)}"
    return {
        "type": "FeatureCollection",
        "features": [station_feature(station, sent.open_at) for station in page],
        "graph": graph_name,
        "sources": [source_fields(source) for source in stations.sources],
        "matched": len(matching),
        "returned": len(page),
        "next": following,
        "left_out": dict(stations.left_out),
        "warnings": _warnings(matching, sent.open_at),
    }


def station_feature(station: Station, open_at: datetime | None = None) -> dict[str, Any]:
    """One station as the fields of a StationFeature."""
    power = power_w(station)
    return {
        "type": "Feature",
        "id": station.id,
        "geometry": {"type": "Point", "coordinates": [station.at.lon_deg, station.at.lat_deg]},
        "properties": {
            "name": station.name,
            "operator": station.operator,
            "network": station.network,
            "sockets": [socket_fields(socket) for socket in station.sockets],
            "power_kw": kilowatts(power) if power else None,
            "capacity": station.capacity,
            "access": station.access.value,
            "fee": station.fee,
            "price": price_fields(station.price),
            "opening_hours": station.opening_hours,
            "open": None if open_at is None else opening_at(station.opening_hours, open_at).value,
            "operational": station.operational,
            "source": station.source,
            "merged": list(station.merged),
            "road_distance_m": station.snap_m,
            "roads": [
                {"link": place.link_idx, "offset_m": round(place.offset_m, LINK_DECIMALS)} for place in station.position
            ],
        },
    }


def _warnings(matching: list[Station], open_at: datetime | None) -> list[str]:
    if open_at is None:
        return []
    unsaid = sum(station.opening_hours is None for station in matching)
    unread = [
        station
        for station in matching
        if station.opening_hours is not None and not is_understood(station.opening_hours)
    ]
    unknown = sum(opening_at(station.opening_hours, open_at) is Opening.UNKNOWN for station in matching)
    if not unknown:
        return []
    parts = [f"{unsaid} say no opening hours"] if unsaid else []
    if unread:
        shown = f"{unread[0].id}: {(unread[0].opening_hours or '')[:80]!r}"
        parts.append(f"those of {len(unread)} are not understood, such as {shown}")
    said = f" ({'; '.join(parts)})" if parts else ""
    return [f"of {unknown} of {len(matching)} stations it is not known whether they are open then{said}"]
