/** What is said of a route that the charge does not suffice for, and what would make it work. */

import { el } from "../dom.js";
import { energyText, percentText } from "../units.js";
import { NAMES } from "./compare.js";

/** Charge at departure in whole per cents that suffices, null where a full battery does not. */
export function enoughCharge({ remedy }) {
  const percent = Math.ceil(100 * remedy.soc_start_needed - 1e-6);
  return percent <= 100 ? percent / 100 : null;
}

/** The largest reserve in whole per cents that the charge suffices for, null where there is none. */
export function keptReserve({ soc_min: least }) {
  const percent = Math.floor(100 * least + 1e-6);
  return percent >= 0 ? percent / 100 : null;
}

const button = (text, click, primary = false) => el("button", { type: "button", class: primary ? "button primary" : "button", on: { click } }, text);

/**
 * The notice. reach_m: how far it gets. reserve: what must be left. others: routes of the answer that do reach the
 * goal. act: {setCharge(soc), setReserve(reserve), choose(name)}.
 */
export function outOfReach(route, reach, reserve, others, units, act) {
  const left = route.distance_m - reach;
  const charge = enoughCharge(route);
  const least = keptReserve(route);
  return el(
    "div",
    { class: "notice bad out-of-reach" },
    el("h3", {}, `Out of reach with ${percentText(route.soc_start)}`),
    el("p", {}, `The charge is down to ${reserve > 0 ? `the reserve of ${percentText(reserve)}` : "nothing"} after ${units.lengthText(reach)}, ${units.lengthText(left)} before the goal. ${energyText(route.deficit_kwh)} are missing.`),
    charge === null && el("p", {}, `A full battery does not suffice: at least ${energyText(route.remedy.charge_needed_kwh)} must be charged before or on the way.`),
    el(
      "div",
      { class: "row wrap" },
      others.map(({ name }) => button(`${NAMES[name] ?? name} gets there`, () => act.choose(name), true)),
      charge !== null && button(`Set charge to ${percentText(charge)}`, () => act.setCharge(charge), others.length === 0),
      least !== null && least < reserve && button(`Set reserve to ${percentText(least)}`, () => act.setReserve(least)),
    ),
  );
}
