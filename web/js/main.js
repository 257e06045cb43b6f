/** Puts the page together: stores, map, panels, and the address. */

import { keepAddress } from "./address.js";
import { ApiError, call } from "./api.js";
import { chargingForm } from "./charging/form.js";
import { attachChrome } from "./chrome.js";
import { byId, el, fill } from "./dom.js";
import { conditionsPanel } from "./journey/conditions.js";
import { journeyOf, setDefaultGraph } from "./journey/journey.js";
import { placesPanel } from "./journey/places.js";
import { vehiclePanel } from "./journey/vehicle.js";
import { askForKey } from "./key.js";
import { MapView } from "./map/view.js";
import { working } from "./notices.js";
import { rangePanel } from "./range/panel.js";
import { routesPanel } from "./routes/panel.js";
import { attachStations } from "./stations/box.js";
import { createStore } from "./store.js";
import { unitsOf } from "./units.js";

/**
 * What every panel is given.
 * settings: what the service says of itself (web/settings.json).
 * journey: what the user has chosen (journey/journey.js). session: what came back: `graphs` and `vehicles` (lists of the
 * service), `tiles` (of the chosen graph), `routes`, `range`: {status: "none"|"loading"|"done"|"failed", answer, error},
 * `theme`, `stationNames`. stationCard: that of a charging station over the map. units(): formats of the chosen units. say(text): tells screen readers. toast(text): tells everybody.
 */
function createApp(view, settings) {
  const journey = createStore(journeyOf(location.search));
  const session = createStore({
    graphs: null,
    vehicles: null,
    tiles: null,
    stationNames: {}, // by id, of those that were seen
    theme: "light",
    routes: { status: "none", answer: null, error: null },
    range: { status: "none", answer: null, error: null },
  });
  return {
    settings,
    journey,
    session,
    view,
    units: () => unitsOf(journey.get().units),
    say(text) {
      byId("announcer").textContent = text;
    },
    toast(text) {
      const box = fill(byId("toast"), text);
      box.hidden = false;
      clearTimeout(box.timer);
      box.timer = setTimeout(() => {
        box.hidden = true;
      }, 4000);
    },
  };
}

async function start() {
  const asked = [call("web/settings.json"), call("graphs"), call("vehicles")];
  for (const one of asked) one.catch(() => {}); // each is waited for below, and may fail before
  const settings = await asked[0];
  const view = new MapView(byId("map"), { styleUrl: settings.map_style_url });
  const app = createApp(view, settings);
  byId("version").textContent = `joulepath ${settings.version}`;
  attachChrome(app);
  placesPanel(app, byId("places"));
  vehiclePanel(app, byId("vehicle"));
  conditionsPanel(app, byId("conditions"));
  app.stationCard = attachStations(app);
  chargingForm(app, byId("charging"));
  openDiagnosis(app);
  keepAddress(app.journey);
  app.journey.on(["graph"], () => showGraph(app));
  app.session.on(["theme"], ({ tiles }) => tiles && drawGraph(app, tiles));
  asked[2].then(
    (vehicles) => app.session.set({ vehicles }),
    (error) => app.session.set({ vehicles: { vehicles: [], default: null, error: error.message } }),
  );
  const graphs = await asked[1];
  setDefaultGraph(graphs.default);
  app.session.set({ graphs });
  // Not before: what is asked names the graph that is shown.
  routesPanel(app, byId("routes"));
  rangePanel(app, byId("range"));
  await showGraph(app);
}

/** The tab of diagnoses is loaded when it is first looked at. */
function openDiagnosis(app) {
  const pane = byId("pane-diagnosis");
  let opened = false;
  const open = async () => {
    if (opened || app.journey.get().tab !== "diagnosis") return;
    opened = true;
    fill(pane, working("Loading …"));
    try {
      const { diagnosisPane } = await import("./diagnosis/pane.js");
      diagnosisPane(app, pane);
    } catch (error) {
      console.warn(error);
      fill(pane, el("div", { class: "notice bad", role: "alert" }, "The diagnosis could not be loaded. ", retry()));
    }
  };
  app.journey.on(["tab"], open);
  open();
}

/** Draw the chosen graph, or the default one where there is none of that name. */
async function showGraph(app) {
  const { journey, session, view, toast } = app;
  const { graphs } = session.get();
  const wanted = journey.get().graph ?? graphs.default;
  const known = graphs.graphs.find(({ name }) => name === wanted);
  if (!known) {
    toast(`There is no graph ${wanted} here; ${graphs.default} is shown.`);
    journey.set({ graph: null, start: null, goal: null, via: [] });
    return;
  }
  try {
    const tiles = await call(`graphs/${encodeURIComponent(known.name)}/tiles.json`);
    if ((journey.get().graph ?? graphs.default) !== known.name) return;
    const again = session.get().tiles !== null;
    if (again) view.fit(tiles.bounds, { animate: false });
    session.set({ tiles });
    drawGraph(app, tiles);
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    view.fail(error.message, () => showGraph(app));
  }
}

/** Draw a graph, or say why this browser can't; all but the map works then too. */
function drawGraph({ session, view }, tiles) {
  try {
    view.show(tiles, session.get().theme);
  } catch (error) {
    view.fail("This browser can't draw the map: WebGL seems to be missing or switched off. Places can be typed, and all results are listed.");
    console.warn(error);
  }
}

start().catch((error) => {
  if (error instanceof ApiError && error.status === 401) {
    askForKey(error.message);
    return;
  }
  const message = error instanceof ApiError ? error.message : `The page could not start: ${error.message}`;
  fill(byId("places"), el("div", { class: "notice bad", role: "alert" }, message, " ", retry()));
});

function retry() {
  return el("button", { type: "button", class: "button", on: { click: () => location.reload() } }, "Try again");
}
