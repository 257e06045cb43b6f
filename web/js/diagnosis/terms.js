/** Words for what a diagnosis says: verdicts, families of causes, axes, effects and parameters. */

import { number } from "../units.js";

/** What each verdict is called and means, and how it is coloured. */
export const VERDICTS = {
  too_few_trips: {
    title: "Too few drives to name a cause", tone: "plain",
    meaning: "A cause is named only where it shows on drive after drive. Add recordings of the same vehicle and try again.",
  },
  nothing_missing: {
    title: "Nothing is missing", tone: "good",
    meaning: "The vehicle takes what the model says that it should. What is left over looks like chance.",
  },
  parameter_error: {
    title: "The vehicle's numbers are off", tone: "warn",
    meaning: "The model has all the physics that these drives need, but with other numbers than the vehicle's file has.",
  },
  left_out_physics: {
    title: "The model leaves something out", tone: "warn",
    meaning: "These drives take energy for something that the model has no term for. Below is what it is, how much it takes and how sure that is.",
  },
  cannot_tell: {
    title: "Several causes look alike on these drives", tone: "warn",
    meaning: "Something is left out, but two or more causes would look the same on these drives. Each of them names the drive that would tell them apart.",
  },
  unexplained: {
    title: "Something happens that no known effect explains", tone: "bad",
    meaning: "The difference between measured and modelled has a pattern that is no chance, but no effect that is known here makes such a pattern.",
  },
};

/** Families of causes, in the order in which bars stack them. */
export const FAMILIES = {
  rolling: "Rolling resistance",
  aerodynamic: "Air drag",
  grade: "Slopes",
  mass: "Load and inertia",
  drivetrain: "Drivetrain losses",
  recuperation: "Recuperation losses",
  auxiliary: "Auxiliaries",
  thermal: "Heating and cooling",
  battery: "Battery losses",
  wind: "Wind",
  profile: "Way of driving",
  unexplained: "Unexplained",
};

const PARAMETERS = {
  mass_kg: "mass",
  usable_capacity_wh: "usable capacity",
  residual_sd_frac: "what trips scatter by",
  road_load_a_n: "rolling resistance (A)",
  road_load_b_n_per_mps: "road load that grows with speed (B)",
  road_load_c_n_per_mps2: "air drag (C)",
  drive_eff: "efficiency of the drive",
  recuperation_eff: "efficiency of recuperation",
  aux_power_w: "power of the auxiliaries",
};

/** Axes: name, unit, and beyond which bounds a range is open. */
const AXES = {
  ambient_c: ["air temperature", "°C", -50, 55],
  since_start_min: ["time since the start", "min", null, 1440],
  speed_kmh: ["speed", "km/h", null, 200],
  simulated_power_kw: ["modelled power", "kW", -200, 200],
  grade_percent: ["grade", "%", -30, 30],
  soc_percent: ["state of charge", "%", null, 100],
  soc: ["state of charge", "%", null, 100],
};

const UNIT_ENDING = /((_(w|n|kg))?_per_[a-z0-9_]+|_(km|m|s|min|h|kmh|mps|kw|w|kwh|c|k|deg|rad|frac|kg|n|pa))$/;
const spoken = (name) => name.replace(UNIT_ENDING, "").replaceAll("_", " ");

export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
export const uncapped = (text) => text.charAt(0).toLowerCase() + text.slice(1);
export const familyName = (family) => FAMILIES[family] ?? capital(spoken(family));
export const effectName = (effect) => capital(spoken(effect));
export const parameterName = (parameter) => PARAMETERS[parameter] ?? spoken(parameter);
export const axisName = (axis) => AXES[axis]?.[0] ?? spoken(axis);
export const counted = (count, noun, plural = `${noun}s`) => `${number(count)} ${count === 1 ? noun : plural}`;

/** Several texts as a sentence lists them. */
export function listed(texts, word = "and") {
  return texts.length < 2 ? texts.join("") : `${texts.slice(0, -1).join(", ")} ${word} ${texts.at(-1)}`;
}

const withUnit = (text, unit) => (unit && unit !== "1" && unit !== "-" ? `${text} ${unit}` : text);
const bound = (value) => number(value, Math.abs(value) < 10 && !Number.isInteger(value) ? 1 : 0);

/** Where on an axis something lies, in words: "air temperature below −5 °C". */
export function rangeText(axis, [low, high], unit = AXES[axis]?.[1] ?? "") {
  if (axis === "standstill") return low > 0 ? "while standing" : "while driving";
  const [name, , least, most] = [axisName(axis), ...(AXES[axis] ?? []).slice(1)];
  const open = [low === null || (least !== null && low <= least), high === null || (most !== null && high >= most)];
  if (open[0] && open[1]) return `${name}: everywhere`;
  if (open[0]) return `${name} below ${withUnit(bound(high), unit)}`;
  if (open[1]) return `${name} above ${withUnit(bound(low), unit)}`;
  return `${name} ${bound(low)} to ${withUnit(bound(high), unit)}`;
}

const INTERVAL_DIGITS = 2;
const VALUE_DIGITS = 3;
const MOST_DIGITS = 6;

/** Digits after the point that an interval's half width carries, or three digits of a value without one; may be negative. */
function digitsOf(value, interval) {
  const half = interval ? Math.abs(interval[1] - interval[0]) / 2 : 0;
  if (half > 0) return INTERVAL_DIGITS - 1 - Math.floor(Math.log10(half));
  return value ? VALUE_DIGITS - 1 - Math.floor(Math.log10(Math.abs(value))) : 0;
}

function rounded(value, digits) {
  if (digits >= 0) return number(value, Math.min(digits, MOST_DIGITS));
  const step = 10 ** -digits;
  return number(step * Math.round(value / step));
}

/** A value as its interval carries it, with its unit. */
export function valueText(value, unit, interval = null, signed = false) {
  if (value === null || value === undefined) return "–";
  const text = rounded(value, digitsOf(value, interval));
  return withUnit(signed && value > 0 ? `+${text}` : text, unit);
}

/** An interval of 95 % in words, "" where there is none. */
export function intervalText(value, interval) {
  if (!interval || interval.includes(null) || interval[0] === interval[1]) return "";
  const digits = digitsOf(value, interval);
  return `${rounded(interval[0], digits)} to ${rounded(interval[1], digits)}`;
}

/** A value with its interval, as a sentence has it. */
export function quantityText(value, unit, interval) {
  const between = intervalText(value, interval);
  return valueText(value, unit, interval) + (between && ` (95 %: ${between})`);
}

/** An interval of shares in per cent. */
export const percents = (interval) => interval && interval.map((share) => (share === null ? null : 100 * share));

/** A parameter that is off, in a sentence. */
export function parameterSentence(one) {
  const told = valueText(one.nameplate, one.unit, one.ci95);
  return `The drives speak for another ${parameterName(one.parameter)}: ${quantityText(one.fitted, one.unit, one.ci95)}. The vehicle's file says ${told}.`;
}

/** Structure that nothing explains, in a sentence. */
export function unexplainedSentence(one) {
  const more = one.mean_w >= 0 ? "more" : "less";
  const interval = one.ci95_w && (one.mean_w >= 0 ? one.ci95_w : [-one.ci95_w[1], -one.ci95_w[0]]);
  const where = one.axis === "trip" ? `On ${listed(one.trips)}` : `At ${rangeText(one.axis, one.interval, one.unit)}`;
  return `${where}, the vehicle takes ${quantityText(Math.abs(one.mean_w), "W", interval)} ${more} than on the rest of its drives, ${valueText(Math.abs(one.energy_kwh), "kWh")} in all.`;
}

/** What a diagnosis says first, in a sentence. */
export function verdictSentence(result) {
  const [finding] = result.findings.toSorted((a, b) => Math.abs(b.energy_kwh) - Math.abs(a.energy_kwh));
  if (["left_out_physics", "cannot_tell"].includes(result.verdict) && finding) return finding.text;
  if (result.verdict === "parameter_error" && result.parameter_errors.length) return parameterSentence(result.parameter_errors[0]);
  if (result.verdict === "unexplained" && result.unexplained.length) return unexplainedSentence(result.unexplained[0]);
  return result.text;
}
