"""What an index of places takes: `python -m benchmarks.places MAP [--searches N]`.

Its size, the time that it adds to reading the map, and times of searches as they are typed: whole names, their begins,
names with a letter wrong or two exchanged, words turned round, with house numbers and nearness. Processor times.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from routing.gazetteer.building import content_of
from routing.gazetteer.files import index_bytes, save_index
from routing.gazetteer.found import Near
from routing.gazetteer.gazetteer import Gazetteer
from routing.gazetteer.osm import PlaceReader
from routing.importers.region import import_region

if TYPE_CHECKING:
    from routing.gazetteer.building import Content

SEARCHES: Final = 2000
TIMES: Final = 3  # that each import is measured, of which the shortest counts


def typed(content: Content, count: int, rng: np.random.Generator) -> list[tuple[str, str, Near | None, str]]:
    """Texts as people type them, each with how it was made, where it is asked from and the name that is meant."""
    texts: list[tuple[str, str, Near | None, str]] = []
    for k in rng.integers(len(content.entries), size=count).tolist():
        entry, way = content.entries[k], len(texts) % 6
        name, near = entry.name, None
        if way == 1:
            name = name[: max(1, int(rng.integers(1, len(name) + 1)))]
        elif way == 2 and len(name) > 4:
            at = int(rng.integers(1, len(name) - 1))
            name = name[:at] + name[at + 1] + name[at] + name[at + 2 :]
        elif way == 3:
            name = " ".join(reversed(name.split()))
        elif way == 4:
            name = f"{name} {rng.integers(1, 300)}"
        elif way == 5:
            near = Near(entry.lat, entry.lon)
        texts.append((("whole", "begin", "exchanged", "reversed", "number", "near")[way], name, near, entry.name))
    return texts


def main(argv: list[str] | None = None) -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("map", type=Path)
    options.add_argument("--searches", type=int, default=SEARCHES)
    asked = options.parse_args(argv)
    took: list[list[float]] = [[], []]
    for _ in range(TIMES):
        for seconds, reader in zip(took, (None, PlaceReader()), strict=True):
            began = time.process_time()
            import_region(asked.map, [], "measured", beside=reader)
            seconds.append(time.process_time() - began)
    assert reader is not None
    began = time.process_time()
    content = content_of(reader.found, None, asked.map.name.partition(".")[0])
    index = index_bytes(content, asked.map.name)
    made_s = time.process_time() - began
    with tempfile.TemporaryDirectory() as folder:
        save_index(Path(folder), index)
        gazetteer = Gazetteer(Path(folder))
        times: dict[str, list[float]] = {}
        right: dict[str, list[bool]] = {}
        for way, text, near, meant in typed(content, asked.searches, np.random.default_rng(1)):
            began = time.perf_counter()
            found = gazetteer.search(text, near=near)
            times.setdefault(way, []).append(time.perf_counter() - began)
            right.setdefault(way, []).append(any(place.name == meant for place in found))
        began = time.perf_counter()
        for entry in content.entries[:: max(1, len(content.entries) // 300)]:
            gazetteer.reverse(entry.lat + 2e-4, entry.lon + 2e-4)
        reverse_s = (time.perf_counter() - began) / len(content.entries[:: max(1, len(content.entries) // 300)])
    print(f"{asked.map.name}: {content.counts()}")
    print(
        f"index {len(index) / 1e6:.1f} MB; the graph {min(took[0]):.2f} s, with places {min(took[1]):.2f} s, "
        f"making the index {made_s:.2f} s"
    )
    every = [second for part in times.values() for second in part]
    for way, part in [*times.items(), ("all", every)]:
        p50, p99, most = (1e3 * float(np.quantile(part, q)) for q in (0.5, 0.99, 1.0))
        answered = f", of that name among ten answers {np.mean(right[way]):.1%}" if way in right else ""
        print(f"  {way:10} p50 {p50:6.2f} ms, p99 {p99:6.2f} ms, most {most:6.2f} ms{answered}")
    print(f"  reverse    mean {1e3 * reverse_s:5.2f} ms")


if __name__ == "__main__":
    main()
