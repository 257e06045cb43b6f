"""What a vehicle takes from which plug: power into its battery by charge."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from energy.errors import VehicleError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

MOST_POWER_W = 4e6  # megawatt charging of lorries


class Connector(StrEnum):
    """Kinds of plugs, by the names that OCPI, OpenStreetMap and vehicle databases can be told to."""

    TYPE1 = "type1"  # SAE J1772, AC
    TYPE2 = "type2"  # IEC 62196-2, AC
    TYPE3 = "type3"  # Scame, AC
    DOMESTIC = "domestic"  # household sockets of any country
    CEE = "cee"  # industrial sockets of IEC 60309
    GBT_AC = "gbt_ac"
    CCS1 = "ccs1"  # Combo with type 1, DC
    CCS2 = "ccs2"  # Combo with type 2, DC
    CHADEMO = "chademo"
    NACS = "nacs"  # SAE J3400, as Tesla in America: AC and DC
    TESLA_EU = "tesla_eu"  # type 2 that carries DC to cars of the make
    GBT_DC = "gbt_dc"
    MCS = "mcs"


DC_CONNECTORS = frozenset(
    {Connector.CCS1, Connector.CCS2, Connector.CHADEMO, Connector.GBT_DC, Connector.MCS, Connector.TESLA_EU}
)


@dataclass(frozen=True, slots=True)
class PowerCurve:
    """Power into the battery by its charge, linear between points.

    soc_frac: float64 (n,), n ≥ 2, rising from 0 to 1. power_w: float64 (n,) [W], each > 0.
    Raises VehicleError.
    """

    soc_frac: NDArray[np.float64]
    power_w: NDArray[np.float64]

    def __post_init__(self) -> None:
        soc, power = self.soc_frac, self.power_w
        if soc.ndim != 1 or soc.size < 2 or power.shape != soc.shape:
            raise VehicleError("charging.curve", f"{soc.size} charges, {power.size} powers", "as many, at least two")
        if soc[0] != 0.0 or soc[-1] != 1.0 or not bool(np.all(np.diff(soc) > 0.0)):
            raise VehicleError("charging.curve.soc", soc.tolist(), "rising from 0 to 1")
        if not bool(np.all((power > 0.0) & (power <= MOST_POWER_W))):
            raise VehicleError("charging.curve.power", power.tolist(), f"each (0, {MOST_POWER_W:g}] W")


@dataclass(frozen=True, slots=True)
class Charging:
    """How a vehicle charges.

    connectors: plugs that fit it. dc: power that the battery takes by direct current, None where it takes none.
    ac_power_w: most that its charger takes from the wall [W], 0 where it has none; ac_phases: 1, 2 or 3, which it can
    use. ac_eff, dc_eff: battery from wall [-], (0, 1]; the curve is at the battery already.
    cold_curve: factor on the curve by the battery's temperature [°C], pairs rising in temperature; empty: none.
    sources: where each number is from, by field name.
    """

    connectors: tuple[Connector, ...]
    dc: PowerCurve | None = None
    ac_power_w: float = 0.0
    ac_phases: int = 1
    ac_eff: float = 0.9
    dc_eff: float = 0.95
    cold_curve: tuple[tuple[float, float], ...] = ()
    sources: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
