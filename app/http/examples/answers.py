"""Examples that the OpenAPI document shows: requests on the bundled graph, and real answers to them, shortened."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

_FOLDER: Final = Path(__file__).parent


def _answer(name: str) -> dict[str, Any]:
    example: dict[str, Any] = json.loads((_FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return example


INLINE_VEHICLE: Final = {
    "name": "my compact car",
    "mass_kg": 1650,
    "road_load": {"a_lbf": 28.0, "b_lbf_per_mph": 0.05, "c_lbf_per_mph2": 0.019},
    "drive_eff": 0.9,
    "recuperation_eff": 0.6,
    "aux_power_w": 450,
    "usable_capacity_kwh": 45,
}

ROUTE_REQUESTS: Final[dict[str, Any]] = {
    "eco": {
        "summary": "Least energy",
        "value": {
            "start": {"lat": 44.4401, "lon": -36.781},
            "goal": {"lat": 44.2838, "lon": -36.2298},
            "soc": 0.8,
            "vehicle": "hyundai-kona-64",
        },
    },
    "alternatives": {
        "summary": "Eco beside fastest, coordinates as in GeoJSON, without the list of links",
        "value": {
            "start": [-36.781, 44.4401],
            "goal": [-36.2298, 44.2838],
            "soc": 0.8,
            "alternatives": ["eco", "fastest"],
            "reserve_soc": 0.1,
            "links": False,
        },
    },
    "steps": {
        "summary": "Between places named by a text, with what a driver is told along the way",
        "value": {
            "start": "Mill Street, Alsenwick",
            "goal": "Maple Street, Valaford",
            "soc": 0.8,
            "vehicle": "hyundai-kona-64",
            "steps": True,
            "links": False,
        },
    },
    "lean": {
        "summary": "A simplified line as a text, six digits, no list of links",
        "value": {
            "start": [-36.781, 44.4401],
            "goal": [-36.2298, 44.2838],
            "soc": 0.8,
            "links": False,
            "geometry_format": "polyline6",
            "overview": "simplified",
            "compact": True,
        },
    },
    "pareto": {
        "summary": "Few routes between the fastest and the thriftiest, one within 5 % of any other way",
        "value": {
            "start": [-36.781, 44.4401],
            "goal": [-36.2298, 44.2838],
            "soc": 0.8,
            "pareto": {"epsilon_frac": 0.05, "most": 6},
            "links": False,
        },
    },
    "charging": {
        "summary": "A journey beyond the charge, with the charging stops that make it fastest",
        "value": {
            "start": [-36.433, 43.872],
            "goal": [-35.19, 43.697],
            "soc": 0.3,
            "vehicle": "hyundai-kona-64",
            "charging": {
                "max_soc": 0.8,
                "min_power_kw": 50,
                "networks": {"avoided": ["Voltway"], "preferred": ["Town Works"]},
                "stays": [{"at": "goal", "minutes": 600, "power_kw": 11}],
                "departure_time": "2026-11-30T08:15:00",
            },
            "links": False,
        },
    },
    "no plan": {
        "summary": "A journey that no charging stops make possible, with what would help",
        "value": {
            "start": [-36.433, 43.872],
            "goal": [-35.19, 43.697],
            "soc": 0.11,
            "vehicle": "hyundai-kona-64",
            "charging": {"min_power_kw": 100},
            "links": False,
        },
    },
    "inline vehicle": {
        "summary": "A vehicle of one's own, with a weight on time",
        "value": {
            "start": {"lat": 44.4401, "lon": -36.781},
            "goal": {"lat": 44.2838, "lon": -36.2298},
            "soc": 0.5,
            "vehicle": INLINE_VEHICLE,
            "weights": {"energy": 1, "time": 5},
        },
    },
    "learned effects": {
        "summary": "A cold day, with effects that a diagnosis has learned; they could be named by its id as well",
        "value": {
            "start": {"lat": 44.4401, "lon": -36.781},
            "goal": {"lat": 44.2838, "lon": -36.2298},
            "soc": 0.9,
            "vehicle": "hyundai-kona-64",
            "conditions": {"ambient_c": -5},
            "effects": {
                "cabin_ua_w_per_k": 118.4,
                "parameters": {"aux_power_w": 420},
                "learned_from": {"vehicle": "bmw-i3-60ah", "trips": 28},
            },
        },
    },
}

MATRIX_REQUESTS: Final[dict[str, Any]] = {
    "all to all": {
        "summary": "From each of three places to each of them, with the least energy; one pair is beyond the charge",
        "value": {
            "sources": [
                {"lat": 44.4401, "lon": -36.781},
                {"lat": 44.2838, "lon": -36.2298},
                {"lat": 44.3536, "lon": -36.5003},
            ],
            "soc": 0.16,
            "reserve_soc": 0.05,
            "vehicle": "hyundai-kona-64",
        },
    },
    "depot": {
        "summary": "From one place to others, with a weight on time, on a cold day",
        "value": {
            "sources": [[-36.781, 44.4401]],
            "targets": [[-36.2298, 44.2838], [-36.5003, 44.3536]],
            "soc": 0.9,
            "reserve_soc": 0.1,
            "weights": {"energy": 1, "time": 5},
            "conditions": {"ambient_c": -5},
        },
    },
}

VEHICLE_BODIES: Final[dict[str, Any]] = {
    "physical": {
        "summary": "By its physics: coast-down coefficients of EPA, sources and standard deviations of some numbers",
        "value": {
            **INLINE_VEHICLE,
            "sources": {"mass_kg": "weighed", "road_load.a_lbf": "EPA test car list"},
            "sd": {"mass_kg": 20, "drive_eff": 0.02},
            "effects": {"cabin_target_c": 20},
            "charging": {
                "connectors": ["type2", "ccs2"],
                "curve_soc_percent": [0, 50, 80, 100],
                "curve_kw": [100, 100, 50, 20],
                "ac_kw": 11,
                "ac_phases": 3,
            },
        },
    },
    "consumption table": {
        "summary": "By its consumption at constant speeds",
        "value": {
            "kind": "consumption_table",
            "name": "my van",
            "consumption": {"speed_kmh": [30, 50, 90, 110, 130], "kwh_per_100km": [13, 14.5, 21, 26.5, 34]},
            "ascent_wh_per_m": 7.5,
            "descent_wh_per_m": 4.9,
            "kinetic": {"mass_kg": 2400, "acceleration_eff": 0.9, "deceleration_eff": 0.6},
            "aux_power_w": 600,
            "usable_capacity_kwh": 60,
        },
    },
    "tomtom": {
        "summary": "In the parameters of TomTom and Azure Maps",
        "value": {
            "format": "tomtom",
            "name": "example of Azure Maps",
            "source": "Azure Maps, Route - Get Route Range; the weight is assumed",
            "constantSpeedConsumptionInkWhPerHundredkm": "50,8.2:130,21.3",
            "maxChargeInkWh": 85,
            "vehicleWeight": 1900,
            "accelerationEfficiency": 0.66,
            "decelerationEfficiency": 0.91,
            "uphillEfficiency": 0.74,
            "downhillEfficiency": 0.73,
            "auxiliaryPowerInkW": 1.7,
            "chargingParameters": {
                "batteryCurve": [
                    {"stateOfChargeInkWh": 50, "maxPowerInkW": 200},
                    {"stateOfChargeInkWh": 70, "maxPowerInkW": 100},
                    {"stateOfChargeInkWh": 80, "maxPowerInkW": 40},
                ],
                "chargingConnectors": [
                    {
                        "currentType": "AC3",
                        "plugTypes": ["IEC_62196_Type_2_Outlet", "IEC_62196_Type_2_Connector_Cable_Attached"],
                        "efficiency": 0.9,
                        "baseLoadInkW": 0.2,
                        "maxPowerInkW": 11,
                    },
                    {
                        "currentType": "DC",
                        "plugTypes": ["Combo_to_IEC_62196_Type_2_Base"],
                        "efficiency": 0.9,
                        "baseLoadInkW": 0.2,
                        "maxPowerInkW": 150,
                        "voltageRange": {"minVoltageInV": 0, "maxVoltageInV": 500},
                    },
                ],
            },
        },
    },
    "here": {
        "summary": "In the parameters of HERE",
        "value": {
            "format": "here",
            "freeFlowSpeedTable": "10,0.13,30,0.136,50,0.151,70,0.176,90,0.214,110,0.264,130,0.321",
            "maxCharge": 80,
            "ascent": 9,
            "descent": 4.3,
            "auxiliaryConsumption": 1.8,
            "chargingCurve": "0,239,32,199,56,167,60,130,64,111,68,83,72,55,76,33,78,17,80,1",
            "connectorTypes": "iec62196Type2Combo,chademo",
        },
    },
    "mapbox": {
        "summary": "In the parameters of Mapbox",
        "value": {
            "format": "mapbox",
            "energy_consumption_curve": "0,300;20,160;80,140;120,180",
            "ev_max_charge": 50000,
            "ev_ascent": 9,
            "ev_descent": 4.3,
            "auxiliary_consumption": 300,
            "ev_charging_curve": "0,100000;25000,70000;37500,30000;50000,10000",
            "ev_connector_types": "ccs_combo_type1,ccs_combo_type2",
            "ev_max_ac_charging_power": 7400,
        },
    },
}

RANGE_REQUESTS: Final[dict[str, Any]] = {
    "bands": {
        "summary": "Three bands with an inline vehicle",
        "value": {"origin": [-36.781, 44.4401], "soc": 0.3, "vehicle": INLINE_VEHICLE, "reserve_soc": 0.1, "bands": 3},
    },
    "charges left": {
        "summary": "Bands by the charge left on arrival",
        "value": {"origin": {"lat": 44.4401, "lon": -36.781}, "soc": 0.3, "bands": [0.0, 0.1, 0.2]},
    },
}

SIMULATE_REQUESTS: Final[dict[str, Any]] = {
    "chain": {
        "summary": "Two links by their numbers",
        "value": {
            "chain": [
                {
                    "length_m": 400,
                    "grade": 0.02,
                    "speed_limit_kmh": 50,
                    "cross": "large",
                    "urban": True,
                    "functional_class": "tertiary",
                },
                {"length_m": 2500, "grade": -0.01, "speed_limit_kmh": 80},
            ],
            "soc": 0.5,
        },
    },
    "time steps": {
        "summary": "In time steps, on a cold day, with the speed along the way",
        "value": {
            "chain": [
                {"length_m": 700, "speed_limit_kmh": 80, "cross": "medium"},
                {"length_m": 900, "speed_limit_kmh": 50, "urban": True},
            ],
            "model": "timestep",
            "conditions": {"ambient_c": -5, "payload_kg": 80},
            "effects": {"heating_cop": 2.5},
            "profile": True,
        },
    },
    "links": {
        "summary": "Two links of a graph, the second in part",
        "value": {"graph": "highlands", "links": [{"id": 0}, {"id": 1, "from_m": 0, "to_m": 20}]},
    },
}

DIAGNOSIS_REQUESTS: Final[dict[str, Any]] = {
    "referenced": {
        "summary": "Recordings in a folder on the server, three tenths of the trips kept out of the fit",
        "value": {"recordings": ["winter"], "vehicle": "bmw-i3-60ah", "holdout_fraction": 0.3},
    },
    "on a graph": {
        "summary": "Recordings with positions, matched to the roads of a graph",
        "value": {
            "recordings": ["winter"],
            "vehicle": "hyundai-kona-64",
            "holdout_fraction": 0.2,
            "graph": "highlands",
        },
    },
    "hidden": {
        "summary": "Without the columns that tell of heating",
        "value": {"recordings": ["winter/*.csv.gz"], "vehicle": "bmw-i3-60ah", "hide": ["*Heat*"], "seed": 7},
    },
}

ROUTE_ANSWER: Final = _answer("route")
CHARGING_ANSWER: Final = _answer("route_charging")
NO_PLAN_ANSWER: Final = _answer("route_no_plan")
STEPS_ANSWER: Final = _answer("route_steps")
ROUTE_FEATURES: Final = _answer("route_geojson")
MATRIX_ANSWER: Final = _answer("matrix")
RANGE_FEATURES: Final = _answer("range")
SIMULATE_ANSWER: Final = _answer("simulate")
VEHICLE_LIST: Final = _answer("vehicles")
VEHICLE_DETAIL: Final = _answer("vehicle")
VEHICLE_STORED: Final = _answer("vehicle_stored")
GRAPH_LIST: Final = _answer("graphs")
GRAPH_DETAIL: Final = _answer("graph")
STATIONS: Final = _answer("stations")
SEARCH_ANSWER: Final = _answer("search")
SEARCH_NOMINATIM: Final = [_answer("search_nominatim")]
REVERSE_ANSWER: Final = _answer("reverse")
REVERSE_NOMINATIM: Final = _answer("reverse_nominatim")
DIAGNOSIS_ANSWER: Final = _answer("diagnosis")
DIAGNOSIS_RESIDUALS: Final = _answer("diagnosis_residuals")
DIAGNOSIS_TRIPS: Final = _answer("diagnosis_trips")
DIAGNOSIS_TRIP: Final = _answer("diagnosis_trip")
LEARNED_EFFECTS: Final = _answer("learned_effects")
_OF_ONE: Final = ("request", "refused", "warnings", "problem", "result")
DIAGNOSIS_LIST: Final = {
    "diagnoses": [{name: value for name, value in DIAGNOSIS_ANSWER.items() if name not in _OF_ONE}]
}
DIAGNOSIS_QUEUED: Final = {
    **DIAGNOSIS_ANSWER,
    "state": "queued",
    "progress": 0.0,
    "verdict": None,
    "text": None,
    "links": {name: path if name == "self" else None for name, path in DIAGNOSIS_ANSWER["links"].items()},
    "refused": [],
    "warnings": [],
    "result": None,
}
