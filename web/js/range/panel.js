/** The area that can be reached: asked for while the user changes things, drawn as nested bands, told as a table. */

import { ApiError, call, latest } from "../api.js";
import { byId, el, fill, newId } from "../dom.js";
import { saveGeoJson } from "../download.js";
import { RANGE_MODES, rangeRequest } from "../journey/journey.js";
import { extentOf } from "../map/view.js";
import { failure, working, warningsOf } from "../notices.js";
import { energyText, percentText } from "../units.js";
import { areaFeatures, bandColour, bandsOf, endsWithMap, mapEdgeFeatures } from "./bands.js";

const MODES = { from: "From here", reverse: "To here", round_trip: "Round trip" };
const EXPLAINED = {
  from: "Places that can be reached from here",
  reverse: "Places from which this one can still be reached, leaving there with this charge",
  round_trip: "Places that can be visited and returned from without charging",
};
const ASKED_BY = ["start", "soc", "reserve", "vehicle", "graph", "conditions", "effects", "uncertainty", "rangeMode", "bands"];

export function rangePanel(app, element) {
  const { journey, session, view } = app;
  const controls = el("div", { class: "stack" });
  const results = el("div", { class: "stack" });
  fill(element, el("div", { class: "card stack" }, el("h2", { class: "unseen" }, "Range"), controls, results));
  const mode = modeChoice(journey);
  const bands = bandChoice(journey);
  fill(controls, mode.field, bands.field);

  const asking = latest(ask);
  const wanted = () => {
    const { tab, goal } = journey.get();
    return tab === "range" || (tab === "route" && !goal); // with a start alone, the area is shown in the tab of routes too
  };
  const renew = () => {
    mode.show();
    bands.show();
    if (wanted() && rangeRequest(asked())) asking.ask();
    else {
      asking.cancel();
      session.set({ range: { status: "none", answer: null, error: null } });
    }
  };
  journey.on([...ASKED_BY, "tab", "goal"], renew);
  session.on(["range", "theme"], show);
  journey.on(["units"], show);
  show();
  renew();

  /** In the tab of routes it is always the area that can be reached from the start. */
  function asked() {
    const chosen = journey.get();
    return chosen.tab === "route" ? { ...chosen, rangeMode: "from" } : chosen;
  }

  async function ask(signal) {
    const { answer } = session.get().range;
    session.set({ range: { status: "loading", answer, error: null } });
    try {
      const found = await call("range", { body: rangeRequest(asked()), signal });
      session.set({ range: { status: "done", answer: found, error: null } });
      announce(found);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      session.set({ range: { status: "failed", answer: null, error } });
    }
  }

  function announce(answer) {
    const [outer] = bandsOf(answer);
    app.say(`${EXPLAINED[modeOf(answer)]}: ${app.units().areaText(outer.area_km2)} with at least ${percentText(outer.soc_left)} left.`);
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
      status === "none" && el("p", { class: "dim" }, "Click the map, or type a place above."),
      status === "loading" && working("Searching the area …"),
      status === "failed" && failure(error, () => asking.ask()),
      answer && table(answer, theme),
    );
    legend(answer, theme);
  }

  function table(answer, theme) {
    const rows = bandsOf(answer);
    const units = app.units();
    return [
      el("p", { class: "small dim" }, EXPLAINED[modeOf(answer)], "."),
      el(
        "table",
        {},
        el("caption", { class: "unseen" }, "Area by charge left"),
        el("thead", {}, el("tr", {}, ["Charge left", "Area", "Sureness"].slice(0, rows[0].probability === null ? 2 : 3).map((text, i) => el("th", { scope: "col", class: i ? "num" : null }, text)))),
        el("tbody", {}, rows.map((band, i) => el(
          "tr", {},
          el("td", {}, el("span", { class: "row" }, swatch(band, i, rows, theme), `at least ${percentText(band.soc_left)}`)),
          el("td", { class: "num" }, units.areaText(band.area_km2)),
          band.probability !== null && el("td", { class: "num" }, percentText(band.probability)),
        ))),
      ),
      el("p", { class: "small dim" }, reachText(rows[0], units)),
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
    const rows = bandsOf(answer).filter(({ probability }) => probability === null || probability === 0.5);
    box.dataset.of = "range";
    box.hidden = false;
    fill(
      box,
      el("h2", {}, "Charge left"),
      el("ul", {}, rows.map((band, i) => el("li", {}, swatch(band, i, rows, theme), `≥ ${percentText(band.soc_left)}`, el("span", { class: "dim num" }, app.units().areaText(band.area_km2)))),
        endsWithMap(answer) && el("li", {}, el("span", { class: "swatch beyond-map" }), "beyond this map")),
    );
  }
}

/** How far the outermost band reaches. */
function reachText({ reach_nearest_km: near, reach_farthest_km: far, road_farthest_km: road, map_edge_left_kwh: left }, units) {
  const text = `${units.lengthText(1000 * near)} to ${units.lengthText(1000 * far)} as the crow flies, up to ${units.lengthText(1000 * road)} along roads`;
  return left === null ? `${text}.` : `${text}, and beyond this map with up to ${energyText(left)} left at its edge.`;
}

const modeOf = ({ request }) => RANGE_MODES.find((mode) => request[mode]) ?? "from";
const swatch = (band, i, rows, theme) => el("span", { class: "swatch", style: { "background-color": bandColour(band, rows, theme) } });
const positionsOf = (answer) => answer.features.filter(({ geometry }) => geometry.type === "MultiPolygon").flatMap(({ geometry }) => geometry.coordinates.flatMap(([shell]) => shell));

function modeChoice(journey) {
  const group = newId("mode");
  const inputs = RANGE_MODES.map((mode) => el("input", { type: "radio", name: group, value: mode, on: { change: () => journey.set({ rangeMode: mode }) } }));
  return {
    field: el("fieldset", {}, el("legend", { class: "unseen" }, "Which area"), el("div", { class: "segments" }, inputs.map((input, i) => el("label", {}, input, el("span", {}, MODES[RANGE_MODES[i]]))))),
    show() {
      for (const input of inputs) input.checked = input.value === journey.get().rangeMode;
    },
  };
}

function bandChoice(journey) {
  const id = newId("bands");
  const input = el("input", { type: "range", id, min: 1, max: 8, step: 1, on: { input: () => journey.set({ bands: Number(input.value) }) } });
  const output = el("output", { for: id });
  return {
    field: el("div", { class: "slider" }, el("label", { for: id }, "Bands"), output, input),
    show() {
      const { bands } = journey.get();
      input.value = String(bands);
      output.textContent = String(bands);
    },
  };
}
