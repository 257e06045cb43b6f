/** Routes: asked for, listed beside each other, drawn on the map, and followed along the way. */

import { ApiError, call, latest } from "../api.js";
import { byId, el, fill } from "../dom.js";
import { icon } from "../icons.js";
import { routeRequest } from "../journey/journey.js";
import { bringToPhone, PHONE, refusal, warningsOf, working } from "../notices.js";
import { createCards } from "./cards.js";
import { createChart } from "./chart.js";
import { answerText, chosenOf, isSame, NAMES } from "./compare.js";
import { figuresTables, legsTable } from "./details.js";
import { saveAnswer, saveTrack } from "./files.js";
import { outOfReach } from "./notice.js";
import { createRoutesOnMap } from "./onmap.js";
import { partsTable } from "./parts.js";
import { profileOf, reachOf } from "./profile.js";
import { stretchList } from "./stretches.js";

const ASKED_BY = ["start", "goal", "via", "soc", "reserve", "vehicle", "graph", "conditions", "effects", "uncertainty"];
const NONE = { status: "none", answer: null, error: null };
const OF = "routes";

export function routesPanel(app, element) {
  const { journey, session } = app;
  const status = el("div", {});
  const shown = createResults(app);
  fill(element, el("h2", { class: "unseen" }, "Routes"), status, shown.element);

  const asking = latest(ask);
  const renew = () => {
    if (journey.get().tab === "route" && routeRequest(journey.get())) asking.ask();
    else {
      asking.cancel();
      session.set({ routes: NONE });
    }
  };
  journey.on([...ASKED_BY, "tab"], renew);
  journey.on(["start", "goal", "tab"], showStatus);
  session.on(["routes"], show);
  session.on(["range"], showStatus);
  renew();
  show();

  async function ask(signal) {
    const { answer } = session.get().routes;
    session.set({ routes: { status: "loading", answer, error: null } });
    try {
      const found = await call("route", { body: routeRequest(journey.get()), signal });
      session.set({ routes: { status: "done", answer: found, error: null } });
      app.say(answerText(found, app.units()));
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      session.set({ routes: { status: "failed", answer: null, error } });
    }
  }

  function show() {
    showStatus();
    shown.show();
  }

  function showStatus() {
    const { status: state, answer, error } = session.get().routes;
    const { range } = session.get();
    element.setAttribute("aria-busy", String(state === "loading"));
    fill(
      status,
      state === "loading" && !answer && working("Searching routes …"),
      state === "failed" && refusal(journey, error, () => asking.ask()),
      state === "none" && journey.get().tab === "route" && el("p", { class: "dim" }, missingText(journey.get())),
      state === "none" && range.status === "failed" && refusal(journey, range.error),
    );
    if (status.querySelector(".notice")) bringToPhone(status);
  }
}

/** The results: cards, chart and what is said of the route that is looked at. */
function createResults(app) {
  const { journey, session } = app;
  const cards = createCards((name) => journey.set({ route: name }));
  const chart = createChart((along) => onMap.cursor(along));
  const onMap = createRoutesOnMap(app, { choose: chooseOnMap, stretch: markOnMap, along: (along) => chart.cursor(along) });
  const notice = el("div", {});
  const chartPlace = el("div", {});
  const below = el("div", { class: "stack" });
  const element = el("div", { class: "stack", hidden: true }, notice, cards.element, chartPlace, below);

  let looked = null; // the route that is looked at: {answer, route, profile, reserve, reach, units}
  let stretch = null; // position of the hot stretch that is marked
  let unfolded = false; // whether the figures are shown

  const redraw = () => onMap.draw(looked, stretch);
  session.on(["theme"], redraw);
  journey.on(["colour"], redraw);
  journey.on(["units"], () => looked && show());
  journey.on(["route"], () => {
    look();
    if (looked) onMap.fitWhereLost();
  });
  PHONE.addEventListener("change", placeChart);

  /** Show what the session has; where only its status changed, what is shown stays. */
  function show() {
    const { status, answer } = session.get().routes;
    element.classList.toggle("stale", status === "loading");
    if (status === "none") onMap.forget();
    if (answer && answer === looked?.answer && looked.units === journey.get().units) return;
    element.hidden = !answer;
    if (answer) cards.show(answer, app.units());
    look();
  }

  /** Look at the chosen route of the answer. */
  function look() {
    const { answer } = session.get().routes;
    const before = looked?.route;
    looked = answer && lookAt(answer, journey.get());
    if (!looked || !before || !isSame(looked.route, before)) stretch = null;
    placeChart();
    showChart();
    redraw();
    if (!looked) return;
    cards.select(looked.route.name);
    const isNew = onMap.fitWhereNew();
    showNotice();
    showBelow();
    if (isNew) bringToPhone(cards.element);
  }

  function showNotice() {
    const { answer, route, reach, reserve } = looked;
    const others = answer.routes.filter(({ feasible }) => feasible);
    const act = {
      setCharge: (soc) => change({ soc }),
      setReserve: (least) => change({ reserve: least }),
      choose: (name) => change({ route: name }),
    };
    fill(notice, reach !== null && outOfReach(route, reach, reserve, others, app.units(), act));
  }

  /** Change what was chosen, by a button that goes away. */
  function change(patch) {
    cards.focus();
    journey.set(patch);
  }

  function showBelow() {
    const { answer, route } = looked;
    const units = app.units();
    const legs = legsTable(route, units);
    const focused = below.contains(document.activeElement) ? document.activeElement.dataset.stretch : undefined;
    fill(
      below,
      legs && el("div", { class: "card legs" }, legs),
      route.links.length > 0 && el("div", { class: "card" }, el("h2", {}, "Where the energy goes"), partsTable(route)),
      route.hot_links.length > 0 && hotCard(route, units),
      actions(),
      el("details", { class: "card", open: unfolded, on: { toggle: ({ target }) => (unfolded = target.open) } }, el("summary", {}, "Details"), figuresTables(route, answer, units)),
      warningsOf(answer.warnings),
    );
    if (focused !== undefined) stretchButton(focused)?.focus();
  }

  function hotCard(route, units) {
    const list = stretchList(route, stretch, units, (index) => {
      mark(index);
      if (index !== null) onMap.showStretch(index);
    });
    return el("div", { class: "card" }, el("h2", {}, "Hot stretches"), el("p", { class: "small dim" }, "They take the most beyond the route's mean."), list);
  }

  function actions() {
    return el(
      "div",
      { class: "row wrap" },
      button(save, icon("down"), "GeoJSON"),
      looked.route.links.length > 0 && button(() => saveTrack(looked), icon("down"), "GPX"),
      button(onMap.showAll, "Show all of it"),
    );
  }

  async function save() {
    try {
      await saveAnswer(looked.answer);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      app.toast(error.message);
    }
  }

  const stretchButton = (index) => below.querySelector(`[data-stretch="${index}"]`);

  /** Mark a hot stretch, null for none. */
  function mark(index) {
    stretch = index;
    showBelow();
    onMap.mark(stretch);
    chart.mark(index === null ? null : looked.route.hot_links[index]);
  }

  function markOnMap(index) {
    mark(index);
    stretchButton(index)?.scrollIntoView({ block: "nearest" });
  }

  function chooseOnMap(name) {
    journey.set({ route: name });
    app.say(`${NAMES[name] ?? name} is looked at.`);
  }

  function showChart() {
    if (!looked || !looked.route.links.length) return;
    const { answer, route, profile, reserve, reach } = looked;
    const hot = stretch === null ? null : route.hot_links[stretch];
    const places = route.legs.slice(1).map(({ from_m: from }) => from);
    const heights = answer.terrain.terrain !== "absent";
    chart.show({ profile, units: app.units(), reserve, heights, name: `Along ${NAMES[route.name] ?? route.name}`, reach_m: reach, places_m: places, stretch: hot });
  }

  /** On a phone the chart lies in the panel, elsewhere below the map. */
  function placeChart() {
    const drawer = byId("drawer");
    const wanted = Boolean(looked?.route.links.length);
    if (wanted && PHONE.matches && !chartPlace.contains(chart.element)) fill(chartPlace, el("div", { class: "card" }, chart.element));
    if (wanted && !PHONE.matches && !drawer.contains(chart.element)) fill(drawer, chart.element);
    if (wanted) drawer.dataset.of = OF;
    if (drawer.dataset.of === OF) drawer.hidden = !wanted || PHONE.matches;
    chartPlace.hidden = !wanted || !PHONE.matches;
  }

  return { element, show };
}

const button = (click, ...content) => el("button", { type: "button", class: "button", on: { click } }, content);

/** All that is needed to show the chosen route of an answer. */
function lookAt(answer, { route: name, units }) {
  const route = chosenOf(answer, name);
  const profile = profileOf(route);
  const reserve = answer.request.reserve_soc;
  return { answer, route, profile, reserve, reach: reachOf(profile, reserve), units };
}

function missingText({ start, goal }) {
  if (start && goal) return "";
  if (!start) return "Set start and goal to see routes.";
  return "Set a goal to see routes. The area shows how far the charge goes.";
}
