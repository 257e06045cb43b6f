/** The area that can be reached: asked for while the user changes things, drawn as nested bands, told as a table. */

import { ApiError, call, latest } from "../api.js";
import { byId, el, fill } from "../dom.js";
import { saveGeoJson } from "../download.js";
import { rangeRequest } from "../journey/journey.js";
import { extentOf } from "../map/view.js";
import { bringToPhone, refusal, working, warningsOf } from "../notices.js";
import { percentText } from "../units.js";
import { areaFeatures, bandColour, bandsOf, endsWithMap, mapEdgeFeatures, outerBand } from "./bands.js";
import { batteryCapacity } from "./capacity.js";
import { rangeChoices } from "./choices.js";
import { explainedText, outlineText, reachText, termsOf, valueText } from "./words.js";

const OF_ROUTES = { rangeMode: "from", by: "charge", outline: "roads" }; // what is shown in the tab of routes, which offers no others
const ASKED_BY = ["start", "soc", "reserve", "vehicle", "graph", "conditions", "effects", "uncertainty", "rangeMode", "bands", "by", "values", "outline"];

export function rangePanel(app, element) {
  const { journey, session, view } = app;
  const results = el("div", { class: "stack" });
  const battery = batteryCapacity(app, () => journey.get().by === "energy" && renew());
  const capacity = () => (journey.get().by === "energy" ? battery.kwh() : null);
  const choices = rangeChoices(app, capacity);
  fill(element, el("div", { class: "card stack" }, el("h2", { class: "unseen" }, "Range"), choices.element, results));

  const asking = latest(ask);
  const wanted = () => {
    const { tab, goal } = journey.get();
    return tab === "range" || (tab === "route" && !goal); // with a start alone, the area is shown in the tab of routes too
  };
  const renew = () => {
    choices.show();
    if (wanted() && request()) asking.ask();
    else {
      asking.cancel();
      session.set({ range: { status: "none", answer: null, error: null } });
      show(); // what is missing may have become another thing
    }
  };
  journey.on([...ASKED_BY, "tab", "goal"], renew);
  session.on(["range", "theme"], show);
  journey.on(["units"], () => (journey.get().by === "distance" ? renew() : show())); // whose automatic values are round in either
  show();
  renew();

  /** What is asked for, null where something is missing. */
  function request() {
    const chosen = journey.get();
    if (chosen.tab === "route") return rangeRequest({ ...chosen, ...OF_ROUTES });
    const held = capacity();
    return held === undefined ? null : rangeRequest(chosen, held);
  }

  async function ask(signal) {
    const { answer } = session.get().range;
    session.set({ range: { status: "loading", answer, error: null } });
    try {
      const found = await call("range", { body: request(), signal });
      session.set({ range: { status: "done", answer: found, error: null } });
      announce(found);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      session.set({ range: { status: "failed", answer: null, error } });
    }
  }

  function announce({ request: asked, ...answer }) {
    const outer = outerBand(answer);
    const units = app.units();
    app.say(`${explainedText(asked)}: ${units.areaText(outer.area_km2)} ${termsOf(asked).said(valueText(outer, asked, units))}.`);
  }

  function show() {
    const { status, answer, error } = session.get().range;
    const { theme } = session.get();
    const drawn = answer ? areaFeatures(answer, theme) : { areas: [], edges: [] };
    view.draw("area", drawn.areas);
    view.draw("area-edge", drawn.edges);
    view.draw("map-edge", answer ? mapEdgeFeatures(answer) : []);
    fill(
      results,
      status === "none" && missing(),
      status === "loading" && working("Searching the area …"),
      status === "failed" && refusal(journey, error, () => asking.ask()),
      answer && table(answer, theme),
    );
    legend(answer, theme);
    if (status === "failed" && journey.get().tab === "range") bringToPhone(results);
  }

  /** What is to be done before an area can be drawn. */
  function missing() {
    if (!journey.get().start) return el("p", { class: "dim" }, "Click the map, or type a place above.");
    if (capacity() === undefined) return working("Looking up the battery …");
    const { soc, reserve } = journey.get();
    return el("p", { class: "dim" }, soc <= reserve ? "The charge now is the reserve: there is no energy to take." : "None of the values can be drawn.");
  }

  function table(answer, theme) {
    const { request: asked } = answer;
    const rows = bandsOf(answer);
    const units = app.units();
    const { head, row } = termsOf(asked);
    return [
      el("p", { class: "small dim" }, explainedText(asked), "."),
      el(
        "table",
        {},
        el("caption", { class: "unseen" }, `Area by ${head.toLowerCase()}`),
        el("thead", {}, el("tr", {}, [head, "Area", "Sureness"].slice(0, rows[0].probability === null ? 2 : 3).map((text, i) => el("th", { scope: "col", class: i ? "num" : null }, text)))),
        el("tbody", {}, rows.map((band, i) => el(
          "tr", {},
          el("td", {}, el("span", { class: "row" }, swatch(band, i, rows, theme), row(valueText(band, asked, units)))),
          el("td", { class: "num" }, units.areaText(band.area_km2)),
          band.probability !== null && el("td", { class: "num" }, percentText(band.probability)),
        ))),
      ),
      el("p", { class: "small dim" }, reachText(outerBand(answer), units)),
      el("p", { class: "small dim" }, outlineText(rows, answer.filling, units)),
      warningsOf(answer.warnings),
      el(
        "div",
        { class: "row wrap" },
        el("button", { type: "button", class: "button", on: { click: () => view.fit(extentOf(positionsOf(answer))) } }, "Show all of it"),
        el("button", { type: "button", class: "button", on: { click: () => saveGeoJson("range.geojson", answer) } }, "GeoJSON"),
      ),
    ];
  }

  function legend(answer, theme) {
    const box = byId("legend");
    if (!answer) {
      if (box.dataset.of === "range") box.hidden = true;
      return;
    }
    const { request: asked } = answer;
    const rows = bandsOf(answer).filter(({ probability }) => probability === null || probability === 0.5);
    const { head, mark } = termsOf(asked);
    const units = app.units();
    box.dataset.of = "range";
    box.hidden = false;
    fill(
      box,
      el("h2", {}, head),
      el("ul", {}, rows.map((band, i) => el("li", {}, swatch(band, i, rows, theme), `${mark} ${valueText(band, asked, units)}`, el("span", { class: "dim num" }, units.areaText(band.area_km2)))),
        endsWithMap(answer) && el("li", {}, el("span", { class: "swatch beyond-map" }), "beyond this map")),
    );
  }
}

const swatch = (band, i, rows, theme) => el("span", { class: "swatch", style: { "background-color": bandColour(band, rows, theme) } });
const positionsOf = (answer) => answer.features.filter(({ geometry }) => geometry.type === "MultiPolygon").flatMap(({ geometry }) => geometry.coordinates.flatMap(([shell]) => shell));
