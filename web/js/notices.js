/** What stands in place of a result: work under way, errors, warnings. */

import { el } from "./dom.js";

/** Work under way. */
export const working = (text) => el("div", { class: "busy-line" }, el("span", { class: "spinner", "aria-hidden": "true" }), text);

/** An ApiError with what can be done about it. */
export function failure(error, again) {
  const retry = error.status === 0 || error.status >= 500 || error.status === 429;
  return el(
    "div",
    { class: "notice bad", role: "alert" },
    el("p", {}, error.message),
    retry && again && el("button", { type: "button", class: "button", on: { click: again } }, "Try again"),
  );
}

/** Warnings of an answer, folded where they are many. */
export function warningsOf(warnings) {
  if (!warnings.length) return null;
  const items = el("ul", {}, warnings.map((text) => el("li", {}, text)));
  if (warnings.length < 3) return el("div", { class: "notice warn small" }, items);
  return el("details", { class: "notice warn small" }, el("summary", {}, `${warnings.length} remarks on this answer`), items);
}
