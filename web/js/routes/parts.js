/** Where the energy goes, by cause. */

import { el } from "../dom.js";
import { energyText, percentText } from "../units.js";
import { signed } from "./compare.js";

/** Causes in the order of energy/force/parts.py, which a test holds them to: short name, and what is meant. */
export const CAUSES = {
  rolling: ["Rolling", "rolling resistance of the tyres at 20 °C on a dry road"],
  linear: ["Drag by speed", "part of the measured road load that grows evenly with speed; it corrects air drag and rolling, and may be below 0"],
  aero: ["Air drag", "drag of the vehicle itself in still air"],
  grade: ["Climbing", "lifting the vehicle; below 0 where the way leads down"],
  inertia: ["Speeding up", "gaining speed; what braking gives back is taken off"],
  drivetrain_loss: ["Drivetrain losses", "lost between battery and wheels when driving"],
  recuperation_loss: ["Braking losses", "what braking does not bring back"],
  auxiliary: ["On-board supply", "lights, computers, pumps"],
  tyre_temperature: ["Cold or warm tyres", "rolling resistance of tyres colder or warmer than 20 °C"],
  road_surface: ["Wet or snowy road", "rolling resistance of water or snow"],
  payload: ["Payload", "rolling, climbing and speeding up of the load"],
  air_density: ["Dense or thin air", "drag of air denser or thinner than at 20 °C and 100 kPa"],
  drag: ["Roof load, side wind", "drag of a roof load, and of air that flows from the side"],
  wind: ["Wind", "wind against or with the vehicle"],
  regen_limit: ["Friction brakes", "recuperation beyond its cap, left to the friction brakes"],
  load_loss: ["Losses under load", "drivetrain loss that grows with the square of the force"],
  battery_resistance: ["Cold battery", "heat in a battery colder than its reference"],
  cabin: ["Cabin climate", "heating or cooling the cabin"],
  tyre_warm_up: ["Tyres warming up", "rolling resistance of tyres that are not yet warm from driving"],
  consumption_table: ["Driving on the flat", "all that the vehicle's consumption table has for level roads"],
};

const BRAKED_AWAY = { name: "Battery full", meaning: "counted as given back above, but a full battery could not take it" };
const LEAST_KWH = 0.005; // shown as 0.00 kWh
const MOST_ROWS = 8;

/** Parts that are not 0, the largest first, what is negative last: {name, meaning, kwh}; small ones together. */
export function partsOfEnergy(parts) {
  const rows = Object.entries(parts)
    .map(([key, kwh]) => ({ name: CAUSES[key]?.[0] ?? key.replaceAll("_", " "), meaning: CAUSES[key]?.[1] ?? "", kwh }))
    .filter(({ kwh }) => Math.abs(kwh) >= LEAST_KWH)
    .toSorted((a, b) => b.kwh - a.kwh);
  if (rows.length <= MOST_ROWS) return rows;
  const byWeight = rows.toSorted((a, b) => Math.abs(b.kwh) - Math.abs(a.kwh));
  const kept = new Set(byWeight.slice(0, MOST_ROWS - 1));
  const small = rows.filter((row) => !kept.has(row));
  const rest = { name: `${small.length} smaller ones`, meaning: small.map(({ name, kwh }) => `${name} ${energyText(kwh)}`).join(", "), kwh: small.reduce((sum, { kwh }) => sum + kwh, 0) };
  return [...rows.filter((row) => kept.has(row)), rest].toSorted((a, b) => b.kwh - a.kwh);
}

/** Bars of all parts, with the total. */
export function partsTable(route) {
  const rows = partsOfEnergy(route.energy_parts_kwh);
  if (route.braked_away_kwh >= LEAST_KWH) rows.push({ ...BRAKED_AWAY, kwh: route.braked_away_kwh });
  const most = Math.max(...rows.map(({ kwh }) => kwh), 0);
  const least = Math.min(...rows.map(({ kwh }) => kwh), 0);
  const span = most - least || 1;
  const place = (kwh) => ({ left: `${(100 * (Math.min(kwh, 0) - least)) / span}%`, width: `${(100 * Math.abs(kwh)) / span}%` });
  const total = route.battery_kwh;
  return el(
    "table",
    { class: "parts", "aria-label": "Energy by cause; negative parts give energy back" },
    el("thead", {}, el("tr", {}, ["Cause", "Share", "Energy"].map((text) => el("th", { scope: "col" }, el("span", { class: "unseen" }, text))))),
    el("tbody", {}, rows.map(({ name, meaning, kwh }) =>
      el(
        "tr",
        { title: `${name}: ${meaning}` },
        el("th", { scope: "row" }, name, el("span", { class: "unseen" }, ` (${meaning})`)),
        el("td", { class: "bar-cell" }, el("span", { class: "bar-track" }, el("span", { class: `bar${kwh < 0 ? " back" : ""}`, style: place(kwh) }), least < 0 && el("span", { class: "bar-zero", style: { left: `${(-100 * least) / span}%` } })), total > 0 && el("span", { class: "unseen" }, percentText(kwh / total))),
        el("td", { class: "num" }, kwh < 0 ? signed(kwh, energyText) : energyText(kwh)),
      ),
    )),
    el("tfoot", {}, el("tr", {}, el("th", { scope: "row", colspan: 2 }, "From the battery"), el("td", { class: "num" }, el("b", {}, energyText(total))))),
  );
}
