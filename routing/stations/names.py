"""What queries may name of a graph's stations: ids, networks and plugs; and what was meant where they do not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from energy.charging.power import fits
from routing.errors import QueryError
from routing.spelling import question, similar

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from energy.charging.charging import Charging, Connector
    from routing.stations.station import Stations, StationSource

SHOWN: Final = 3
W_PER_KW: Final = 1000.0
POWER_ROUNDING: Final = 1e-9


class StationNames:
    """Names of one graph's stations; read-only.

    sources: by key. Its methods raise QueryError, naming the field of the query, the value and what is allowed.
    """

    def __init__(self, graph_name: str, stations: Stations) -> None:
        self.graph_name = graph_name
        self.stations = stations
        self.sources: dict[str, StationSource] = {source.key: source for source in stations.sources}
        self._ids = frozenset(station.id for station in stations.stations)
        self._sorted_ids = sorted(self._ids)
        self._networks: dict[str, set[str]] = {}  # as stations have them, by what they are in any case
        self._most_w: dict[Connector, float] = {}
        for station in stations.stations:
            for name in (station.network, station.operator):
                if name:
                    self._networks.setdefault(name.casefold(), set()).add(name)
            for socket in station.sockets:
                most_w = max(self._most_w.get(socket.connector, 0.0), socket.output_w or 0.0)
                self._most_w[socket.connector] = most_w
        self._sorted_networks = sorted(min(names) for names in self._networks.values())

    def check_id(self, field: str, station_id: str) -> None:
        """Raise where no station has this id."""
        if station_id not in self._ids:
            ends = [known for known in self._sorted_ids if known.partition(":")[2] == station_id]
            meant = ends[:SHOWN] or similar(station_id, self._sorted_ids)
            allowed = (
                f"ids of stations of graph {self.graph_name!r}{question(meant) if self._ids else ', which has none'}"
            )
            raise QueryError(field, station_id, allowed)

    def usable_plugs(self, field: str, charging: Charging, asked: Sequence[Connector]) -> list[Connector]:
        """Plugs of stations that a vehicle may use, of those asked for if any are.

        Raises where one asked for does not fit it, or no station has any of them. Where none is asked for and none
        fits, or there are no stations, there are none.
        """
        fitting = [plug for plug in self._most_w if fits(charging, plug)]
        if not asked:
            return fitting
        for k, plug in enumerate(asked):
            if not fits(charging, plug):
                allowed = f"plugs that fit the vehicle: {_listed(charging.connectors)}"
                raise QueryError(f"{field}[{k}]", plug.value, allowed)
        usable = [plug for plug in fitting if plug in asked]
        if not usable and self._ids:
            has = _listed(fitting) or f"none that fits the vehicle, but {_listed(self._most_w) or 'no plugs'}"
            allowed = f"plugs that stations of graph {self.graph_name!r} have: {has}"
            raise QueryError(field, [plug.value for plug in asked], allowed)
        return usable

    def check_power(self, field: str, least_kw: float, plugs: Sequence[Connector]) -> None:
        """Raise where no socket of these plugs has so much output [kW]."""
        if least_kw <= 0.0 or not plugs:
            return
        most_kw = max(self._most_w[plug] for plug in plugs) / W_PER_KW
        if least_kw > most_kw * (1.0 + POWER_ROUNDING):
            whose = f"the most of stations of graph {self.graph_name!r} with {_listed(plugs)}"
            raise QueryError(field, least_kw, f"at most {most_kw:g}, {whose}")

    def networks(self, field: str, name: str) -> set[str]:
        """Names of networks and operators as stations have them, of one in any case.

        Raises where there is none, but on a graph without stations, where no name says anything.
        """
        known = self._networks.get(name.casefold())
        if known is None:
            if not self._ids:
                return set()
            within = [other for other in self._sorted_networks if name.casefold() in other.casefold()]
            meant = within[:SHOWN] or similar(name, self._sorted_networks)
            allowed = f"a network or an operator of stations of graph {self.graph_name!r}{question(meant)}"
            raise QueryError(field, name, allowed)
        return known


def network_rules(
    names: StationNames, field: str, weighted: Iterable[tuple[str, Sequence[str], float | None]]
) -> tuple[dict[str, float], frozenset[str]]:
    """Factors on time by the names that stations have, and the names of those that are excluded.

    weighted: kind, names in any case, and their factor, None where they are excluded. Raises QueryError.
    """
    factors: dict[str, float] = {}
    excluded: set[str] = set()
    for kind, given, factor in weighted:
        for k, name in enumerate(given):
            known = names.networks(f"{field}{kind}[{k}]", name)
            if factor is None:
                excluded |= known
            else:
                factors |= dict.fromkeys(known, factor)
    return factors, frozenset(excluded)


def _listed(plugs: Iterable[Connector]) -> str:
    return ", ".join(sorted(plug.value for plug in plugs))
