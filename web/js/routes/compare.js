/** Routes beside each other: which are the same, what they take more or less than eco, and all of it in a sentence. */

import { PLANS } from "../journey/journey.js";
import { durationText, energyText, percentText } from "../units.js";

export const NAMES = { eco: "Eco", balanced: "Balanced", fastest: "Fastest", ...PLANS };

/** The name of a route as part of that of a style: of-eco, --eco. */
export const slugOf = (name) => name.replaceAll(" ", "-");

/** Whether two routes drive the same links. */
const isSameWay = (a, b) => a.links.length === b.links.length && a.links.every(({ id }, i) => id === b.links[i].id);

const stopsText = ({ charging }) => JSON.stringify((charging?.stops ?? []).map(({ station, depart_soc: soc }) => [station?.id, soc]));

/** Whether two routes drive the same links, and charge as much at the same stops. */
export const isSame = (a, b) => isSameWay(a, b) && stopsText(a) === stopsText(b);

/** Time of a route with its charging stops [s]. */
export const totalSeconds = (route) => route.charging?.totals.total_s ?? route.duration_s;

/** For each route the name of the first one that it is the same as, null where it is the first of its kind. */
export const twinsOf = (routes) => routes.map((route, i) => routes.slice(0, i).find((earlier) => isSame(earlier, route))?.name ?? null);

/** The route that is looked at: the chosen one, or the first where the answer has none of that name. */
export const chosenOf = (answer, name) => answer.routes.find((route) => route.name === name) ?? answer.routes[0];

/** Consumption [kWh/100 km], null where nothing is driven. */
export const consumptionOf = (route) => (route.distance_m > 0 ? (route.battery_kwh * 1e5) / route.distance_m : null);

/** A difference with its sign. */
export function signed(value, text) {
  const bare = text(Math.abs(value));
  return `${value < 0 ? "−" : "+"}${bare}`;
}

/** The whole answer in one sentence for those who listen to it. */
export function answerText(answer, units) {
  const [first] = answer.routes;
  if (answer.no_plan) return `There is no plan with charging stops: ${answer.no_plan.reason}.`;
  if (answer.routes.every(({ feasible }) => !feasible)) {
    return `The goal is out of reach with ${percentText(first.soc_start)}: ${energyText(first.deficit_kwh)} are missing.`;
  }
  const twins = twinsOf(answer.routes);
  return answer.routes
    .map((route, i) => {
      if (twins[i]) return `${NAMES[route.name]}: the same as ${NAMES[twins[i]]}.`;
      const arrival = route.feasible ? `arrives with ${percentText(route.soc_end)}` : "out of reach";
      return `${NAMES[route.name]}: ${energyText(route.battery_kwh)}, ${durationText(totalSeconds(route))}, ${units.lengthText(route.distance_m)}, ${stopsSaid(route)}${arrival}.`;
    })
    .join(" ");
}

/** How often a route is charged on, empty where that was not asked for. */
const stopsSaid = ({ charging }) => (charging ? `${charging.stops.length} charging ${charging.stops.length === 1 ? "stop" : "stops"}, ` : "");
