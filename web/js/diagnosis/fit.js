/** How well drives are met before and after: errors as big numbers, and a picture of all drives. */

import { el, fill, newId } from "../dom.js";
import { number, percentText } from "../units.js";
import { errorPicture, scatterPicture } from "./pictures.js";
import { counted, intervalText, percents, valueText } from "./terms.js";

const PICTURES = { errors: "Error", scatter: "Energy" };

/** The part on the fit; null where the drives were too few for it. */
export function fitPart(result, choose) {
  const { before, after, held_out_trips: held } = result.fit;
  if (!before || !after) return [el("p", { class: "dim" }, "There are too few drives to say how well the model meets one that it has not seen.")];
  const of = held.length ? `${counted(held.length, "drive")} that the fit has not seen` : "drives that were left out of the fit one at a time";
  const same = before.mape === after.mape;
  const trips = result.trips.filter(({ held_out: out, measured_kwh: measured }) => (out || !held.length) && measured > 0);
  return [
    el("p", { class: "dim" }, `By how much the model misses the energy of ${of}, on average:`),
    el(
      "div", { class: "from-to big" },
      score("Before", before, "before"),
      el("span", { class: "arrow", "aria-hidden": "true" }, "→"),
      score("After", after, "after"),
    ),
    same && el("p", { class: "small dim" }, "Nothing was found that would change it."),
    trips.length > 0 && picture(trips, choose),
    scoreTable(result.fit),
  ];
}

const interval = (text) => text && el("span", { class: "small dim num" }, `95 %: ${text}`);
const score = (name, one, kind) => el(
  "div", { class: kind },
  el("span", { class: "small dim" }, name),
  el("span", { class: "figure num" }, `${number(100 * one.mape, 1)} %`),
  interval(one.mape_ci95 ? intervalText(100 * one.mape, percents(one.mape_ci95)) : ""),
);

function picture(trips, choose) {
  const box = el("div", { class: "picture" });
  const group = newId("picture");
  const draw = (kind) => fill(box, (kind === "errors" ? errorPicture : scatterPicture)(trips, choose));
  const inputs = Object.keys(PICTURES).map((kind) => el("input", { type: "radio", name: group, value: kind, checked: kind === "errors", on: { change: () => draw(kind) } }));
  draw("errors");
  return el(
    "div", { class: "stack" },
    el(
      "fieldset", {},
      el("legend", { class: "unseen" }, "Picture of the drives"),
      el("div", { class: "segments" }, inputs.map((input) => el("label", {}, input, el("span", {}, PICTURES[input.value])))),
    ),
    box,
    el("p", { class: "key small" }, el("span", { class: "key-before" }, "before"), el("span", { class: "key-after" }, "after"), el("span", { class: "dim" }, "click a drive to see it along time")),
  );
}

function scoreTable({ before, after, routes }) {
  const columns = [["Before", before], ["After", after], ...(routes ? [["As routes use it", routes]] : [])];
  const rows = [
    ["Mean error, either way", ({ mape }) => percentText(mape, 1)],
    ["Mean error, with sign", ({ bias }) => (bias > 0 ? "+" : "") + percentText(bias, 1)],
    ["Spread of errors (sd)", ({ sd }) => percentText(sd, 1)],
    ["Error of power (rms)", ({ rmse_w: rmse }) => valueText(rmse, "W")],
  ];
  return el(
    "details", {},
    el("summary", { class: "small" }, "All figures"),
    el(
      "table", {},
      el("thead", {}, el("tr", {}, el("td", {}), columns.map(([name]) => el("th", { scope: "col", class: "num" }, name)))),
      el("tbody", {}, rows.map(([name, text]) => el("tr", {}, el("th", { scope: "row" }, name), columns.map(([, one]) => el("td", { class: "num" }, text(one)))))),
    ),
  );
}
