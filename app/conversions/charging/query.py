"""What a request says of charging stops, into routing.charging."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from app.conversions.charging.plans import departure_of
from energy.charging.power import at_battery_temperature
from energy.conditions import exact_minute_of_week
from energy.errors import VehicleError
from energy.units import KMH_PER_MPS, SECOND_PER_MINUTE
from routing.charging.plan import ChargingQuery, FixedStay
from routing.errors import QueryError
from routing.stations.names import network_rules

if TYPE_CHECKING:
    from app.schemas.charging import NetworksSent
    from app.schemas.route import RouteRequest
    from energy.charging.charging import Charging
    from energy.vehicle.files import AnyVehicle
    from routing.stations.names import StationNames

W_PER_KW: Final = 1000.0


def charging_query(understood: RouteRequest, charging: Charging, names: StationNames) -> ChargingQuery:
    """What the planner is asked; charging: of the vehicle, names: of the graph's stations.

    Raises QueryError, naming the field of the request, where it names what the graph's stations or the vehicle lack.
    """
    sent = understood.charging
    if sent is None:
        raise QueryError("charging", None, "an object")
    for k, station_id in enumerate(sent.stations or ()):
        names.check_id(f"charging.stations[{k}]", station_id)
    for k, station_id in enumerate(sent.excluded_stations):
        names.check_id(f"charging.excluded_stations[{k}]", station_id)
    for k, chosen in enumerate(sent.via_stations):
        names.check_id(f"charging.via_stations[{k}].station", chosen.station)
    plugs = names.usable_plugs("charging.connectors", charging, sent.connectors or ())
    names.check_power("charging.min_power_kw", sent.min_power_kw, plugs)
    factors, excluded = network_rules(names, "charging.networks.", _weighted(sent.networks))
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
        departure_min=None if departure is None else exact_minute_of_week(departure),
        departure=departure,
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
        allowed = "plugs and power of charging, without which no stops can be planned"
        raise VehicleError("charging", None, allowed, vehicle.id)
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


def _weighted(sent: NetworksSent | None) -> tuple[tuple[str, list[str], float | None], ...]:
    if sent is None:
        return ()
    return (
        ("preferred", sent.preferred, sent.preferred_factor),
        ("avoided", sent.avoided, sent.avoided_factor),
        ("excluded", sent.excluded, None),
    )
