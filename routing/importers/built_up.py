"""Which pieces of road lie in built-up areas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from scipy.ndimage import gaussian_filter

from energy.stops import FunctionalClass
from routing.graph.earth import E7
from routing.importers.speeds import KMH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from routing.importers.chains import Chains, Pieces
    from routing.importers.roads import Roads

CELL_M: Final = 100.0
BLUR_M: Final = 200.0  # standard deviation
URBAN_DENSITY_KM_PER_KM2: Final = 4.0  # assumed; see docs/import.md for what it gives
OTHER_STREET_WEIGHT: Final = 0.5  # of streets that are neither residential nor living streets
RURAL_ABOVE_MPS: Final = 71.0 * KMH  # no built-up area is signed for more (assumed)
_MOST_CELLS: Final = 20_000_000  # 0.5 GB while they are blurred; one stray point can make a map that wide
_M_PER_DEG: Final = 111_195.0  # of a great circle on the mean sphere


def urban_pieces(roads: Roads, chains: Chains, pieces: Pieces) -> NDArray[np.bool_]:
    """Whether each piece lies in a built-up area, bool (K,), judged at its middle.

    A tag decides (`maxspeed:type=DE:urban`); a signed limit above RURAL_ABOVE_MPS means outside; else a piece is urban
    where the blurred density of streets exceeds URBAN_DENSITY_KM_PER_KM2 or in a built-up landuse area of the map.
    """
    way = chains.way[pieces.begin]
    middle = chains.point[(pieces.begin + pieces.end) // 2]
    lon, lat = chains.lon_e7 / E7, chains.lat_e7 / E7
    urban = _street_density(roads, chains, lon, lat)[middle] >= URBAN_DENSITY_KM_PER_KM2
    if roads.built_up:
        tree = shapely.STRtree(list(roads.built_up))
        inside, _ = tree.query(shapely.points(lon[middle], lat[middle]), predicate="within")
        urban[inside] = True
    signed = np.fmax(roads.ways.forward_mps, roads.ways.backward_mps)[way]
    with np.errstate(invalid="ignore"):
        urban &= ~(signed > RURAL_ABOVE_MPS)
    tagged = roads.ways.urban[way]
    result: NDArray[np.bool_] = np.where(tagged >= 0, tagged == 1, urban)
    return result


def _street_density(
    roads: Roads, chains: Chains, lon_deg: NDArray[np.float64], lat_deg: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Blurred length of streets around each point, float64 (P,) [km/km²], without motorways, trunk roads and ramps."""
    ways = roads.ways
    squeeze = float(np.cos(np.radians(lat_deg.mean())))
    if float(lon_deg.max() - lon_deg.min()) > 180.0:  # on both sides of the antimeridian
        lon_deg = np.where(lon_deg < 0.0, lon_deg + 360.0, lon_deg)
    x_m, y_m = (lon_deg - lon_deg.min()) * squeeze * _M_PER_DEG, (lat_deg - lat_deg.min()) * _M_PER_DEG
    cell_m = max(CELL_M, float(np.sqrt((x_m.max() + CELL_M) * (y_m.max() + CELL_M) / _MOST_CELLS)))
    column, row = (x_m / cell_m).astype(np.int64), (y_m / cell_m).astype(np.int64)
    weight = np.where(ways.functional_class == FunctionalClass.RESIDENTIAL, 1.0, OTHER_STREET_WEIGHT)
    weight[(ways.functional_class <= FunctionalClass.TRUNK) | ways.ramp | ways.structure] = 0.0
    street_m = chains.step_m * weight[chains.way]
    at = chains.point
    shape = (int(row.max()) + 1, int(column.max()) + 1)
    total_m = np.bincount(row[at] * shape[1] + column[at], street_m, shape[0] * shape[1]).reshape(shape)
    density = gaussian_filter(total_m.astype(np.float32), BLUR_M / cell_m, mode="constant") * (1000.0 / cell_m**2)
    found: NDArray[np.float64] = density[row, column].astype(np.float64)
    return found
