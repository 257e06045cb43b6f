/** Start, via points and goal: typed, clicked or dragged. */

import { byId, el, fill, newId } from "../dom.js";
import { icon } from "../icons.js";
import { placeFromText, placeText } from "../units.js";
import { MAX_VIA } from "./journey.js";

const MARGIN_DEG = 0.02; // places near a map's edge may still be near a road of it

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
  const waitFor = (key) => {
    waiting = key;
    render();
  };
  const put = (key, place) => {
    waiting = null;
    const rounded = place && { lat: Number(place.lat.toFixed(6)), lon: Number(wrapped(place.lon).toFixed(6)) };
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
    waitFor(waiting === key ? null : key);
    if (waiting) app.say(`Click the map to set ${titleOf(key).toLowerCase()}, or press Escape.`);
  };

  view.on("click", (place) => {
    if (journey.get().tab === "diagnosis") return;
    const key = target();
    if (key) put(key, place);
  });
  document.addEventListener("keydown", ({ key }) => {
    if (key === "Escape" && waiting) waitFor(null);
  });

  function render() {
    const { start, goal, via, tab } = journey.get();
    const route = tab === "route";
    if (tab === "diagnosis" || (waiting && !route && waiting !== "start") || Number(waiting?.split("-")[1] ?? -1) >= via.length) waiting = null;
    const rows = [["start", start], ...(route ? [...via.map((place, i) => [`via-${i}`, place]), ["goal", goal]] : [])];
    const focus = focusedKey(element);
    const drafts = draftsIn(element);
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
            button([icon("plus"), "Via point"], addVia, { dataset: { key: "add-via" }, disabled: !start || !goal || via.length >= MAX_VIA }),
            button([icon("swap"), "Swap"], () => replace({ start: goal, goal: start, via: via.toReversed() }), { dataset: { key: "swap" }, disabled: !start && !goal, title: "Swap start and goal" }),
            button([icon("close"), "Clear"], () => replace({ start: null, goal: null, via: [] }), { dataset: { key: "clear" }, disabled: !start && !goal }),
          ),
      ),
    );
    if (focus) focusOn(focus);
    for (const draft of drafts) keepDraft(element, draft);
    showMarkers();
    view.aim(waiting !== null);
    hint();
  }

  /** Other places instead of all that are shown or being typed. */
  function replace(places) {
    for (const input of element.querySelectorAll("input")) input.value = input.dataset.shown;
    journey.set(places);
    render();
  }

  /** Give the focus back to what had it; to a field near it where that is gone or disabled. */
  function focusOn(key) {
    const [kind, i] = key.split("-");
    const near = [key, kind, `via-${i}`, `via-${i - 1}`, "goal", "start"];
    near.map((one) => element.querySelector(`[data-key="${one}"]:enabled`)).find(Boolean)?.focus();
  }

  function addVia() {
    const { start, goal, via } = journey.get();
    const before = via.at(-1) ?? start;
    put(`via-${via.length}`, middleOf(session.get().routes.answer, before, goal));
    app.say("A via point was added half-way; type its coordinates, drag it, or click the map for it.");
    waitFor(`via-${via.length}`);
  }

  function row(key, place) {
    const id = newId("place");
    const title = titleOf(key);
    const message = el("div", { class: "message unseen", id: `${id}-message`, role: "status" });
    const input = el("input", {
      type: "text", id, value: placeText(place), placeholder: "latitude, longitude", autocomplete: "off", spellcheck: "false",
      inputmode: "text", "aria-describedby": `${id}-message`, dataset: { key, shown: placeText(place) },
      on: {
        change: () => setTimeout(() => leave(key)), // after the focus has gone on, which a new row would catch
        keydown: (event) => event.key === "Enter" && take(key),
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

  /** Take over what was typed, unless the row was only drawn anew while it is still typed in. */
  function leave(key) {
    if (document.activeElement?.dataset.key !== key) take(key);
  }

  /** Take over what was typed for a place, or say beside it what is wrong. */
  function take(key) {
    const input = element.querySelector(`input[data-key="${key}"]`);
    if (!input) return; // its row has gone meanwhile
    const { place, error } = placeFromText(input.value);
    showError(input, error);
    if (!error && input.value !== input.dataset.shown) put(key, place);
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

  journey.on(["start", "goal", "via", "tab"], render);
  session.on(["graphs"], () => dropOutside(app));
  journey.on(["graph"], () => dropOutside(app));
  render();
}

/** What is being typed, or can't be read, in the fields of places. */
function draftsIn(element) {
  return [...element.querySelectorAll("input")]
    .filter(({ value, dataset }) => value !== dataset.shown)
    .map((input) => ({
      key: input.dataset.key, shown: input.dataset.shown, value: input.value, selection: [input.selectionStart, input.selectionEnd],
      error: messageOf(input).textContent,
    }));
}

/** Leave a draft in its field, unless its place has become another one meanwhile. */
function keepDraft(element, { key, shown, value, selection, error }) {
  const input = element.querySelector(`input[data-key="${key}"]`);
  if (!input || input.dataset.shown !== shown) return;
  input.value = value;
  if (document.activeElement === input) input.setSelectionRange(...selection);
  showError(input, error);
}

const messageOf = (input) => document.getElementById(input.getAttribute("aria-describedby"));

/** Say beside a field what is wrong with it, empty for nothing. */
function showError(input, error) {
  input.setAttribute("aria-invalid", String(Boolean(error)));
  const message = messageOf(input);
  message.textContent = error;
  message.className = error ? "message" : "message unseen";
}

/** A longitude within ±180, also of a copy of the world beside the first one. */
const wrapped = (lon) => (Math.abs(lon) <= 180 ? lon : ((((lon + 180) % 360) + 360) % 360) - 180);

/** The middle between two places: on the first route of an answer, or on a straight line where there is none. */
function middleOf(answer, from, to) {
  const line = answer?.routes[0].geometry.coordinates ?? [];
  const apart = ([lon, lat]) => Math.hypot(lon - from.lon, lat - from.lat);
  const nearest = line.reduce((best, position, i) => (apart(position) < apart(line[best]) ? i : best), 0);
  const [lon, lat] = line[Math.floor((nearest + line.length) / 2)] ?? [(from.lon + to.lon) / 2, (from.lat + to.lat) / 2];
  return { lat, lon };
}

/** Places on another map are of no use on this one. */
function dropOutside({ journey, session, toast }) {
  const { graphs } = session.get();
  const { graph, start, goal, via } = journey.get();
  const known = graphs?.graphs.find(({ name }) => name === (graph ?? graphs.default));
  if (!known) return;
  const [west, south, east, north] = known.bbox;
  const inside = (place) =>
    place && place.lon > west - MARGIN_DEG && place.lon < east + MARGIN_DEG && place.lat > south - MARGIN_DEG && place.lat < north + MARGIN_DEG;
  const kept = { start: inside(start) ? start : null, goal: inside(goal) ? goal : null, via: via.filter(inside) };
  if ((start && !kept.start) || (goal && !kept.goal) || kept.via.length < via.length) {
    toast("Places outside of this map were removed.");
    journey.set(kept);
  }
}

const letterOf = (key) => (key.startsWith("via") ? String(Number(key.slice(4)) + 1) : key === "start" ? "A" : "B");
const focusedKey = (element) => (element.contains(document.activeElement) ? document.activeElement.dataset.key : null);
const button = (text, click, more = {}) => el("button", { type: "button", class: "quiet", on: { click }, ...more }, text);
