/** Colours of the line by charge or by consumption, in classes that differ in lightness. */

import { niceStep } from "../chart/scales.js";
import { meansOf } from "./profile.js";

/** viridis (CC0), from little to much charge. */
const CHARGE = {
  light: ["#fde725", "#a0da39", "#4ac16d", "#1fa187", "#277f8e", "#365c8d", "#46327e"],
  dark: ["#fdef7a", "#b5e35a", "#5fce7c", "#33b29a", "#4596ab", "#5a82bd", "#7f70c4"],
};
/** Blue where energy comes back, to red where much is taken; lightest around 0. */
const CONSUMPTION = {
  light: ["#1f5fa8", "#8fc1e8", "#ffe3a6", "#f7b04a", "#e36f2c", "#a32020"],
  dark: ["#4c92e0", "#b0d8f7", "#fff0c4", "#ffc463", "#f58a4b", "#dd4f4f"],
};
export const BEYOND = { light: "#8a9293", dark: "#9aa5a6" };

const SHORTEST_PIECE_M = 250; // shorter ones are specks on the map
const PIECES_PER_ROUTE = 120;

/** A scale of classes: colours, and the bounds between them in ascending order, one less. */
const scaleOf = (bounds, colours) => ({ bounds, colours, classOf: (value) => bounds.filter((bound) => value >= bound).length });

const MOST_CLASSES = 10;
const channels = (colour) => [1, 3, 5].map((at) => Number.parseInt(colour.slice(at, at + 2), 16));

/** The colour at a share 0..1 of a ramp. */
export function colourAt(ramp, share) {
  const at = share * (ramp.length - 1);
  const i = Math.min(Math.floor(at), ramp.length - 2);
  const [from, to] = [channels(ramp[i]), channels(ramp[i + 1])];
  return `#${from.map((value, k) => Math.round(value + (at - i) * (to[k] - value)).toString(16).padStart(2, "0")).join("")}`;
}

/** Classes of charge [0..1] that cover these charges, at bounds of whole per cents. */
export function chargeScale(charges, theme) {
  const [least, most] = [Math.min(...charges), Math.max(...charges)];
  const step = Math.max(0.01, niceStep(Math.max(most - least, 0.01) / (MOST_CLASSES - 1)));
  const from = Math.floor(least / step + 1e-9);
  const count = Math.max(2, Math.ceil(most / step - 1e-9) - from);
  const colours = Array.from({ length: count }, (_, i) => colourAt(CHARGE[theme], i / (count - 1)));
  const bounds = Array.from({ length: count - 1 }, (_, i) => Number(((from + i + 1) * step).toFixed(4)));
  return scaleOf(bounds, colours);
}

/** Classes of consumption [kWh/100 km] around 0, in steps that fit the mean. */
export function consumptionScale(mean, theme) {
  const step = niceStep(Math.max(Math.abs(mean) * 0.7, 1));
  return scaleOf([-step, 0, step, 2 * step, 3 * step], CONSUMPTION[theme]);
}

/**
 * Runs of one colour: {from_m, to_m, colour, first, last, beyond}. parts: {first, last, from_m, to_m, colour} in driving
 * order; from reach_m on, where it is not null, the runs are beyond what the charge allows.
 */
export function runsOf(parts, reach, grey) {
  const runs = [];
  for (const part of parts.flatMap((one) => cutAt(one, reach))) {
    const beyond = reach !== null && part.from_m >= reach;
    const colour = beyond ? grey : part.colour;
    const run = runs.at(-1);
    if (run && run.colour === colour && run.beyond === beyond) Object.assign(run, { to_m: part.to_m, last: part.last });
    else if (part.to_m > part.from_m) runs.push({ ...part, colour, beyond });
  }
  return runs;
}

function cutAt(part, at) {
  if (at === null || at <= part.from_m || at >= part.to_m) return [part];
  return [{ ...part, to_m: at }, { ...part, from_m: at }];
}

/** Parts of a route with their colours. colouring: "soc", "consumption" or "plain", the last in one colour. */
export function partsOf(profile, colouring, scale, plain) {
  const { links, ends_m: ends, soc, length_m: length } = profile;
  if (colouring === "consumption") {
    const taken = (mean) => scale.colours[scale.classOf(mean.kwh_per_100km)];
    const means = meansOf(profile, Math.max(SHORTEST_PIECE_M, length / PIECES_PER_ROUTE));
    return means.map((mean) => ({ first: mean.first, last: mean.last, from_m: mean.from_m, to_m: mean.to_m, colour: taken(mean) }));
  }
  if (colouring === "plain") return [{ first: 0, last: links.length - 1, from_m: 0, to_m: length, colour: plain }];
  const colour = (i) => scale.colours[scale.classOf(((profile.filled.get(i) ?? soc[i]) + soc[i + 1]) / 2)];
  return links.map((_, i) => ({ first: i, last: i, from_m: ends[i], to_m: ends[i + 1], colour: colour(i) }));
}
