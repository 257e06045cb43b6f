/** What the chart can show along the way, each curve in a lane of its own. */

import { number, percentText } from "../units.js";
import { areaPath, bandPath, linePath, niceDomain, quantile, stepsOf } from "../chart/scales.js";

const byEnds = (profile, x) => Array.from(profile.ends_m, x);
const bySteps = (steps, x, y, field) => stepsOf(steps.map((step) => ({ from: x(step.from_m), to: x(step.to_m), y: y(step[field]) })));
const limitsOf = ({ links, ends_m: ends }, units) => links.map((link, i) => ({ from_m: ends[i], to_m: ends[i + 1], limit: units.speed(link.speed_limit_kmh) }));
const speedsOf = ({ means }, units) => means.map((mean) => ({ ...mean, speed: units.speed(mean.speed_kmh) }));
const takenOf = ({ means }, units) => means.map((mean) => ({ ...mean, taken: units.consumption(mean.kwh_per_100km) }));

/** The charge at the ends of links, upright where it is filled up. */
function withStops({ soc, filled }, xs, ys) {
  const order = soc.flatMap((share, i) => (filled.has(i) ? [[i, share], [i, filled.get(i)]] : [[i, share]]));
  return [order.map(([i]) => xs[i]), ys(order.map(([, share]) => share))];
}

/**
 * One lane: share of the height, title with unit, domain of its axis, marks as {class, d} or {class, level, text}, the
 * value at the cursor in the axis' unit, and in words. context: {units, reserve, heights}.
 */
export const LANES = {
  charge: {
    weight: 2,
    name: "Charge",
    unit: () => "%",
    domain: ({ soc, low, high, filled }, { reserve }) => niceDomain([...soc, ...filled.values(), ...(low ?? []), ...(high ?? [])].map((share) => 100 * share), { least: 4, include: [Math.max(0, 100 * reserve - 3)] }),
    marks(profile, x, y, { reserve }) {
      const xs = byEnds(profile, x);
      const ys = (values) => values.map((share) => y(100 * share));
      return [
        profile.low && { class: "curve-band", d: bandPath(xs, ys(profile.high), ys(profile.low)) },
        reserve > 0 && { class: "curve-reserve", level: 100 * reserve, text: "reserve" },
        { class: "curve-charge", d: linePath(...withStops(profile, xs, ys)) },
      ].filter(Boolean);
    },
    value: ({ soc }) => 100 * soc,
    text({ soc, low, high }) {
      return low === null || low === undefined ? percentText(soc, 1) : `${percentText(soc, 1)} (${number(100 * low, 1)} to ${percentText(high, 1)})`;
    },
  },
  height: {
    weight: 1,
    name: "Height",
    unit: (units) => units.heightUnit,
    domain: ({ height_m: heights }, { units }) => niceDomain(heights.map(units.height), { least: units.height(40), count: 2 }),
    marks(profile, x, y, { units }) {
      const [xs, ys] = [byEnds(profile, x), profile.height_m.map((height) => y(units.height(height)))];
      return [{ class: "curve-ground", d: areaPath(xs, ys, y(-Infinity)) }, { class: "curve-height", d: linePath(xs, ys) }];
    },
    value: ({ height_m: height }, { units }) => units.height(height),
    text: ({ height_m: height }, { units }) => units.heightText(height),
  },
  speed: {
    weight: 1,
    name: "Speed",
    unit: (units) => units.speedUnit,
    domain: (profile, { units }) => niceDomain([...speedsOf(profile, units).map(({ speed }) => speed), ...limitsOf(profile, units).map(({ limit }) => limit)], { least: 20, count: 2, include: [0] }),
    marks: (profile, x, y, { units }) => [
      { class: "curve-limit", d: linePath(...bySteps(limitsOf(profile, units), x, y, "limit")) },
      { class: "curve-speed", d: linePath(...bySteps(speedsOf(profile, units), x, y, "speed")) },
    ],
    value: ({ speed_kmh: speed }, { units }) => units.speed(speed),
    text: ({ speed_kmh: speed, limit_kmh: limit }, { units }) => `${units.speedText(speed)} (limit ${number(units.speed(limit))})`,
  },
  consumption: {
    weight: 1,
    name: "Consumption",
    unit: (units) => units.consumptionUnit,
    domain(profile, { units }) {
      const taken = takenOf(profile, units).map((mean) => mean.taken);
      return niceDomain([quantile(taken, 0.02), quantile(taken, 0.98)], { least: units.consumption(5), count: 2, include: [0] });
    },
    marks(profile, x, y, { units }) {
      const [xs, ys] = bySteps(takenOf(profile, units), x, y, "taken");
      return [{ class: "curve-zero", level: 0, text: "" }, { class: "curve-taken-area", d: areaPath(xs, ys, y(0)) }, { class: "curve-taken", d: linePath(xs, ys) }];
    },
    value: ({ kwh_per_100km: taken }, { units }) => units.consumption(taken),
    text: ({ kwh_per_100km: taken, power_kw: power }, { units }) => `${units.consumptionText(taken)}, ${number(power, 1)} kW`,
  },
};

/** Names of the lanes that there is something to show in; `heights`: whether the map has any. */
export const lanesFor = ({ heights }) => Object.keys(LANES).filter((key) => heights || key !== "height");

/** All that is known at a place, in words: {what, value, plain}; plain where the value says by itself what it is. */
export function readingOf(values, context) {
  const one = (key) => ({ what: LANES[key].name, value: LANES[key].text(values, context), plain: key !== "charge" });
  const at = { what: "After", value: context.units.lengthText(values.along_m), plain: true };
  const road = values.name ? [{ what: "Road", value: values.name, plain: true }] : [];
  return [at, ...lanesFor(context).map(one), ...road];
}
