"""Writes the files of data/vehicles from the tables of docs/data; run `python docs/vehicle_files.py`.

A row of vehicles.csv is one test vehicle of EPA's test car list 2022 with what other data sets say of its battery and
auxiliaries. A row of more_vehicles.csv is a car that is not on that list: its road load is a sister's or an estimate
(docs/vehicle_estimates.py). charging.csv says how each charges, heat_pumps.csv which have a heat pump beside those of
which a data set says so. What no data set gives is the same in every file and stands here, with its reason. The other
files of data/vehicles are written by hand, but for their section `[charging]`, which is put into them.
"""

from __future__ import annotations

import csv
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

from docs.vehicle_estimates import (
    CHARGING,
    EPA_LOAD_KG,
    MORE,
    SOC_PERCENT,
    Errors,
    body_of,
    estimate_errors,
    listed_mass_error_kg,
    mass_error_kg,
    mass_fit,
    measured_vehicles,
    middle_shape,
    own_curves,
    road_load_fit,
    sister_errors,
    sister_road_load,
)
from energy.units import KM_PER_MILE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from docs.vehicle_estimates import Body

DOCS: Final = Path(__file__).resolve().parent
JOINED: Final = DOCS / "data" / "vehicles.csv"
HEAT_PUMPS: Final = DOCS / "data" / "heat_pumps.csv"
VEHICLES: Final = DOCS.parent / "data" / "vehicles"
BY_HAND: Final = ("bmw-i3-60ah", "chevrolet-bolt", "nissan-leaf", "tesla-model-3", "vw-id4")

KWH_PER_GALLON: Final = 33.7  # EPA's petrol equivalent

EPA: Final = (
    "EPA test car list 2022 (22-tstcar.csv, public domain, "
    "https://www.epa.gov/compliance-and-fuel-economy-data/data-cars-used-testing-fuel-economy)"
)
SOURCE: Final = "BEV Energy Consumption Estimation for Route Planning, section III.A"
KONA: Final = f"the value that {SOURCE}, uses for the Kona Electric; nothing is published for this car"
FASTSIM: Final = "fastsim 2.1.5 vehicle database (Apache-2.0, resources/FASTSim_py_veh_db.csv)"
EMOBPY: Final = "emobpy 0.6.2 vehicle database (MIT licence, data/evspecs.json)"
OPEN_EV: Final = "Open EV Data (https://github.com/KilowattApp/open-ev-data, MIT with attribution, of 2025-04-12)"
DATASET: Final = "Open EV Data dataset (CDLA-Permissive-2.0, https://github.com/open-ev-data/open-ev-data-dataset, "
DATASET_COMMIT: Final = "8edb266da3b2c4424dd031e248468ba5d445da5d"

MASS_SD_LB: Final = 165
ROAD_LOAD_A_SD: Final = 0.05
ROAD_LOAD_C_SD: Final = 0.04
PERSON_KG: Final = 75
HEAT_PUMP_COP: Final = 2.0
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
    if row["id"] in heat_pumps():
        parts.append(_heat_pump(f"that it has one: {heat_pumps()[row['id']]}"))
    parts.append(charging_section(charging_rows()[row["id"]]))
    parts.append(_published(row))
    return "\n".join(parts)


def _section(name: str, values: str, source: str) -> str:
    return f"[{name}]\n{values}\nsource = {_literal(source)}\n"


def _literal(text: str) -> str:
    """A TOML literal string, which is read several times as fast as a basic one."""
    return f"'''{text}'''" if "'" in text else f"'{text}'"


def _aux_power(row: Mapping[str, str]) -> str:
    if row["aux_kw"]:
        watts = round(1000.0 * float(row["aux_kw"]))
        reason = f": {row['aux_reason']}" if row["aux_reason"] else ""
        source = f"{FASTSIM}, '{row['aux_entry']}', aux_kw {row['aux_kw']}{reason}"
    else:
        watts = USUAL_AUX_W
        source = f"assumed: aux_kw 0.25 of most electric cars in {FASTSIM}, which has no entry near this car"
    return _section("aux_power", f"value_w = {watts}\nsd_w = {AUX_SD_W}", source + AUX_SD_REASON)


def _heat_pump(source: str) -> str:
    return _section(
        "heating_cop", f"value_coef = {HEAT_PUMP_COP}", f"assumed: {HEAT_PUMP_COP} of a heat pump in the cold; {source}"
    )


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


# --- cars that EPA's list does not have -------------------------------------------------------------------------


@cache
def more_rows() -> tuple[dict[str, str], ...]:
    """Rows of docs/data/more_vehicles.csv."""
    with MORE.open(encoding="utf-8", newline="") as file:
        return tuple(csv.DictReader(file))


@cache
def heat_pumps() -> dict[str, str]:
    """Who says that a car has a heat pump, by vehicle, of cars of which the dataset does not say so."""
    with HEAT_PUMPS.open(encoding="utf-8", newline="") as file:
        return {row["id"]: row["source"] for row in csv.DictReader(file)}


@cache
def charging_rows() -> dict[str, dict[str, str]]:
    """Rows of docs/data/charging.csv by vehicle."""
    with CHARGING.open(encoding="utf-8", newline="") as file:
        return {row["id"]: row for row in csv.DictReader(file)}


def cited(source: str) -> str:
    """A source of the tables in full: `oed:`, `oevd:`, `emobpy:` and `fastsim:` stand for data sets."""
    kind, _, entry = source.partition(":")
    return {
        "oed": f"{OPEN_EV}, {entry}",
        "oevd": f"{DATASET}src/{entry}.json at commit {DATASET_COMMIT})",
        "emobpy": f"{EMOBPY}, {entry}",
        "fastsim": f"{FASTSIM}, '{entry}'",
    }.get(kind, source)


def more_vehicle_file(row: Mapping[str, str]) -> str:
    """Text of the vehicle file of a row of more_vehicles.csv."""
    kerb_kg, mass_sd_kg, mass_source = _mass(row)
    body = body_of(row, kerb_kg + EPA_LOAD_KG)
    parts = [
        f"# {row['name']}. Written by docs/vehicle_files.py.\n"
        f'id = "{row["id"]}"\nname = "{row["name"]}"\npowertrain = "bev"\n',
        _section("mass", f"value_kg = {body.mass_kg:.0f}\nsd_kg = {mass_sd_kg:.0f}", mass_source),
        _section("rotating_mass", "value_coef = 1.1", f"assumed: {KONA}"),
        *_road_load(row, body),
        _section("drive_efficiency", "value_eff = 0.92\nsd_eff = 0.03", f"assumed: {KONA}{DRIVE_SD_REASON}"),
        _section("recuperation_efficiency", "value_eff = 0.75\nsd_eff = 0.08", RECUPERATION_REASON),
        _aux_power({"aux_kw": ""}),
        _section("aux_efficiency_moving", "value_eff = 0.9", f"assumed: {KONA}"),
        _section("aux_efficiency_idle", "value_eff = 0.9", f"assumed: {KONA}"),
        _section(
            "usable_capacity",
            f"value_kwh = {row['capacity_kwh']}\nsd_kwh = {max(1.0, 0.03 * float(row['capacity_kwh'])):.1f}",
            f"{cited(row['capacity_source'])}: usable battery{CAPACITY_SD_REASON}",
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
    if row["heat_pump_source"]:
        listed = row["heat_pump_source"].removeprefix("oevd:")
        parts.append(_heat_pump(f"{DATASET}src/{listed} at commit {DATASET_COMMIT}) lists one: heat_pump"))
    elif row["id"] in heat_pumps():
        parts.append(_heat_pump(f"that it has one: {heat_pumps()[row['id']]}"))
    charging = charging_rows()[row["id"]]
    parts.append(charging_section(charging))
    if charging["listed_kwh_per_100km"]:
        listed_kwh = f"listed_kwh_per_100km = {charging['listed_kwh_per_100km']}"
        parts.append(_section("published", listed_kwh, f"{OPEN_EV}, {charging['entry']}: average_consumption"))
    return "\n".join(parts)


def _mass(row: Mapping[str, str]) -> tuple[float, float, str]:
    """Kerb mass [kg], standard deviation of the mass with load [kg] and source."""
    estimated_kg = mass_fit().kerb_kg(
        body_of(row, 0.0), float(row["capacity_kwh"]), both_axles=row["driven_wheels"] == "4"
    )
    load = f"and {EPA_LOAD_KG:.0f} kg (300 lb), as EPA's test weights have"
    if row["kerb_kg"]:
        sd_kg = (listed_mass_error_kg() ** 2 + PERSON_KG**2) ** 0.5
        source = (
            f"{row['kerb_kg']} kg kerb ({cited(row['kerb_source'])}) {load}; sd measured: listed kerb masses are off"
        )
        return float(row["kerb_kg"]), sd_kg, f"{source} {listed_mass_error_kg():.0f} kg from those, and a person more"
    sd_kg = (mass_error_kg() ** 2 + PERSON_KG**2) ** 0.5
    source = f"estimated: kerb mass by size and battery (docs/vehicles.md), {estimated_kg:.0f} kg, {load}"
    return (
        round(estimated_kg),
        sd_kg,
        f"{source}; sd measured: {mass_error_kg():.0f} kg on cars left out, and a person more",
    )


def _road_load(row: Mapping[str, str], body: Body) -> list[str]:
    errors: Errors
    if row["sister"]:
        sister = next(measured for measured in measured_vehicles() if measured.name == row["sister"])
        road_load, errors = sister_road_load(sister, body), sister_errors_once()
        origin = f"of the sister {sister.name} on the same platform (EPA test car list 2022)"
        mass = f"estimated: {origin}, times {body.mass_kg / sister.body.mass_kg:.3f}, the ratio of masses"
        area = body.frontal_m2 / sister.body.frontal_m2
        drag = f"estimated: {origin}, times {area:.3f}, the ratio of width times height ({cited(row['size_source'])})"
        by = "sisters in EPA's list"
    else:
        fit = road_load_fit()
        road_load, errors = fit.road_load(body), estimate_errors_once(with_cd=body.cd is not None)
        mass = "estimated: {coef} times the weight; no coast-down of this car is published"
        size = f"frontal area 0.85 · {body.width_m:.3f} m · {body.height_m:.3f} m ({cited(row['size_source'])})"
        if body.cd is None:
            drag = f"estimated: C of this kind of body, {body.kind}: ½ · 1.2 kg/m³ · {fit.kind_cd[body.kind]}, {size}"
        else:
            factor = f"½ · 1.2 kg/m³ · {fit.cd_coef} · Cd {body.cd} ({cited(row['cd_source'])})"
            drag = f"estimated: {factor}, {size}"
        by = "families of cars of EPA's list that took no part in the fit"
    rolling = road_load_fit()
    a_sd, c_sd = errors.a * road_load.a_n, errors.c * road_load.c_n_per_mps2
    return [
        _section(
            "road_load_a",
            f"value_n = {road_load.a_n:.1f}\nsd_n = {a_sd:.1f}",
            f"{mass.format(coef=rolling.rolling_coef)}; sd measured: {100 * errors.a:.0f} % on {by}",
        ),
        _section(
            "road_load_b",
            f"value_n_per_mps = {road_load.b_n_per_mps:.3f}",
            f"{mass.format(coef=f'{rolling.rolling_s_per_m:.6f} s/m')}; no sd of its own, it is in those of A and C",
        ),
        _section(
            "road_load_c",
            f"value_n_per_mps2 = {road_load.c_n_per_mps2:.4f}\nsd_n_per_mps2 = {c_sd:.4f}",
            f"{drag}; sd measured: {100 * errors.c:.0f} % on {by}",
        ),
    ]


sister_errors_once: Final = cache(sister_errors)
estimate_errors_once: Final = cache(estimate_errors)


# --- charging ----------------------------------------------------------------------------------------------------


def charging_section(row: Mapping[str, str]) -> str:
    """Text of the section `[charging]` of a row of charging.csv."""
    plugs = row["connectors"].split()
    lines = ["[charging]", f"connectors = [{', '.join(f'{chr(34)}{plug}{chr(34)}' for plug in plugs)}]"]
    curve = _curve(row)
    if curve is not None:
        soc, power, source = curve
        lines += [f"curve_soc_percent = [{soc}]", f"curve_kw = [{power}]", f"curve_source = {_literal(source)}"]
    lines += [f"ac_kw = {row['ac_kw']}", f"ac_phases = {row['ac_phases']}"]
    one_phase = ""
    if row["ac_one_phase_kw"]:
        lines.append(f"ac_one_phase_kw = {row['ac_one_phase_kw']}")
        american = not {"type1", "nacs"}.isdisjoint(plugs)
        reason = "11 kW, as in America" if american else "32 A"
        one_phase = f"; on one phase assumed: {reason}"
    origin = f"{OPEN_EV}, {row['entry']}: ports and ac_charger" if row["entry"] else cited(row["dc_source"])
    note = f"; {row['ac_note']}" if row["ac_note"] else ""
    lines.append(f"source = {_literal(f'{origin}{note}; plugs by market (docs/vehicles.md){one_phase}')}")
    return "\n".join(lines) + "\n"


def _curve(row: Mapping[str, str]) -> tuple[str, str, str] | None:
    """Charges [%], powers [kW] and source of a curve; None without one."""
    listed = ", ".join(row["curve_soc_percent"].split()), ", ".join(row["curve_kw"].split())
    match row["curve_kind"]:
        case "none":
            return None
        case "own":
            return (*listed, f"{OPEN_EV}, {row['curve_entry']}: charging_curve, its own")
        case "sister":
            entry = row["curve_entry"]
            return (*listed, f"assumed: the curve of a car with the same battery or platform, {OPEN_EV}, {entry}")
        case _:
            most_kw = float(row["dc_kw"])
            shape = middle_shape(own_curves())
            powers = ", ".join(f"{most_kw * share:.4g}" for share in shape)
            charges = ", ".join(f"{soc:.0f}" for soc in SOC_PERCENT)
            source = f"assumed: the middle shape of {len(own_curves())} curves (docs/vehicles.md) times {most_kw:g} kW"
            return charges, powers, f"{source}, {cited(row['dc_source'])}"


def with_charging(text: str, row: Mapping[str, str]) -> str:
    """A vehicle file with its section `[charging]` renewed, or put before `[published]` or at the end."""
    section = charging_section(row)
    if "\n[charging]\n" in text:
        return re.sub(r"\[charging\]\n.*?(?=\n\[|\Z)", lambda _: section, text, flags=re.DOTALL)
    head, published, tail = text.partition("[published]\n")
    return f"{head}{section}\n{published}{tail}" if published else f"{head}\n{section}"


def write() -> None:
    """Write all files that the tables hold."""
    for joined in joined_rows():
        (VEHICLES / f"{joined['id']}.toml").write_text(vehicle_file(joined), encoding="utf-8")
    for vehicle_id in BY_HAND:
        path = VEHICLES / f"{vehicle_id}.toml"
        path.write_text(with_charging(path.read_text(encoding="utf-8"), charging_rows()[vehicle_id]), encoding="utf-8")
    for more in more_rows():
        (VEHICLES / f"{more['id']}.toml").write_text(more_vehicle_file(more), encoding="utf-8")


if __name__ == "__main__":
    write()
