/** An answer as features of the map's overlays. */

import { BEYOND, chargeScale, consumptionScale, partsOf, runsOf } from "./colours.js";
import { consumptionOf, isSame } from "./compare.js";
import { lineBetween, stretchLine } from "./profile.js";

const line = (coordinates, properties) => ({ type: "Feature", geometry: { type: "LineString", coordinates }, properties });

/** The scale of a colouring over all routes of an answer; null for "plain". */
export function scaleFor(colouring, answer, chosen, theme) {
  if (colouring === "plain") return null;
  if (colouring === "consumption") return consumptionScale(consumptionOf(chosen) ?? 0, theme);
  const reserve = answer.request.reserve_soc; // below it, no colour of the scale is drawn
  const charges = answer.routes.flatMap(({ soc_start: start, soc_end: end, soc_min: least, charging: plan }) => [start, end, least, ...(plan?.stops ?? []).map(({ depart_soc: filled }) => filled)]);
  return chargeScale(charges.map((charge) => Math.max(charge, reserve)), theme);
}

/** The route that is looked at: pieces of one colour. reach_m: how far the charge suffices, null for all of it. */
export function routeFeatures(profile, { colouring, scale, plain, reach, theme }) {
  const parts = profile.links.length ? partsOf(profile, colouring, scale, plain) : [];
  return runsOf(parts, reach, BEYOND[theme]).map(({ from_m: from, to_m: to, colour, first, last, beyond }) =>
    line(lineBetween(profile, from, to), { colour, first, last, beyond }),
  );
}

/** The other routes, each once. colourOf(name): their colours. */
export function otherFeatures(routes, chosen, colourOf) {
  const others = routes.filter((route, i) => !isSame(route, chosen) && !routes.slice(0, i).some((earlier) => isSame(earlier, route)));
  return others.map((route) => line(route.geometry.coordinates, { name: route.name, colour: colourOf(route.name) }));
}

/** Hot stretches of the route that is looked at. */
export const stretchFeatures = (profile, active) =>
  profile.route.hot_links.map((hot, index) => line(stretchLine(profile, hot), { index, active: index === active }));
