/** Routes: asked for, listed beside each other, drawn on the map, and followed along the way. */

import { ApiError, call, latest } from "../api.js";
import { createPlanResults } from "../charging/results.js";
import { byId, el, fill } from "../dom.js";
import { icon } from "../icons.js";
import { routeRequest } from "../journey/journey.js";
import { remember, remembered } from "../remembered.js";
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

const ASKED_BY = ["start", "goal", "via", "soc", "reserve", "vehicle", "graph", "conditions", "effects", "uncertainty", "charging"];
const NONE = { status: "none", answer: null, error: null };
const OF = "routes";
const STILL_MS = 1200; // after which further plans are asked for, which take longer

export function routesPanel(app, element) {
  const { journey, session } = app;
  const status = el("div", {});
  const shown = createResults(app);
  fill(element, el("h2", { class: "unseen" }, "Routes"), status, shown.element);

  const asking = latest(ask);
  const further = latest(askFurther, { delay: STILL_MS, maxWait: STILL_MS });
  const renew = () => {
    further.cancel();
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
      if (found.request.charging && !found.no_plan && !found.request.charging.via_stations.length) further.ask(); // with chosen stations there is little choice
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      session.set({ routes: { status: "failed", answer: null, error } });
    }
  }

  /** Other plans beside the best one. */
  async function askFurther(signal) {
    const { status: state, answer } = session.get().routes;
    const body = routeRequest(journey.get(), { further: true });
    if (state !== "done" || !body) return;
    session.set({ routes: { status: "done", answer, error: null, further: true } });
    let found = answer; // there are none where they can't be had
    try {
      found = await call("route", { body, signal });
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
    } finally {
      if (session.get().routes.answer === answer && session.get().routes.further) session.set({ routes: { status: "done", answer: found.no_plan ? answer : found, error: null } });
    }
  }

  function show() {
    showStatus();
    shown.show();
  }

  function showStatus() {
    const { status: state, answer, error, further: more } = session.get().routes;
    const { range } = session.get();
    element.setAttribute("aria-busy", String(state === "loading"));
    fill(
      status,
      state === "loading" && !answer && working(journey.get().charging.on ? "Planning …" : "Searching routes …"),
      state === "failed" && refusal(journey, error, () => asking.ask()),
      more && working("Looking for further plans …"),
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
  const chart = createChart((along) => {
    onMap.cursor(along);
    plan.cursor(along);
  });
  const plan = createPlanResults(app, (along) => {
    onMap.cursor(along);
    chart.cursor(along);
  }, change);
  const courses = createCourses({ time: plan.timeline, way: chart.element });
  const onMap = createRoutesOnMap(app, {
    choose: chooseOnMap,
    stretch: markOnMap,
    along(along) {
      chart.cursor(along);
      plan.cursor(along);
    },
  });
  const notice = el("div", {});
  const chartPlace = el("div", {});
  const below = el("div", { class: "stack" });
  const element = el("div", { class: "stack", hidden: true }, notice, cards.element, chartPlace, plan.list, below);

  let looked = null; // the route that is looked at: {answer, route, profile, reserve, reach, units}
  let stretch = null; // position of the hot stretch that is marked
  let unfolded = false; // whether the figures are shown

  const redraw = () => onMap.draw(looked, stretch, plan.markers(redraw));
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
    plan.show(looked);
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
    fill(notice, plan.notice(answer) ?? (reach !== null && outOfReach(route, reach, reserve, others, app.units(), act)));
  }

  /** Change what was chosen, by a button that goes away. */
  function change(patch) {
    cards.focus();
    journey.set(patch);
  }

  function showBelow() {
    const { answer, route } = looked;
    const units = app.units();
    const legs = !route.charging && legsTable(route, units);
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
    const places = route.charging ? route.charging.stops.map(({ along_m: at }) => at) : route.legs.slice(1).map(({ from_m: from }) => from);
    const heights = answer.terrain.terrain !== "absent";
    chart.show({ profile, units: app.units(), reserve, heights, name: `Along ${NAMES[route.name] ?? route.name}`, reach_m: reach, places_m: places, stretch: hot });
  }

  /** On a phone the chart lies in the panel, elsewhere below the map. */
  function placeChart() {
    const drawer = byId("drawer");
    const wanted = Boolean(looked?.route.links.length);
    courses.show(Boolean(looked?.route.charging));
    if (wanted && PHONE.matches && !chartPlace.contains(courses.element)) fill(chartPlace, el("div", { class: "card" }, courses.element));
    if (wanted && !PHONE.matches && !drawer.contains(courses.element)) fill(drawer, courses.element);
    if (wanted) drawer.dataset.of = OF;
    if (drawer.dataset.of === OF) drawer.hidden = !wanted || PHONE.matches;
    chartPlace.hidden = !wanted || !PHONE.matches;
  }

  return { element, show };
}

/** The charts below the map, of which a plan has two: along time and along the way. */
function createCourses(charts) {
  const names = { time: "Along time", way: "Along the way" };
  let chosen = remembered("course") === "way" ? "way" : "time";
  const buttons = Object.keys(names).map((key) => el("button", { type: "button", class: "profile-toggle", on: { click: () => choose(key) } }, names[key]));
  const head = el("div", { class: "courses-head", role: "group", "aria-label": "Chart" }, buttons);
  const element = el("div", { class: "courses" }, charts.way);
  let both = false;

  function choose(key) {
    chosen = key;
    remember("course", key);
    show(both);
  }

  /** plan: whether there is a timeline. */
  function show(plan) {
    if (plan && !both) element.prepend(head, charts.time);
    if (!plan && both) for (const part of [head, charts.time]) part.remove();
    both = plan;
    charts.time.hidden = chosen !== "time";
    charts.way.hidden = plan && chosen !== "way";
    for (const [i, key] of Object.keys(names).entries()) buttons[i].setAttribute("aria-pressed", String(key === chosen));
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
