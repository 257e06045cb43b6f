/** A route with charging stops along time: when it is where, with which charge. */

import { CONNECTORS } from "../journey/charging.js";
import { durationText } from "../units.js";
import { stationName } from "../stations/words.js";

/** The first stop that ends a leg, by the position of the leg. */
const stopsByLeg = ({ charging }) => new Map(charging.stops.map((stop, i) => [stop.leg, { stop, i }]));

/**
 * What happens in order: {kind: "drive", leg, i, place, halts} and {kind: "stop", stop, i}; place: what the drive leads to.
 */
export function eventsOf(route) {
  const stops = stopsByLeg(route);
  let vias = 0;
  return route.legs.flatMap((leg, i) => {
    const found = stops.get(i);
    const place = found ? stopName(found.stop) : i === route.legs.length - 1 ? "Goal" : `Via ${(vias += 1)}`;
    const halts = route.charging.halts.filter((halt) => halt.leg === i);
    return [{ kind: "drive", leg, i, place, halts }, ...(found ? [{ kind: "stop", stop: found.stop, i: found.i }] : [])];
  });
}

/** What a stop is called. */
export const stopName = ({ station }) => (station ? stationName(station) : "Stay");

/** The plug and its output. */
export const plugText = ({ socket }) => (socket ? `${CONNECTORS[socket.connector] ?? socket.connector}${socket.output_kw ? `, ${Math.round(socket.output_kw)} kW` : ""}` : "");

/**
 * The course of the charge: points {at_s, along_m, soc, what} in order of time, what: "drive", "wait" or "charge" of the
 * piece that ends there. Within a stop, power is taken to fall while the battery fills.
 */
export function courseOf(route) {
  const { links, legs, charging } = route;
  const points = [{ at_s: 0, along_m: 0, soc: route.soc_start, what: "drive" }];
  const add = (at_s, along_m, soc, what) => points.push({ at_s, along_m, soc, what });
  const stops = stopsByLeg(route);
  let [at, along] = [0, 0];
  for (const [i, leg] of legs.entries()) {
    const halts = charging.halts.filter((halt) => halt.leg === i);
    if (leg.first_link !== null) {
      for (const link of links.slice(leg.first_link, leg.last_link + 1)) {
        at += link.duration_s;
        along += link.length_m;
        add(at, along, link.soc_end, "drive");
        while (halts.length && along >= halts[0].along_m - 0.01) {
          at = halts.shift().depart_s;
          add(at, along, link.soc_end, "wait");
        }
      }
    }
    const found = stops.get(i)?.stop;
    if (!found) continue;
    at = found.arrive_s;
    const begun = found.depart_s - found.charging_s;
    if (begun > at) add(begun, along, found.arrive_soc, "wait");
    for (const [share, soc] of filling(found)) add(begun + share * found.charging_s, along, soc, "charge");
    at = found.depart_s;
  }
  return { points, end_s: charging.goal.arrive_s, length_m: along };
}

/** Charge by the share of the time at the plug: the strongest band of power first. */
function filling({ arrive_soc: from, depart_soc: to, power_bands: bands, charging_s: all }) {
  const parts = bands.toReversed().map(({ from_kw: least, to_kw: most, seconds }) => ({ seconds, weight: seconds * ((least + (most ?? least * 1.2)) / 2) }));
  const total = parts.reduce((sum, { weight }) => sum + weight, 0);
  if (!(total > 0) || !(all > 0)) return [[1, to]];
  let [time, weight] = [0, 0];
  return parts.map((part, i) => {
    time += part.seconds;
    weight += part.weight;
    return i === parts.length - 1 ? [1, to] : [Math.min(1, time / all), from + ((to - from) * weight) / total];
  });
}

/** What is known at a time: {at_s, along_m, soc, what}, even between two points. */
export function courseAt({ points, end_s: end }, wanted) {
  const at = Math.min(Math.max(wanted, 0), end);
  const next = points.findIndex(({ at_s: time }) => time >= at);
  const k = next < 0 ? points.length - 1 : Math.max(1, next);
  const [before, after] = [points[k - 1] ?? points[0], points[k] ?? points.at(-1)];
  if (next < 0) return { ...after, at_s: at }; // its time is summed up otherwise
  const share = after.at_s > before.at_s ? (at - before.at_s) / (after.at_s - before.at_s) : 1;
  const between = (field) => before[field] + share * (after[field] - before[field]);
  return { at_s: at, along_m: between("along_m"), soc: between("soc"), what: after.what };
}

/** The first time at which a distance is reached [s]. */
export function timeOf({ points }, along) {
  const k = points.findIndex(({ along_m: there }) => there >= along - 1e-6);
  if (k <= 0) return k < 0 ? points.at(-1).at_s : 0;
  const [before, after] = [points[k - 1], points[k]];
  const share = after.along_m > before.along_m ? (along - before.along_m) / (after.along_m - before.along_m) : 1;
  return before.at_s + share * (after.at_s - before.at_s);
}

/** Time of day of a moment in local time, with the day where it is another one than that of departure. */
export function clockText(time, departure) {
  const days = departure ? Math.round((Date.parse(`${time.slice(0, 10)}T12:00`) - Date.parse(`${departure.slice(0, 10)}T12:00`)) / 86_400_000) : 0;
  return `${time.slice(11, 16)}${days ? ` (+${days} d)` : ""}`;
}

/** When something is: by the clock where the departure is known, or else since departure. */
export const whenText = (time, seconds, departure) => (time ? clockText(time, departure) : `+${durationText(seconds)}`);

/** What is to be left on arrival, by the request as understood: at stops, and at the goal. */
export const askedOf = ({ request: { charging, reserve_soc: reserve } }) => ({ stop: Math.max(charging.arrive_soc, reserve), goal: Math.max(charging.goal_soc, reserve) });

/** The time of departure of an answer, null where none was said. */
export const departureOf = ({ request }) => request.charging?.departure_time ?? null;

/** The time of day after some seconds from a departure. */
export function clockAfter(departure, seconds) {
  const [, year, month, day, hour, minute] = departure.match(/^(\d+)-(\d+)-(\d+)T(\d+):(\d+)/).map(Number);
  const moment = new Date(Date.UTC(year, month - 1, day, hour, minute) + 1000 * seconds);
  return clockText(moment.toISOString(), departure);
}
