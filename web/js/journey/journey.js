/** What the user has chosen: kept in one store, written into the address, sent as requests. */

import { placeFromText } from "../units.js";
import { chargingOf, chargingRequest, INITIAL_CHARGING, putCharging, viaWithStations } from "./charging.js";
import { bandValues, BY, knowsCharge, MAX_BANDS, OUTLINES, VALUE_KEYS, valuesFromText } from "./limits.js";

export const TABS = ["route", "range", "diagnosis"];
export const ALTERNATIVES = ["eco", "balanced", "fastest"];
export const PLANS = { best: "Best", "fewest stops": "Fewest stops", fastest: "Fastest", "most reserve": "Most reserve" };
export const COLOURINGS = ["soc", "consumption", "plain"];
export const RANGE_MODES = ["from", "reverse", "round_trip"];
export const MAX_VIA = 20;

/** Conditions that the panel offers: default (left out of requests), and how the address writes them. */
export const CONDITIONS = {
  ambient_c: { kind: "number", default: null, min: -30, max: 45 },
  road: { kind: "choice", default: "dry", choices: ["dry", "wet", "snow"] },
  wind_speed_mps: { kind: "number", default: 0, min: 0, max: 25 },
  wind_from_deg: { kind: "number", default: 0, min: 0, max: 360 },
  payload_kg: { kind: "number", default: 0, min: 0, max: 1000 },
  drag_factor: { kind: "number", default: 1, min: 1, max: 2 },
  speed_factor: { kind: "number", default: 1, min: 0.7, max: 1.3 },
  climate: { kind: "flag", default: true },
  regen_limited: { kind: "flag", default: false },
};

export const INITIAL = {
  tab: "route",
  graph: null, // null: the service's default
  vehicle: null,
  start: null, // {lat, lon}
  goal: null,
  via: [],
  soc: 0.8,
  reserve: 0.1,
  conditions: {}, // only what differs from its default
  effects: null, // id of a diagnosis
  uncertainty: false,
  charging: INITIAL_CHARGING, // charging stops (charging.js)
  stations: null, // whether charging stations are on the map, null: where stops are planned
  route: "eco", // which alternative, or plan, is looked at
  colour: "soc",
  rangeMode: "from",
  bands: 4,
  by: "charge", // what bands are of
  values: { charge: null, energy: null, time: null, distance: null }, // typed ones, in the units of VALUE_KEYS
  outline: "roads",
  diagnosis: null, // id of the diagnosis that is looked at
  units: "km",
};

/** Conditions with one field set, which falls out where it is at its default. */
export function withCondition(conditions, name, value) {
  const { [name]: _, ...others } = conditions;
  return value === null || value === CONDITIONS[name].default ? others : { ...others, [name]: value };
}

const placeOut = (place) => `${trimmed(place.lat, 6)},${trimmed(place.lon, 6)}`;
const trimmed = (value, digits) => String(Number(value.toFixed(digits)));

/** The query part of an address that leads to what is chosen; what is at its default is left out. */
export function addressOf(journey) {
  const out = [];
  const put = (key, value) => out.push(`${key}=${encodeURIComponent(value).replaceAll("%2C", ",").replaceAll("%3A", ":").replaceAll("%3B", ";")}`);
  if (journey.tab !== INITIAL.tab) put("tab", journey.tab);
  if (journey.graph) put("graph", journey.graph);
  if (journey.vehicle) put("vehicle", journey.vehicle);
  if (journey.start) put("start", placeOut(journey.start));
  if (journey.goal) put("goal", placeOut(journey.goal));
  if (journey.via.length) put("via", journey.via.filter(Boolean).map(placeOut).join(";"));
  if (journey.soc !== INITIAL.soc) put("soc", trimmed(100 * journey.soc, 2));
  if (journey.reserve !== INITIAL.reserve) put("reserve", trimmed(100 * journey.reserve, 2));
  const conditions = Object.entries(journey.conditions);
  if (conditions.length) put("conditions", conditions.map(([name, value]) => `${name}:${value}`).join(","));
  for (const key of ["effects", "diagnosis"]) if (journey[key]) put(key, journey[key]);
  if (journey.uncertainty) put("uncertainty", "1");
  putCharging(journey.charging, put);
  if (journey.stations !== null) put("stations", journey.stations ? "1" : "0");
  for (const key of ["route", "colour", "rangeMode", "bands", "by", "outline", "units"]) {
    if (journey[key] !== INITIAL[key]) put(key === "rangeMode" ? "range" : key, journey[key]);
  }
  for (const by of BY) if (journey.values[by]) put(VALUE_KEYS[by], journey.values[by].join(","));
  return out.length ? `?${out.join("&")}` : "";
}

const placeOf = (text) => placeFromText(text ?? "").place;

/** What an address says; whatever can't be read stays at its default. */
export function journeyOf(search) {
  const given = new URLSearchParams(search);
  const journey = { ...INITIAL };
  const oneOf = (key, field, allowed) => {
    if (allowed.includes(given.get(key))) journey[field] = given.get(key);
  };
  const percent = (key, field) => {
    const value = Number(given.get(key));
    if (given.get(key) && value >= 0 && value <= 100) journey[field] = Number((value / 100).toFixed(4));
  };
  oneOf("tab", "tab", TABS);
  for (const key of ["graph", "vehicle", "effects", "diagnosis"]) journey[key] = given.get(key) || null;
  journey.start = placeOf(given.get("start"));
  journey.goal = placeOf(given.get("goal"));
  journey.via = (given.get("via") ?? "").split(";").map(placeOf).filter(Boolean).slice(0, MAX_VIA);
  percent("soc", "soc");
  percent("reserve", "reserve");
  journey.reserve = Math.min(journey.reserve, journey.soc);
  journey.conditions = conditionsOf(given.get("conditions") ?? "");
  journey.uncertainty = given.get("uncertainty") === "1";
  journey.charging = chargingOf(given);
  if (["0", "1"].includes(given.get("stations"))) journey.stations = given.get("stations") === "1";
  oneOf("route", "route", [...ALTERNATIVES, ...Object.keys(PLANS)]);
  oneOf("colour", "colour", COLOURINGS);
  oneOf("range", "rangeMode", RANGE_MODES);
  oneOf("units", "units", ["km", "mi"]);
  const bands = Number(given.get("bands"));
  if (Number.isInteger(bands) && bands >= 1 && bands <= MAX_BANDS) journey.bands = bands;
  oneOf("by", "by", BY);
  oneOf("outline", "outline", OUTLINES);
  journey.values = Object.fromEntries(BY.map((by) => [by, valuesFromText(given.get(VALUE_KEYS[by]) ?? "", by).values]));
  return journey;
}

function conditionsOf(text) {
  let conditions = {};
  for (const part of text.split(",")) {
    const [name, value] = part.split(":");
    const form = CONDITIONS[name];
    if (!form || value === undefined || value === "") continue;
    if (form.kind === "choice" && form.choices.includes(value)) conditions = withCondition(conditions, name, value);
    if (form.kind === "flag" && ["true", "false"].includes(value)) conditions = withCondition(conditions, name, value === "true");
    const number = Number(value);
    if (form.kind === "number" && number >= form.min && number <= form.max) conditions = withCondition(conditions, name, number);
  }
  return conditions;
}

let defaultGraph = null;

/** Have requests name this graph, which is shown, where the journey has none: the service would choose by the places. */
export function setDefaultGraph(name) {
  defaultGraph = name;
}

/** What route and range requests share. */
function shared(journey) {
  const asked = { soc: journey.soc, reserve_soc: Math.min(journey.reserve, journey.soc) };
  const graph = journey.graph ?? defaultGraph;
  if (graph) asked.graph = graph;
  if (journey.vehicle) asked.vehicle = journey.vehicle;
  if (Object.keys(journey.conditions).length) asked.conditions = journey.conditions;
  if (journey.effects) asked.effects = journey.effects;
  if (journey.uncertainty) asked.uncertainty = true;
  return asked;
}

/** The body of POST /route, or null while start or goal is missing. further: with plans beside the best one. */
export function routeRequest(journey, { further = false } = {}) {
  if (!journey.start || !journey.goal) return null;
  const { charging } = journey;
  const places = journey.via.filter(Boolean);
  const { via, chargedAt } = charging.on ? viaWithStations(journey.start, places, journey.goal, charging.at) : { via: places };
  const asked = charging.on ? { charging: chargingRequest(charging, chargedAt, further) } : { alternatives: ALTERNATIVES };
  return { start: journey.start, goal: journey.goal, ...(via.length ? { via } : {}), ...shared(journey), ...asked };
}

/** Which area is asked for; by time and distance only that from here is known. */
export const rangeModeOf = (journey) => (knowsCharge(journey) ? journey.rangeMode : "from");

/**
 * The body of POST /range, or null while there is no start, or no band to draw.
 * @param {object} journey
 * @param {number|null} [capacityKwh] what the battery holds, null where that is not known
 */
export function rangeRequest(journey, capacityKwh = null) {
  const { start, by, outline } = journey;
  const { values } = bandValues(journey, capacityKwh);
  if (!start || !values.length) return null;
  const mode = rangeModeOf(journey);
  const { uncertainty, ...asked } = { origin: start, ...shared(journey) };
  if (uncertainty && knowsCharge(journey)) asked.uncertainty = true;
  if (by === "charge") asked.bands = values.map((percent) => Number((percent / 100).toFixed(6)));
  else Object.assign(asked, { by, limits: values });
  if (mode !== "from") asked[mode] = true;
  return outline === "roads" ? asked : { ...asked, outline };
}
