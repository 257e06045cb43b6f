/** What the bands of an area are of: which values they have, unless others are typed, and how these are read. */

export const BY = ["charge", "energy", "time", "distance"];
export const OUTLINES = ["roads", "filled"];
export const MAX_BANDS = 8;

/** Names of the values in addresses, which say their unit: charge left [%], energy [kWh], time [min], distance [km]. */
export const VALUE_KEYS = { charge: "left", energy: "kwh", time: "minutes", distance: "km" };

const KM_PER_MI = 1.609344;
const ALLOWED = [0.01, 10_000]; // of energies, times and distances
const STEP_MIN = 15;
const STEP_KM = { km: 20, mi: 10 * KM_PER_MI };
const STEP_KWH = 10; // where it is not known what the battery holds
const ROUND = [1, 1.5, 2, 2.5, 3, 4, 5, 6, 8];
const LOOSE = 1 + 1e-9; // which the rounding of charges may make

const tidy = (value) => Number(value.toFixed(6));

/** A number as it is typed and shown: with few digits after the point, and none where it is whole. */
export const plainNumber = (value, digits = 2) => String(Number(value.toFixed(digits)));

/** Whether areas of these bands know the way back, the round trip and how sure they are. */
export const knowsCharge = ({ by }) => by === "charge" || by === "energy";

/** What may be taken down to the reserve [kWh], null where it is not known what the battery holds. */
const mostKwh = ({ soc, reserve }, capacityKwh) => (capacityKwh === null ? null : Math.max(soc - reserve, 0) * capacityKwh);

/** The largest round number that is not above a value. */
function roundBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value * LOOSE));
  return power * (ROUND.findLast((digits) => digits * power <= value * LOOSE) ?? 1);
}

/** The values that bands have where none are typed, ascending, in the units of VALUE_KEYS; none where there is nothing to take. */
export function automaticValues(journey, capacityKwh = null) {
  const { by, bands, soc, reserve, units } = journey;
  if (by === "charge") {
    const [low, high] = [100 * Math.min(reserve, soc), 100 * soc];
    const whole = Array.from({ length: bands }, (_, i) => (i === 0 ? low : Math.round(low + (i * (high - low)) / bands)));
    return [...new Set(whole.map(tidy))].filter((value) => value >= tidy(low) && value <= tidy(high));
  }
  const most = mostKwh(journey, capacityKwh);
  if (by === "energy" && most === 0) return [];
  const step = { energy: most === null ? STEP_KWH : roundBelow(most / bands), time: STEP_MIN, distance: STEP_KM[units] }[by];
  return Array.from({ length: bands }, (_, i) => tidy(step * (i + 1)));
}

/**
 * The values that are asked for, and those of the typed ones that can't be: charges below the reserve or above that at
 * departure, energies that the battery does not hold; the reserve is always the outermost band.
 * @returns {{values: number[], beyond: number[]}}
 */
export function bandValues(journey, capacityKwh = null) {
  const { by, soc, reserve } = journey;
  const own = journey.values[by];
  if (!own) return { values: automaticValues(journey, capacityKwh), beyond: [] };
  const [least, most] = { charge: [100 * Math.min(reserve, soc), 100 * soc], energy: [0, mostKwh(journey, capacityKwh) ?? Infinity] }[by] ?? [0, Infinity];
  const fits = (value) => value * LOOSE >= least && value <= most * LOOSE;
  const values = own.filter(fits);
  return { values: by === "charge" ? [...new Set([tidy(least), ...values])] : values, beyond: own.filter((value) => !fits(value)) };
}

const wrong = (error) => ({ values: null, error });

/**
 * Values out of typed text: numbers with commas, semicolons or blanks between, ascending and each only once. With
 * semicolons between, a comma is a decimal sign.
 * @param {string} text
 * @param {string} by one of BY
 * @param {{unit?: string, factor?: number}} shown the unit that may stand behind a number, and what makes it that of VALUE_KEYS
 * @returns {{values: number[]|null, error: string}} values null and no error where the text is empty
 */
export function valuesFromText(text, by, { unit = "", factor = 1 } = {}) {
  const bare = unit ? text.toLowerCase().replaceAll(unit.toLowerCase(), " ") : text;
  const parts = (bare.includes(";") ? bare.replaceAll(",", ".").split(/[\s;]+/) : bare.split(/[\s,]+/)).filter(Boolean);
  if (!parts.length) return { values: null, error: "" };
  const unreadable = parts.find((part) => !/^-?(\d{1,9}(\.\d*)?|\.\d+)$/.test(part));
  if (unreadable !== undefined) return wrong(`“${unreadable.slice(0, 20)}” is no number. Write numbers with commas between, such as 10, 20, 30`);
  const [least, most] = by === "charge" ? [0, 100] : ALLOWED;
  const outside = parts.map(Number).find((value) => value < least || value > most);
  if (outside !== undefined) return wrong(`A value is ${outside}, allowed: ${least} to ${most.toLocaleString("en")}`);
  const values = [...new Set(parts.map((part) => tidy(Number(part) * factor)))].toSorted((a, b) => a - b);
  if (values.length > MAX_BANDS) return wrong(`There are ${values.length} values, allowed: at most ${MAX_BANDS}`);
  return { values, error: "" };
}
