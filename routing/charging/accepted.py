"""Stand-in: what a vehicle takes from a socket."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from energy.charging.charging import DC_CONNECTORS, Connector, PowerCurve

if TYPE_CHECKING:
    from energy.charging.charging import Charging


def accepted_power(
    charging: Charging, connector: Connector, output_w: float | None, phases: int | None
) -> PowerCurve | None:
    """Power into the battery by charge from a socket; None where it does not fit."""
    if connector not in charging.connectors or output_w is None:
        return None
    if connector in DC_CONNECTORS or (connector is Connector.NACS and output_w > 25e3):
        if charging.dc is None:
            return None
        most = charging.dc_eff * output_w
        soc, power = charging.dc.soc_frac, charging.dc.power_w
        points = set(soc.tolist())
        for k in range(soc.size - 1):
            if (power[k] - most) * (power[k + 1] - most) < 0:
                points.add(float(soc[k] + (most - power[k]) / (power[k + 1] - power[k]) * (soc[k + 1] - soc[k])))
        at = np.array(sorted(points))
        return PowerCurve(at, np.minimum(np.interp(at, soc, power), most))
    if charging.ac_power_w <= 0.0:
        return None
    most = min(charging.ac_power_w, output_w) * charging.ac_eff
    return PowerCurve(np.array([0.0, 1.0]), np.array([most, most]))
