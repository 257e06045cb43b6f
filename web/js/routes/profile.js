/** One route by the distance along it: charge, height, speed and place at every metre. */

const METRES_PER_DEG = 111_195; // of latitude, on a sphere of 6371 km
const SHORTEST_MEAN_M = 150; // means over less are of single junctions
const MEANS_PER_ROUTE = 300; // as many as a chart has room for

/**
 * A route of an answer, ready to be looked up by distance.
 * ends_m, soc, low, high, height_m: at the beginning and at the end of each link, one value more than there are links;
 * low and high (P10 and P90 of the charge) are null where they were not asked for. at_m: distance of each coordinate.
 * filled: charge at the beginning of links that follow a charging stop, by their position.
 */
export function profileOf(route) {
  const { links } = route;
  const ends = new Float64Array(links.length + 1);
  for (const [i, link] of links.entries()) ends[i + 1] = ends[i] + link.length_m;
  const withBand = links.length > 0 && links.every(({ soc_end_p10: low, soc_end_p90: high }) => low !== null && high !== null);
  const along = (first, field) => [first, ...links.map((link) => link[field])];
  const profile = {
    route,
    links,
    length_m: ends[links.length],
    ends_m: ends,
    soc: along(route.soc_start, "soc_end"),
    filled: filledOf(route),
    low: withBand ? along(route.soc_start, "soc_end_p10") : null,
    high: withBand ? along(route.soc_start, "soc_end_p90") : null,
    height_m: along(route.height_start_m, "height_end_m"),
    coordinates: route.geometry.coordinates,
    at_m: distancesOf(route, ends),
  };
  return { ...profile, means: meansOf(profile, Math.max(SHORTEST_MEAN_M, profile.length_m / MEANS_PER_ROUTE)) };
}

/** Charge after each charging stop, by the position of the link that follows it. */
function filledOf({ legs, charging }) {
  const stops = charging?.stops ?? [];
  const after = stops.map(({ leg, depart_soc: soc }) => [legs.slice(leg + 1).find(({ first_link: first }) => first !== null)?.first_link, soc]);
  return new Map(after.filter(([first]) => first !== undefined));
}

/** Distance of each coordinate: a link's own length, shared out among its pieces. */
function distancesOf({ links, geometry: { coordinates } }, ends) {
  const at = new Float64Array(coordinates.length);
  let from = 0;
  for (const [i, { geometry_end: to }] of links.entries()) {
    let drawn = 0;
    for (let k = from + 1; k <= to; k += 1) {
      drawn += apart_m(coordinates[k - 1], coordinates[k]);
      at[k] = drawn;
    }
    for (let k = from + 1; k <= to; k += 1) at[k] = ends[i] + (drawn > 0 ? at[k] / drawn : 1) * links[i].length_m;
    from = to;
  }
  return at;
}

function apart_m([lon1, lat1], [lon2, lat2]) {
  const narrow = Math.cos((((lat1 + lat2) / 2) * Math.PI) / 180);
  return METRES_PER_DEG * Math.hypot((lon2 - lon1) * narrow, lat2 - lat1);
}

/** Consumption and speed over runs of links, each at least `shortest` metres long. */
export function meansOf({ links, ends_m: ends, length_m: length }, shortest) {
  const means = [];
  let [first, energy, time] = [0, 0, 0];
  for (const [i, link] of links.entries()) {
    energy += link.energy_wh;
    time += link.duration_s;
    const driven = ends[i + 1] - ends[first];
    const rest = length - ends[i + 1];
    if (i < links.length - 1 && (driven < shortest || rest < shortest / 2)) continue;
    if (driven > 0) {
      const speed = time > 0 ? (3.6 * driven) / time : 0;
      means.push({ first, last: i, from_m: ends[first], to_m: ends[i + 1], kwh_per_100km: (100 * energy) / driven, speed_kmh: speed });
    }
    [first, energy, time] = [i + 1, 0, 0];
  }
  return means;
}

/** Position of the last value that is not above what is looked for; values ascend. */
function lastNotAbove(values, wanted) {
  let [low, high] = [0, values.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (values[middle] <= wanted) low = middle;
    else high = middle - 1;
  }
  return low;
}

const within = (profile, along) => Math.min(Math.max(along, 0), profile.length_m);

/** The link that is driven at a distance. */
export const linkAt = (profile, along) => Math.min(lastNotAbove(profile.ends_m, within(profile, along)), profile.links.length - 1);

/** What is known at a distance; the charge between a link's ends is taken as even. */
export function valuesAt(profile, along) {
  const at = within(profile, along);
  const i = linkAt(profile, at);
  const link = profile.links[i];
  const share = link.length_m > 0 ? (at - profile.ends_m[i]) / link.length_m : 1;
  const between = (values, begin = values?.[i]) => values && begin + share * (values[i + 1] - begin);
  const mean = profile.means.find(({ to_m: to }) => at <= to) ?? profile.means.at(-1);
  return {
    along_m: at,
    link: i,
    soc: between(profile.soc, profile.filled.get(i)),
    low: between(profile.low),
    high: between(profile.high),
    height_m: between(profile.height_m),
    speed_kmh: mean.speed_kmh,
    limit_kmh: link.speed_limit_kmh,
    kwh_per_100km: mean.kwh_per_100km,
    power_kw: (mean.kwh_per_100km * mean.speed_kmh) / 100,
    name: link.name,
  };
}

/** The position [lon, lat] at a distance. */
export function positionAt(profile, along) {
  const { coordinates, at_m: at } = profile;
  const wanted = within(profile, along);
  const k = Math.min(lastNotAbove(at, wanted), coordinates.length - 2);
  const length = at[k + 1] - at[k];
  const share = length > 0 ? (wanted - at[k]) / length : 0;
  return coordinates[k].map((value, axis) => value + share * (coordinates[k + 1][axis] - value));
}

/** The line between two distances. */
export function lineBetween(profile, from, to) {
  const { coordinates, at_m: at } = profile;
  const first = lastNotAbove(at, from) + 1;
  let end = first;
  while (end < at.length && at[end] < to) end += 1;
  return [positionAt(profile, from), ...coordinates.slice(first, end), positionAt(profile, to)];
}

/** The distance of that point between two links which is nearest to a place. */
export function alongAt(profile, { lat, lon }, first = 0, last = profile.links.length - 1) {
  const { coordinates, at_m: at, links } = profile;
  const narrow = Math.cos((lat * Math.PI) / 180);
  let best = { apart: Infinity, along: 0 };
  const start = first > 0 ? links[first - 1].geometry_end : 0;
  for (let k = start; k < links[last].geometry_end; k += 1) {
    const [x1, y1] = [(coordinates[k][0] - lon) * narrow, coordinates[k][1] - lat];
    const [dx, dy] = [(coordinates[k + 1][0] - coordinates[k][0]) * narrow, coordinates[k + 1][1] - coordinates[k][1]];
    const squared = dx * dx + dy * dy;
    const share = squared > 0 ? Math.min(1, Math.max(0, -(x1 * dx + y1 * dy) / squared)) : 0;
    const apart = Math.hypot(x1 + share * dx, y1 + share * dy);
    if (apart < best.apart) best = { apart, along: at[k] + share * (at[k + 1] - at[k]) };
  }
  return best.along;
}

/** How far an infeasible route gets: where `furthest` lies on it; null for a feasible one. */
export function reachOf(profile, reserve) {
  const { route, soc, links } = profile;
  if (route.feasible || route.charging || !route.furthest || !links.length) return null;
  const last = soc.findIndex((charge) => charge < reserve) - 1;
  return last < 0 ? alongAt(profile, route.furthest) : alongAt(profile, route.furthest, last, last);
}

/** The line of a stretch of links. */
export const stretchLine = (profile, { first, last }) => lineBetween(profile, profile.ends_m[first], profile.ends_m[last + 1]);

/** Which of the hot stretches lies at a distance, -1 for none. */
export const stretchAt = (route, along) => route.hot_links.findIndex(({ from_m: from, to_m: to }) => along >= from && along <= to);
