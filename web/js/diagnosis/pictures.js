/** Pictures of all drives: their errors before and after, and measured against modelled. */

import { svg } from "../dom.js";
import { digitsOf, linear, niceDomain, ticksOf } from "../chart/scales.js";
import { energyText, number } from "../units.js";
import { counted } from "./terms.js";

const WIDTH = 344;
const HEIGHT = 230;
const PLOT = { left: 40, right: WIDTH - 10, top: 16, bottom: HEIGHT - 34 };
const RADIUS = 4;
const MOST_LABELS = 6;
const BAND = 0.1; // ± error that the scatter marks

const errorOf = (trip, kwh) => (100 * (kwh - trip.measured_kwh)) / trip.measured_kwh;
const signed = (value) => `${value > 0 ? "+" : ""}${number(value, 1)} %`;
const modelled = (trip, kwh) => `${energyText(kwh)} (${signed(errorOf(trip, kwh))})`;
const told = (trip) => `${trip.id}: measured ${energyText(trip.measured_kwh)}, before ${modelled(trip, trip.before_kwh)}, after ${modelled(trip, trip.after_kwh)}`;
const mean = (values) => values.reduce((sum, value) => sum + Math.abs(value), 0) / values.length;

function frame(label, ...children) {
  return svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label, class: "drives-picture" }, children);
}

function levels(y, ticks, unit) {
  const digits = digitsOf(ticks);
  return ticks.map((tick) => [
    svg("line", { class: tick === 0 ? "base" : "grid", x1: PLOT.left, x2: PLOT.right, y1: y(tick), y2: y(tick) }),
    svg("text", { x: PLOT.left - 5, y: y(tick) + 4, "text-anchor": "end" }, number(tick, digits) + unit),
  ]);
}

/** One drive: a line from before to after, which a click chooses. */
function pair(trip, choose, [x1, y1], [x2, y2], hit) {
  return svg(
    "g", { class: "drive", on: { click: () => choose(trip.id) } },
    svg("title", {}, told(trip)),
    hit,
    svg("line", { class: "change", x1, y1, x2, y2 }),
    svg("circle", { class: "mark-before", cx: x1, cy: y1, r: RADIUS }),
    svg("circle", { class: "mark-after", cx: x2, cy: y2, r: RADIUS }),
  );
}

/** Errors of drives in the order of their temperature; where one has none, in the order of their energy. */
export function errorPicture(trips, choose) {
  const warm = trips.every(({ ambient_c: ambient }) => ambient !== null);
  const sorted = trips.toSorted((a, b) => (warm ? a.ambient_c - b.ambient_c : a.measured_kwh - b.measured_kwh));
  const errors = sorted.map((trip) => [errorOf(trip, trip.before_kwh), errorOf(trip, trip.after_kwh)]);
  const domain = niceDomain(errors.flat(), { least: 4, count: 4, include: [0] });
  const y = linear(domain, [PLOT.bottom, PLOT.top]);
  const step = (PLOT.right - PLOT.left) / sorted.length;
  const at = (i) => PLOT.left + (i + 0.5) * step;
  const every = Math.ceil(sorted.length / MOST_LABELS);
  const [before, after] = [0, 1].map((i) => number(mean(errors.map((pairOf) => pairOf[i])), 1));
  const label = `Errors of ${counted(trips.length, "drive")}: ${before} % on average before, ${after} % after`;
  return frame(
    label,
    levels(y, ticksOf(domain, 5), " %"),
    sorted.map((trip, i) => pair(
      trip, choose, [at(i), y(errors[i][0])], [at(i), y(errors[i][1])],
      svg("rect", { class: "hit", x: at(i) - step / 2, width: step, y: PLOT.top, height: PLOT.bottom - PLOT.top }),
    )),
    sorted.map((trip, i) => i % every === 0 && svg("text", { x: at(i), y: PLOT.bottom + 14, "text-anchor": "middle" }, warm ? `${number(trip.ambient_c)} °C` : number(trip.measured_kwh, 1))),
    svg("text", { class: "axis", x: (PLOT.left + PLOT.right) / 2, y: HEIGHT - 4, "text-anchor": "middle" }, warm ? "drives by air temperature" : "drives by measured kWh"),
    svg("text", { class: "axis", x: PLOT.left - 36, y: 9 }, "modelled over measured"),
  );
}

/** Measured against modelled energy of each drive, with the line of no error. */
export function scatterPicture(trips, choose) {
  const values = trips.flatMap((trip) => [trip.measured_kwh, trip.before_kwh, trip.after_kwh]);
  const domain = niceDomain(values, { least: 0.5, count: 4, include: [0] });
  const x = linear(domain, [PLOT.left, PLOT.right]);
  const y = linear(domain, [PLOT.bottom, PLOT.top]);
  const [, most] = domain;
  const ticks = ticksOf(domain, 5);
  const digits = digitsOf(ticks);
  const corner = (share) => `${x(most / Math.max(1, share))},${y(most * Math.min(1, share))}`;
  return frame(
    `Measured and modelled energy of ${counted(trips.length, "drive")}, before and after`,
    levels(y, ticks, ""),
    ticks.map((tick) => svg("text", { x: x(tick), y: PLOT.bottom + 14, "text-anchor": "middle" }, number(tick, digits))),
    svg("polygon", { class: "band", points: `${x(0)},${y(0)} ${corner(1 + BAND)} ${x(most)},${y(most)} ${corner(1 - BAND)}` }),
    svg("line", { class: "base", x1: x(0), y1: y(0), x2: x(most), y2: y(most) }),
    trips.map((trip) => {
      const at = x(trip.measured_kwh);
      return pair(trip, choose, [at, y(trip.before_kwh)], [at, y(trip.after_kwh)], null);
    }),
    svg("text", { class: "axis", x: (PLOT.left + PLOT.right) / 2, y: HEIGHT - 4, "text-anchor": "middle" }, "measured kWh (shaded: within 10 %)"),
    svg("text", { class: "axis", x: PLOT.left - 36, y: 9 }, "modelled kWh"),
  );
}
