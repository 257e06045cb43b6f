/** Hot stretches: where a route takes the most energy for its length, and why. */

import { el } from "../dom.js";
import { energyText, number } from "../units.js";

const REASONS = {
  climb: (hot, units) => (hot.rise_m >= 1 ? `climbs ${units.heightText(hot.rise_m)}` : "climbs"),
  speed: (hot, units) => `fast, ${units.speedText(hot.speed_kmh)}`,
  stops: (hot) => (hot.stop_count >= 0.1 ? `stops, ${number(hot.stop_count, 1)} expected` : "speeding up and braking"),
  auxiliary: (hot, units) => `slow, ${units.speedText(hot.speed_kmh)}: the on-board supply runs all the time`,
  rolling: () => "rolling resistance",
  conditions: () => "weather, road or load",
};

/** Why a stretch takes much, in words. */
export const reasonText = (hot, units) => REASONS[hot.reason]?.(hot, units) ?? hot.reason;

/** The roads of a stretch, the first two by name. */
export function roadsText(hot) {
  const names = hot.names.filter(Boolean);
  if (!names.length) return "Unnamed road";
  return names.length > 2 ? `${names[0]}, ${names[1]} and ${names.length - 2} more` : names.join(", ");
}

/** Where along the route a stretch is. */
export const whereText = (hot, units) => `${number(units.length(hot.from_m), 1)}–${number(units.length(hot.to_m), 1)} ${units.lengthUnit}`;

/** The list as buttons; the active one is pressed. choose(index | null) is called for each press. */
export function stretchList(route, active, units, choose) {
  return el(
    "ol",
    { class: "stretches" },
    route.hot_links.map((hot, i) =>
      el(
        "li",
        {},
        el(
          "button",
          { type: "button", class: "stretch", "aria-pressed": String(i === active), dataset: { stretch: i }, on: { click: () => choose(i === active ? null : i) } },
          el("span", { class: "stretch-number num", "aria-hidden": "true" }, String(i + 1)),
          el("span", { class: "stretch-road" }, roadsText(hot)),
          el("span", { class: "stretch-energy num" }, energyText(hot.energy_kwh)),
          el("span", { class: "stretch-facts small dim" }, reasonText(hot, units), hot.times_mean !== null && ` · ${number(hot.times_mean, 1)} × mean`),
          el("span", { class: "stretch-where small dim num" }, whereText(hot, units)),
        ),
      ),
    ),
  );
}
