/** One drive along time, as the chart draws it: means over bins, and energy so far. */

const GAP = 1.5; // of a window's length, from which on a line is broken

/** Curves of a drive, by the names that the answer has. */
export const CURVES = { measured: "measured_w", before: "before_w", after: "after_w" };
const KWH_PER_WS = 1 / 3.6e6;

/**
 * Bins of a drive, at most `most`, each {from_s, to_s, speed_kmh, measured, before, after: {kw, kwh}, position, broken}.
 * kw: mean of the bin; kwh: energy until its end; position: [lon, lat] in its middle, or null; broken: whether the
 * recording has a gap before it.
 */
export function binsOf(answer, most) {
  const { t_s: begin, duration_s: duration } = answer;
  const size = Math.max(1, Math.ceil(begin.length / most));
  const bins = [];
  const spent = { measured: 0, before: 0, after: 0 };
  for (let first = 0; first < begin.length; first += size) {
    const last = Math.min(first + size, begin.length) - 1;
    const bin = {
      from_s: begin[first], to_s: begin[last] + duration[last],
      speed_kmh: meanOf(answer.speed_kmh, duration, first, last),
      position: positionOf(answer, first, last),
      broken: first > 0 && begin[first] - begin[first - 1] > GAP * duration[first - 1] + 1,
    };
    for (const [name, field] of Object.entries(CURVES)) {
      const kw = meanOf(answer[field], duration, first, last) / 1000;
      spent[name] += 1000 * kw * sumOf(duration, first, last) * KWH_PER_WS;
      bin[name] = { kw, kwh: spent[name] };
    }
    bins.push(bin);
  }
  return bins;
}

function sumOf(values, first, last) {
  let sum = 0;
  for (let i = first; i <= last; i += 1) sum += values[i];
  return sum;
}

function meanOf(values, weights, first, last) {
  let [sum, weight] = [0, 0];
  for (let i = first; i <= last; i += 1) [sum, weight] = [sum + values[i] * weights[i], weight + weights[i]];
  return weight > 0 ? sum / weight : 0;
}

function positionOf({ lat, lon }, first, last) {
  if (!lat || !lon) return null;
  const middle = Math.floor((first + last) / 2);
  const at = [middle, first, last].find((i) => lat[i] !== null && lon[i] !== null);
  return at === undefined ? null : [lon[at], lat[at]];
}

/** The bin at a time, the nearest where there is a gap. */
export function binAt(bins, at_s) {
  const found = bins.findIndex(({ to_s: to }) => to >= at_s);
  if (found < 0) return bins.length - 1;
  const before = bins[found - 1];
  return before && at_s < bins[found].from_s && at_s - before.to_s < bins[found].from_s - at_s ? found - 1 : found;
}

/** The positions of a drive that are known, [lon, lat]. */
export function positionsOf({ lat, lon }) {
  if (!lat || !lon) return [];
  return lat.flatMap((one, i) => (one === null || lon[i] === null ? [] : [[lon[i], one]]));
}
