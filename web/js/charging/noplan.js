/** Why there is no plan, and what would help, as buttons that apply it. */

import { el } from "../dom.js";
import { stationName } from "../stations/words.js";
import { percentText } from "../units.js";

const LEAST = 0.05; // charge on arrival that is offered
const MOST_CAPS = 4;

/** What the service says would help, by its kind, as remedies: {text, patch}; patch: of the journey. */
const REMEDIES = {
  speed_cap: (kmh, charging, units) => ({ text: `Drive at most ${units.speedText(kmh)}`, patch: { charging: { ...charging, capsKmh: [...charging.capsKmh, kmh].slice(-MOST_CAPS) } } }),
  max_soc: (most, charging) => ({ text: `Charge to ${percentText(most)}`, patch: { charging: { ...charging, most } } }),
  soc: (soc) => ({ text: `Depart with ${percentText(soc)}`, patch: { soc } }),
  confidence: (sure, charging) => ({ text: `Be ${percentText(sure, 1)} sure`, patch: { charging: { ...charging, confidence: sure } } }),
};

const knownRemedies = (helps, { charging }, units) => helps.flatMap(({ kind, value }) => REMEDIES[kind]?.(value, charging, units) ?? []);

/** What else could be chosen otherwise, of which it is not known whether it helps. */
function otherRemedies({ charging }) {
  const { arrive, atGoal, leastKw, plugs, avoid, never, not, at, confidence } = charging;
  const change = (text, patch) => ({ text, patch: { charging: { ...charging, ...patch } } });
  return [
    (not.length > 0 || at.length > 0) && change("Forget chosen stations", { not: [], at: [] }),
    avoid.length > 0 && never && change("Avoided networks too", { never: false }),
    leastKw > 0 && change("Stations of any power", { leastKw: 0 }),
    plugs.length > 0 && change("All plugs that fit", { plugs: [] }),
    confidence !== null && change("Plan by the mean", { confidence: null }),
    arrive > LEAST && change(`Arrive with ${percentText(LEAST)}`, { arrive: LEAST }),
    atGoal > LEAST && change(`${percentText(LEAST)} at the goal`, { atGoal: LEAST }),
  ].filter(Boolean);
}

const buttons = (remedies, act, look) => el("div", { class: "row wrap" }, remedies.map(({ text, patch }) => el("button", { type: "button", class: look, on: { click: () => act(patch) } }, text)));

/** The notice. noPlan: of the answer. act(patch): changes the journey. */
export function noPlanNotice({ reason, last_reached: last, helps }, journey, units, act) {
  const known = knownRemedies(helps, journey, units);
  const others = otherRemedies(journey);
  return el(
    "div",
    { class: "notice bad out-of-reach" },
    el("h3", {}, "No plan with charging stops"),
    el("p", {}, sentence(reason)),
    last && el("p", {}, `The last station in reach is ${stationName(last)}.`),
    known.length === 0 && helps.length > 0 && [el("p", {}, "What would help:"), el("ul", { class: "plan-helps" }, helps.map(({ text }) => el("li", {}, sentence(text))))],
    known.length > 0 && [el("p", {}, known.length > 1 ? "Each of these helps:" : "This helps:"), buttons(known, act, "button primary")],
    others.length > 0 && [el("p", { class: "plan-perhaps" }, known.length ? "Or perhaps:" : "What might help:"), buttons(others, act, "button")],
  );
}

const sentence = (text) => (text ? `${text[0].toUpperCase()}${text.slice(1)}${/[.!?]$/.test(text) ? "" : "."}` : "");
