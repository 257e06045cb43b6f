"""Names of synthetic roads and streets, plainly invented."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from energy.stops import FunctionalClass

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from routing.synth.links import RoadPieces
    from routing.synth.settlements import Settlements
    from routing.synth.streets import Streets
    from routing.synth.terrain import Landscape

_STREETS: Final = [
    "Mill",
    "Church",
    "Market",
    "Bridge",
    "School",
    "Station",
    "Garden",
    "Orchard",
    "River",
    "Meadow",
    "Castle",
    "Forge",
    "Baker",
    "Weaver",
    "Tanner",
    "Cooper",
    "Linden",
    "Maple",
    "Elm",
    "Birch",
    "Rowan",
    "Alder",
    "Hazel",
    "Chestnut",
    "Spring",
    "Well",
    "Tower",
    "Abbey",
    "Harbour",
    "Quarry",
    "Miller",
    "Mason",
    "Carter",
    "Fuller",
    "Glover",
    "Hill",
    "Lower",
    "Upper",
    "Long",
    "Short",
]
_KINDS: Final = ("Street", "Lane")
PASS_FROM_M: Final = 1_100.0
VALLEY_FROM_M: Final = 420.0


def way_names(
    places: Settlements, streets: Streets, parts: Sequence[RoadPieces], land: Landscape
) -> tuple[tuple[str, ...], NDArray[np.int32]]:
    """All names, and the name of every piece of streets, roads and motorways, int32 (pieces,), in that order."""
    street, road, motorway = parts
    lines, of_street = np.unique(street.way, return_inverse=True)
    place, local = lines // 512, lines % 512
    street_names = [
        f"{_STREETS[(13 * p + 7 * n) % len(_STREETS)]} {_KINDS[n // 256]}, {places.names[p]}"
        if n % 256 != 255
        else f"Yard road, {places.names[p]}"
        for p, n in zip(place.tolist(), local.tolist(), strict=True)
    ]
    ways, first_at, of_road = np.unique(road.way, return_index=True, return_inverse=True)
    top = np.zeros(ways.size)
    np.maximum.at(top, of_road, land.sample_m(road.shape.x_m, road.shape.y_m)[road.shape.first[:-1]])
    kind = np.where(top > PASS_FROM_M, "Pass Road", np.where(top > VALLEY_FROM_M, "Valley Road", "Plain Road"))
    main = road.functional_class[first_at] <= FunctionalClass.TRUNK
    kind = np.where(main, "Trunk Road", kind)
    road_names = [f"{k} {n + 1}" for n, k in enumerate(kind.tolist())]
    routes, of_motorway = np.unique(motorway.way, return_inverse=True)
    motorway_names = [f"Motorway M{n + 1}" for n in range(routes.size)]
    idx = np.concatenate(
        (of_street, len(street_names) + of_road, len(street_names) + len(road_names) + of_motorway)
    ).astype(np.int32)
    return tuple(street_names + road_names + motorway_names), idx
