"""What a request says of charging stops, into routing.charging."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.conversions.charging.names import question
from app.conversions.charging.plans import departure_of
from energy.charging.power import at_battery_temperature, fits
from energy.conditions import minute_of_week
from energy.errors import VehicleError
from energy.units import KMH_PER_MPS, SECOND_PER_MINUTE
from routing.charging.plan import ChargingQuery, FixedStay
from routing.errors import QueryError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from app.conversions.charging.names import StationNames
    from app.schemas.charging import ChargingRequest, NetworksSent
    from app.schemas.route import RouteRequest
    from energy.charging.charging import Charging, Connector
    from energy.vehicle.files import AnyVehicle

W_PER_KW: Final = 1000.0
POWER_ROUNDING: Final = 1e-9


def charging_query(understood: RouteRequest, charging: Charging, names: StationNames, graph_name: str) -> ChargingQuery:
    """What the planner is asked; charging: of the vehicle, names: of the graph's stations.

    Raises QueryError, naming the field of the request, where it names what the graph's stations or the vehicle lack.
    """
    sent = understood.charging
    if sent is None:
        raise QueryError("charging", None, "an object")
    if not names.ids:
        allowed = "a graph with charging stations, which `joulepath stations import` gives it"
        raise QueryError(
            "graph", graph_name, allowed, message=f"graph {graph_name!r} has no stations: choose {allowed}"
        )
    _check_stations(sent, names, graph_name)
    plugs = _usable_plugs(sent, charging, names, graph_name)
    _check_power(sent, plugs, names, graph_name)
    factors, excluded = _networks(sent.networks, names, graph_name)
    departure = departure_of(understood)
    return ChargingQuery(
        arrive_soc_frac=max(sent.arrive_soc, understood.reserve_soc),
        goal_soc_frac=sent.goal_soc,
        max_soc_frac=sent.max_soc,
        overhead_s=sent.overhead_s,
        connectors=tuple(sent.connectors or ()),
        min_power_w=sent.min_power_kw * W_PER_KW,
        network_factors=factors,
        excluded_networks=excluded,
        stations=tuple(sent.stations or ()),
        excluded_stations=frozenset(sent.excluded_stations),
        via_stations=tuple((chosen.via, chosen.station) for chosen in sent.via_stations),
        stays=tuple(
            FixedStay(
                via_idx=None if isinstance(stay.at, str) else stay.at,
                seconds=stay.minutes * SECOND_PER_MINUTE,
                power_w=stay.power_kw * W_PER_KW,
            )
            for stay in sent.stays
        ),
        departure_min=None if departure is None else float(minute_of_week(departure)),
        objective=sent.objective,
        confidence=sent.confidence,
        speed_caps_mps=tuple(cap / KMH_PER_MPS for cap in sent.speed_caps_kmh),
        most_stops=sent.most_stops,
        alternatives=sent.alternatives,
        time_value_per_h=sent.time_value_per_h,
    )


def charging_of(vehicle: AnyVehicle, understood: RouteRequest) -> Charging:
    """How the vehicle of a request charges; raises QueryError or VehicleError where it does not say."""
    if vehicle.charging is not None:
        return vehicle.charging
    if not isinstance(understood.vehicle, str):
        raise VehicleError("charging", None, "plugs and power of charging, without which no stops can be planned")
    known = "a vehicle with `charging`, as GET /vehicles lists"
    message = f"vehicle {understood.vehicle!r} does not say how it charges: choose {known}"
    raise QueryError("vehicle", understood.vehicle, known, message=message)


def charging_warnings(charging: Charging, understood: RouteRequest) -> tuple[str, ...]:
    """What is to be said of how a vehicle charges under the conditions of a request."""
    ambient_c = None if understood.conditions is None else understood.conditions.ambient_c
    if ambient_c is None or charging.dc is None:
        return ()
    cold = at_battery_temperature(charging, ambient_c).dc
    share = 1.0 if cold is None else float(cold.power_w.max() / charging.dc.power_w.max())
    if share >= 1.0:
        return ()
    return (f"the battery counts as cold as the air, {ambient_c:g} °C: it takes {share:.0%} of its power",)


def _check_stations(sent: ChargingRequest, names: StationNames, graph_name: str) -> None:
    named = [(f"stations[{k}]", station_id) for k, station_id in enumerate(sent.stations or ())]
    named += [(f"excluded_stations[{k}]", station_id) for k, station_id in enumerate(sent.excluded_stations)]
    named += [(f"via_stations[{k}].station", chosen.station) for k, chosen in enumerate(sent.via_stations)]
    for field, station_id in named:
        if station_id not in names.ids:
            allowed = f"ids of stations of graph {graph_name!r}{question(names.similar_ids(station_id))}"
            raise QueryError(f"charging.{field}", station_id, allowed)


def _usable_plugs(sent: ChargingRequest, charging: Charging, names: StationNames, graph_name: str) -> list[Connector]:
    """Plugs of stations that the vehicle may use; none where it fits none and none is asked for."""
    fitting = [plug for plug in names.most_w if fits(charging, plug)]
    if sent.connectors is None:
        return fitting
    for k, plug in enumerate(sent.connectors):
        if not fits(charging, plug):
            allowed = f"plugs that fit the vehicle: {_listed(charging.connectors)}"
            raise QueryError(f"charging.connectors[{k}]", plug.value, allowed)
    usable = [plug for plug in fitting if plug in sent.connectors]
    if not usable:
        has = _listed(fitting) or f"none that fits the vehicle, but {_listed(names.most_w)}"
        allowed = f"plugs that stations of graph {graph_name!r} have: {has}"
        raise QueryError("charging.connectors", [plug.value for plug in sent.connectors], allowed)
    return usable


def _check_power(sent: ChargingRequest, plugs: list[Connector], names: StationNames, graph_name: str) -> None:
    if sent.min_power_kw <= 0.0 or not plugs:
        return
    most_kw = max(names.most_w[plug] for plug in plugs) / W_PER_KW
    if sent.min_power_kw > most_kw * (1.0 + POWER_ROUNDING):
        whose = f"the most of stations of graph {graph_name!r} with {_listed(plugs)}"
        raise QueryError("charging.min_power_kw", sent.min_power_kw, f"at most {most_kw:g}, {whose}")


def _networks(
    sent: NetworksSent | None, names: StationNames, graph_name: str
) -> tuple[dict[str, float], frozenset[str]]:
    """Factors by the names that stations have, and names of those that are excluded."""
    if sent is None:
        return {}, frozenset()
    factors: dict[str, float] = {}
    excluded: set[str] = set()
    for kind, factor in (("preferred", sent.preferred_factor), ("avoided", sent.avoided_factor), ("excluded", None)):
        for k, name in enumerate(getattr(sent, kind)):
            known = names.networks.get(name.casefold())
            if known is None:
                meant = question(names.similar_networks(name))
                allowed = f"a network or an operator of stations of graph {graph_name!r}{meant}"
                raise QueryError(f"charging.networks.{kind}[{k}]", name, allowed)
            if factor is None:
                excluded |= known
            else:
                factors |= dict.fromkeys(known, factor)
    return factors, frozenset(excluded)


def _listed(plugs: Iterable[Connector]) -> str:
    return ", ".join(sorted(plug.value for plug in plugs))
