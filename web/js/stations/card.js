/** The card of a station: what is known of it, and whether the plan is to charge there. */

import { ApiError } from "../api.js";
import { el, fill } from "../dom.js";
import { icon } from "../icons.js";
import { isChosen, withAnyStation, withoutStation, withStation } from "../journey/charging.js";
import { working } from "../notices.js";
import { placeOfFeature, stationById } from "./details.js";
import { classColour, classOf, powerText } from "./power.js";
import { nameStations } from "./names.js";
import { hindranceText, operatorText, priceText, socketText, stationName } from "./words.js";

/**
 * The card over the map. open(id, place, {reach_deg, from}): show a station; from: what gets the focus back when the
 * card is closed. show(feature, sources, {from}): the same of one that is known. close().
 */
export function createStationCard(app, element) {
  const { journey, session, view } = app;
  let shown = null; // {station, sources}
  let opener = null;
  let asked = 0;

  element.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    close();
  });
  journey.on(["charging"], render);
  session.on(["theme"], render);
  journey.on(["graph"], close);
  journey.on(["tab"], ({ tab }) => tab === "diagnosis" && close());

  async function open(id, place, { reach_deg: reach, from = null } = {}) {
    asked += 1;
    const mine = asked;
    opener = from;
    shown = null;
    element.hidden = false;
    fill(element, head("Charging station"), working("Looking up the station …"));
    try {
      const found = await stationById(app, id, place, reach);
      if (mine !== asked) return;
      if (found) show(found.station, found.sources, { from });
      else fill(element, head("Charging station"), el("p", { class: "dim" }, "The service does not know this station any more."));
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (mine === asked) fill(element, head("Charging station"), el("p", { class: "notice bad", role: "alert" }, error.message));
    }
  }

  function show(station, sources, { from = null } = {}) {
    asked += 1;
    opener = from;
    shown = { station, sources };
    element.hidden = false;
    nameStations(app, { [station.id]: stationName(station.properties) });
    render();
    view.draw("station-looked", [{ type: "Feature", properties: {}, geometry: station.geometry }]);
    if (from) element.querySelector("button")?.focus();
    app.say(`${stationName(station.properties)}, ${powerText(station.properties.power_kw)}.`);
  }

  function close() {
    if (element.hidden) return;
    asked += 1;
    const focused = element.contains(document.activeElement);
    element.hidden = true;
    shown = null;
    view.draw("station-looked", []);
    if (focused) (opener?.isConnected ? opener : view.container.querySelector("canvas"))?.focus();
  }

  function head(text, more = null) {
    const closer = el("button", { type: "button", class: "icon-button", "aria-label": "Close the station", title: "Close", dataset: { key: "close" }, on: { click: close } }, icon("close"));
    return el("div", { class: "station-head" }, el("h2", {}, text), more, closer);
  }

  function render() {
    if (!shown || element.hidden) return;
    const { station: { id, properties: facts }, sources } = shown;
    const focused = element.contains(document.activeElement) ? document.activeElement.dataset.key : null;
    const { theme } = session.get();
    const operator = operatorText(facts);
    const hindrance = hindranceText(facts);
    const price = priceText(facts);
    fill(
      element,
      head(stationName(facts)),
      el("p", { class: "row" }, el("span", { class: "station-dot", style: { "background-color": classColour(classOf(facts.power_kw), theme) } }), el("b", {}, powerText(facts.power_kw)), hindrance && el("span", { class: "station-hindrance" }, hindrance)),
      el(
        "dl",
        { class: "station-facts" },
        row("Operator", operator),
        row("Sockets", facts.sockets.length ? el("ul", {}, facts.sockets.map((socket) => el("li", {}, socketText(socket)))) : null),
        row("Hours", facts.opening_hours === "24/7" ? "all day, every day" : (facts.opening_hours ?? "not known")),
        row("Price", price ?? "not known"),
      ),
      choices(id),
      sourceText(facts.source, sources),
    );
    if (focused) element.querySelector(`[data-key="${focused}"]`)?.focus();
  }

  /** Whether the plan charges here, as a pair of buttons that are pressed or not. */
  function choices(id) {
    const { charging } = journey.get();
    const at = isChosen(charging, id);
    const not = charging.not.includes(id);
    const choose = (pressed, next) => journey.set({ tab: "route", charging: pressed ? withAnyStation(charging, id) : next(charging) });
    const button = (key, text, pressed, next) =>
      el("button", { type: "button", class: "button", "aria-pressed": String(pressed), dataset: { key }, on: { click: () => choose(pressed, next) } }, text);
    return el("div", { class: "row wrap" }, button("at", "Charge here", at, (chosen) => withStation(chosen, { id, ...placeOfFeature(shown.station) })), button("not", "Not here", not, (chosen) => withoutStation(chosen, id)));
  }

  return { open, show, close };
}

const row = (what, text) => text && el("div", {}, el("dt", {}, what), el("dd", {}, text));

/** Whose data a station is, and under which licence. */
export function sourceText(key, sources) {
  const source = sources.find((one) => one.key === key);
  if (!source) return null;
  const name = /^https?:\/\//.test(source.url) ? el("a", { href: source.url, rel: "noopener noreferrer" }, source.name) : source.name;
  return el("p", { class: "small dim" }, "Data: ", name, source.licence && ` (${source.licence})`, source.retrieved && `, ${source.retrieved}`);
}
