"""Graphs in memory that several processes read: one copy of the arrays, whoever holds them."""

from __future__ import annotations

import mmap
import os
import pickle
import struct
import sys
from typing import TYPE_CHECKING, Final

from routing.graph.road_graph import RoadGraph
from routing.stations.files import NO_STATIONS
from routing.stations.station import Stations

if TYPE_CHECKING:
    from collections.abc import Sequence

ALIGNED_BYTES: Final = 64  # a line of the processor's cache, more than any array's type asks for
_HEAD: Final = struct.Struct("<QQ")  # where the description begins, and how long it is
_WRITTEN_BYTES: Final = 2**24  # at once


def can_share() -> bool:
    """Whether this system has memory without a file that can be sealed: Linux."""
    return sys.platform == "linux" and hasattr(os, "memfd_create")


def share_graph(graph: RoadGraph, label: str, stations: Stations = NO_STATIONS) -> int:
    """A descriptor of memory that holds a graph with its stations, which nobody can change, cut or grow any more.

    No file backs it, so that nothing that happens to a disk ends those who read it; it goes with the last descriptor
    and the last graph on it. label: by which the system lists it, as in /proc/PID/maps. The arrays follow each other,
    each aligned; all else is a pickle, which names them by their order. Raises OSError where there is no memory, and
    where can_share is false.
    """
    buffers: list[pickle.PickleBuffer] = []
    described = pickle.dumps((graph, stations), protocol=5, buffer_callback=buffers.append)
    raw = [buffer.raw() for buffer in buffers]
    places: list[tuple[int, int]] = []
    end = _HEAD.size
    for view in raw:
        begin = _aligned(end)
        places.append((begin, view.nbytes))
        end = begin + view.nbytes
    description = pickle.dumps((places, described), protocol=5)
    begin = _aligned(end)
    if sys.platform != "linux":
        raise OSError("no memory can be shared without a file on this system")
    descriptor = os.memfd_create(label, os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    try:
        os.ftruncate(descriptor, begin + len(description))
        _write(descriptor, 0, memoryview(_HEAD.pack(begin, len(description))))
        for (at, _), view in zip(places, raw, strict=True):
            _write(descriptor, at, view)
        _write(descriptor, begin, memoryview(description))
        _seal(descriptor)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def shared_graph(descriptor: int) -> tuple[RoadGraph, Stations]:
    """The graph that share_graph has put into memory, its arrays there, not copied, and read-only; and its stations.

    The descriptor may be closed afterwards. It must come from this program: it is unpickled.
    """
    memory = memoryview(mmap.mmap(descriptor, 0, access=mmap.ACCESS_READ))
    begin, length = _HEAD.unpack_from(memory)
    places: Sequence[tuple[int, int]]
    places, described = pickle.loads(memory[begin : begin + length])
    graph, stations = pickle.loads(described, buffers=[memory[at : at + size] for at, size in places])
    if not isinstance(graph, RoadGraph) or not isinstance(stations, Stations):
        raise TypeError(f"the shared memory holds a {type(graph).__name__}, no graph")
    return graph, stations


def _aligned(offset: int) -> int:
    return -(-offset // ALIGNED_BYTES) * ALIGNED_BYTES


def _write(descriptor: int, at: int, view: memoryview) -> None:
    done = 0
    while done < view.nbytes:
        done += os.pwrite(descriptor, view[done : done + _WRITTEN_BYTES], at + done)


def _seal(descriptor: int) -> None:
    if sys.platform == "linux":
        import fcntl

        seals = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_WRITE | fcntl.F_SEAL_SEAL
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, seals)
