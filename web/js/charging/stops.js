/** A plan as cards: each drive and each stop with times, charge, power, price, how sure it is, and what else could be done. */

import { el, fill } from "../dom.js";
import { icon } from "../icons.js";
import { sourceText } from "../stations/card.js";
import { moneyText, stationName } from "../stations/words.js";
import { durationText, energyText, number, percentText, spanText } from "../units.js";
import { askedOf, departureOf, eventsOf, plugText, stopName, whenText } from "./plan.js";

const span = (from, to) => [percentText(from), " → ", percentText(to)];

/**
 * The list of a plan. told: {look(stop index, element): show the station, choose(stop index, element): offer others,
 * leave(stop index): plan without it, point(seconds | null): a card is pointed at}. Gives {element, show, …}.
 */
export function createStopList(told) {
  const element = el("div", { class: "stack" });
  let shown = null;

  function show(answer, route, units) {
    shown = route;
    const departure = departureOf(answer);
    const focused = element.contains(document.activeElement) ? document.activeElement.dataset.key : null;
    const { charging } = route;
    const events = eventsOf(route);
    const asked = askedOf(answer);
    fill(
      element,
      totals(route, units),
      el(
        "ol",
        { class: "plan" },
        el("li", { class: "plan-end" }, el("span", { class: "pin start", "aria-hidden": "true" }, "A"), el("b", {}, "Start"), el("span", { class: "num plan-when" }, departure ? `${whenText(departure, 0, departure)}, ` : "", percentText(route.soc_start))),
        events.map((event) => (event.kind === "drive" ? drive(event, route, units, departure, asked) : stop(event, departure, asked, route === answer.routes[0]))),
      ),
      proofText(charging),
      charging.sources.map(({ key }) => sourceText(key, charging.sources)),
    );
    if (focused) element.querySelector(`[data-key="${focused}"]`)?.focus();
  }

  const pointed = (at) => ({
    pointerenter: () => told.point(at),
    pointerleave: () => told.point(null),
    focusin: () => told.point(at),
    focusout: () => told.point(null),
  });

  function drive({ leg, i, place, halts }, route, units, departure, asked) {
    const before = route.charging.stops.findLast((one) => one.leg < i);
    const last = i === route.legs.length - 1;
    const { goal } = route.charging;
    const facts = [units.lengthText(leg.to_m - leg.from_m), durationText(leg.duration_s), energyText(leg.battery_kwh), leg.speed_cap_kmh && `at most ${units.speedText(leg.speed_cap_kmh)}`].filter(Boolean);
    const at = before ? before.depart_s : 0;
    return [
      el("li", { class: "plan-drive small", on: pointed(at + leg.duration_s / 2) }, el("span", { class: "unseen" }, `Drive to ${place}: `), el("span", { class: "num" }, facts.join(" · ")), el("span", { class: "num dim" }, span(leg.soc_start, leg.soc_end))),
      halts.map((halt) => el("li", { class: "plan-drive plan-halt small", on: pointed(halt.arrive_s) }, el("span", {}, `On the way a halt at ${stationName(halt.station)} without charging, from which driving on serves better than passing it`), el("span", { class: "num dim" }, `${whenText(halt.arrive_time, halt.arrive_s, departure)}, ${durationText(halt.overhead_s)}`))),
      last && el(
        "li", { class: "plan-end", on: pointed(goal.arrive_s) },
        el("span", { class: "pin goal", "aria-hidden": "true" }, "B"),
        el("b", {}, "Goal"),
        el("span", { class: "num plan-when" }, whenText(goal.arrive_time, goal.arrive_s, departure), ", ", percentText(goal.arrive_soc)),
        sureText(goal, goal.stay ? null : asked.goal),
        goal.stay && stayText(goal.stay, departure),
      ),
      !last && leg.ends_at === "via" && el("li", { class: "plan-end" }, el("span", { class: "pin via", "aria-hidden": "true" }, place.split(" ")[1]), el("b", {}, place), el("span", { class: "num plan-when" }, percentText(leg.soc_end))),
    ];
  }

  function stop({ stop: one, i }, departure, asked, best) {
    const { station, waiting_s: wait } = one;
    const name = stopName(one);
    const minutes = durationText(one.charging_s);
    const button = (key, text, act, label) => el("button", { type: "button", class: "button", "aria-label": label, dataset: { key: `${key}-${i}` }, on: { click: ({ currentTarget }) => act(i, currentTarget) } }, text);
    return el(
      "li",
      { class: "plan-stop", dataset: { stop: i }, on: pointed((one.arrive_s + one.depart_s) / 2) },
      el(
        "div",
        { class: "plan-stop-head" },
        el("span", { class: "pin stop", "aria-hidden": "true" }, String(i + 1)),
        el("div", { class: "grow" }, el("h3", {}, station ? el("button", { type: "button", class: "link-button", title: "Show the station", dataset: { key: `look-${i}` }, on: { click: ({ currentTarget }) => told.look(i, currentTarget) } }, name) : name), el("div", { class: "small dim" }, [plugText(one), station && stationMore(station, name)].filter(Boolean).join(" · "))),
        one.gatekeeper && el("span", { class: "gatekeeper", title: "Without this station there is no way to the goal" }, "no way without it"),
      ),
      el(
        "dl",
        { class: "plan-facts num" },
        fact("Time", [whenText(one.arrive_time, one.arrive_s, departure), " → ", whenText(one.depart_time, one.depart_s, departure)], `${minutes} charging${one.overhead_s - wait >= 1 ? ` + ${durationText(one.overhead_s - wait)} stop` : ""}`),
        wait >= 1 && fact("Waiting", el("span", { class: "plan-wait small" }, `Closed on arrival, opens ${durationText(wait)} later`)),
        fact("Charge", span(one.arrive_soc, one.depart_soc), `${energyText(one.charged_kwh)}${one.mean_power_kw ? ` at ${number(one.mean_power_kw)} kW` : ""}${one.price === null ? "" : ` for ${moneyText(one.price, one.currency)}`}`),
      ),
      sureText(one, asked.stop),
      one.fallback && fallbackText(one.fallback),
      station && best && one.gatekeeper === null && el("p", { class: "small dim" }, "Whether there is a way without it is not known"),
      station && el("div", { class: "row wrap plan-actions" }, button("other", [icon("swap"), "Another station"], told.choose, `Another station than ${name}`), button("leave", "Not here", told.leave, `Not at ${name}`)),
      el("div", { class: "plan-others", dataset: { others: i } }),
    );
  }

  /** The place under a stop where other stations are offered. */
  const othersOf = (i) => element.querySelector(`[data-others="${i}"]`);
  const openerOf = (i) => element.querySelector(`[data-key="other-${i}"]`);
  /** Where the focus is in what goes away, it stays with the stop. */
  function keepFocus(moved) {
    const i = shown?.charging.stops.findIndex(({ station }) => station && station.id === moved.station?.id) ?? -1;
    if (othersOf(i)?.contains(document.activeElement)) openerOf(i)?.focus();
  }
  const focus = (i) => {
    const card = element.querySelector(`[data-stop="${i}"]`);
    card?.scrollIntoView({ block: "nearest" });
    card?.querySelector("button")?.focus();
  };
  /** Mark the stop that the cursor of the chart is at, null for none. */
  function mark(i) {
    for (const card of element.querySelectorAll("[data-stop]")) card.toggleAttribute("data-looked", Number(card.dataset.stop) === i);
  }

  return { element, show, othersOf, openerOf, keepFocus, focus, mark };
}

const stationMore = ({ operator, network }, name) => [operator, network].find((text) => text && text !== name) ?? "";
const fact = (what, main, more) => el("div", {}, el("dt", { class: "unseen" }, what), el("dd", {}, el("b", {}, main), more && el("span", { class: "small dim" }, more)));

/** How sure a charge on arrival is, null where that is not known; asked: what is to be left, null where it is later. */
function sureText({ arrive_soc_p10: low, arrive_soc_p90: high, probability_kept: kept }, asked) {
  if (low === null || low === undefined) return null;
  return el("p", { class: "small dim num plan-sure" }, `${spanText(low, high)} on arrival`, kept !== null && kept !== undefined && [", ", el("b", {}, sureness(kept)), asked === null ? " sure of what is asked" : ` sure of ≥ ${percentText(asked)}`]);
}

const sureness = (kept) => (kept > 0.9995 ? "> 99.9 %" : percentText(kept, kept > 0.99 ? 1 : 0));

/** What a stay at the goal charges, and until when. */
function stayText({ depart_soc: soc, depart_s: at, depart_time: time, charged_kwh: kwh }, departure) {
  const charged = kwh > 0 ? `charged there to ${percentText(soc)}, ${energyText(kwh)}` : "not charged there";
  return el("p", { class: "small dim num plan-sure" }, `${charged}, until ${whenText(time, at, departure)}`);
}

function fallbackText({ station_name: name, drive_s: drive, arrive_soc: soc, reached, wait_s: wait, open_soc: left }) {
  const there = reached ? `arriving with ${percentText(soc)}` : `not reached: ${percentText(Math.max(0, -soc))} short`;
  const text = wait >= 1 && reached ? `${there}, closed for ${durationText(wait)}: ${left < 0 ? "empty before" : `${percentText(left)} left then`}` : there;
  return el("p", { class: `small num plan-fallback${reached ? "" : " missing"}` }, el("span", { class: "dim" }, "Should it fail: "), `${name || "the next station"}, ${durationText(drive)} farther, ${text}`);
}

/** Sums over the plan. */
function totals(route, units) {
  const { totals: sums, stops, probability_kept: kept } = route.charging;
  const parts = [["Driving", sums.driving_s, "driving"], ["Charging", sums.charging_s, "charging"], ["Stopping", sums.overhead_s - sums.waiting_s, "besides"], ["Waiting", sums.waiting_s, "waiting"]].filter(([, seconds]) => seconds > 0);
  return el(
    "div",
    { class: "plan-totals" },
    el("p", { class: "num" }, el("b", {}, durationText(sums.total_s)), ` for ${units.lengthText(route.distance_m)}, `, stops.length ? `${number(stops.length)} ${stops.length === 1 ? "stop" : "stops"}` : "no stop needed", sums.charged_kwh > 0 && `, ${energyText(sums.charged_kwh)} charged`, sums.price !== null && `, ${moneyText(sums.price, sums.currency)}`),
    el("div", { class: "plan-shares", "aria-hidden": "true" }, parts.map(([, seconds, key]) => el("span", { class: `share-${key}`, style: { "flex-grow": String(seconds) } }))),
    el("ul", { class: "plan-sums small num" }, parts.map(([name, seconds, key]) => el("li", {}, el("span", { class: `swatch share-${key}` }), `${name} ${durationText(seconds)}`))),
    kept !== null && stops.length > 0 && el("p", { class: "small dim num" }, el("b", {}, sureness(kept)), " sure to arrive everywhere with what is asked, if no charger fails"),
  );
}

/** What is proven of the plan. */
function proofText({ proof, objective_unit: unit }) {
  if (proof.proven) return el("p", { class: "small dim" }, "Proven: no plan is better by this model.");
  const short = proof.short_by;
  const text = short === null ? "Nothing is proven of this plan" : `Another plan may be better by at most ${unit === "s" ? durationText(short) : unit === "kWh" ? energyText(short) : moneyText(short, unit)}`;
  return el("p", { class: "small dim" }, `${text}${proof.unproven ? `: ${proof.unproven}` : ""}.`);
}
