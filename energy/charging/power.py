"""What a vehicle takes from a socket: power into its battery by charge, and how much of what is drawn arrives."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from energy.charging.charging import DC_CONNECTORS, LEAST_POWER_W, Charging, Connector, PowerCurve

if TYPE_CHECKING:
    from numpy.typing import NDArray

# a socket that carries both is one for direct current above this output: 80 A at 240 V is the most of SAE J3400's AC
MOST_NACS_AC_W: Final = 19_200.0
# where the phases of a socket are not known: 32 A of one phase at 230 V are 7.36 kW, so more is of three
MOST_ONE_PHASE_W: Final = 7_500.0
ONE_PHASE: Final = frozenset({Connector.TYPE1, Connector.NACS, Connector.DOMESTIC})
_INLETS: Final = {
    Connector.TYPE1: (Connector.TYPE1, Connector.CCS1, Connector.NACS),
    Connector.TYPE2: (Connector.TYPE2, Connector.CCS2, Connector.TESLA_EU),
}


def fits(charging: Charging, connector: Connector) -> bool:
    """Whether the vehicle can be plugged into a socket of this kind.

    It can where the vehicle names the plug; and beyond that where its inlet holds that plug anyway (a CCS inlet its
    alternating current's half, a European Tesla's inlet type 2), or the adapter comes with every such car: type 1 to
    NACS, and the cable to household sockets of every car with a charger on board. Adapters that are bought are not
    assumed: a vehicle that has one names the plug.
    """
    if connector is Connector.DOMESTIC and charging.ac_power_w > 0.0:
        return True
    return not frozenset(charging.connectors).isdisjoint(_INLETS.get(connector, (connector,)))


def is_direct(connector: Connector, output_w: float) -> bool:
    """Whether a socket carries direct current; NACS does above the most of its alternating current."""
    return connector in DC_CONNECTORS or (connector is Connector.NACS and output_w > MOST_NACS_AC_W)


def accepted_power(
    charging: Charging, connector: Connector, output_w: float, phases: int | None = None
) -> PowerCurve | None:
    """Power into the battery by charge at a socket; None where the plug does not fit or nothing would flow.

    output_w: most that the socket gives [W], > 0. phases: of its alternating current, None where they are not known:
    then type 1, NACS and household sockets have one, others one up to 7.5 kW and three above.

    Direct current: the lesser of the vehicle's curve and dc_eff·output_w, with a point where they cross. Alternating
    current: ac_eff times what the charger on board takes, `ac_drawn_w`, whatever the charge.
    """
    if not (output_w > 0.0 and fits(charging, connector)):
        return None
    if is_direct(connector, output_w):
        most_w = charging.dc_eff * output_w
        return None if charging.dc is None or most_w < LEAST_POWER_W else limited(charging.dc, most_w)
    power_w = charging.ac_eff * ac_drawn_w(charging, connector, output_w, phases)
    return None if power_w < LEAST_POWER_W else _frozen(np.array([0.0, 1.0]), np.full(2, power_w))


def ac_drawn_w(charging: Charging, connector: Connector, output_w: float, phases: int | None = None) -> float:
    """Power that the charger on board draws from a socket for alternating current [W].

    The socket gives output_w / phases of each of its phases. Of each that both have, the vehicle takes at most its
    share ac_power_w / ac_phases; of one alone, as much as ac_one_phase_w, where it has that: an 11 kW charger takes
    16 A of each of three phases, and of a single one 3.7 kW, or up to 7.4 kW where it can put two of its three parts
    on it (32 A).
    """
    given = 1 if connector in ONE_PHASE else phases
    if given is None:
        given = 1 if output_w <= MOST_ONE_PHASE_W else 3
    used = min(given, charging.ac_phases)
    share_w = charging.ac_power_w / charging.ac_phases
    if used == 1 and charging.ac_one_phase_w is not None:
        share_w = charging.ac_one_phase_w
    return min(used * min(share_w, output_w / given), charging.ac_power_w)


def wall_eff(charging: Charging, connector: Connector, output_w: float) -> float:
    """Energy into the battery over energy drawn from the socket [-]."""
    return charging.dc_eff if is_direct(connector, output_w) else charging.ac_eff


def drawn_j(charging: Charging, connector: Connector, output_w: float, charged_j: float) -> float:
    """Energy drawn from the socket for energy into the battery [J]."""
    return charged_j / wall_eff(charging, connector, output_w)


def limited(curve: PowerCurve, most_w: float) -> PowerCurve:
    """The curve where it is below a power ≥ 1 mW [W], and that power elsewhere, with a point at each crossing."""
    soc: list[float] = []
    power: list[float] = []
    for k, (charge, given) in enumerate(zip(curve.soc_frac.tolist(), curve.power_w.tolist(), strict=True)):
        if k > 0:
            before, last = float(curve.soc_frac[k - 1]), float(curve.power_w[k - 1])
            if (last - most_w) * (given - most_w) < 0.0:
                crossing = before + (most_w - last) / (given - last) * (charge - before)
                if before < crossing < charge:
                    soc.append(crossing)
                    power.append(most_w)
        soc.append(charge)
        power.append(min(given, most_w))
    inner = [k for k in range(1, len(soc) - 1) if not power[k - 1] == power[k] == power[k + 1]]
    kept = [0, *inner, len(soc) - 1]
    return _frozen(np.array([soc[k] for k in kept]), np.array([power[k] for k in kept]))


def at_battery_temperature(charging: Charging, celsius: float) -> Charging:
    """The vehicle with the curve that its battery has at a temperature [°C]; alternating current stays as it is.

    The factor of cold_curve is linear between its temperatures and constant beyond them.
    """
    if charging.dc is None or not charging.cold_curve:
        return charging
    temperatures, factors = zip(*charging.cold_curve, strict=True)
    factor = float(np.interp(celsius, temperatures, factors))
    return replace(charging, dc=_frozen(charging.dc.soc_frac.copy(), charging.dc.power_w * factor))


def _frozen(soc_frac: NDArray[np.float64], power_w: NDArray[np.float64]) -> PowerCurve:
    soc_frac.flags.writeable = False
    power_w.flags.writeable = False
    return PowerCurve(soc_frac, power_w)
