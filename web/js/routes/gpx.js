/** A route as GPX 1.1 (topografix.com/GPX/1/1): a track with heights, and its places as waypoints. */

import { valuesAt } from "./profile.js";

const ENTITIES = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&apos;" };
// what XML 1.0 can't hold, not even escaped
// oxlint-disable-next-line no-control-regex
const UNWRITABLE = /[\u0000-\u0008\u000B\u000C\u000E-\u001F\uFFFE\uFFFF]/g;

const escaped = (text) => text.replace(UNWRITABLE, "").replace(/[&<>"']/g, (sign) => ENTITIES[sign]);
const degrees = (value) => value.toFixed(7);

/**
 * The text of a GPX file.
 * @param {object} profile of the route (profile.js)
 * @param {string} name of the track
 * @param {Array<{name: string, lat: number, lon: number}>} places waypoints in driving order
 * @param {boolean} withHeights false where the map has none
 */
export function gpxText(profile, name, places, withHeights) {
  const height = (along) => (withHeights ? `<ele>${valuesAt(profile, along).height_m.toFixed(1)}</ele>` : "");
  const waypoints = places.map((place) => `  <wpt lat="${degrees(place.lat)}" lon="${degrees(place.lon)}"><name>${escaped(place.name)}</name></wpt>`);
  const points = profile.coordinates.map(([lon, lat], k) => `      <trkpt lat="${degrees(lat)}" lon="${degrees(lon)}">${height(profile.at_m[k])}</trkpt>`);
  return [
    '<?xml version="1.0" encoding="UTF-8"?>',
    '<gpx version="1.1" creator="joulepath" xmlns="http://www.topografix.com/GPX/1/1">',
    `  <metadata><name>${escaped(name)}</name></metadata>`,
    ...waypoints,
    "  <trk>",
    `    <name>${escaped(name)}</name>`,
    "    <trkseg>",
    ...points,
    "    </trkseg>",
    "  </trk>",
    "</gpx>",
    "",
  ].join("\n");
}
