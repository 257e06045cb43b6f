/** What is said of an answer: its bands in their unit, how far they reach, and how true their outlines are. */

import { rangeModeOf } from "../journey/journey.js";
import { plainNumber } from "../journey/limits.js";
import { directionText, energyText, number, percentText } from "../units.js";

const BEARING_DEG = 15; // between two directions in which the reach is measured
const FEW = 2000; // 1 in so many places is said to be few
const MANY_FRAC = 0.3; // from which a share is said in per cent alone

/** Of bands by each: what they are of, and how a value is said in a table, in a legend, and after an area. */
const TERMS = {
  charge: { head: "Charge left", row: (text) => `at least ${text}`, mark: "≥", said: (text) => `with at least ${text} left` },
  energy: { head: "Energy taken", row: (text) => `up to ${text}`, mark: "≤", said: (text) => `with up to ${text}` },
  time: { head: "Driving time", row: (text) => `within ${text}`, mark: "≤", said: (text) => `within ${text}` },
  distance: { head: "Distance driven", row: (text) => `within ${text}`, mark: "≤", said: (text) => `within ${text}` },
};

const EXPLAINED = {
  from: "Places that can be reached from here",
  reverse: "Places from which this one can still be reached, leaving there with this charge",
  round_trip: "Places that can be visited and returned from without charging",
};
const WAYS = { time: ", by the fastest way", distance: ", by the shortest way" };

export const termsOf = ({ by }) => TERMS[by];

/** The value of a band with its unit. */
export function valueText(band, { by }, units) {
  if (by === "charge") return `${plainNumber(100 * band.soc_left)} %`;
  if (by === "energy") return `${plainNumber(band.limit)} kWh`;
  if (by === "time") return `${plainNumber(band.limit)} min`;
  return `${plainNumber(units.length(1000 * band.limit))} ${units.lengthUnit}`;
}

/** Which places the areas of a request hold. */
export const explainedText = (request) => EXPLAINED[modeOf(request)] + (WAYS[request.by] ?? "");

const modeOf = ({ by, reverse, round_trip: round }) => rangeModeOf({ by, rangeMode: reverse ? "reverse" : round ? "round_trip" : "from" });

/** How far a band reaches, and whether the map ends it. */
export function reachText(band, units) {
  const { reach_by_bearing_km: km, road_farthest_km: road, map_edge_left_kwh: left, reaches_map_edge: ended } = band;
  const [near, far] = [Math.min(...km), Math.max(...km)];
  const at = (reach) => `${units.lengthText(1000 * reach)} to the ${directionText(BEARING_DEG * km.indexOf(reach))}`;
  const text = `Farthest ${at(far)}, nearest ${at(near)} as the crow flies, up to ${units.lengthText(1000 * road)} along roads`;
  if (!ended) return `${text}.`;
  return left === null ? `${text}, and beyond this map.` : `${text}, and beyond this map with up to ${energyText(left)} left at its edge.`;
}

/** How true the outlines of bands are, and what a filled one leaves out. */
export function outlineText(bands, filling, units) {
  const share = shareText(Math.max(...bands.map(({ false_in_share: frac }) => frac)));
  if (!filling) return `Along roads: ${share}.`;
  return `Filled: gaps narrower than ${units.lengthText(filling.gap_m)} and holes smaller than ${units.areaText(filling.hole_km2)} are closed; ${share}.`;
}

function shareText(frac) {
  if (frac === 0) return "no crossing inside is out of reach";
  if (frac < 1 / FEW) return `fewer than 1 in ${number(FEW)} crossings inside are out of reach`;
  if (frac >= MANY_FRAC) return `up to ${percentText(frac)} of the crossings inside are out of reach`;
  return `up to 1 in ${number(Number((1 / frac).toPrecision(2)))} crossings inside is out of reach (${percentText(frac, frac < 0.1 ? 1 : 0)})`;
}
