/** The legend over the map: how the line is coloured, and what its colours mean. */

import { byId, el, fill, newId } from "../dom.js";
import { COLOURINGS } from "../journey/journey.js";
import { number } from "../units.js";
import { NAMES, slugOf } from "./compare.js";
import { digitsOf } from "../chart/scales.js";

const OF = "routes";
const TITLES = { soc: "Charge", consumption: "Consumption", plain: "Route" };

/** The legend; colour(name) is called where another colouring is chosen. */
export function createLegend(choose) {
  const id = newId("colour");
  const select = el("select", { id, on: { change: () => choose(select.value) } }, COLOURINGS.map((name) => el("option", { value: name }, TITLES[name])));
  const key = el("div", {});
  const content = el("div", { class: "route-legend" }, el("label", { for: id }, "Line shows"), select, key);

  /** Show it. scale: of the colouring, null for plain. context: {colouring, units, routes, beyond, grey}. */
  function show(scale, { colouring, units, names, beyond, grey, hot }) {
    const box = byId("legend");
    select.value = colouring;
    fill(
      key,
      scale && ramp(scale, colouring, units),
      el(
        "ul",
        {},
        !scale && names.map((name) => el("li", {}, el("span", { class: `swatch of-${slugOf(name)}` }), NAMES[name] ?? name)),
        beyond && el("li", {}, el("span", { class: "swatch", style: { "background-color": grey } }), "beyond the charge"),
        hot && el("li", {}, el("span", { class: "swatch hot" }), "hot stretch"),
      ),
    );
    if (box.dataset.of !== OF || !box.contains(content)) fill(box, content);
    box.dataset.of = OF;
    box.hidden = false;
  }

  return { show, hide: hideLegend };
}

function hideLegend() {
  const box = byId("legend");
  if (box.dataset.of === OF) box.hidden = true;
}

function ramp({ bounds, colours }, colouring, units) {
  const inUnit = (bound) => (colouring === "soc" ? 100 * bound : units.consumption(bound));
  const values = bounds.map((bound) => Number(inUnit(bound).toPrecision(3)));
  const digits = digitsOf(values);
  const unit = colouring === "soc" ? "%" : units.consumptionUnit;
  const spoken = `${TITLES[colouring]} in ${unit}: ${colours.length} colours, with bounds at ${values.map((value) => number(value, digits)).join(", ")}`;
  return el(
    "div",
    { role: "img", "aria-label": spoken },
    el("div", { class: "ramp-blocks" }, colours.map((colour) => el("span", { style: { "background-color": colour } }))),
    el("div", { class: `ramp-bounds num${bounds.length > 5 ? (digits ? " many wide" : " many") : ""}` }, values.map((value, i) => el("span", { style: { left: `${(100 * (i + 1)) / colours.length}%` } }, number(value, digits)))),
    el("div", { class: "dim" }, colouring === "soc" ? "% of the battery" : `${unit}; below 0 energy comes back`),
  );
}
