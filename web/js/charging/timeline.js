/** The charge along time, driving and charging, with a cursor that can be moved by pointer and keys. */

import { digitsOf, linear, linePath, areaPath, ticksOf } from "../chart/scales.js";
import { el, fill, svg } from "../dom.js";
import { durationText, number, percentText } from "../units.js";
import { clockAfter, courseAt, courseOf, departureOf, stopName } from "./plan.js";

const LEFT_PX = 44;
const RIGHT_PX = 14;
const TOP_PX = 24;
const AXIS_PX = 18;
const MARK_PX = 20;
const STEPS = { ArrowRight: 0.01, ArrowUp: 0.01, ArrowLeft: -0.01, ArrowDown: -0.01, PageUp: 0.1, PageDown: -0.1 };
const TICKS_MIN = [5, 10, 15, 30, 60, 120, 180, 360, 720, 1440];

const WHAT = { drive: "driving", wait: "at the stop", charge: "charging" };

/** A chart. moved({at_s, along_m} | null): called where the user moves its cursor. Gives {element, show, cursor}. */
export function createTimeline(moved) {
  let data = null; // {answer, route, course, units, arrive, departure}
  let drawn = null;
  let now = null;

  const reading = el("p", { class: "profile-reading num" });
  const plot = el("div", { class: "profile-plot timeline-plot", role: "slider", tabindex: "0", "aria-label": "Time along the plan", "aria-valuemin": "0" });
  const element = el("section", { class: "profile", "aria-label": "Charge over time" }, reading, plot);

  plot.addEventListener("pointermove", point);
  plot.addEventListener("pointerdown", point);
  plot.addEventListener("pointerleave", ({ pointerType }) => pointerType === "touch" || move(null));
  plot.addEventListener("focus", () => now ?? move(0));
  plot.addEventListener("blur", () => move(null));
  plot.addEventListener("keydown", press);
  new ResizeObserver(() => draw()).observe(plot);

  function point(event) {
    if (drawn) move(drawn.x.invert(event.clientX - plot.getBoundingClientRect().left));
  }

  function press(event) {
    if (!data) return;
    const { end_s: end } = data.course;
    const ends = { Home: 0, End: end };
    if (event.key === "Escape") move(null);
    else if (event.key in ends) move(ends[event.key]);
    else if (event.key in STEPS) move(Math.min(end, Math.max(0, (now ?? 0) + STEPS[event.key] * end)));
    else return;
    event.preventDefault();
  }

  function move(to) {
    cursor(to);
    moved(to === null ? null : courseAt(data.course, to));
  }

  function show(answer, route, units) {
    data = { answer, route, course: courseOf(route), units, arrive: answer.request.charging.arrive_soc, departure: departureOf(answer) };
    plot.setAttribute("aria-valuemax", String(Math.round(data.course.end_s / 60)));
    draw();
  }

  function draw() {
    const [width, height] = [plot.clientWidth, plot.clientHeight];
    if (!data || width < LEFT_PX + RIGHT_PX + 40 || height < 60) return;
    const { route, course, arrive } = data;
    const { points, end_s: end } = course;
    const x = linear([0, end], [LEFT_PX, width - RIGHT_PX]);
    const bottom = height - AXIS_PX;
    const y = linear([0, 1], [bottom, TOP_PX]);
    drawn = { x, y, bottom };
    const [from, to] = [x(0), x(end)];
    const ticks = ticksOf([0, 100], Math.max(2, (bottom - TOP_PX) / 26));
    fill(
      plot,
      svg(
        "svg",
        { width, height, viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" },
        route.charging.stops.map((stop) => svg("rect", { class: "timeline-stop", x: x(stop.arrive_s), width: Math.max(1.5, x(stop.depart_s) - x(stop.arrive_s)), y: TOP_PX, height: bottom - TOP_PX })),
        svg("text", { class: "profile-label", x: 0, y: 10 }, "Charge, %"),
        ticks.map((tick) => [
          svg("line", { class: "profile-grid", x1: from, x2: to, y1: y(tick / 100), y2: y(tick / 100) }),
          svg("text", { class: "profile-tick", x: from - 6, y: y(tick / 100) + 3.5, "text-anchor": "end" }, number(tick, digitsOf(ticks))),
        ]),
        svg("path", { class: "timeline-area", d: areaPath(points.map(({ at_s: at }) => x(at)), points.map(({ soc }) => y(soc)), bottom) }),
        arrive > 0 && [svg("line", { class: "curve-reserve", x1: from, x2: to, y1: y(arrive), y2: y(arrive) }), svg("text", { class: "curve-reserve-label", x: from + 4, y: y(arrive) + (bottom - y(arrive) >= 12 ? 10 : -3) }, "least on arrival")],
        pieces(points).map(({ what, part }) => svg("path", { class: `timeline-${what}`, d: linePath(part.map(({ at_s: at }) => x(at)), part.map(({ soc }) => y(soc))) })),
        route.charging.stops.map((stop) => whisker(stop, x(stop.arrive_s))),
        whisker(route.charging.goal, to - 1),
        numbers(route.charging.stops, x),
        timeAxis(width),
        svg("line", { class: "profile-base", x1: from, x2: to, y1: bottom, y2: bottom }),
        svg("g", { class: "profile-cursor" }),
      ),
    );
    cursor(now);
  }

  /** From P10 to P90 of the charge on arrival. */
  function whisker({ arrive_soc_p10: low, arrive_soc_p90: high }, at) {
    if (low === null || low === undefined) return null;
    const { y } = drawn;
    const [top, foot] = [y(high), y(low)];
    return svg("path", { class: "timeline-whisker", d: `M${at - 3},${top}h6m-3,0V${foot}m-3,0h6` });
  }

  function timeAxis(width) {
    const { departure, course } = data;
    const offset = departure ? 60 * Number(departure.slice(11, 13)) + Number(departure.slice(14, 16)) : 0;
    const all = course.end_s / 60;
    const step = TICKS_MIN.find((minutes) => (all / minutes) * 62 <= width - LEFT_PX) ?? TICKS_MIN.at(-1);
    const ticks = [];
    for (let at = Math.ceil(offset / step) * step; at <= offset + all; at += step) ticks.push(at);
    const text = (at) => (departure ? `${String(Math.floor(at / 60) % 24).padStart(2, "0")}:${String(at % 60).padStart(2, "0")}` : at % 60 && step < 60 ? `${Math.floor(at / 60)}:${String(at % 60).padStart(2, "0")} h` : `${Math.floor(at / 60)} h`);
    return ticks.map((at) => {
      const place = drawn.x(60 * (at - offset));
      return [
        svg("line", { class: "profile-base", x1: place, x2: place, y1: drawn.bottom, y2: drawn.bottom + 4 }),
        svg("text", { class: "profile-tick", x: place, y: drawn.bottom + 15, "text-anchor": place > width - 34 ? "end" : "middle" }, text(at)),
      ];
    });
  }

  /** Put the cursor at a time [s], null for none. */
  function cursor(to) {
    now = to;
    plot.setAttribute("aria-valuenow", String(Math.round((to ?? 0) / 60)));
    if (!data) return;
    const { course, departure, units, route } = data;
    const values = courseAt(course, to ?? 0);
    const stop = route.charging.stops.find(({ arrive_s: from, depart_s: until }) => values.what !== "drive" && values.at_s >= from && values.at_s <= until);
    const facts = [departure ? clockAfter(departure, values.at_s) : `after ${durationText(values.at_s)}`, percentText(values.soc, 1), stop ? `${WHAT[values.what]}, ${stopName(stop)}` : WHAT[values.what], units.lengthText(values.along_m)];
    plot.setAttribute("aria-valuetext", facts.join(", "));
    if (to === null) fill(reading, el("span", { class: "dim" }, "Point at the chart, at a stop or at the route to read what is there."));
    else fill(reading, facts.map((text) => el("b", {}, text)));
    const group = plot.querySelector(".profile-cursor");
    if (!group || !drawn) return;
    const at = drawn.x(values.at_s);
    fill(group, to !== null && [svg("line", { x1: at, x2: at, y1: TOP_PX, y2: drawn.bottom }), svg("circle", { cx: at, cy: drawn.y(values.soc), r: 3.5 })]);
  }

  return { element, show, cursor, get course() { return data?.course ?? null; } };
}

/** Numbers of stops above the chart, where they don't lie over each other. */
function numbers(stops, x) {
  let last = -Infinity;
  return stops.map((stop, i) => {
    const at = (x(stop.arrive_s) + x(stop.depart_s)) / 2;
    if (at - last < MARK_PX) return null;
    last = at;
    return [svg("circle", { class: "timeline-number", cx: at, cy: 10, r: 8 }), svg("text", { class: "timeline-number-text", x: at, y: 13.5, "text-anchor": "middle" }, String(i + 1))];
  });
}

/** Runs of one kind, each beginning where the one before ended: {what, part}. */
function pieces(points) {
  const runs = [];
  for (let i = 1; i < points.length; i += 1) {
    const run = runs.at(-1);
    if (run && run.what === points[i].what) run.part.push(points[i]);
    else runs.push({ what: points[i].what, part: [points[i - 1], points[i]] });
  }
  return runs;
}
