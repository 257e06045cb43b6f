"""The Earth as a sphere: distances, and degrees in metres."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


E7: Final = 1e7  # geometry is stored as whole 1e-7 degrees, as OSM does (11 mm)
EARTH_RADIUS_M: Final = 6_371_008.8  # IUGG mean radius
METRE_PER_DEGREE: Final = EARTH_RADIUS_M * np.pi / 180.0


def great_circle_m(
    lat_a_deg: NDArray[np.float64] | float,
    lon_a_deg: NDArray[np.float64] | float,
    lat_b_deg: NDArray[np.float64] | float,
    lon_b_deg: NDArray[np.float64] | float,
) -> NDArray[np.float64]:
    """Great-circle distance between points on the mean sphere [m]; broadcasts (haversine formula)."""
    phi_a, phi_b = np.radians(lat_a_deg), np.radians(lat_b_deg)
    half_dphi = (phi_b - phi_a) / 2.0
    half_dlam = np.radians(np.subtract(lon_b_deg, lon_a_deg)) / 2.0
    hav = np.sin(half_dphi) ** 2 + np.cos(phi_a) * np.cos(phi_b) * np.sin(half_dlam) ** 2
    distance: NDArray[np.float64] = 2.0 * EARTH_RADIUS_M * np.arcsin(np.sqrt(np.minimum(hav, 1.0)))
    return distance
