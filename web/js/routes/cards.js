/** The alternatives side by side, one of which is looked at. */

import { el, fill } from "../dom.js";
import { durationText, energyText, percentText, spanText } from "../units.js";
import { consumptionOf, NAMES, signed, slugOf, totalSeconds, twinsOf } from "./compare.js";

/** Cards in a group of radio buttons. choose(name) is called where another one is chosen. */
export function createCards(choose) {
  const element = el("fieldset", { class: "route-cards" });
  let inputs = [];

  /** Show an answer; where a card had the focus, it keeps it. */
  function show(answer, units) {
    const focused = element.contains(document.activeElement) ? document.activeElement.value : null;
    const twins = twinsOf(answer.routes);
    const cards = answer.routes.map((route, i) => card(route, answer.routes[0], twins[i], units));
    inputs = cards.map(({ input }) => input);
    fill(element, el("legend", { class: "unseen" }, "Route to look at"), cards.map(({ label }) => label));
    if (focused) inputs.find(({ value }) => value === focused)?.focus();
  }

  function card(route, eco, twin, units) {
    const facts = factsOf(route, eco, twin, units);
    const name = NAMES[route.name] ?? route.name;
    const input = el("input", { type: "radio", name: "route-looked-at", value: route.name, class: "unseen", "aria-label": `${name}: ${facts.map(({ text, spoken }) => spoken ?? text).join(", ")}`, on: { change: () => choose(route.name) } });
    const label = el(
      "label",
      { class: `route-card of-${slugOf(route.name)}${route.charging ? " plan-card" : ""}${route.feasible ? "" : " infeasible"}` },
      input,
      el("span", { class: "route-name" }, name),
      facts.map(({ text, look, spoken }) => el("span", { class: look, title: spoken }, text)),
    );
    return { input, label };
  }

  /** Mark the one that is looked at. */
  function select(name) {
    for (const input of inputs) input.checked = input.value === name;
  }

  const focus = () => inputs.find(({ checked }) => checked)?.focus();

  return { element, show, select, focus };
}

/** What a card says: text, look, and how it is spoken where the text alone does not say it. */
function factsOf(route, eco, twin, units) {
  const consumption = consumptionOf(route);
  const { uncertainty } = route;
  const span = uncertainty && spanText(uncertainty.soc_end_p10, uncertainty.soc_end_p90);
  const kept = uncertainty && percentText(uncertainty.probability_above_reserve);
  const compared = route !== eco && !twin;
  if (route.charging) return planFacts(route, eco, twin, units);
  return [
    { text: energyText(route.battery_kwh), look: "card-main card-energy" },
    { text: durationText(route.duration_s), look: "card-main card-time" },
    { text: percentText(route.soc_end), look: `card-main card-charge${route.feasible ? "" : " missing"}`, spoken: `${percentText(route.soc_end)} on arrival` },
    consumption !== null && { text: units.consumptionText(consumption), look: "card-more card-energy" },
    { text: units.lengthText(route.distance_m), look: "card-more card-time" },
    route.feasible
      ? { text: uncertainty ? span : "on arrival", look: "card-more card-charge", spoken: uncertainty && `${span} on arrival with 80 % probability` }
      : { text: "out of reach", look: "card-more card-charge missing" },
    twin && { text: `the same roads as ${NAMES[twin] ?? twin}`, look: "card-twin" },
    compared && { text: signed(route.battery_kwh - eco.battery_kwh, energyText), look: "card-last card-energy", spoken: `${signed(route.battery_kwh - eco.battery_kwh, energyText)} against ${NAMES[eco.name] ?? eco.name}` },
    compared && { text: signed(totalSeconds(route) - totalSeconds(eco), durationText), look: "card-last card-time" },
    uncertainty && { text: `${kept} sure`, look: "card-last card-charge", spoken: `${kept} probability of keeping the reserve` },
  ].filter((fact) => fact && fact.text);
}

/** The same of a plan: the time with its stops first. */
function planFacts(route, best, twin, units) {
  const { stops, totals, goal } = route.charging;
  const later = totalSeconds(route) - totalSeconds(best);
  const charging = totals.charging_s + totals.overhead_s;
  return [
    { text: durationText(totals.total_s), look: "card-main card-energy" },
    { text: stops.length === 1 ? "1 stop" : `${stops.length} stops`, look: "card-main card-time" },
    { text: percentText(goal.arrive_soc), look: "card-main card-charge", spoken: `${percentText(goal.arrive_soc)} on arrival` },
    { text: units.lengthText(route.distance_m), look: "card-more card-energy" },
    { text: stops.length ? `${durationText(charging)} there` : energyText(route.battery_kwh), look: "card-more card-time", spoken: stops.length ? `${durationText(charging)} at stops` : undefined },
    { text: goal.arrive_soc_p10 === null ? "on arrival" : spanText(goal.arrive_soc_p10, goal.arrive_soc_p90), look: "card-more card-charge" },
    twin && { text: `the same as ${NAMES[twin] ?? twin}`, look: "card-twin" },
    route !== best && !twin && { text: signed(later, durationText), look: "card-last card-energy", spoken: `${signed(later, durationText)} against ${NAMES[best.name] ?? best.name}` },
    totals.price !== null && !twin && { text: `${totals.price.toFixed(2)} ${totals.currency}`, look: "card-last card-time" },
    goal.probability_kept !== null && { text: `${percentText(goal.probability_kept)} sure`, look: "card-last card-charge" },
  ].filter((fact) => fact && fact.text);
}
