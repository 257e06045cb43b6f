/** Routes as files. */

import { call } from "../api.js";
import { stopName } from "../charging/plan.js";
import { saveFile, saveGeoJson } from "../download.js";
import { placeNames } from "./details.js";
import { gpxText } from "./gpx.js";

const GEOJSON = "application/geo+json";

/** The answer that is shown, as the service writes it in GeoJSON, with all digits. Throws ApiError. */
export async function saveAnswer({ request }) {
  saveGeoJson("routes.geojson", await call("route", { body: { ...request, compact: false }, accept: GEOJSON }));
}

/** The route that is looked at, as GPX. */
export function saveTrack(looked) {
  const { answer, route, profile } = looked;
  const title = `joulepath ${answer.terrain.graph} ${route.name}`;
  saveFile(`route-${route.name}.gpx`, gpxText(profile, title, waypointsOf(looked), answer.terrain.terrain !== "absent"), "application/gpx+xml");
}

/** Start, via points and goal where they meet the road, and where the charge is used up. */
export function waypointsOf({ answer: { snapped }, route, reach }) {
  const names = placeNames([...snapped.via, snapped.goal]);
  const ends = [snapped.start, ...snapped.via, snapped.goal].map(({ on_road: { lat, lon }, road_name: road }, i) => ({ lat, lon, name: road ? `${names[i]}, ${road}` : names[i] }));
  const stops = (route.charging?.stops ?? []).map((stop, i) => ({ lat: stop.at.lat, lon: stop.at.lon, name: `Stop ${i + 1}, ${stopName(stop)}` }));
  const places = [...ends, ...stops];
  return reach === null ? places : [...places, { ...route.furthest, name: "Charge used up" }];
}
