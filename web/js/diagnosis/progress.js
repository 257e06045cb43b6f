/** How far a diagnosis is. */

import { el } from "../dom.js";
import { percentText } from "../units.js";
import { vehicleName } from "./list.js";
import { capital, counted } from "./terms.js";

export function progressCard({ session }, diagnoses) {
  const stage = el("p", { class: "stage" });
  const percent = el("span", { class: "num dim" });
  const what = el("p", { class: "small dim" });
  const bar = el("progress", { max: 1, "aria-label": "Share of the diagnosis that is done" });
  const cancel = el("button", { type: "button", class: "button", on: { click: stop } }, "Cancel");
  let id = null;

  function stop() {
    cancel.disabled = true;
    diagnoses.remove(id);
  }

  return {
    field: el(
      "div", { class: "card stack progress-card" },
      el("h2", {}, "Under way"), what,
      el("div", { class: "spread" }, stage, percent), bar,
      el("p", { class: "small dim" }, "This takes from half a minute to some minutes. It goes on if you look at something else; it stays in the list."),
      el("div", {}, cancel),
    ),
    show(answer) {
      id = answer.id;
      what.textContent = `${vehicleName(session, answer.vehicle)}, ${counted(answer.recordings ?? answer.request.recordings.length, "recording")}`;
      const waiting = answer.state === "queued";
      stage.textContent = waiting ? "Waits until earlier ones are done" : `${capital(answer.stage || "starting")} …`;
      percent.textContent = waiting ? "" : percentText(answer.progress);
      if (waiting) bar.removeAttribute("value");
      else bar.value = answer.progress;
    },
  };
}
