"""What a vehicle takes from which plug: power into its battery by charge."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from energy.errors import VehicleError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

MOST_POWER_W = 4e6  # megawatt charging of lorries
LEAST_POWER_W = 1e-3  # so that times stay finite; figures of vehicles have at least 1 W
MOST_AC_POWER_W = 100_000.0  # 43 kW is the most of cars, lorries have more
PHASES = (1, 2, 3)
LEAST_EFF = 0.01
LEAST_COLD_FACTOR = 0.01
BATTERY_CELSIUS = (-60.0, 80.0)
_ROUNDING = 1e-9


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
# inlets that take direct current, and those that take alternating current; a combo inlet holds its AC plug
DC_INLETS = DC_CONNECTORS | {Connector.NACS}
AC_INLETS = frozenset(Connector) - {Connector.CHADEMO, Connector.GBT_DC, Connector.MCS}


@dataclass(frozen=True, slots=True)
class PowerCurve:
    """Power into the battery by its charge, linear between points.

    soc_frac: float64 (n,), n ≥ 2, rising from 0 to 1. power_w: float64 (n,) [W], each at least 1 mW.
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
        if not bool(np.all((power >= LEAST_POWER_W) & (power <= MOST_POWER_W))):
            raise VehicleError("charging.curve.power", power.tolist(), f"each {LEAST_POWER_W:g}..{MOST_POWER_W:g} W")


@dataclass(frozen=True, slots=True)
class Charging:
    """How a vehicle charges.

    connectors: plugs that fit it. dc: power that the battery takes by direct current, None where it takes none.
    ac_power_w: most that its charger takes from the wall [W], 0 where it has none; ac_phases: 1, 2 or 3, which it can
    use. ac_one_phase_w: most that it takes from one phase [W]; None: its share, ac_power_w / ac_phases.
    ac_eff, dc_eff: battery from wall [-], 0.01..1; the curve is at the battery already.
    cold_curve: factor on the curve by the battery's temperature [°C], pairs rising in temperature; empty: none.
    sources: where each number is from, by field name.

    Raises VehicleError when a number is out of range, where no plug is named, and where power and plugs don't belong
    together: a curve without a plug for direct current, a plug that only carries direct current without a curve.
    """

    connectors: tuple[Connector, ...]
    dc: PowerCurve | None = None
    ac_power_w: float = 0.0
    ac_phases: int = 1
    ac_eff: float = 0.9
    dc_eff: float = 0.95
    cold_curve: tuple[tuple[float, float], ...] = ()
    sources: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    ac_one_phase_w: float | None = None

    def __post_init__(self) -> None:
        self._check_plugs()
        if not 0.0 <= self.ac_power_w <= MOST_AC_POWER_W:
            raise VehicleError("charging.ac_power_w", self.ac_power_w, f"0..{MOST_AC_POWER_W:g} W")
        if self.ac_phases not in PHASES:
            raise VehicleError("charging.ac_phases", self.ac_phases, "1, 2 or 3")
        most_w = self.ac_power_w
        least_w = most_w / self.ac_phases * (1.0 - _ROUNDING)
        if self.ac_one_phase_w is not None and not least_w <= self.ac_one_phase_w <= most_w:
            allowed = f"{most_w / self.ac_phases:g}..{most_w:g} W, from ac_power_w / ac_phases to ac_power_w"
            raise VehicleError("charging.ac_one_phase_w", self.ac_one_phase_w, allowed)
        for name in ("ac_eff", "dc_eff"):
            value = float(getattr(self, name))
            if not LEAST_EFF <= value <= 1.0:
                raise VehicleError(f"charging.{name}", value, f"{LEAST_EFF:g}..1")
        self._check_cold()

    def _check_plugs(self) -> None:
        plugs = self.connectors
        if not plugs or len(set(plugs)) != len(plugs):
            raise VehicleError("charging.connectors", ", ".join(plugs) or "none", "at least one, each once")
        if self.dc is not None and DC_INLETS.isdisjoint(plugs):
            allowed = f"with a curve one of {', '.join(sorted(DC_INLETS))}"
            raise VehicleError("charging.connectors", ", ".join(plugs), allowed)
        if self.ac_power_w > 0.0 and AC_INLETS.isdisjoint(plugs):
            allowed = f"with a charger for alternating current one of {', '.join(sorted(AC_INLETS))}"
            raise VehicleError("charging.connectors", ", ".join(plugs), allowed)
        if self.dc is None and not DC_CONNECTORS.isdisjoint(plugs):
            named = ", ".join(sorted(DC_CONNECTORS.intersection(plugs)))
            raise VehicleError("charging.curve", "missing", f"a curve with the connectors {named}")
        if self.dc is None and self.ac_power_w == 0.0:
            raise VehicleError("charging.ac_power_w", self.ac_power_w, "above 0 without a curve")

    def _check_cold(self) -> None:
        low, high = BATTERY_CELSIUS
        temperatures = [celsius for celsius, _ in self.cold_curve]
        if not all(low <= celsius <= high for celsius in temperatures) or any(
            later <= earlier for earlier, later in pairwise(temperatures)
        ):
            raise VehicleError("charging.cold_curve.temperature", temperatures, f"rising within {low:g}..{high:g} °C")
        factors = [factor for _, factor in self.cold_curve]
        if not all(LEAST_COLD_FACTOR <= factor <= 1.0 for factor in factors):
            raise VehicleError("charging.cold_curve.factor", factors, f"each {LEAST_COLD_FACTOR:g}..1")
