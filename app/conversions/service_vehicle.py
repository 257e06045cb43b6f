"""Vehicles in the parameters of TomTom, HERE and Mapbox as the consumption tables that are stored of them."""

from __future__ import annotations

from app.conversions.consumption_table import table_vehicle_answer
from app.schemas.vehicles.services import HereVehicle, ServiceVehicle, TomTomChargingParameters, TomTomVehicle
from app.schemas.vehicles.vehicle import MAX_TABLE_POINTS, InlineTableVehicle
from energy.errors import VehicleError
from energy.vehicle.consumption_table import ConsumptionTableVehicle
from energy.vehicle.service_charging import TomTomCharging, TomTomConnector
from energy.vehicle.services import (
    HereParameters,
    MapboxParameters,
    TomTomParameters,
    vehicle_from_here,
    vehicle_from_mapbox,
    vehicle_from_tomtom,
)

CONSUMPTION_DIGITS = 9  # of kWh/100 km, so that 0.13 Wh/m is shown as 13


def table_from_service(sent: ServiceVehicle, vehicle_id: str) -> InlineTableVehicle:
    """The consumption table of a service's parameters, as if it had been sent itself.

    Raises VehicleError with the service's names.
    """
    vehicle = _vehicle(sent, vehicle_id)
    if vehicle.speed_mps.size > MAX_TABLE_POINTS:
        field = "freeFlowSpeedTable" if isinstance(sent, HereVehicle) else "energy_consumption_curve"
        raise VehicleError(field, f"{vehicle.speed_mps.size} points", f"at most {MAX_TABLE_POINTS}", vehicle_id)
    shown = table_vehicle_answer(vehicle).model_dump(exclude={"id"})
    consumption = shown["consumption"]
    consumption["kwh_per_100km"] = [round(value, CONSUMPTION_DIGITS) for value in consumption["kwh_per_100km"]]
    return InlineTableVehicle.model_validate(shown)


def _vehicle(sent: ServiceVehicle, vehicle_id: str) -> ConsumptionTableVehicle:
    name = vehicle_id if sent.name is None else sent.name
    if isinstance(sent, TomTomVehicle):
        tomtom = TomTomParameters(
            constant_speed_consumption_kwh_per_100km=sent.constantSpeedConsumptionInkWhPerHundredkm,
            max_charge_kwh=sent.maxChargeInkWh,
            vehicle_weight_kg=sent.vehicleWeight,
            acceleration_eff=sent.accelerationEfficiency,
            deceleration_eff=sent.decelerationEfficiency,
            uphill_eff=sent.uphillEfficiency,
            downhill_eff=sent.downhillEfficiency,
            auxiliary_power_kw=sent.auxiliaryPowerInkW,
            charging=None if sent.chargingParameters is None else _tomtom_charging(sent.chargingParameters),
        )
        return vehicle_from_tomtom(vehicle_id, name, tomtom, sent.source)
    if isinstance(sent, HereVehicle):
        here = HereParameters(
            free_flow_speed_table_wh_per_m=sent.freeFlowSpeedTable,
            max_charge_kwh=sent.maxCharge,
            ascent_wh_per_m=sent.ascent,
            descent_wh_per_m=sent.descent,
            auxiliary_consumption_wh_per_s=sent.auxiliaryConsumption,
            charging_curve_kwh_kw=sent.chargingCurve,
            connector_types=sent.connectorTypes,
        )
        return vehicle_from_here(vehicle_id, name, here, sent.source)
    mapbox = MapboxParameters(
        energy_consumption_curve_wh_per_km=sent.energy_consumption_curve,
        ev_max_charge_wh=sent.ev_max_charge,
        ev_ascent_wh_per_m=sent.ev_ascent,
        ev_descent_wh_per_m=sent.ev_descent,
        auxiliary_consumption_w=sent.auxiliary_consumption,
        ev_charging_curve_wh_w=sent.ev_charging_curve,
        ev_connector_types=sent.ev_connector_types,
        ev_max_ac_charging_power_w=sent.ev_max_ac_charging_power,
    )
    return vehicle_from_mapbox(vehicle_id, name, mapbox, sent.source)


def _tomtom_charging(sent: TomTomChargingParameters) -> TomTomCharging:
    return TomTomCharging(
        battery_curve_kwh_kw=tuple((point.stateOfChargeInkWh, point.maxPowerInkW) for point in sent.batteryCurve),
        charging_connectors=tuple(
            TomTomConnector(
                current_type=connector.currentType,
                plug_types=tuple(connector.plugTypes),
                max_power_kw=connector.maxPowerInkW,
                efficiency=connector.efficiency,
                base_load_kw=connector.baseLoadInkW,
            )
            for connector in sent.chargingConnectors
        ),
    )
