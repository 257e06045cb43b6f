/** What learned effects change of a typical way, shown before they are applied. */

import { ApiError, latest } from "../api.js";
import { capital } from "../diagnosis/terms.js";
import { el, fill } from "../dom.js";
import { failure, working } from "../notices.js";
import { signed } from "../routes/compare.js";
import { CAUSES } from "../routes/parts.js";
import { energyText, number, percentText } from "../units.js";
import { comparedOn } from "./ways.js";

const ASKED_BY = ["start", "goal", "via", "soc", "reserve", "vehicle", "graph", "conditions", "route"];
const SHOWN_KWH = 0.005; // less is 0.00 kWh

/** A comparison that follows what is chosen. {field, isDone(), end()}; done(): called when it is there, or has failed. */
export function comparison(app, answer, done) {
  const { journey, session } = app;
  const field = el("div", { class: "comparison stack", role: "region", "aria-label": "What it changes" });
  let state = { status: "loading", found: null, error: null };
  let unfolded = false;
  const asking = latest(ask);
  const ends = [
    journey.on(ASKED_BY, renew),
    journey.on(["tab"], () => state.status === "loading" && renew()),
    journey.on(["units"], show),
    session.on(["graphs", "vehicles"], renew),
  ];
  renew();
  return {
    field,
    isDone: () => state.status !== "loading",
    end() {
      asking.cancel();
      for (const end of ends) end();
    },
  };

  /** Ask anew; while something else is looked at, when the reader comes back. */
  function renew() {
    put({ status: "loading", found: state.found, error: null });
    if (journey.get().tab === "diagnosis" && session.get().graphs && session.get().vehicles) asking.ask();
    else asking.cancel();
  }

  async function ask(signal) {
    try {
      put({ status: "done", found: await comparedOn(app, answer, signal), error: null });
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      put({ status: "failed", found: null, error });
    }
  }

  function put(next) {
    state = next;
    show();
    done();
  }

  function show() {
    const { status, found, error } = state;
    field.setAttribute("aria-busy", String(status === "loading"));
    field.classList.toggle("stale", status === "loading" && found !== null);
    fill(
      field,
      el("p", {}, el("strong", {}, "What it changes")),
      status === "loading" && !found && working("Driving it before and after …"),
      status === "failed" && failure(error, renew),
      found && contentOf(found),
    );
  }

  function contentOf({ way, pairs }) {
    const [first, ...others] = pairs;
    const told = [app.units().lengthText(first.after.distance_m), temperatureText(first), `with ${percentText(journey.get().soc)} at departure`].filter(Boolean);
    return [
      el("p", { class: "small dim" }, `On ${way.what}: ${told.join(", ")}.`),
      el(
        "div", { class: "from-to" },
        side("Vehicle's file", first.before, "before"),
        el("span", { class: "arrow", "aria-hidden": "true" }, "→"),
        side("With what was learned", first.after, "after"),
      ),
      el("p", {}, changeSentence(first)),
      others.map((pair) => el("p", { class: "small" }, lineOf(pair))),
      first.before.line !== first.after.line && el("p", { class: "small" }, "With what was learned it takes other roads."),
      warningsOf(first).map((text) => el("p", { class: "notice warn small" }, capital(text))),
      causes(pairs.at(-1), pairs.length > 1),
    ];
  }

  function causes(pair, several) {
    const rows = Object.keys(pair.after.parts)
      .map((key) => ({ key, before: pair.before.parts[key], after: pair.after.parts[key] }))
      .filter(({ before, after }) => Math.abs(before) >= SHOWN_KWH || Math.abs(after) >= SHOWN_KWH)
      .toSorted((a, b) => Math.abs(b.after - b.before) - Math.abs(a.after - a.before));
    const heads = ["Cause", "File", "Learned", "Change"];
    return el(
      "details", { open: unfolded, on: { toggle: ({ target }) => (unfolded = target.open) } },
      el("summary", { class: "small" }, `By cause, kWh${several ? `, ${temperatureText(pair)}` : ""}`),
      el(
        "table", { class: "dense" },
        el("thead", {}, el("tr", {}, heads.map((text, i) => el("th", { scope: "col", class: i ? "num" : null }, text)))),
        el("tbody", {}, rows.map(({ key, before, after }) => el(
          "tr", { title: CAUSES[key]?.[1] },
          el("th", { scope: "row" }, CAUSES[key]?.[0] ?? key.replaceAll("_", " ")),
          [before, after].map((kwh) => el("td", { class: "num" }, number(kwh, 2))),
          el("td", { class: "num" }, signedKwh(after - before)),
        ))),
      ),
    );
  }
}

const side = (name, { energy_kwh: kwh, soc_end: soc, feasible }, kind) => el(
  "div", { class: kind },
  el("span", { class: "small dim" }, name),
  el("span", { class: "figure num" }, energyText(kwh)),
  el("span", { class: "small num" }, arrivalText(soc, feasible)),
);

const arrivalText = (soc, feasible) => (feasible ? `${percentText(soc)} on arrival` : `out of reach (${percentText(soc)})`);
const signedKwh = (kwh) => (Math.abs(kwh) < SHOWN_KWH ? "0.00" : signed(kwh, (value) => number(value, 2)));

/** The change of energy in per cent, in kWh where that says nothing. */
function changeText({ before: { energy_kwh: before }, after: { energy_kwh: after } }) {
  if (Math.abs(after - before) < SHOWN_KWH) return "none";
  return before > 0 ? signed((after - before) / before, (share) => percentText(share)) : signed(after - before, energyText);
}

/** What that is more or less, in a sentence. */
function changeSentence({ before, after }) {
  const kwh = after.energy_kwh - before.energy_kwh;
  const points = Math.round(100 * after.soc_end) - Math.round(100 * before.soc_end);
  if (Math.abs(kwh) < SHOWN_KWH) return "That is as much as before.";
  const size = before.energy_kwh > 0 ? percentText(Math.abs(kwh) / before.energy_kwh) : energyText(Math.abs(kwh));
  const charge = points === 0 ? "" : `, and ${Math.abs(points)} ${Math.abs(points) === 1 ? "point" : "points"} ${points > 0 ? "more" : "less"} charge on arrival`;
  return ["That is ", el("strong", {}, `${size} ${kwh > 0 ? "more" : "less"} energy`), `${charge}.`];
}

function temperatureText({ at: { ambient_c: ambient }, median }) {
  if (ambient === undefined) return "no temperature set";
  return `at ${number(ambient)} °C${median ? ", the median of the drives" : ""}`;
}

function lineOf(pair) {
  const { before, after } = pair;
  const text = temperatureText(pair);
  return `${capital(text)}: ${energyText(before.energy_kwh)} → ${energyText(after.energy_kwh)} (${changeText(pair)}), ${arrivalText(before.soc_end, before.feasible)} → ${arrivalText(after.soc_end, after.feasible)}.`;
}

/** What is said of the way with effects only, but for a verdict that leaves all causes open, which the card says itself. */
function warningsOf({ before, after }) {
  const known = new Set(before.warnings);
  return after.warnings.filter((text) => text.startsWith("the effects were learned") && !known.has(text) && !text.includes("could not tell their causes"));
}
