"""What requests may name of a graph's stations: ids, networks and plugs."""

from __future__ import annotations

from bisect import bisect_left
from difflib import get_close_matches
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from energy.charging.charging import Connector
    from routing.stations.station import Stations, StationSource

LOOKED_AT: Final = 100  # names on either side of a wrong one, in alphabetical order, that may be meant
MOST_LOOKED_THROUGH: Final = 2000  # names that are looked through as a whole
CLOSE: Final = 0.6
SHOWN: Final = 8


class StationNames:
    """Names of one graph's stations; read-only.

    networks: by any case of its name, the names of networks and operators as stations have them. connectors: plugs that
    they have. sources: by key.
    """

    def __init__(self, stations: Stations) -> None:
        self.stations = stations
        self.ids = frozenset(station.id for station in stations.stations)
        self.sources: dict[str, StationSource] = {source.key: source for source in stations.sources}
        self.networks: dict[str, set[str]] = {}
        most_w: dict[Connector, float] = {}
        for station in stations.stations:
            for name in (station.network, station.operator):
                if name:
                    self.networks.setdefault(name.casefold(), set()).add(name)
            for socket in station.sockets:
                most_w[socket.connector] = max(most_w.get(socket.connector, 0.0), socket.output_w or 0.0)
        self.most_w = most_w
        self._sorted_ids = sorted(self.ids)
        self._sorted_networks = sorted(min(names) for names in self.networks.values())

    def similar_ids(self, wrong: str) -> list[str]:
        """Ids that may have been meant, the most likely first."""
        ends = [known for known in self._sorted_ids if known.partition(":")[2] == wrong]
        return ends[:SHOWN] or _similar(wrong, self._sorted_ids)

    def similar_networks(self, wrong: str) -> list[str]:
        """Names of networks and operators that may have been meant, the most likely first."""
        within = [known for known in self._sorted_networks if wrong.casefold() in known.casefold()]
        return within[:SHOWN] or _similar(wrong, self._sorted_networks)


def question(names: Iterable[str]) -> str:
    """What is asked where names may have been meant, or nothing."""
    shown = " or ".join(repr(name) for name in names)
    return f"; did you mean {shown}?" if shown else ""


def _similar(wrong: str, known: Sequence[str]) -> list[str]:
    """Known names like a wrong one: of all, or, of many, of those beside it in the alphabet."""
    if len(known) > MOST_LOOKED_THROUGH:
        at = bisect_left(known, wrong)
        known = known[max(at - LOOKED_AT, 0) : at + LOOKED_AT]
    by_case = {name.casefold(): name for name in known}
    return [by_case[name] for name in get_close_matches(wrong.casefold(), by_case, n=2, cutoff=CLOSE)]
