/** What was found: effects that the model leaves out, parameters that are off, structure that stays unexplained. */

import { el } from "../dom.js";
import { number, percentText } from "../units.js";
import { axisName, capital, effectName, familyName, intervalText, listed, parameterName, quantityText, rangeText, unexplainedSentence, valueText } from "./terms.js";

const MOST_PLACES = 4;
const MOST_TRIPS = 8;
const SAME_SHARE = 0.005;

const chip = (family) => el("span", { class: `chip family-${family}` }, familyName(family));
const fact = (name, ...told) => el("div", {}, el("dt", {}, name), el("dd", {}, told));
const byEnergy = (a, b) => Math.abs(b.energy_kwh) - Math.abs(a.energy_kwh);
const tripsText = (trips) => (trips.length > MOST_TRIPS ? `${trips.slice(0, MOST_TRIPS).join(", ")} and ${trips.length - MOST_TRIPS} more` : trips.join(", "));

/** Cards of all findings, the heaviest first. */
export const findingCards = (result) => result.findings.toSorted(byEnergy).map((one) => findingCard(one, result.learned.not_carried, fittedEnergy(result)));

/** Energy that the fitted drives measured, signs aside [kWh]. */
function fittedEnergy({ trips, fit }) {
  const fitted = new Set(fit.fitted_trips);
  return trips.filter(({ id }) => fitted.has(id)).reduce((sum, { measured_kwh: kwh }) => sum + Math.abs(kwh), 0);
}

/** The share of a finding; of one that takes on some drives and gives on others, that with signs aside. */
function shareFigure({ energy_kwh: kwh, energy_kwh_ci95: interval, energy_share: share }, measured) {
  if (Math.abs(share - kwh / measured) > SAME_SHARE) return figure(percentText(share, 1), "moved to and fro between drives", "");
  return figure(percentText(share, 1), "of the measured energy", intervalText(100 * share, interval?.map((one) => (100 * one) / measured)));
}

function findingCard(one, notCarried, measured) {
  const places = one.located.slice(0, MOST_PLACES);
  return el(
    "article", { class: `finding family-edge family-${one.family}` },
    el("div", { class: "spread" }, el("h3", {}, effectName(one.effect)), chip(one.family)),
    el("p", {}, one.text),
    el(
      "div", { class: "figures" },
      figure(valueText(one.energy_kwh, "kWh", one.energy_kwh_ci95), "in all fitted drives", intervalText(one.energy_kwh, one.energy_kwh_ci95)),
      shareFigure(one, measured),
    ),
    one.ambiguous_with.length > 0 && rivals(one),
    el(
      "dl", { class: "facts" },
      places.length > 0 && fact("Shows most", el("ul", {}, places.map((place) => el("li", {}, placeText(place))))),
      one.trips.length > 0 && fact("On", tripsText(one.trips)),
    ),
    Object.keys(one.coefficients).length > 0 && coefficients(one),
    notCarried[one.effect] && el("p", { class: "small dim" }, `Routes can't use it: ${notCarried[one.effect]}.`),
  );
}

const placeText = ({ axis, interval, mean_w: mean, ci95_w: ci95 }) => `${capital(rangeText(axis, interval))}: ${quantityText(mean, "W", ci95)}`;
const figure = (value, what, between) => el(
  "div", {},
  el("span", { class: "figure num" }, value),
  el("span", { class: "small dim" }, what),
  between && el("span", { class: "small dim num" }, `95 %: ${between}`),
);

function rivals(one) {
  const names = one.ambiguous_with.map(({ effect, family }) => `${effectName(effect).toLowerCase()} (${familyName(family).toLowerCase()})`);
  return el(
    "div", { class: "notice warn small" },
    el("p", {}, `Can't be told from ${listed(names, "or")} on these drives.`),
    one.separating_recording && el("p", {}, el("strong", {}, "A drive that would tell: "), one.separating_recording),
  );
}

function coefficients(one) {
  const rows = Object.entries(one.coefficients).map(([name, { value, unit, ci95 }]) => el(
    "tr", {},
    el("th", { scope: "row" }, effectName(name)),
    el("td", { class: "num" }, valueText(value, unit, ci95)),
    el("td", { class: "num" }, intervalText(value, ci95) || (ci95 ? "chosen" : "–")),
  ));
  return el(
    "details", {},
    el("summary", { class: "small" }, "Fitted numbers"),
    el(
      "table", {},
      el("thead", {}, el("tr", {}, ["Number", "Value", "95 %"].map((text, i) => el("th", { scope: "col", class: i ? "num" : null }, text)))),
      el("tbody", {}, rows),
    ),
    el("p", { class: "small dim" }, `Strength: t = ${number(one.t, 1)}`),
  );
}

/** Cards of parameters that are off. */
export const parameterCards = ({ parameter_errors: errors }) => errors.toSorted(byEnergy).map((one) => el(
  "article", { class: `finding family-edge family-${one.family}` },
  el("div", { class: "spread" }, el("h3", {}, capital(parameterName(one.parameter))), chip(one.family)),
  el(
    "div", { class: "from-to" },
    el("div", {}, el("span", { class: "small dim" }, "Vehicle's file"), el("span", { class: "figure num" }, valueText(one.nameplate, one.unit, one.ci95))),
    el("span", { class: "arrow", "aria-hidden": "true" }, "→"),
    el(
      "div", {},
      el("span", { class: "small dim" }, "These drives"),
      el("span", { class: "figure num" }, valueText(one.fitted, one.unit, one.ci95)),
      intervalText(one.fitted, one.ci95) && el("span", { class: "small dim num" }, `95 %: ${intervalText(one.fitted, one.ci95)}`),
    ),
  ),
  el("p", { class: "small" }, `That makes ${valueText(one.energy_kwh, "kWh", null, true)}, ${number(100 * one.energy_share, 1)} % of the measured energy.`),
  one.aliases.length > 0 && el("p", { class: "small dim" }, `By power alone it can't be told from ${listed(one.aliases.map(parameterName), "or")}.`),
));

/** Cards of structure that no effect explains. */
export const unexplainedCards = ({ unexplained }) => unexplained.toSorted(byEnergy).map((one) => el(
  "article", { class: "finding family-edge family-unexplained" },
  el("div", { class: "spread" }, el("h3", {}, one.axis === "trip" ? "Single drives" : capital(axisName(one.axis))), el("span", { class: "small dim num" }, chance(one.p))),
  el("p", {}, unexplainedSentence(one)),
  one.axis !== "trip" && one.trips.length > 0 && el("p", { class: "small dim" }, `On ${tripsText(one.trips)}.`),
));

const chance = (p) => (p === null ? "" : `chance of as much: ${p < 0.001 ? "< 0.1" : number(100 * p, 1)} %`);
