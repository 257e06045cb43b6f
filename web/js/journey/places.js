/** Start, via points and goal: typed, clicked or dragged. */

import { byId, el, fill, newId } from "../dom.js";
import { icon } from "../icons.js";
import { placeFromText, placeText } from "../units.js";
import { MAX_VIA } from "./journey.js";

/** The panel of places; it also sets the markers, and takes the clicks on the map. */
export function placesPanel(app, element) {
  const { journey, view, session } = app;
  let waiting = null; // the place that the next click on the map is for, null: the first that is missing

  const target = () => {
    if (waiting) return waiting;
    const { start, goal, tab } = journey.get();
    if (!start || tab === "range") return "start";
    return goal ? null : "goal";
  };
  const put = (key, place) => {
    waiting = null;
    const rounded = place && { lat: Number(place.lat.toFixed(6)), lon: Number(place.lon.toFixed(6)) };
    if (key.startsWith("via")) {
      const via = [...journey.get().via];
      const i = Number(key.slice(4));
      if (rounded) via[i] = rounded;
      else via.splice(i, 1);
      journey.set({ via });
    } else {
      journey.set({ [key]: rounded });
    }
    render();
  };
  const pick = (key) => {
    waiting = waiting === key ? null : key;
    render();
    if (waiting) app.say(`Click the map to set ${titleOf(key).toLowerCase()}, or press Escape.`);
  };

  view.on("click", (place) => {
    if (journey.get().tab === "diagnosis") return;
    const key = target();
    if (key) put(key, place);
  });
  document.addEventListener("keydown", ({ key }) => {
    if (key !== "Escape" || !waiting) return;
    waiting = null;
    render();
  });

  function render() {
    const { start, goal, via, tab } = journey.get();
    const route = tab === "route";
    const rows = [["start", start], ...(route ? [...via.map((place, i) => [`via-${i}`, place]), ["goal", goal]] : [])];
    const focus = focusedKey(element);
    fill(
      element,
      el(
        "div",
        { class: "card" },
        el("h2", { class: "unseen" }, "Places"),
        rows.map(([key, place]) => row(key, place)),
        route &&
          el(
            "div",
            { class: "row wrap places-actions" },
            button([icon("plus"), "Via point"], () => addVia(), { disabled: !start || !goal || via.length >= MAX_VIA }),
            button([icon("swap"), "Swap"], () => journey.set({ start: goal, goal: start, via: via.toReversed() }), { disabled: !start && !goal, title: "Swap start and goal" }),
            button([icon("close"), "Clear"], () => journey.set({ start: null, goal: null, via: [] }), { disabled: !start && !goal }),
          ),
      ),
    );
    if (focus) element.querySelector(`[data-key="${focus}"]`)?.focus();
    showMarkers();
    hint();
  }

  function addVia() {
    const { start, goal, via } = journey.get();
    const before = via.at(-1) ?? start;
    put(`via-${via.length}`, { lat: (before.lat + goal.lat) / 2, lon: (before.lon + goal.lon) / 2 });
    app.say("A via point was added half-way; type its coordinates, drag it, or click the map for it.");
    waiting = `via-${via.length}`;
    render();
  }

  function row(key, place) {
    const id = newId("place");
    const title = titleOf(key);
    const message = el("div", { class: "message unseen", id: `${id}-message`, role: "status" });
    const commit = () => {
      const { place: typed, error } = placeFromText(input.value);
      input.setAttribute("aria-invalid", String(Boolean(error)));
      message.textContent = error;
      message.className = error ? "message" : "message unseen";
      if (!error) put(key, typed);
    };
    const input = el("input", {
      type: "text", id, value: placeText(place), placeholder: "latitude, longitude", autocomplete: "off", spellcheck: "false",
      inputmode: "text", "aria-describedby": `${id}-message`, dataset: { key },
      on: {
        change: () => setTimeout(commit), // after the focus has gone on, which a new row would catch
        keydown: (event) => event.key === "Enter" && commit(),
      },
    });
    const kind = key.split("-")[0];
    return el(
      "div",
      { class: "place" },
      el("span", { class: `pin ${kind}`, "aria-hidden": "true" }, letterOf(key)),
      el("div", { class: "field" }, el("label", { for: id, class: "unseen" }, `${title}, latitude and longitude`), input, message),
      el("button", { type: "button", class: "icon-button", "aria-pressed": String(waiting === key), "aria-label": `Set ${title.toLowerCase()} on the map`, title: "Set on the map", dataset: { key: `${key}-aim` }, on: { click: () => pick(key) } }, icon("aim")),
      el("button", { type: "button", class: "icon-button", "aria-label": `Remove ${title.toLowerCase()}`, title: "Remove", dataset: { key: `${key}-remove` }, disabled: !place, on: { click: () => put(key, null) } }, icon("close")),
    );
  }

  function showMarkers() {
    const { start, goal, via, tab } = journey.get();
    const wanted = [];
    const mark = (key, place) =>
      place && wanted.push({ key, kind: key.split("-")[0], letter: letterOf(key), title: titleOf(key), place, onMove: (moved) => put(key, moved) });
    if (tab !== "diagnosis") mark("start", start);
    if (tab === "route") {
      via.forEach((place, i) => mark(`via-${i}`, place));
      mark("goal", goal);
    }
    view.placeMarkers(wanted);
  }

  function hint() {
    const { tab } = journey.get();
    const key = tab === "diagnosis" ? null : target();
    const missing = key && (waiting || !(key === "start" ? journey.get().start : journey.get().goal));
    const box = byId("map-hint");
    box.hidden = !missing;
    if (missing) fill(box, `Click the map to set ${tab === "range" && key === "start" ? "the place" : titleOf(key).toLowerCase()}`);
  }

  function titleOf(key) {
    if (key.startsWith("via")) return `Via point ${Number(key.slice(4)) + 1}`;
    if (key === "goal") return "Goal";
    return journey.get().tab === "range" ? "Place" : "Start";
  }

  journey.on(["start", "goal", "via", "tab", "graph"], render);
  session.on(["tiles"], () => {
    dropOutside(app);
    render();
  });
  render();
}

/** Places on another map are of no use on this one. */
function dropOutside({ journey, session, toast }) {
  const { tiles } = session.get();
  const { start, goal, via } = journey.get();
  const [west, south, east, north] = tiles.bounds;
  const inside = (place) => place && place.lon >= west && place.lon <= east && place.lat >= south && place.lat <= north;
  const kept = { start: inside(start) ? start : null, goal: inside(goal) ? goal : null, via: via.filter(inside) };
  if ((start && !kept.start) || (goal && !kept.goal) || kept.via.length < via.length) {
    toast("Places outside of this map were removed.");
    journey.set(kept);
  }
}

const letterOf = (key) => (key.startsWith("via") ? String(Number(key.slice(4)) + 1) : key === "start" ? "A" : "B");
const focusedKey = (element) => (element.contains(document.activeElement) ? document.activeElement.dataset.key : null);
const button = (text, click, more = {}) => el("button", { type: "button", class: "quiet", on: { click }, ...more }, text);
