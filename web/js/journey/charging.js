/** What is chosen for charging stops: defaults, how the address writes them, and what is asked of the service. */

export const CONNECTORS = {
  ccs2: "CCS 2", ccs1: "CCS 1", chademo: "CHAdeMO", nacs: "NACS", tesla_eu: "Tesla", type2: "Type 2", type1: "Type 1", type3: "Type 3",
  gbt_dc: "GB/T DC", gbt_ac: "GB/T AC", mcs: "MCS", cee: "CEE", domestic: "Household",
};
export const OBJECTIVES = ["time", "energy", "cost"];
export const CONFIDENCES = [0.8, 0.9, 0.95, 0.99]; // that the form offers; the service takes others too
export const LEAST_POWERS_KW = [22, 50, 100, 150, 300];
export const STAYS_MIN = [60, 120, 240, 480, 600, 720]; // at the goal, that the form offers
export const STAY_POWERS_KW = [2.3, 3.7, 7.4, 11, 22, 50];
const ALTERNATIVE_PLANS = 3; // beside the best one
export const MOST_LISTED = 40; // stations or networks
const MOST_STATIONS_AT = 8;

/** Numbers of the form: name in the journey, in the address, default, and what is allowed, in the unit that is shown. */
const NUMBERS = {
  arrive: { key: "arrive", default: 0.1, min: 0, max: 0.5, percent: true },
  atGoal: { key: "atgoal", default: 0.1, min: 0, max: 0.9, percent: true },
  most: { key: "chargeto", default: 0.8, min: 0.3, max: 1, percent: true },
  overheadMin: { key: "overhead", default: 5, min: 0, max: 30 },
  leastKw: { key: "leastkw", default: 0, min: 0, max: 4000 },
  stayMin: { key: "stay", default: 0, min: 0, max: 7 * 24 * 60 }, // at the goal, 0 for none
  stayKw: { key: "staykw", default: 11, min: 0, max: 4000 },
};

export const INITIAL_CHARGING = {
  on: false,
  ...Object.fromEntries(Object.entries(NUMBERS).map(([name, { default: value }]) => [name, value])),
  plugs: [], // empty: all that fit the vehicle
  prefer: [], // networks
  avoid: [], // networks
  never: false, // whether those are left out altogether
  confidence: null, // null: by the mean
  departure: null, // local time, as 2026-11-30T08:15
  objective: "time",
  capsKmh: [],
  at: [], // stations to charge at: {id, lat, lon}
  not: [], // ids of stations not to charge at
};

const DEPARTURE = /^\d{4}-\d\d-\d\dT\d\d:\d\d$/;
const CAP_KMH = [30, 250];

/** A part of the address that stays readable, in which commas separate. */
const listed = (values) => values.map((value) => value.replaceAll("%", "%25").replaceAll(",", "%2C")).join(",");
const unlisted = (text) => (text ?? "").split(",").map((part) => decoded(part.trim())).filter(Boolean).slice(0, MOST_LISTED);

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

/** Write what is chosen by put(key, text); nothing where stops are not asked for. */
export function putCharging(charging, put) {
  if (!charging.on) return;
  put("charge", "1");
  for (const [name, { key, default: value, percent }] of Object.entries(NUMBERS)) {
    if (charging[name] !== value) put(key, String(Number((percent ? 100 * charging[name] : charging[name]).toFixed(2))));
  }
  if (charging.plugs.length) put("plugs", charging.plugs.join(","));
  if (charging.prefer.length) put("prefer", listed(charging.prefer));
  if (charging.avoid.length) put("avoid", listed(charging.avoid));
  if (charging.never) put("never", "1");
  if (charging.confidence !== null) put("sure", String(Number((100 * charging.confidence).toFixed(2))));
  if (charging.departure) put("departure", charging.departure);
  if (charging.objective !== "time") put("objective", charging.objective);
  if (charging.capsKmh.length) put("caps", charging.capsKmh.join(","));
  if (charging.at.length) put("chargeat", charging.at.map(({ id, lat, lon }) => `${lat},${lon},${id.replaceAll("%", "%25").replaceAll(";", "%3B")}`).join(";"));
  if (charging.not.length) put("notat", listed(charging.not));
}

/** What an address says; whatever can't be read stays at its default. */
export function chargingOf(given) {
  const charging = { ...INITIAL_CHARGING, on: given.get("charge") === "1" };
  if (!charging.on) return charging;
  for (const [name, { key, min, max, percent }] of Object.entries(NUMBERS)) {
    const text = given.get(key);
    const value = percent ? Number((Number(text) / 100).toFixed(4)) : Number(text);
    if (text && value >= min && value <= max) charging[name] = value;
  }
  if (charging.most <= charging.arrive) charging.most = Number(Math.min(1, charging.arrive + 0.1).toFixed(4));
  charging.plugs = (given.get("plugs") ?? "").split(",").filter((plug) => plug in CONNECTORS);
  charging.prefer = networkNames(unlisted(given.get("prefer")));
  charging.avoid = networkNames(unlisted(given.get("avoid"))).filter((name) => !named(charging.prefer, name));
  charging.never = given.get("never") === "1";
  const sure = Number(given.get("sure")) / 100;
  if (given.get("sure") && sure >= 0.5 && sure <= 0.999) charging.confidence = Number(sure.toFixed(4));
  const departure = given.get("departure") ?? "";
  if (DEPARTURE.test(departure) && !Number.isNaN(Date.parse(departure))) charging.departure = departure;
  if (OBJECTIVES.includes(given.get("objective"))) charging.objective = given.get("objective");
  charging.capsKmh = capsFromText(given.get("caps") ?? "").caps ?? [];
  charging.at = (given.get("chargeat") ?? "").split(";").map(stationOf).filter(Boolean).slice(0, MOST_STATIONS_AT);
  charging.not = unlisted(given.get("notat")).filter((id) => !charging.at.some((station) => station.id === id));
  return charging;
}

/** A station of an address: latitude, longitude, id; null where it can't be read. */
function stationOf(text) {
  const [lat, lon, ...rest] = text.split(",");
  const id = decoded(rest.join(","));
  const place = { id, lat: Number(lat), lon: Number(lon) };
  return id && lat && lon && Math.abs(place.lat) <= 90 && Math.abs(place.lon) <= 180 ? place : null;
}

/**
 * Speed caps out of typed text, in km/h; factor: km/h of the unit that is typed.
 * @returns {{caps: number[]|null, error: string}} no caps and no error where the text is empty
 */
export function capsFromText(text, factor = 1) {
  const parts = text.split(/[\s,;]+/).filter(Boolean);
  const values = parts.map((part) => Number((Number(part) * factor).toFixed(1)));
  const wrong = parts.find((_, i) => !(values[i] >= CAP_KMH[0] && values[i] <= CAP_KMH[1]));
  if (wrong !== undefined) return { caps: null, error: `“${wrong.slice(0, 20)}” is no speed of ${Math.ceil(CAP_KMH[0] / factor)} to ${Math.floor(CAP_KMH[1] / factor)}` };
  return { caps: [...new Set(values)].toSorted((a, b) => b - a).slice(0, 4), error: "" };
}

/**
 * Via points with the stations to charge at among them, each where it lengthens the way least as the crow flies.
 * @returns {{via: Array<{lat: number, lon: number}>, chargedAt: Array<{via: number, station: string}>}} chargedAt: which of them are stations
 */
export function viaWithStations(start, via, goal, stations) {
  const way = [start, ...via, goal];
  for (const { id, lat, lon } of stations) {
    const station = { lat, lon, id };
    const longer = (i) => apart(way[i], station) + apart(station, way[i + 1]) - apart(way[i], way[i + 1]);
    const best = way.slice(1).reduce((least, _, i) => (longer(i) < longer(least) ? i : least), 0);
    way.splice(best + 1, 0, station);
  }
  const between = way.slice(1, -1);
  return { via: between.map(({ lat, lon }) => ({ lat, lon })), chargedAt: between.flatMap(({ id }, i) => (id ? [{ via: i, station: id }] : [])) };
}

const apart = (a, b) => Math.hypot(a.lat - b.lat, (a.lon - b.lon) * Math.cos((((a.lat + b.lat) / 2) * Math.PI) / 180));

/** The part `charging` of the body of POST /route; chargedAt: as viaWithStations gives it; further: with other plans. */
export function chargingRequest(charging, chargedAt, further) {
  const asked = {
    arrive_soc: charging.arrive,
    goal_soc: charging.atGoal,
    max_soc: charging.most,
    overhead_s: 60 * charging.overheadMin,
    objective: charging.objective,
  };
  if (further) asked.alternatives = ALTERNATIVE_PLANS;
  if (charging.leastKw > 0) asked.min_power_kw = charging.leastKw;
  if (charging.plugs.length) asked.connectors = charging.plugs;
  const networks = Object.entries({ preferred: charging.prefer, [charging.never ? "excluded" : "avoided"]: charging.avoid }).filter(([, names]) => names.length);
  if (networks.length) asked.networks = Object.fromEntries(networks);
  if (charging.stayMin > 0) asked.stays = [{ at: "goal", minutes: charging.stayMin, power_kw: charging.stayKw }];
  if (charging.confidence !== null) asked.confidence = charging.confidence;
  if (charging.departure) asked.departure_time = charging.departure;
  if (charging.capsKmh.length) asked.speed_caps_kmh = charging.capsKmh;
  if (chargedAt.length) asked.via_stations = chargedAt;
  if (charging.not.length) asked.excluded_stations = charging.not;
  return asked;
}

const named = (names, wanted) => names.some((name) => name.toLowerCase() === wanted.toLowerCase());

/** Names of networks, each once in any case. */
export const networkNames = (names) => names.filter((name, i) => !named(names.slice(0, i), name)).slice(0, MOST_LISTED);

/** The choices with networks to prefer, or to avoid, which are none of the others then; which: "prefer" or "avoid". */
export function withNetworks(charging, which, names) {
  const other = which === "prefer" ? "avoid" : "prefer";
  return { ...charging, [which]: networkNames(names), [other]: charging[other].filter((name) => !named(names, name)) };
}

const rounded = (degrees) => Number(degrees.toFixed(7));

/** The choices with nothing said of a station. */
export const withAnyStation = (charging, id) => ({ ...charging, at: charging.at.filter((other) => other.id !== id), not: charging.not.filter((other) => other !== id) });

/** The choices with a station to charge at, {id, lat, lon}. */
export function withStation(charging, { id, lat, lon }) {
  const others = withAnyStation(charging, id);
  return { ...others, on: true, at: [...others.at, { id, lat: rounded(lat), lon: rounded(lon) }].slice(-MOST_STATIONS_AT) };
}

/** The choices with a station that is not charged at. */
export function withoutStation(charging, id) {
  const others = withAnyStation(charging, id);
  return { ...others, on: true, not: [...others.not, id].slice(-MOST_LISTED) };
}

/** Whether a station is one to charge at. */
export const isChosen = (charging, id) => charging.at.some((station) => station.id === id);
