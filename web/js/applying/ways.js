/** Ways on which it is shown what learned effects change, before they are applied. */

import { ApiError, call } from "../api.js";
import { pathOf } from "../diagnosis/diagnoses.js";
import { positionsOf } from "../diagnosis/timeline.js";
import { routeRequest } from "../journey/journey.js";
import { NAMES } from "../routes/compare.js";

const INLINE = "inline"; // a vehicle that was sent along with the recordings, and has no name
const MOST_DRIVES = 3; // that are tried, until one of them lies on roads
const LEAST_M = 300; // between the ends of a way
const M_PER_DEGREE = 111_195;
const LIMITS_KMH = [50, 80, 110]; // of a made-up way, a third each
const LINKS = 8; // of each third
const KM = [2, 100]; // least and greatest length of a made-up way

/** The vehicle that routes drive once a diagnosis is applied: its id, null for the default one. */
export const vehicleOf = ({ journey, session }, { vehicle }) => (vehicle === INLINE ? journey.get().vehicle : vehicle === session.get().vehicles?.default ? null : vehicle);

/**
 * Ways in the order of how well they show it: the chosen route, routes between places of drives, a made-up way. Each
 * is {what, known, ask(effects, conditions)}; known: whether the reader has it before them; ask answers {energy_kwh,
 * parts, soc_end, feasible, distance_m, line, warnings}. Later ones are looked up when they are asked for.
 */
export async function* waysOf(app, answer, signal) {
  const { start, goal } = app.journey.get();
  if (start && goal) yield routeWay(app, answer, { start, goal, via: app.journey.get().via }, signal, `the chosen ${NAMES[app.journey.get().route].toLowerCase()} route`, true);
  for (const { id, start: from, goal: to } of await endsOfDrives(app, answer, signal)) {
    yield routeWay(app, answer, { start: from, goal: to, via: [] }, signal, `the way from where drive ${id} began to its farthest place`, false);
  }
  yield await madeUpWay(app, answer, signal);
}

function routeWay(app, answer, places, signal, what, known) {
  const journey = app.journey.get();
  const asked = routeRequest({ ...journey, ...places, vehicle: vehicleOf(app, answer), conditions: {}, effects: null, uncertainty: false });
  return {
    what, known,
    async ask(effects, conditions) {
      const body = { ...asked, alternatives: [journey.route], links: false, conditions, ...(effects && { effects }) };
      const { routes: [route], warnings } = await call("route", { body, signal });
      return { energy_kwh: route.battery_kwh, parts: route.energy_parts_kwh, soc_end: route.soc_end, feasible: route.feasible, distance_m: route.distance_m, line: JSON.stringify(route.geometry), warnings };
    },
  };
}

/** Begin and farthest place of drives on the shown graph, of those nearest to the median length. */
async function endsOfDrives({ journey, session }, { id, links, result }, signal) {
  const { graphs } = session.get();
  const shown = graphs?.graphs.find(({ name }) => name === (journey.get().graph ?? graphs.default));
  if (!links.trips || !shown) return [];
  const [west, south, east, north] = shown.bbox;
  const km = new Map(result.trips.map((trip) => [trip.id, trip.distance_km]));
  const middle = medianOf([...km.values()]);
  const { trips } = await call(pathOf(id, "trips"), { signal });
  const here = trips
    .filter(({ bbox }) => bbox && bbox[0] >= west && bbox[1] >= south && bbox[2] <= east && bbox[3] <= north)
    .toSorted((a, b) => Math.abs(km.get(a.id) - middle) - Math.abs(km.get(b.id) - middle));
  const found = [];
  for (const trip of here.slice(0, MOST_DRIVES)) {
    const positions = positionsOf(await call(pathOf(id, "trips", trip.id), { signal }));
    const [first] = positions;
    const apart = ([lon, lat]) => M_PER_DEGREE * Math.hypot((lon - first[0]) * Math.cos((first[1] * Math.PI) / 180), lat - first[1]);
    const farthest = positions.reduce((best, position) => (apart(position) > apart(best) ? position : best), first);
    if (first && apart(farthest) >= LEAST_M) found.push({ id: trip.id, start: placeOf(first), goal: placeOf(farthest) });
  }
  return found;
}

const placeOf = ([lon, lat]) => ({ lat, lon });

/** Level road as long as the median drive, there and back, at most as fast as the drives were. */
async function madeUpWay(app, answer, signal) {
  const { learned_from: from } = await call(pathOf(answer.id, "effects"), { signal });
  const fastest = Math.max(30, from?.speed_kmh ?? Infinity);
  const km = Math.min(KM[1], Math.max(KM[0], medianOf(answer.result.trips.map(({ distance_km: one }) => one))));
  const limits = [...new Set(LIMITS_KMH.map((limit) => Math.min(limit, Math.round(fastest))))];
  const chain = limits.flatMap((limit) => Array.from({ length: LINKS }, (_, i) => ({
    length_m: (1000 * km) / (LINKS * limits.length), speed_limit_kmh: limit, urban: limit <= LIMITS_KMH[0],
    cross: limit <= LIMITS_KMH[0] ? "large" : "none", altitude_m: 0, heading_deg: i % 2 ? 180 : 0, // there and back, so that wind evens out
  })));
  const vehicle = vehicleOf(app, answer);
  const units = app.units();
  const speeds = limits.map((limit) => units.speedText(limit)).join(", ");
  return {
    what: `a made-up level way as long as the median drive, in equal parts at ${speeds}`, known: false,
    async ask(effects, conditions) {
      const body = { chain, soc: app.journey.get().soc, ...(vehicle && { vehicle }), conditions, ...(effects && { effects }) };
      const driven = await call("simulate", { body, signal });
      return { energy_kwh: driven.battery_kwh, parts: driven.energy_parts_kwh, soc_end: driven.soc_end, feasible: driven.soc_min >= 0, distance_m: driven.distance_m, line: "", warnings: driven.warnings };
    },
  };
}

/** The median of some numbers, null of none. */
export function medianOf(values) {
  const sorted = values.toSorted((a, b) => a - b);
  const [low, high] = [sorted[Math.floor((sorted.length - 1) / 2)], sorted[Math.floor(sorted.length / 2)]];
  return sorted.length ? (low + high) / 2 : null;
}

/** What the first way that can be driven takes by the vehicle's file and with effects: {way, pairs}, of each temperature one. */
export async function comparedOn(app, answer, signal) {
  const { conditions } = app.journey.get();
  const ambient = medianOf(answer.result.trips.map((trip) => trip.ambient_c).filter((one) => one !== null));
  const usual = conditions.ambient_c === undefined && ambient !== null ? { ...conditions, ambient_c: Number(ambient.toFixed(1)) } : null;
  let failed = null;
  for await (const way of waysOf(app, answer, signal)) {
    try {
      const pairs = [];
      for (const at of [...(way.known || !usual ? [conditions] : []), ...(usual ? [usual] : [])]) {
        const [before, after] = await Promise.all([way.ask(null, at), way.ask(answer.id, at)]);
        pairs.push({ at, before, after, median: at === usual });
      }
      return { way, pairs };
    } catch (error) {
      if (!(error instanceof ApiError) || error.status === 0 || error.status >= 500) throw error;
      failed = error;
    }
  }
  throw failed;
}
