/** The chart along the way: lanes over one axis of distance, with a cursor that can be moved by pointer and keys. */

import { el, fill, svg } from "../dom.js";
import { remember, remembered } from "../remembered.js";
import { number } from "../units.js";
import { LANES, lanesFor, readingOf } from "./lanes.js";
import { valuesAt } from "./profile.js";
import { digitsOf, linear, ticksOf } from "../chart/scales.js";

const LEFT_PX = 44;
const RIGHT_PX = 14;
const TITLE_PX = 15;
const AXIS_PX = 18;
const GAP_PX = 5;
const STEPS = { ArrowRight: 0.01, ArrowUp: 0.01, ArrowLeft: -0.01, ArrowDown: -0.01, PageUp: 0.1, PageDown: -0.1 };

/**
 * A chart. moved(along_m | null): called where the user moves its cursor. Gives {element, show, cursor, mark}.
 */
export function createChart(moved) {
  const shown = new Set(["charge", "height", "speed"]);
  let data = null; // {profile, units, reserve, heights, name, reach_m, places_m, stretch}
  let drawn = null; // {x, lanes} of the last drawing
  let along = null;

  const title = el("h2", {});
  const reading = el("p", { class: "profile-reading num" });
  const toggles = Object.entries(LANES).map(([key, lane]) =>
    el("button", { type: "button", class: `profile-toggle toggle-${key}`, on: { click: () => toggle(key) } }, lane.name),
  );
  const opener = el("button", { type: "button", class: "quiet", on: { click: () => setOpen(plot.hidden) } });
  const plot = el("div", { class: "profile-plot", role: "slider", tabindex: "0", "aria-label": "Place along the route", "aria-valuemin": "0" });
  const curves = el("div", { class: "profile-toggles", role: "group", "aria-label": "Curves" }, toggles);
  const element = el("section", { class: "profile", "aria-label": "Along the route" }, el("div", { class: "profile-head" }, title, curves, opener), reading, plot);

  plot.addEventListener("pointermove", (event) => point(event));
  plot.addEventListener("pointerdown", (event) => point(event));
  plot.addEventListener("pointerleave", ({ pointerType }) => pointerType === "touch" || move(null));
  plot.addEventListener("focus", () => along ?? move(0));
  plot.addEventListener("blur", () => move(null));
  plot.addEventListener("keydown", press);
  new ResizeObserver(() => draw()).observe(plot);
  setOpen(remembered("chart") !== "closed");

  function setOpen(open) {
    plot.hidden = !open;
    reading.hidden = !open;
    curves.hidden = !open;
    opener.textContent = open ? "Hide chart" : "Show chart";
    opener.setAttribute("aria-expanded", String(open));
    remember("chart", open ? "open" : "closed");
    draw();
  }

  function toggle(key) {
    if (visible().join() !== key && !shown.delete(key)) shown.add(key); // the last one stays
    draw();
  }

  /** Names of the lanes that are drawn, at least one. */
  function visible() {
    const some = lanesFor(data ?? { heights: true }).filter((key) => shown.has(key));
    return some.length ? some : ["charge"];
  }

  function showToggles() {
    const drawable = lanesFor(data ?? { heights: true });
    for (const [i, key] of Object.keys(LANES).entries()) {
      toggles[i].hidden = !drawable.includes(key);
      toggles[i].setAttribute("aria-pressed", String(visible().includes(key)));
    }
    plot.style.setProperty("--weight", visible().reduce((sum, key) => sum + LANES[key].weight, 0));
  }

  function point(event) {
    if (!drawn) return;
    move(drawn.x.invert(event.clientX - plot.getBoundingClientRect().left));
  }

  function press(event) {
    if (!data) return;
    const length = data.profile.length_m;
    const now = along ?? 0;
    const ends = { Home: 0, End: length };
    if (event.key === "Escape") move(null);
    else if (event.key in ends) move(ends[event.key]);
    else if (event.key in STEPS) move(Math.min(length, Math.max(0, now + STEPS[event.key] * length)));
    else return;
    event.preventDefault();
  }

  function move(to) {
    cursor(to);
    moved(to);
  }

  /** Draw another route, or the same one in other units. */
  function show(next) {
    data = next;
    fill(title, next.name);
    plot.setAttribute("aria-valuemax", next.units.length(next.profile.length_m).toFixed(1));
    draw();
  }

  /** Mark the stretch {from_m, to_m}, null for none. */
  function mark(stretch) {
    if (!data) return;
    data = { ...data, stretch };
    draw();
  }

  function draw() {
    showToggles();
    const [width, height] = [plot.clientWidth, plot.clientHeight];
    if (!data || plot.hidden || width < LEFT_PX + RIGHT_PX + 40 || height < 60) return;
    const { profile } = data;
    const x = linear([0, profile.length_m], [LEFT_PX, width - RIGHT_PX]);
    const lanes = placed(height).map(([lane, top, bottom]) => {
      const domain = lane.domain(profile, data);
      return { lane, top, bottom, y: linear(domain, [bottom, top]), ticks: ticksOf(domain, Math.max(1, (bottom - top) / 17)) };
    });
    const bottom = height - AXIS_PX;
    drawn = { x, lanes, bottom };
    fill(
      plot,
      svg("svg", { width, height, viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" }, backdrop(), lanes.map(drawLane), distanceAxis(width), svg("g", { class: "profile-cursor" })),
    );
    cursor(along);
  }

  function placed(height) {
    const lanes = visible().map((key) => LANES[key]);
    const room = height - AXIS_PX - lanes.length * (TITLE_PX + GAP_PX);
    const weight = lanes.reduce((sum, lane) => sum + lane.weight, 0);
    let top = 0;
    return lanes.map((lane) => {
      const from = top + TITLE_PX;
      top = from + (room * lane.weight) / weight + GAP_PX;
      return [lane, from, top - GAP_PX];
    });
  }

  /** What goes through all lanes: the marked stretch, via points, and where the charge ends. */
  function backdrop() {
    const { x, bottom } = drawn;
    const { stretch, places_m: places, reach_m: reach } = data;
    const upright = (at, name) => svg("line", { class: name, x1: x(at), x2: x(at), y1: 2, y2: bottom });
    return [
      stretch && svg("rect", { class: "profile-stretch", x: x(stretch.from_m), width: Math.max(2, x(stretch.to_m) - x(stretch.from_m)), y: 0, height: bottom }),
      reach !== null && svg("rect", { class: "profile-beyond", x: x(reach), width: Math.max(0, x(Infinity) - x(reach)), y: 0, height: bottom }),
      places.map((at, i) => [upright(at, "profile-via"), svg("text", { x: x(at) + 3, y: 10, class: "profile-label" }, String(i + 1))]),
      reach !== null && upright(reach, "profile-reach"),
    ];
  }

  function drawLane({ lane, top, bottom, y, ticks }) {
    const { x } = drawn;
    const digits = digitsOf(ticks);
    const [start, end] = [x(0), x(Infinity)];
    return svg(
      "g",
      {},
      svg("text", { class: "profile-label", x: start, y: top - 4 }, `${lane.name}, ${lane.unit(data.units)}`),
      ticks.map((tick) => [
        svg("line", { class: "profile-grid", x1: start, x2: end, y1: y(tick), y2: y(tick) }),
        svg("text", { class: "profile-tick", x: start - 6, y: y(tick) + 3.5, "text-anchor": "end" }, number(tick, digits)),
      ]),
      lane.marks(data.profile, x, y, data).map((one) => {
        if (one.d) return svg("path", { class: one.class, d: one.d });
        const at = y(one.level);
        return [
          svg("line", { class: one.class, x1: start, x2: end, y1: at, y2: at }),
          one.text && svg("text", { class: `${one.class}-label`, x: start + 4, y: at - 3 < top + 8 ? at + 11 : at - 3 }, one.text),
        ];
      }),
      svg("line", { class: "profile-base", x1: start, x2: end, y1: bottom, y2: bottom }),
    );
  }

  function distanceAxis(width) {
    const { units, profile } = data;
    const ticks = ticksOf([0, units.length(profile.length_m)], Math.max(2, width / 90));
    const digits = digitsOf(ticks);
    const scale = linear([0, units.length(profile.length_m)], [drawn.x(0), drawn.x(Infinity)]);
    const y = drawn.bottom;
    return ticks.map((tick, i) => [
      svg("line", { class: "profile-base", x1: scale(tick), x2: scale(tick), y1: y, y2: y + 4 }),
      svg("text", { class: "profile-tick", x: scale(tick), y: y + 15, "text-anchor": scale(tick) > width - 34 ? "end" : "middle" }, number(tick, digits), i === 0 && ` ${units.lengthUnit}`),
    ]);
  }

  /** Put the cursor at a distance, null for none. */
  function cursor(to) {
    along = to;
    plot.setAttribute("aria-valuenow", data ? data.units.length(to ?? 0).toFixed(1) : "0");
    if (!data) return;
    const values = valuesAt(data.profile, to ?? 0);
    const facts = readingOf(values, data);
    plot.setAttribute("aria-valuetext", facts.map(({ what, value }) => `${what} ${value}`).join(", "));
    if (to === null) fill(reading, el("span", { class: "dim" }, "Point at the chart or at the route to read what is there."));
    else fill(reading, facts.map(({ what, value, plain }) => el("span", {}, !plain && el("span", { class: "dim" }, `${what} `), el("b", {}, value))));
    const group = plot.querySelector(".profile-cursor");
    if (!group || !drawn) return;
    const at = drawn.x(values.along_m);
    fill(
      group,
      to !== null && [
        svg("line", { x1: at, x2: at, y1: 0, y2: drawn.bottom }),
        drawn.lanes.map(({ lane, y }) => svg("circle", { cx: at, cy: y(lane.value(values, data)), r: 3.5 })),
      ],
    );
  }

  return { element, show, cursor, mark };
}
