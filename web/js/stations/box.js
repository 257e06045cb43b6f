/** The switch of the stations on the map, what their dots mean, and a list of those in view for who can't point at them. */

import { ApiError } from "../api.js";
import { byId, el, fill } from "../dom.js";
import { icon } from "../icons.js";
import { failure, PHONE, working } from "../notices.js";
import { number } from "../units.js";
import { createStationCard } from "./card.js";
import { stationsInView } from "./details.js";
import { CLASSES, classColour, powerText } from "./power.js";
import { socketText, stationName } from "./words.js";

const MOST_SHOWN = 30;

/** Whether stations are drawn: as the user says, or else where stops are planned. */
export const stationsShown = ({ stations, charging, tab }) => tab !== "diagnosis" && (stations ?? (charging.on && tab === "route"));

/** Whether the graph on the map has stations, null before that is known. */
export const hasStations = ({ tiles }) => (tiles ? (tiles.vector_layers ?? []).some(({ id }) => id === "stations") : null);

/** Attach the switch and the card; gives the card. */
export function attachStations(app) {
  const { journey, session, view } = app;
  const box = byId("stations-box");
  const card = createStationCard(app, byId("station-card"));
  let listing = null; // what the list holds: null for closed, {status, found}

  const toggle = el("button", { type: "button", class: "map-button", on: { click: () => journey.set({ stations: !stationsShown(journey.get()) }) } }, icon("bolt"), el("span", {}, "Stations"));
  const key = el("ul", { class: "stations-key" });
  const lister = el("button", { type: "button", class: "link-button", "aria-expanded": "false", on: { click: list } });
  const items = el("div", {});
  const below = el("div", { class: "stations-below" }, key, lister, items);
  fill(box, toggle, below);

  view.on("pick", ({ source, properties }, place, zoom) => {
    if (source !== "station") return;
    card.open(properties.id, place, { reach_deg: Math.max(0.001, 3 / 2 ** Math.min(Math.floor(zoom), 14)) });
  });
  journey.on(["stations", "charging", "tab"], show);
  session.on(["tiles", "theme"], show);
  journey.on(["graph"], () => {
    listing = null;
    show();
  });
  PHONE.addEventListener("change", show);
  show();

  function show() {
    const wanted = stationsShown(journey.get());
    const { tab } = journey.get();
    box.hidden = tab === "diagnosis" || !hasStations(session.get());
    toggle.setAttribute("aria-pressed", String(wanted));
    toggle.setAttribute("aria-label", "Charging stations on the map");
    below.hidden = !wanted;
    view.showStations(wanted);
    if (!wanted) listing = null;
    const { theme } = session.get();
    fill(key, CLASSES.map(({ name, radius }, i) => el("li", {}, el("span", { class: "station-dot", style: { "background-color": classColour(i, theme), width: `${2 * radius}px`, height: `${2 * radius}px` } }), name)));
    key.hidden = PHONE.matches;
    showList();
  }

  function showList() {
    lister.textContent = listing ? "Close the list" : "List those in view";
    lister.setAttribute("aria-expanded", String(Boolean(listing)));
    fill(items, listing && (listing.found ? entries(listing.found) : listing.error ? failure(listing.error, null) : working("Looking …")));
  }

  async function list() {
    listing = listing ? null : { found: null };
    showList();
    if (!listing) return;
    const mine = listing;
    try {
      mine.found = await stationsInView(app, view.extentShown());
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      mine.error = error;
    }
    if (listing === mine) showList();
  }

  function entries({ stations, matched, sources }) {
    if (!matched) return el("p", { class: "small dim" }, "None in view.");
    const shown = stations.slice(0, MOST_SHOWN);
    return [
      matched > shown.length && el("p", { class: "small dim" }, `The strongest ${number(shown.length)} of ${number(matched)}.`),
      el("ul", { class: "stations-list", "aria-label": "Charging stations in view" }, shown.map((station) => el(
        "li", {},
        el("button", { type: "button", class: "stations-entry", title: station.properties.sockets.map(socketText).join("; "), on: { click: ({ currentTarget }) => card.show(station, sources, { from: currentTarget }) } },
          el("span", { class: "grow" }, stationName(station.properties)), el("span", { class: "num" }, powerText(station.properties.power_kw))),
      ))),
    ];
  }

  return card;
}
