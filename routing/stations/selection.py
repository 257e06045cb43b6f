"""The stations of a graph that are asked for: by place, plug, power, network, access and time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from routing.stations.opening import Opening, opening_at

if TYPE_CHECKING:
    from datetime import datetime

    from numpy.typing import NDArray

    from energy.charging.charging import Connector
    from routing.stations.station import Access, Station, Stations


@dataclass(frozen=True, slots=True)
class StationFilter:
    """What stations must be like; what is not said may be anything.

    bbox: west, south, east, north [deg], west above east over the antimeridian. connectors: at least one of them;
    min_power_w: at a socket of these connectors [W]. network: of its network or operator, in any case, a part is
    enough. open_at: local time at which it is not known to be closed.
    """

    bbox: tuple[float, float, float, float] | None = None
    connectors: frozenset[Connector] = frozenset()
    min_power_w: float = 0.0
    network: str = ""
    access: frozenset[Access] = frozenset()
    open_at: datetime | None = None


class StationIndex:
    """The stations of one graph, ordered by id, with what is asked of them most in arrays; read-only.

    lat_deg, lon_deg, power_w: float64 (n,), power_w the greatest output of a socket, 0 where none is known.
    """

    def __init__(self, stations: Stations) -> None:
        self.stations = stations
        every = stations.stations
        self.lat_deg = np.array([station.at.lat_deg for station in every], np.float64)
        self.lon_deg = np.array([station.at.lon_deg for station in every], np.float64)
        self.power_w = np.array([power_w(station) for station in every], np.float64)

    def __len__(self) -> int:
        return len(self.stations.stations)

    def matching(self, asked: StationFilter) -> NDArray[np.int64]:
        """Positions of the stations that a filter lets through, int64 (k,) ascending; O(n)."""
        every = self.stations.stations
        is_in = self.power_w >= asked.min_power_w
        if asked.bbox is not None:
            west, south, east, north = asked.bbox
            is_in &= (self.lat_deg >= south) & (self.lat_deg <= north)
            east_of, west_of = self.lon_deg >= west, self.lon_deg <= east
            is_in &= (east_of & west_of) if west <= east else (east_of | west_of)
        found = np.flatnonzero(is_in)
        if not (asked.connectors or asked.network or asked.access or asked.open_at):
            return found
        name = asked.network.casefold()
        kept = [k for k in found.tolist() if _matches(every[k], asked, name)]
        return np.array(kept, np.int64)


def power_w(station: Station) -> float:
    """The greatest output of a station's sockets [W], 0 where none is known."""
    return max((socket.output_w for socket in station.sockets if socket.output_w is not None), default=0.0)


def _matches(station: Station, asked: StationFilter, name: str) -> bool:
    if asked.access and station.access not in asked.access:
        return False
    if asked.connectors and not any(
        socket.connector in asked.connectors and (socket.output_w or 0.0) >= asked.min_power_w
        for socket in station.sockets
    ):
        return False
    if name and name not in station.network.casefold() and name not in station.operator.casefold():
        return False
    return asked.open_at is None or opening_at(station.opening_hours, asked.open_at) is not Opening.CLOSED
