/** What stands in place of a result: work under way, errors, warnings. */

import { ApiError } from "./api.js";
import { byId, el } from "./dom.js";
import { forgetKey, typedKey } from "./key.js";

export const PHONE = matchMedia("(max-width: 760px)");
const CALM = matchMedia("(prefers-reduced-motion: reduce)");

/** Work under way. */
export const working = (text) => el("div", { class: "busy-line" }, el("span", { class: "spinner", "aria-hidden": "true" }), text);

/** An ApiError with what can be done about it. */
export function failure(error, again) {
  const retry = error.status === 0 || error.status >= 500 || error.status === 429;
  const other = typedKey() && (error.status === 401 || error.code === "forbidden");
  return el(
    "div",
    { class: "notice bad", role: "alert" },
    el("p", {}, error.message),
    other && el("button", { type: "button", class: "button", on: { click: forgetKey } }, "Use another key"),
    retry && again && el("button", { type: "button", class: "button", on: { click: again } }, "Try again"),
  );
}

/** Why something chosen can't be answered, and what helps where the service does not know what the address names. */
export function refusal(journey, error, again) {
  const [text, patch] = { unknown_vehicle: ["Take the default vehicle", { vehicle: null }], unknown_effects: ["Leave the learned effects out", { effects: null }] }[error.code] ?? [];
  const change = text && el("button", { type: "button", class: "button", on: { click: () => journey.set(patch) } }, text);
  return [failure(plainly(journey, error), again), change && el("p", {}, change)];
}

/** The service lists all vehicles that it knows, which is too much to read. */
function plainly(journey, error) {
  return error.code === "unknown_vehicle" ? new ApiError(`The service does not know the vehicle ${journey.get().vehicle}.`, error) : error;
}

/** On a phone, answers lie below all inputs, where nobody who taps the map would see them. */
export function bringToPhone(element) {
  if (!PHONE.matches || !navigator.userActivation?.hasBeenActive || byId("panel").contains(document.activeElement)) return;
  element.scrollIntoView({ block: "end", behavior: CALM.matches ? "auto" : "smooth" });
}

/** Warnings of an answer, folded where they are many. */
export function warningsOf(warnings) {
  if (!warnings.length) return null;
  const items = el("ul", {}, warnings.map((text) => el("li", {}, text)));
  if (warnings.length < 3) return el("div", { class: "notice warn small" }, items);
  return el("details", { class: "notice warn small" }, el("summary", {}, `${warnings.length} remarks on this answer`), items);
}
