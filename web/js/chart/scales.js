/** Scales, ticks and path texts of charts. */

const NICE = [1, 2, 2.5, 5, 10];

/** The smallest of 1, 2, 2.5, 5 times a power of ten that is not below a value above 0. */
export function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return NICE.find((one) => one * power >= least * (1 - 1e-9)) * power;
}

/** A straight scale from a domain to pixels. */
export function linear([from, to], [start, end]) {
  const stretch = to > from ? (end - start) / (to - from) : 0;
  const scale = (value) => start + (Math.min(Math.max(value, from), to) - from) * stretch;
  scale.invert = (pixel) => (stretch === 0 ? from : Math.min(Math.max(from + (pixel - start) / stretch, from), to));
  return scale;
}

/** Round values inside of a domain, about that many. */
export function ticksOf([from, to], count) {
  if (!(to > from)) return [from];
  const step = niceStep((to - from) / count);
  const ticks = [];
  for (let k = Math.ceil(from / step - 1e-9); k * step <= to + 1e-9 * step; k += 1) ticks.push(Number((k * step).toPrecision(12)));
  return ticks;
}

/** The digits after the point that ticks need. */
export const digitsOf = (ticks) => Math.max(0, ...ticks.map((tick) => (String(tick).split(".")[1] ?? "").length));

/** A domain widened to round values, at least `least` wide. */
export function niceDomain(values, { least = 1, count = 3, include = [] } = {}) {
  const all = [...values, ...include];
  let [from, to] = [Infinity, -Infinity];
  for (const value of all) [from, to] = [Math.min(from, value), Math.max(to, value)];
  if (to - from < least) [from, to] = [(from + to - least) / 2, (from + to + least) / 2];
  const step = niceStep((to - from) / count) / 2;
  return [Math.floor(from / step + 1e-9) * step, Math.ceil(to / step - 1e-9) * step];
}

/** The value below which a share of all values lies. */
export function quantile(values, share) {
  const sorted = [...values].toSorted((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.max(0, Math.round(share * (sorted.length - 1))))];
}

const pixel = (value) => Number(value.toFixed(1));
const points = (xs, ys) => Array.from(xs, (x, i) => `${pixel(x)},${pixel(ys[i])}`);

/** A line through points. */
export const linePath = (xs, ys) => `M${points(xs, ys).join("L")}`;

/** The area between two lines over the same xs. */
export const bandPath = (xs, upper, lower) => `M${[...points(xs, upper), ...points(xs, lower).toReversed()].join("L")}Z`;

/** The area between a line and a level. */
export const areaPath = (xs, ys, level) => bandPath(xs, ys, Array.from(xs, () => level));

/** Steps {from, to, y} as the points of a line: [xs, ys]. */
export const stepsOf = (steps) => [steps.flatMap(({ from, to }) => [from, to]), steps.flatMap(({ y }) => [y, y])];
