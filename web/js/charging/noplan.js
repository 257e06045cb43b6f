/** Why there is no plan, and what would help, as buttons that apply it. */

import { el } from "../dom.js";
import { stationName } from "../stations/words.js";
import { energyText, percentText } from "../units.js";

const SLOWER_KMH = [110, 90];
const FULL = 1;
const LEAST = 0.05;

/** What could be chosen otherwise, the least first: {text, patch}; patch: of the journey. */
function remedies({ charging, soc }, units) {
  const { most, arrive, atGoal, leastKw, plugs, avoid, never, not, at, capsKmh, confidence } = charging;
  const change = (text, patch) => ({ text, patch: { charging: { ...charging, ...patch } } });
  const slower = SLOWER_KMH.find((kmh) => !capsKmh.length || kmh < Math.min(...capsKmh));
  return [
    slower && change(`Drive at most ${units.speedText(slower)}`, { capsKmh: [...capsKmh, slower].slice(-4) }),
    most < FULL && change("Charge to 100 %", { most: FULL }),
    soc < FULL && { text: "Depart with 100 %", patch: { soc: FULL } },
    confidence !== null && change("Plan by the mean", { confidence: null }),
    arrive > LEAST && change(`Arrive with ${percentText(LEAST)}`, { arrive: LEAST }),
    atGoal > LEAST && change(`${percentText(LEAST)} at the goal`, { atGoal: LEAST }),
    leastKw > 0 && change("Stations of any power", { leastKw: 0 }),
    plugs.length > 0 && change("All plugs that fit", { plugs: [] }),
    avoid.length > 0 && never && change("Avoided networks too", { never: false }),
    (not.length > 0 || at.length > 0) && change("Forget chosen stations", { not: [], at: [] }),
  ].filter(Boolean);
}

/** The notice. noPlan: of the answer. act(patch): changes the journey. */
export function noPlanNotice({ reason, from_station: from, missing_kwh: missing, last_reached: last, helps }, journey, units, act) {
  const options = remedies(journey, units);
  return el(
    "div",
    { class: "notice bad out-of-reach" },
    el("h3", {}, "No plan with charging stops"),
    el("p", {}, sentence(reason)),
    missing > 0 && el("p", {}, `The drive ${from ? `from ${stationName(from)}` : "from the start"} lacks ${energyText(missing)}.`),
    last && el("p", {}, `The last station in reach is ${stationName(last)}.`),
    helps.length > 0 && [el("p", {}, "What would help:"), el("ul", { class: "plan-helps" }, helps.map((text) => el("li", {}, sentence(text))))],
    options.length > 0 && el("div", { class: "row wrap" }, options.map(({ text, patch }, i) => el("button", { type: "button", class: i ? "button" : "button primary", on: { click: () => act(patch) } }, text))),
  );
}

const sentence = (text) => (text ? `${text[0].toUpperCase()}${text.slice(1)}${/[.!?]$/.test(text) ? "" : "."}` : "");
