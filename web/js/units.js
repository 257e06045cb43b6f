/** Numbers as texts, in kilometres or miles. */

const KM_PER_MI = 1.609344;
const shown = new Map();

function format(value, digits) {
  if (!shown.has(digits)) {
    shown.set(digits, new Intl.NumberFormat("en", { minimumFractionDigits: digits, maximumFractionDigits: digits }));
  }
  const text = shown.get(digits).format(value);
  return (Number(text.replaceAll(",", "")) === 0 ? text.replace(/^-/, "") : text).replace("-", "−");
}

/** A plain number with that many digits after the point. */
export const number = (value, digits = 0) => format(value, digits);

/** Formats for one choice of units, "km" or "mi". */
export function unitsOf(choice) {
  const miles = choice === "mi";
  const perUnit = miles ? 1000 * KM_PER_MI : 1000;
  return {
    choice,
    lengthUnit: miles ? "mi" : "km",
    speedUnit: miles ? "mph" : "km/h",
    consumptionUnit: miles ? "Wh/mi" : "kWh/100 km",
    areaUnit: miles ? "mi²" : "km²",
    heightUnit: miles ? "ft" : "m",
    length: (m) => m / perUnit,
    speed: (kmh) => (miles ? kmh / KM_PER_MI : kmh),
    speedToKmh: (value) => (miles ? value * KM_PER_MI : value),
    height: (m) => (miles ? m / 0.3048 : m),
    consumption: (kwhPer100km) => (miles ? kwhPer100km * 10 * KM_PER_MI : kwhPer100km),
    lengthText(m) {
      const value = m / perUnit;
      if (!miles && Math.abs(m) < 1000) return `${format(m, 0)} m`;
      return `${format(value, Math.abs(value) < 100 ? 1 : 0)} ${miles ? "mi" : "km"}`;
    },
    speedText: (kmh) => `${format(miles ? kmh / KM_PER_MI : kmh, 0)} ${miles ? "mph" : "km/h"}`,
    heightText: (m) => `${format(miles ? m / 0.3048 : m, 0)} ${miles ? "ft" : "m"}`,
    areaText: (km2) => {
      const value = miles ? km2 / KM_PER_MI ** 2 : km2;
      return `${format(value, value < 0.1 ? 3 : value < 10 ? 1 : 0)} ${miles ? "mi²" : "km²"}`;
    },
    consumptionText: (kwhPer100km) =>
      miles ? `${format(kwhPer100km * 10 * KM_PER_MI, 0)} Wh/mi` : `${format(kwhPer100km, 1)} kWh/100 km`,
  };
}

/** Energy in kWh. */
export const energyText = (kwh) => `${format(kwh, Math.abs(kwh) < 10 ? 2 : 1)} kWh`;

/** A share 0..1 in per cent. */
export const percentText = (share, digits = 0) => `${format(100 * share, digits)} %`;

/** A span of two shares in per cent: "39–47 %". */
export const spanText = (low, high) => `${format(100 * low, 0)}–${percentText(high)}`;

/** A time in hours and minutes. */
export function durationText(seconds) {
  if (seconds < 60) return `${Math.round(seconds)} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, "0")} min`;
}

/** Eight directions from north on, clockwise. */
export const DIRECTIONS = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];

/** The direction of a bearing, clockwise from north. */
export const directionText = (degrees) => DIRECTIONS[Math.round(degrees / 45) % DIRECTIONS.length];

/** A place as it is typed: latitude, longitude. */
export const placeText = (place) => (place ? `${place.lat.toFixed(5)}, ${place.lon.toFixed(5)}` : "");

/**
 * A place out of typed text: "lat, lon" with points as decimal signs, also with a semicolon or blanks between.
 * @returns {{place: {lat: number, lon: number}|null, error: string}} place null and no error where the text is empty
 */
export function placeFromText(text) {
  const trimmed = text.trim();
  if (trimmed === "") return { place: null, error: "" };
  const parts = trimmed.match(/^([+-]?\d{1,3}(?:\.\d+)?)°?\s*(?:[,;]\s*|\s+)([+-]?\d{1,3}(?:\.\d+)?)°?$/);
  if (!parts) return { place: null, error: "Write latitude and longitude, such as 43.872, -36.433" };
  const [lat, lon] = [Number(parts[1]), Number(parts[2])];
  if (Math.abs(lat) > 90) return { place: null, error: `The latitude is ${lat}, allowed: −90 to 90` };
  if (Math.abs(lon) > 180) return { place: null, error: `The longitude is ${lon}, allowed: −180 to 180` };
  return { place: { lat, lon }, error: "" };
}
