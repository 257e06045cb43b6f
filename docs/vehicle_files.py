"""Writes the files of data/vehicles that are joined from docs/data/vehicles.csv; run `python docs/vehicle_files.py`.

A row of the table is one test vehicle of EPA's test car list 2022 with what other data sets say of its battery and
auxiliaries. What no data set gives is the same in every file and stands here, with its reason. The other files of
data/vehicles are written by hand.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Final

from energy.units import KM_PER_MILE

DOCS: Final = Path(__file__).resolve().parent
JOINED: Final = DOCS / "data" / "vehicles.csv"
VEHICLES: Final = DOCS.parent / "data" / "vehicles"

KWH_PER_GALLON: Final = 33.7  # EPA's petrol equivalent

EPA: Final = (
    "EPA test car list 2022 (22-tstcar.csv, public domain, "
    "https://www.epa.gov/compliance-and-fuel-economy-data/data-cars-used-testing-fuel-economy)"
)
SOURCE: Final = "BEV Energy Consumption Estimation for Route Planning, section III.A"
KONA: Final = f"the value that {SOURCE}, uses for the Kona Electric; nothing is published for this car"
FASTSIM: Final = "fastsim 2.1.5 vehicle database (Apache-2.0, resources/FASTSim_py_veh_db.csv)"
EMOBPY: Final = "emobpy 0.6.2 vehicle database (MIT licence, data/evspecs.json)"

MASS_SD_LB: Final = 165
ROAD_LOAD_A_SD: Final = 0.05
ROAD_LOAD_C_SD: Final = 0.04
USUAL_AUX_W: Final = 250
AUX_SD_W: Final = 150

MASS_SD_REASON: Final = "; sd assumed: 75 kg, one person more or less; the list itself rounds to steps of 125 to 500 lb"
ROAD_LOAD_SD_REASON: Final = "spread between cars of one model, their tyres and repeated coast-downs"
CAPACITY_SD_REASON: Final = "; sd assumed: ageing, temperature, and model years that data sets don't tell apart"
AUX_SD_REASON: Final = "; sd assumed: 150 W, what lights, pumps and fans take varies widely; climate is not in it"
DRIVE_SD_REASON: Final = "; sd assumed: 0.03, about a third of the losses between battery and wheel"
RECUPERATION_REASON: Final = (
    "derived: from emobpy 0.6.2 (MIT licence): transmission 0.95, generator 0.91 at load fraction 0.2 "
    "(data/motor_efficiency.csv), battery charging 0.9 and recuperated share exp(-0.0411/1) = 0.96 when braking with "
    "1 m/s², together 0.75; sd assumed: 0.08, so that the 0.63 of real drives with a Kona Electric "
    f"({SOURCE}) lies within 1.5 sd"
)
SPEEDS_KMH: Final = "[0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120, 130]"
ACCELERATION: Final = "[1.30, 1.25, 1.15, 1.05, 0.95, 0.85, 0.78, 0.70, 0.63, 0.56, 0.50, 0.45, 0.40]"
DECELERATION: Final = "[-1.20, -1.20, -1.15, -1.15, -1.10, -1.05, -1.00, -1.00, -0.95, -0.90, -0.90, -0.85, -0.80]"
TABLE_REASON: Final = "the source sets its table from its own drives and does not print it"


def joined_rows() -> list[dict[str, str]]:
    """Rows of docs/data/vehicles.csv."""
    with JOINED.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def kwh_per_100km(listed: str, unit: str) -> float:
    """Consumption [kWh/100 km] from the list's column RND_ADJ_FE: figures joined by +, whose mean is taken.

    unit: `mpge`, miles a gallon of petrol equivalent; or `kwh_per_100mi`, which the list heads MPG too.
    """
    figures = [float(figure) for figure in listed.split("+")]
    mean = sum(figures) / len(figures)
    return (KWH_PER_GALLON / mean * 100.0 if unit == "mpge" else mean) / KM_PER_MILE


def vehicle_file(row: dict[str, str]) -> str:
    """Text of the vehicle file of one row."""
    make, model = row["epa_make"], row["epa_model"].replace('"', " inch").replace("inch Wheels", "inch wheels")
    listed = model if make in ("2022", model) else f"{make} {model}"
    test = f"{EPA}, {listed}, test vehicle {row['test_vehicle_id']}, configuration {row['configurations']}"
    a, c = float(row["target_coef_a_lbf"]), float(row["target_coef_c_lbf_per_mph2"])
    comment = f"# {row['name']}{': ' + row['note'] if row['note'] else ''}. Written by docs/vehicle_files.py.\n"
    parts = [
        f'{comment}id = "{row["id"]}"\nname = "{row["name"]}"\npowertrain = "bev"\n',
        _section(
            "mass",
            f"value_lb = {row['equivalent_test_weight_lb']}\nsd_lb = {MASS_SD_LB}",
            f"{test}, equivalent test weight, which includes driver and load{MASS_SD_REASON}",
        ),
        _section("rotating_mass", "value_coef = 1.1", f"assumed: {KONA}"),
        _section(
            "road_load_a",
            f"value_lbf = {row['target_coef_a_lbf']}\nsd_lbf = {ROAD_LOAD_A_SD * a:.2f}",
            f"{test}, target coefficient A; sd assumed: 5 %, {ROAD_LOAD_SD_REASON}",
        ),
        _section(
            "road_load_b",
            f"value_lbf_per_mph = {row['target_coef_b_lbf_per_mph']}",
            f"{test}, target coefficient B; no sd of its own, since A, B and C are fitted together",
        ),
        _section(
            "road_load_c",
            f"value_lbf_per_mph2 = {row['target_coef_c_lbf_per_mph2']}\nsd_lbf_per_mph2 = {ROAD_LOAD_C_SD * c:.6f}",
            f"{test}, target coefficient C; sd assumed: 4 %, {ROAD_LOAD_SD_REASON}",
        ),
        _section("drive_efficiency", "value_eff = 0.92\nsd_eff = 0.03", f"assumed: {KONA}{DRIVE_SD_REASON}"),
        _section("recuperation_efficiency", "value_eff = 0.75\nsd_eff = 0.08", RECUPERATION_REASON),
        _aux_power(row),
        _section("aux_efficiency_moving", "value_eff = 0.9", f"assumed: {KONA}"),
        _section("aux_efficiency_idle", "value_eff = 0.9", f"assumed: {KONA}"),
        _section(
            "usable_capacity",
            f"value_kwh = {row['capacity_kwh']}\nsd_kwh = {row['capacity_sd_kwh']}",
            f"{row['capacity_source']}{CAPACITY_SD_REASON}",
        ),
        _section("accel_speed", f"value_kmh = {SPEEDS_KMH}", f"{SOURCE}: 13 intervals from 0 to 130 km/h"),
        _section(
            "acceleration",
            f"value_mps2 = {ACCELERATION}",
            f"assumed: ordinary driving, falling with speed; {TABLE_REASON}",
        ),
        _section(
            "deceleration",
            f"value_mps2 = {DECELERATION}",
            f"assumed: ordinary driving, gentler at high speed; {TABLE_REASON}",
        ),
    ]
    if row["voltage_v"]:
        source = f"{EMOBPY}, {row['voltage_entry']}: voltage"
        parts.append(_section("battery_voltage", f"value_v = {row['voltage_v']}", source))
    parts.append(_published(row))
    return "\n".join(parts)


def _section(name: str, values: str, source: str) -> str:
    return f'[{name}]\n{values}\nsource = "{source}"\n'


def _aux_power(row: dict[str, str]) -> str:
    if row["aux_kw"]:
        watts = round(1000.0 * float(row["aux_kw"]))
        reason = f": {row['aux_reason']}" if row["aux_reason"] else ""
        source = f"{FASTSIM}, '{row['aux_entry']}', aux_kw {row['aux_kw']}{reason}"
    else:
        watts = USUAL_AUX_W
        source = f"assumed: aux_kw 0.25 of most electric cars in {FASTSIM}, which has no entry near this car"
    return _section("aux_power", f"value_w = {watts}\nsd_w = {AUX_SD_W}", source + AUX_SD_REASON)


def _published(row: dict[str, str]) -> str:
    unit = row["listed_unit"]
    printed = "MPGe" if unit == "mpge" else "kWh a 100 miles, though the list says MPG"
    values, quotes = [], []
    for cycle, key in (("udds", "epa_udds_kwh_per_100km"), ("hwfet", "epa_hwfet_kwh_per_100km")):
        listed, tests = row[f"{cycle}_listed"], row[f"{cycle}_tests"]
        if listed:
            values.append(f"{key} = {kwh_per_100km(listed, unit):.2f}")
            quotes.append(f"{cycle.upper()} {listed.replace('+', ' and ')} (test {tests.replace('+', ' and ')})")
    source = f"{EPA}, RND_ADJ_FE in {printed}: {'; '.join(quotes)}; from the wall, unadjusted"
    return _section("published", "\n".join(values), source)


if __name__ == "__main__":
    for joined in joined_rows():
        (VEHICLES / f"{joined['id']}.toml").write_text(vehicle_file(joined), encoding="utf-8")
