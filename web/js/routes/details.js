/** A route's legs from place to place, and its figures in a table. */

import { el } from "../dom.js";
import { durationText, energyText, number, percentText } from "../units.js";

/** Names of the places that legs lead between. */
export const placeNames = (legs) => ["Start", ...legs.slice(1).map((_, i) => `Via ${i + 1}`), "Goal"];

const table = (caption, heads, rows) =>
  el(
    "table",
    { class: "small" },
    el("caption", {}, caption),
    el("thead", {}, el("tr", {}, heads.map((text, i) => el("th", { scope: "col", class: i ? "num" : null }, text)))),
    el("tbody", {}, rows.map(([first, ...others]) => el("tr", {}, el("th", { scope: "row" }, first), others.map((text) => el("td", { class: "num" }, text))))),
  );

/** Legs over via points; null where there are none. */
export function legsTable({ legs }, units) {
  if (legs.length < 2) return null;
  const names = placeNames(legs);
  return table(
    "From place to place",
    ["To", "Distance", "Time", "Energy", "Charge"],
    legs.map((leg, i) => [names[i + 1], units.lengthText(leg.to_m - leg.from_m), durationText(leg.duration_s), energyText(leg.battery_kwh), percentText(leg.soc_end)]),
  );
}

/** How long the search of a route took [s], of plans that of all of them. */
const searchSeconds = (route, { routes, stats, planning }) => planning?.seconds ?? stats[routes.indexOf(route)].seconds;

/** All figures of a route but its links. */
export function figuresTables(route, answer, units) {
  const { uncertainty, links } = route;
  const { start, goal } = answer.snapped;
  const figures = [
    ["Distance", units.lengthText(route.distance_m)],
    ["Time of driving, with standing still", durationText(route.duration_s)],
    answer.terrain.terrain !== "absent" && ["Climb", units.heightText(route.climb_m)],
    answer.terrain.terrain !== "absent" && ["Descent", units.heightText(route.descent_m)],
    ["Charge at departure", percentText(route.soc_start, 1)],
    ["Charge on arrival", percentText(route.soc_end, 1)],
    ["Least charge on the way", percentText(route.soc_min, 1)],
    route.braked_away_kwh >= 0.005 && ["Not taken by a full battery", energyText(route.braked_away_kwh)],
    uncertainty && ["Energy, P10 to P90", `${number(uncertainty.energy_kwh_p10, 1)} to ${energyText(uncertainty.energy_kwh_p90)}`],
    uncertainty && ["Charge on arrival, P10 to P90", `${number(100 * uncertainty.soc_end_p10, 1)} to ${percentText(uncertainty.soc_end_p90, 1)}`],
    uncertainty && ["Probability of keeping the reserve", percentText(uncertainty.probability_above_reserve)],
    ["Links", number(links.length)],
    ["Start, moved to a road by", units.lengthText(start.distance_m)],
    ["Goal, moved to a road by", units.lengthText(goal.distance_m)],
    route.weights && ["Weights of kWh, hour, km", [route.weights.energy, route.weights.time, route.weights.distance].join(", ")],
    ["Search", `${number(1000 * searchSeconds(route, answer))} ms`],
  ];
  return [
    table("Figures", ["What", "Value"], figures.filter(Boolean)),
    route.hot_links.length > 0 &&
      table(
        "Hot stretches",
        ["No.", "Share", units.consumptionUnit, units.speedUnit, "Rise", "Stops"],
        route.hot_links.map((hot, i) => [
          i + 1,
          hot.energy_share === null ? "–" : percentText(hot.energy_share, 1),
          number(units.consumption(hot.kwh_per_100km), units.choice === "mi" ? 0 : 1),
          number(units.speed(hot.speed_kmh)),
          units.heightText(hot.rise_m),
          number(hot.stop_count, 1),
        ]),
      ),
  ];
}
