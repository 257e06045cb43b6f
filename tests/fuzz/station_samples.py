"""Small files of charging stations in each format that is read, which mutations are made of."""

from __future__ import annotations

import json

_OCM_PLUGS = [
    {"ConnectionTypeID": 33, "StatusTypeID": 50, "LevelID": 3, "PowerKW": 350, "CurrentTypeID": 30, "Quantity": 4},
    {"ConnectionTypeID": 25, "Amps": 32, "Voltage": 400, "CurrentTypeID": 20},
    {"ConnectionType": {"ID": 27, "Title": "Tesla"}, "Level": {"ID": 2}},
    {"ConnectionTypeID": 24},
]
_OCPI_PLUGS = [
    {"standard": "IEC_62196_T2_COMBO", "power_type": "DC", "max_voltage": 920, "max_amperage": 500, "tariff_ids": [""]},
    {"standard": "IEC_62196_T2", "power_type": "AC_3_PHASE", "voltage": 230, "amperage": 32, "tariff_id": "b"},
    {"standard": "CHADEMO", "power_type": "DC", "max_electric_power": 50000},
]
_TAGS = {
    "amenity": "charging_station", "socket:type2": "2", "socket:type2:output": "22 kW", "socket:type2_combo": "yes",
    "charging_station:output": "150 kW;300 kW", "fee": "yes", "charge": "0.45 EUR/kWh", "opening_hours": "24/7",
}  # fmt: skip


def _ocm() -> object:
    return [
        {
            "ID": 100 + k,
            "UUID": "AA",
            "DataProviderID": 1 + k,
            "OperatorID": 3299,
            "OperatorInfo": {"ID": 3299, "Title": "Ionity"},
            "UsageTypeID": 5 - k,
            "UsageCost": ("€0.79/kWh", "Free", "1 EUR session fee + 0,39 €/kWh")[k],
            "StatusTypeID": (50, 150, 75)[k],
            "NumberOfPoints": 4,
            "AddressInfo": {"Title": "Rest area", "Latitude": 48.1 + k, "Longitude": 11.5, "CountryID": 87},
            "Connections": _OCM_PLUGS,
        }
        for k in range(3)
    ]


def _ocpi() -> object:
    hours = [{"weekday": day, "period_begin": "08:00", "period_end": "20:00"} for day in range(1, 6)]
    locations = [
        {
            "country_code": "DE",
            "party_id": "ABC",
            "id": f"LOC{k}",
            "publish": k < 2,
            "coordinates": {"latitude": f"48.{k}", "longitude": "11.5"},
            "operator": {"name": "Werk"},
            "evses": [
                {"uid": "1", "status": ("AVAILABLE", "OUTOFORDER", "PLANNED")[k], "connectors": _OCPI_PLUGS},
                {"uid": "2", "parking_restrictions": ["CUSTOMERS"], "connectors": _OCPI_PLUGS[:1]},
            ],
            "opening_times": {"twentyfourseven": False, "regular_hours": hours},
            "last_updated": "2026-01-01T00:00:00Z",
        }
        for k in range(3)
    ]
    return {"status_code": 1000, "timestamp": "2026-01-01T00:00:00Z", "data": locations}


def _geojson() -> object:
    ring = [[11.0, 48.0], [11.2, 48.0], [11.2, 48.4], [11.0, 48.0]]
    outline = {"type": "Polygon", "coordinates": [ring]}
    own = {"name": "Inn", "connectors": ["CCS2", "2x Type 2 22 kW"], "power_kw": 50, "price": "0.5 EUR/min"}
    return {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "id": "way/7", "geometry": outline, "properties": _TAGS},
            {"type": "Feature", "geometry": {"type": "Point", "coordinates": [11.5, 48.1]}, "properties": own},
            {"type": "node", "id": 5, "lat": 48.2, "lon": 11.3, "tags": _TAGS},
        ],
        "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}},
    }


_PLAIN = """name;lat;lon;connectors;power_kw;operator;price;opening_hours;status;capacity
Inn;48,1;11,5;2x CCS2 150 kW, Type 2 x3 (3,7 kW);50;EnBW;0,59 EUR/kWh + 1 EUR session fee;Mo-Fr 08:00-18:00;open;4
Mill;48,2;11,6;Type 2;22;;Free;24/7;;2
"Yard; A";48,3;11,7;"CHAdeMO; Schuko";"50;2,3";;2 €;closed on Mondays;out of order;
"""
_BNETZA = """Ladesäulenregister;;;
Letzte Aktualisierung vom: 01.09.2026;;;
Ladeeinrichtungs-ID;Betreiber;Status;Anzahl Ladepunkte;Nennleistung Ladeeinrichtung [kW];Breitengrad;Längengrad;\
Öffnungszeiten;Öffnungszeiten: Wochentage;Öffnungszeiten: Tageszeiten;Steckertypen1;Nennleistung Stecker1;\
Steckertypen2;Nennleistung Stecker2
1010338;Werk AG;In Betrieb;2;22;48,442398;9,659075;247;;;AC Typ 2 Steckdose;22;"AC Typ 2 Steckdose; AC Schuko";"11; 3,7"
1010339;Werk AG;In Betrieb;1;150;48,452398;9,659075;Eingeschränkt;"Montag; Dienstag";"08:00-20:00; 08:00-20:00";\
DC Fahrzeugkupplung Typ Combo 2 (CCS);150;;
1010340;Rat;In Planung;1;50;48,462398;9,659075;Keine Angabe;;;DC CHAdeMO;;;
"""
_AFDC = """Fuel Type Code,Station Name,Status Code,Access Days Time,EV Level1 EVSE Num,EV Level2 EVSE Num,\
EV DC Fast Count,EV Network,Latitude,Longitude,ID,Updated At,EV Connector Types,Country,Access Code,EV Pricing,\
EV CCS Connector Count,EV CCS Power Output (kW)
ELEC,Mill,E,24 hours daily,,2,,Non-Networked,41.5,-74.07,1,2025-02-12 00:16:32 UTC,J1772,US,public,Free,,
ELEC,Yard,T,Mon-Fri 8am-5pm; Sat 9am-1pm,1,2,4,Tesla,41.6,-74.17,2,2025-02-12 00:16:32 UTC,J1772 TESLA NEMA520,US,\
private,$1.50 per hour,,
ELEC,Inn,E,Business hours,,,2,eVgo,41.7,-74.27,3,2025-02-12 00:16:32 UTC,CHADEMO J1772COMBO,CA,,$0.25 per kWh,2,200
ELEC,Inn,E,Business hours,,,2,eVgo,41.7,-74.27,3,2025-02-12 00:16:32 UTC,CHADEMO J1772COMBO,CA,,$0.25 per kWh,1,62.5
"""


def station_samples() -> dict[str, bytes]:
    """Content of small files by name, each of which has stations, and some that are left out."""
    return {
        "stations-ocm.json": json.dumps(_ocm(), indent=0).encode(),
        "stations-ocpi.json": json.dumps(_ocpi(), indent=0).encode(),
        "stations-geo.json": json.dumps(_geojson(), indent=0).encode(),
        "stations-plain.csv": _PLAIN.encode(),
        "stations-bnetza.csv": _BNETZA.encode("cp1252"),
        "stations-afdc.csv": _AFDC.encode(),
    }
