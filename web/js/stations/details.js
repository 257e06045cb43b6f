/** Stations as the service knows them, asked for when they are looked at. */

import { call } from "../api.js";
import { shownGround } from "../journey/ground.js";

const MOST_NEAR = 12;
const MOST_IN_VIEW = 200;
const REACH_DEG = [0.06, 0.25, 1]; // of squares in which near ones are looked for, one after the other
const METRES_PER_DEG = 111_195;

/** A page of stations of the graph on the map, {features, sources, matched}; filters: parameters of the API. @throws {ApiError} */
export function stationsOf(app, filters, signal) {
  const asked = new URLSearchParams(Object.entries(filters).filter(([, value]) => value !== null && value !== ""));
  return call(`graphs/${encodeURIComponent(shownGround(app).name)}/stations?${asked}`, { signal });
}

const boxAround = ({ lat, lon }, reach) => {
  const wide = reach / Math.max(0.05, Math.cos((lat * Math.PI) / 180));
  return [Math.max(-180, lon - wide), Math.max(-90, lat - reach), Math.min(180, lon + wide), Math.min(90, lat + reach)].map((value) => value.toFixed(6)).join(",");
};

/** How far two places are apart [m], as the crow flies. */
export function apart_m(a, b) {
  const narrow = Math.cos((((a.lat + b.lat) / 2) * Math.PI) / 180);
  return METRES_PER_DEG * Math.hypot(a.lat - b.lat, (a.lon - b.lon) * narrow);
}

export const placeOfFeature = ({ geometry: { coordinates: [lon, lat] } }) => ({ lat, lon });

/** One station, {station, sources}, by its id near a place; null where there is none. reach_deg: how exact the place is. */
export async function stationById(app, id, place, reach_deg = 0.002) {
  const found = await stationsOf(app, { bbox: boxAround(place, reach_deg), limit: 5000 });
  const station = found.features.find((feature) => feature.id === id);
  return station ? { station, sources: found.sources } : null;
}

/**
 * Stations near a place that fit the filters, the nearest first: [{station, apart_m, closed}]; closed: whether it is at
 * a local time, false where none is given.
 */
export async function stationsNear(app, place, filters, { besides = [], at = null } = {}) {
  let near = [];
  for (const reach of REACH_DEG) {
    const asked = { ...filters, bbox: boxAround(place, reach), limit: 2000 };
    const [found, then] = await Promise.all([stationsOf(app, asked), at && stationsOf(app, { ...asked, open_at: at.slice(0, 16) })]);
    const open = then && new Set(then.features.map(({ id }) => id));
    near = found.features
      .filter(({ id, properties }) => !besides.includes(id) && properties.operational !== false)
      .map((station) => ({ station, apart_m: apart_m(place, placeOfFeature(station)), closed: open ? !open.has(station.id) : false }))
      .toSorted((a, b) => a.apart_m - b.apart_m);
    if (near.length >= MOST_NEAR || found.matched === 0 && reach === REACH_DEG.at(-1)) break;
  }
  return near.slice(0, MOST_NEAR);
}

/** Stations in view, those of most power first, and how many there are. */
export async function stationsInView(app, [west, south, east, north]) {
  const bbox = [Math.max(-180, west), Math.max(-90, south), Math.min(180, east), Math.min(90, north)].map((value) => value.toFixed(6)).join(",");
  const found = await stationsOf(app, { bbox, limit: MOST_IN_VIEW });
  const stations = found.features.toSorted((a, b) => (b.properties.power_kw ?? 0) - (a.properties.power_kw ?? 0));
  return { stations, matched: found.matched, sources: found.sources };
}

/** Filters of stations that a charging choice may use; connectors: plugs of the vehicle. */
export function usableFilters({ plugs, leastKw }, connectors) {
  const fitting = plugs.length ? plugs : connectors;
  return { connectors: fitting.join(","), min_power_kw: leastKw || "" };
}
