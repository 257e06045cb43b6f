/** What a diagnosis has learned, given to routes and ranges, and taken back. */

import { byId, el, fill } from "../dom.js";
import { vehicleName } from "./list.js";
import { effectName } from "./terms.js";

const INLINE = "inline";

/** Whether routes take anything over from a diagnosis. */
export const carries = ({ learned }) => Object.keys(learned.effects).length + Object.keys(learned.parameters).length > 0;

/** The button that applies a diagnosis to routes, or what stands in its place; renewed where what is applied changes. */
export function applying(app, answer) {
  const { journey, session } = app;
  const box = el("div", { class: "applying" });
  const warm = answer.result.findings.some(({ family }) => family === "thermal" || family === "rolling");

  function apply() {
    const vehicle = answer.vehicle === session.get().vehicles?.default ? null : answer.vehicle;
    journey.set({ effects: answer.id, ...(answer.vehicle === INLINE ? {} : { vehicle }) });
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
    box.querySelector("button")?.focus();
  }

  function show() {
    if (!carries(answer.result)) {
      fill(box, nothing(answer.result));
      return;
    }
    if (journey.get().effects === answer.id) {
      fill(
        box,
        el("div", { class: "notice good" },
          el("p", {}, el("strong", {}, "Applied. "), `Routes and ranges of ${vehicleName(session, answer.vehicle)} count what was learned here.`),
          el("div", { class: "row wrap" },
            el("button", { type: "button", class: "button", on: { click: leave } }, "Leave out again"),
            el("button", { type: "button", class: "button", on: { click: toRoute } }, "Go to the route"))),
      );
      return;
    }
    fill(
      box,
      el("button", { type: "button", class: "button primary", on: { click: apply } }, "Apply to the next route"),
      el("p", { class: "small dim" }, appliedText(answer.result)),
    );
  }

  show();
  return { field: box, show };
}

function nothing({ verdict, learned }) {
  const reason = learned.not_carried.all;
  const why = reason ? `: ${reason}` : verdict === "too_few_trips" ? ": the drives are too few" : "";
  return el("p", { class: "small dim" }, `There is nothing in it that routes could use${why}.`);
}

function appliedText({ learned }) {
  const effects = Object.keys(learned.effects).length;
  const own = Object.keys(learned.parameters).length;
  const told = [effects && "what was found", own && "the vehicle's numbers as these drives have them"].filter(Boolean).join(" and ");
  const left = Object.keys(learned.not_carried).filter((name) => name !== "all").map(effectName);
  return `Routes and ranges then count ${told}.${left.length ? ` They can't use: ${left.join(", ")}.` : ""}`;
}
