/** What a diagnosis has learned, given to routes and ranges, and taken back. */

import { ApiError, call } from "../api.js";
import { comparison } from "../applying/comparison.js";
import { vehicleOf } from "../applying/ways.js";
import { byId, el, fill, newId } from "../dom.js";
import { pathOf } from "./diagnoses.js";
import { vehicleName } from "./list.js";
import { effectName, listed, uncapped } from "./terms.js";

/** Whether routes take anything over from a diagnosis. */
export const carries = ({ learned }) => Object.keys(learned.effects).length + Object.keys(learned.parameters).length > 0;

/**
 * What it changes, and the button that applies a diagnosis to routes, or what stands in its place: {field, show, end};
 * show: after a change of what is applied.
 */
export function applying(app, answer) {
  const { journey, session } = app;
  const box = el("div", { class: "applying" });
  if (!carries(answer.result)) return { field: fill(box, nothing(answer.result)), show() {}, end() {} };

  const warm = answer.result.findings.some(({ family }) => family === "thermal" || family === "rolling");
  const isUncertain = answer.result.verdict === "cannot_tell";
  const why = newId("why");
  const agreed = el("input", { type: "checkbox", on: { change: enable } });
  const button = el("button", { type: "button", class: "button primary", "aria-describedby": why, on: { click: apply } }, "Apply to the next route");
  const reason = el("p", { class: "small dim", id: why });
  const offer = el("div", { class: "stack" }, isUncertain && uncertainty(answer, agreed), button, reason);
  const applied = el("div", { class: "notice good" });
  let changes = null; // while it is made it calls already
  changes = comparison(app, answer, enable);
  fill(box, changes.field, offer, applied);
  show();
  return { field: box, show, end: changes.end };

  function apply() {
    journey.set({ effects: answer.id, vehicle: vehicleOf(app, answer) });
    toRoute();
    app.toast(`Routes and ranges now count what this diagnosis has learned${warm ? ". Set the air temperature: it depends on it" : ""}.`);
  }

  function toRoute() {
    journey.set({ tab: "route" });
    byId("tab-route").focus();
  }

  function leave() {
    journey.set({ effects: null });
    app.say("What was learned is left out again.");
    agreed.checked = false;
    enable();
    (button.disabled ? agreed : button).focus();
  }

  /** Nothing is applied before what it changes is there to be read, nor where causes are open before that is agreed to. */
  function enable() {
    if (!changes) return;
    const waits = !changes.isDone();
    button.disabled = waits || (isUncertain && !agreed.checked);
    reason.textContent = waits ? "You see first what it changes." : isUncertain && !agreed.checked ? "Tick the box above to apply it all the same." : appliedText(answer.result);
  }

  function show() {
    const isApplied = journey.get().effects === answer.id;
    offer.hidden = isApplied;
    applied.hidden = !isApplied;
    fill(
      applied,
      el("p", {}, el("strong", {}, "Applied. "), `Routes and ranges of ${vehicleName(session, answer.vehicle)} count what was learned here.`),
      el("div", { class: "row wrap" },
        el("button", { type: "button", class: "button", on: { click: leave } }, "Leave out again"),
        el("button", { type: "button", class: "button", on: { click: toRoute } }, "Go to the route")),
    );
    enable();
  }
}

/** What can't be told apart, what would tell, and a box to tick. */
function uncertainty({ id, result: { findings } }, agreed) {
  const causes = el("ul", { class: "open-causes small" });
  const open = findings.filter(({ ambiguous_with: rivals }) => rivals.length > 0);
  list(open.map((one) => ({ cause: effectName(one.effect), rivals: one.ambiguous_with.map(({ effect }) => effectName(effect)), recording: one.separating_recording })));
  inWords();
  return el(
    "div", { class: "notice warn" },
    el("p", {}, el("strong", {}, "These drives can't tell its causes apart. "), "On other drives than these it may be wrong."),
    causes,
    el("label", { class: "check" }, agreed, "Apply it although its cause is uncertain"),
  );

  /** What the effects say of it, which has better words than names of effects; those of an older version have none. */
  async function inWords() {
    try {
      const { learned_from: from } = await call(pathOf(id, "effects"));
      if (from?.open_causes?.length) list(from.open_causes);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error; // names of effects stay
    }
  }

  function list(told) {
    fill(causes, told.map(({ cause, rivals, recording }) => el(
      "li", {},
      `${cause} could as well be ${listed(rivals.map(uncapped), "or")}.`,
      recording && [" ", el("strong", {}, "What would tell: "), uncapped(recording)],
    )));
  }
}

function nothing({ verdict, learned }) {
  const reason = learned.not_carried.all ?? (verdict === "too_few_trips" ? "the drives are too few" : "these drives name nothing that routes could use");
  return el(
    "p", { class: "notice plain" },
    el("strong", {}, "Nothing is carried over to routes. "),
    `Routes and ranges stay as the vehicle's file has them: ${reason}.`,
  );
}

function appliedText({ learned }) {
  const effects = Object.keys(learned.effects).length;
  const own = Object.keys(learned.parameters).length;
  const told = [effects && "what was found", own && "the vehicle's numbers as these drives have them"].filter(Boolean).join(" and ");
  const left = Object.keys(learned.not_carried).filter((name) => name !== "all").map(effectName);
  return `Routes and ranges then count ${told}.${left.length ? ` They can't use: ${left.join(", ")}.` : ""}`;
}
