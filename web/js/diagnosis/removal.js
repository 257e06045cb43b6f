/** A button that removes something once that is confirmed. */

import { el, fill } from "../dom.js";

/** @param {() => void} remove @param {string} what said to screen readers */
export function removal(remove, what) {
  const box = el("div", { class: "removal" });
  const ask = el("button", { type: "button", class: "quiet small", "aria-label": `Remove: ${what}`, on: { click: confirm } }, "Remove");
  return fill(box, ask);

  function confirm() {
    const keep = el("button", { type: "button", class: "button small", on: { click: stay } }, "Keep");
    const go = el("button", { type: "button", class: "button small danger", "aria-label": `Remove for good: ${what}`, on: { click: remove } }, "Remove");
    fill(box, el("span", { class: "row" }, go, keep));
    box.addEventListener("keydown", escape);
    keep.focus();
  }

  function escape(event) {
    if (event.key === "Escape") stay();
  }

  function stay() {
    box.removeEventListener("keydown", escape);
    fill(box, ask);
    ask.focus();
  }
}
