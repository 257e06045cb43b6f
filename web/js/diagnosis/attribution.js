/** Where each drive's energy went: stacked bars by family, with what was measured. */

import { el, fill, newId, svg } from "../dom.js";
import { energyText, number, percentText } from "../units.js";
import { FAMILIES, familyName } from "./terms.js";

const UNITS = 1000; // of a bar's width
const BAR = 14;
const LEAST_SAID = 0.005; // kWh
const FINE = 0.0995; // below it, errors are told to a tenth of a per cent

/** Families of some trips in the order in which bars stack them. */
function familiesOf(trips) {
  const found = new Set(trips.flatMap(({ by_family_kwh: parts }) => Object.keys(parts)));
  const known = Object.keys(FAMILIES).filter((family) => found.has(family));
  return [...known, ...[...found].filter((family) => !known.includes(family))];
}

const errorOf = (trip) => (trip.measured_kwh > 0 ? trip.after_kwh / trip.measured_kwh - 1 : null);

const errorText = (error) => `${error > 0 ? "+" : ""}${percentText(error, Math.abs(error) < FINE ? 1 : 0)}`;

/** Columns that drives can be sorted by: what is shown, and its value. */
const COLUMNS = {
  id: { head: "Drive", value: ({ id }) => id, first: 1 },
  ambient: { head: "°C", value: ({ ambient_c: ambient }) => ambient, first: 1 },
  energy: { head: "kWh", value: ({ measured_kwh: kwh }) => kwh, first: -1 },
  error: { head: "Error", value: (trip) => (errorOf(trip) === null ? null : Math.abs(errorOf(trip))), first: -1 },
};

/** The part on where energy went. */
export function attributionPart(app, diagnoses, result) {
  const { trips } = result;
  const families = familiesOf(trips);
  let sorted = { by: "id", direction: 1 };
  let perDistance = false;
  const body = el("tbody", {});
  const heads = Object.entries(COLUMNS).map(([key, { head }]) => {
    const sort = el("button", { type: "button", class: "sort", on: { click: () => sortBy(key) } }, head);
    return el("th", { scope: "col", class: key === "id" ? null : "num" }, sort);
  });
  const barHead = el("th", { scope: "col" });
  heads.splice(2, 0, barHead);
  const table = el(
    "table", { class: "attribution" },
    el("caption", { class: "unseen" }, "Drives, where their energy went, what was measured, and the error of the model after"),
    el("thead", {}, el("tr", {}, heads)), body,
  );
  const total = el("div", {});
  show();
  return {
    field: [
      total,
      scaleChoice((per) => { perDistance = per; show(); }),
      el("div", { class: "wide" }, table),
      el("p", { class: "small dim" }, "The upright mark is what was measured. Parts left of zero gave energy back. ● kept from the fit. Click a drive to see it along time."),
    ],
    show,
    mark,
  };

  function sortBy(by) {
    sorted = { by, direction: sorted.by === by ? -sorted.direction : COLUMNS[by].first };
    show();
  }

  function show() {
    const units = app.units();
    const scale = (trip) => (perDistance ? units.consumption(100 / Math.max(trip.distance_km, 0.1)) : 1);
    const ordered = trips.toSorted((a, b) => compare(COLUMNS[sorted.by].value(a), COLUMNS[sorted.by].value(b), sorted.direction));
    const ends = extent(trips, scale);
    for (const [i, key] of ["id", "ambient", null, "energy", "error"].entries()) {
      if (key) heads[i].setAttribute("aria-sort", sorted.by !== key ? "none" : sorted.direction > 0 ? "ascending" : "descending");
    }
    fill(barHead, perDistance ? units.consumptionUnit : "Where it went");
    fill(body, ordered.map((trip) => row(trip, families, ends, scale(trip), () => toggle(trip.id))));
    fill(total, totals(trips, families));
    mark();
  }

  function toggle(id) {
    diagnoses.choose(diagnoses.get().chosen === id ? null : id);
  }

  /** Mark the chosen drive; its row stays as it is, so that the keyboard's focus does. */
  function mark() {
    const { chosen } = diagnoses.get();
    for (const button of body.querySelectorAll(".trip-button")) {
      const is = button.dataset.trip === chosen;
      button.setAttribute("aria-pressed", String(is));
      button.closest("tr").classList.toggle("chosen", is);
    }
  }
}

function compare(a, b, direction) {
  if (a === null || b === null) return (a === null) - (b === null);
  return direction * (typeof a === "string" ? a.localeCompare(b, "en", { numeric: true }) : a - b);
}

/** Ends of the longest bars. */
function extent(trips, scale) {
  let [low, high] = [0, 0];
  for (const trip of trips) {
    const parts = Object.values(trip.by_family_kwh);
    const sum = (sign) => parts.filter((kwh) => sign * kwh > 0).reduce((all, kwh) => all + kwh, 0);
    low = Math.min(low, scale(trip) * sum(-1));
    high = Math.max(high, scale(trip) * sum(1), scale(trip) * trip.measured_kwh);
  }
  return [low, high];
}

function row(trip, families, ends, scale, choose) {
  const error = errorOf(trip);
  const parts = families.map((family) => [family, trip.by_family_kwh[family] ?? 0]).filter(([, kwh]) => Math.abs(kwh) >= LEAST_SAID);
  const text = parts.map(([family, kwh]) => `${familyName(family)} ${energyText(kwh)}`);
  const held = trip.held_out && [el("span", { class: "held", "aria-hidden": "true" }, " ●"), el("span", { class: "unseen" }, ", kept from the fit")];
  return el(
    "tr", {},
    el("th", { scope: "row" }, el("button", { type: "button", class: "trip-button", dataset: { trip: trip.id }, on: { click: choose } }, trip.id, held)),
    el("td", { class: "num" }, trip.ambient_c === null ? "–" : number(trip.ambient_c)),
    el("td", { class: "bar-cell", on: { click: choose } }, bar(trip, families, ends, scale), el("span", { class: "unseen" }, text.join(", "))),
    el("td", { class: "num" }, number(trip.measured_kwh, 2)),
    el("td", { class: "num" }, error === null ? "–" : errorText(error)),
  );
}

function bar(trip, families, [low, high], scale) {
  const x = (value) => (UNITS * (value - low)) / (high - low || 1);
  const at = { plus: 0, minus: 0 };
  const parts = families.map((family) => {
    const value = scale * (trip.by_family_kwh[family] ?? 0);
    const side = value < 0 ? "minus" : "plus";
    const from = at[side];
    at[side] += value;
    const [left, right] = [x(Math.min(from, at[side])), x(Math.max(from, at[side]))];
    if (right - left < 0.5) return null;
    return svg(
      "rect", { class: `part family-${family}`, x: left, width: right - left, y: 3, height: BAR },
      svg("title", {}, `${familyName(family)}: ${energyText(value / scale)}`),
    );
  });
  return svg(
    "svg", { viewBox: `0 0 ${UNITS} ${BAR + 6}`, preserveAspectRatio: "none", class: "parts-bar", "aria-hidden": "true" },
    parts,
    svg("line", { class: "zero", x1: x(0), x2: x(0), y1: 0, y2: BAR + 6 }),
    svg("line", { class: "measured", x1: x(scale * trip.measured_kwh), x2: x(scale * trip.measured_kwh), y1: 0, y2: BAR + 6 }),
  );
}

/** All drives together: a legend with each family's energy and share. */
function totals(trips, families) {
  const measured = trips.reduce((sum, { measured_kwh: kwh }) => sum + kwh, 0);
  const parts = families.map((family) => [family, trips.reduce((sum, { by_family_kwh: kwh }) => sum + (kwh[family] ?? 0), 0)]);
  return el(
    "ul", { class: "totals" },
    parts.toSorted((a, b) => Math.abs(b[1]) - Math.abs(a[1])).map(([family, kwh]) => el(
      "li", {},
      el("span", { class: `dot family-${family}` }), el("span", { class: "grow" }, familyName(family)),
      el("span", { class: "num" }, energyText(kwh)),
      el("span", { class: "num dim share" }, measured > 0 ? percentText(kwh / measured) : ""),
    )),
  );
}

function scaleChoice(choose) {
  const group = newId("scale");
  const input = (per) => el("input", { type: "radio", name: group, checked: !per, on: { change: () => choose(per) } });
  return el(
    "fieldset", {},
    el("legend", { class: "unseen" }, "Length of the bars"),
    el("div", { class: "segments" }, el("label", {}, input(false), el("span", {}, "Energy")), el("label", {}, input(true), el("span", {}, "Energy per distance"))),
  );
}
