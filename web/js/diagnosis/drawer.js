/** The chosen drive along time below the map: power or energy, measured and modelled, with a cursor tied to the map. */

import { byId, el, fill, newId, svg } from "../dom.js";
import { failure, working } from "../notices.js";
import { areaPath, digitsOf, linear, linePath, niceDomain, ticksOf } from "../chart/scales.js";
import { energyText, number } from "../units.js";
import { binAt, binsOf, CURVES } from "./timeline.js";

const LEFT_PX = 46;
const RIGHT_PX = 12;
const TOP_PX = 8;
const AXIS_PX = 18;
const SPEED_SHARE = 0.22;
const BIN_PX = 4;
const FINEST = 600;
const KINDS = { kw: "Power", kwh: "Energy so far" };
const NAMES = { measured: "Measured", before: "Before", after: "After" };
const STEPS = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 };
const OF = "diagnosis";

export function tripDrawer(app, diagnoses) {
  const { journey, view } = app;
  let kind = "kw";
  let fine = []; // all windows of the drive, for the cursor
  let drawn = null; // {x, y, bins, bottom} of the last drawing
  let at = null; // index in fine

  const title = el("h2", {});
  const reading = el("p", { class: "trip-reading num" });
  const body = el("div", { class: "trip-body" });
  const plot = el("div", { class: "trip-plot", role: "slider", tabindex: "0", "aria-label": "Time along the drive, in minutes", "aria-valuemin": "0" });
  const close = el("button", { type: "button", class: "quiet", on: { click: shut } }, "Close");
  const element = el("section", { class: "trip-chart", "aria-label": "One drive along time" }, el("div", { class: "trip-head" }, title, kindChoice(), close), body);

  plot.addEventListener("pointermove", point);
  plot.addEventListener("pointerdown", point);
  plot.addEventListener("pointerleave", () => document.activeElement !== plot && move(null));
  plot.addEventListener("focus", () => at === null && move(0));
  plot.addEventListener("blur", () => move(null));
  plot.addEventListener("keydown", press);
  new ResizeObserver(draw).observe(plot);
  diagnoses.on(["trip", "chosen", "shown"], show);
  journey.on(["tab", "units"], show);

  return { seek: (seconds) => fine.length && move(binAt(fine, seconds)) };

  function shut() {
    const { chosen } = diagnoses.get();
    diagnoses.choose(null);
    document.querySelector(`[data-trip="${CSS.escape(chosen)}"]`)?.focus();
  }

  function show() {
    const { chosen, trip, shown } = diagnoses.get();
    const drawer = byId("drawer");
    if (!chosen || journey.get().tab !== "diagnosis") {
      if (fine.length) view.cursor(null);
      fine = [];
      element.remove();
      if (drawer.dataset.of === OF) {
        drawer.hidden = true;
        delete drawer.dataset.of;
      }
      return;
    }
    drawer.dataset.of = OF;
    if (element.parentElement !== drawer) fill(drawer, element);
    drawer.hidden = false;
    const account = shown.answer?.result?.trips.find(({ id }) => id === chosen);
    fill(title, chosen, account && el("span", { class: "dim small" }, ` ${app.units().lengthText(1000 * account.distance_km)}, ${energyText(account.measured_kwh)}`));
    fine = trip.answer ? binsOf(trip.answer, FINEST) : [];
    fill(body, content(trip, shown));
    move(null);
    draw();
  }

  function content({ status, answer, error }, { answer: whole }) {
    if (status === "failed") return failure(error, () => diagnoses.choose(diagnoses.get().chosen));
    if (status === "loading") return working("Fetching the drive …");
    if (!answer) return el("p", { class: "dim" }, whole?.links.trips ? "" : "This diagnosis keeps no drives along time. Run it again to have them.");
    return [reading, plot];
  }

  function point(event) {
    if (!drawn) return;
    const seconds = 60 * drawn.x.invert(event.clientX - plot.getBoundingClientRect().left);
    move(binAt(fine, seconds));
  }

  function press(event) {
    if (!fine.length) return;
    const last = fine.length - 1;
    if (event.key === "Home" || event.key === "End") move(event.key === "Home" ? 0 : last);
    else if (event.key in STEPS) move(Math.min(last, Math.max(0, (at ?? 0) + STEPS[event.key])));
    else if (event.key === "Escape") close.focus();
    else return;
    event.preventDefault();
  }

  function draw() {
    const [width, height] = [plot.clientWidth, plot.clientHeight];
    if (!fine.length || width < 120 || height < 60) return;
    const bins = binsOf(diagnoses.get().trip.answer, Math.floor((width - LEFT_PX - RIGHT_PX) / BIN_PX));
    const bottom = height - AXIS_PX;
    const floor = Math.round(bottom - SPEED_SHARE * (bottom - TOP_PX)); // of the curves; below it is the speed
    const x = linear([0, fine.at(-1).to_s / 60], [LEFT_PX, width - RIGHT_PX]);
    const domain = niceDomain(bins.flatMap((bin) => Object.keys(CURVES).map((name) => bin[name][kind])), { least: kind === "kw" ? 4 : 0.2, count: 3, include: [0] });
    const y = linear(domain, [floor - 6, TOP_PX]);
    drawn = { x, y, bottom };
    fill(
      plot,
      svg(
        "svg", { width, height, viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true" },
        levels(y, domain, width), speed(bins, x, floor, bottom), minutes(x, bottom, width),
        ["before", "measured", "after"].map((name) => curve(bins, x, y, name)),
        svg("g", { class: "trip-cursor" }),
      ),
    );
    mark();
  }

  function levels(y, domain, width) {
    const ticks = ticksOf(domain, 4);
    const digits = digitsOf(ticks);
    return ticks.map((tick, i) => [
      svg("line", { class: tick === 0 ? "base" : "grid", x1: LEFT_PX, x2: width - RIGHT_PX, y1: y(tick), y2: y(tick) }),
      svg("text", { x: LEFT_PX - 5, y: y(tick) + 4, "text-anchor": "end" }, number(tick, digits), i === ticks.length - 1 && (kind === "kw" ? " kW" : " kWh")),
    ]);
  }

  function speed(bins, x, top, bottom) {
    const [, most] = niceDomain(bins.map(({ speed_kmh: kmh }) => kmh), { least: 20, include: [0] });
    const y = linear([0, most], [bottom, top]);
    const ends = [x(bins[0].from_s / 60), ...bins.map((bin) => x(bin.to_s / 60))];
    const heights = [y(bins[0].speed_kmh), ...bins.map((bin) => y(bin.speed_kmh))];
    return [
      svg("path", { class: "curve-speed-area", d: areaPath(ends, heights, bottom) }),
      svg("text", { x: LEFT_PX - 5, y: bottom - 2, "text-anchor": "end" }, app.units().speedUnit),
    ];
  }

  function minutes(x, bottom, width) {
    const ticks = ticksOf([0, fine.at(-1).to_s / 60], Math.max(2, width / 90));
    const digits = digitsOf(ticks);
    return [
      svg("line", { class: "base", x1: LEFT_PX, x2: width - RIGHT_PX, y1: bottom, y2: bottom }),
      ticks.map((tick, i) => svg("text", { x: x(tick), y: bottom + 14, "text-anchor": x(tick) > width - 30 ? "end" : "middle" }, number(tick, digits), i === 0 && " min")),
    ];
  }

  function curve(bins, x, y, name) {
    const runs = [];
    for (const bin of bins) {
      if (bin.broken || !runs.length) runs.push([]);
      runs.at(-1).push(bin);
    }
    const middle = (bin) => x((kind === "kwh" ? bin.to_s : (bin.from_s + bin.to_s) / 2) / 60);
    const d = runs.map((run) => linePath(run.map(middle), run.map((bin) => y(bin[name][kind])))).join("");
    return svg("path", { class: `curve-${name}`, d });
  }

  function move(to) {
    at = to;
    const bin = to === null ? null : fine[to];
    view.cursor(bin?.position ?? null);
    fill(reading, legend(bin));
    plot.setAttribute("aria-valuemax", fine.length ? (fine.at(-1).to_s / 60).toFixed(1) : "0");
    plot.setAttribute("aria-valuenow", bin ? (bin.from_s / 60).toFixed(1) : "0");
    plot.setAttribute("aria-valuetext", bin ? spoken(bin) : "no time chosen");
    mark();
  }

  function spoken(bin) {
    const values = Object.keys(CURVES).map((name) => `${NAMES[name]} ${valueOf(bin, name)}`);
    return [minuteText(bin), app.units().speedText(bin.speed_kmh), ...values].join(", ");
  }

  function valueOf(bin, name) {
    return kind === "kw" ? `${number(bin[name].kw, 1)} kW` : energyText(bin[name].kwh);
  }

  /** Names of the curves, with what they are at the cursor. */
  function legend(bin) {
    return [
      bin && el("span", { class: "trip-time" }, minuteText(bin), " ", el("b", {}, app.units().speedText(bin.speed_kmh))),
      Object.entries(NAMES).map(([name, text]) => el("span", { class: `key-${name}` }, text, bin && [" ", el("b", {}, valueOf(bin, name))])),
      !bin && el("span", { class: "dim" }, "Speed below. Point at the chart to read it."),
    ];
  }

  function mark() {
    const group = plot.querySelector(".trip-cursor");
    if (!group || !drawn) return;
    const bin = at === null ? null : fine[at];
    if (!bin) {
      fill(group);
      return;
    }
    const along = drawn.x((bin.from_s + bin.to_s) / 120);
    fill(
      group,
      svg("line", { x1: along, x2: along, y1: 0, y2: drawn.bottom }),
      Object.keys(CURVES).map((name) => svg("circle", { class: `dot-${name}`, cx: along, cy: drawn.y(bin[name][kind]), r: 3.5 })),
    );
  }

  function setKind(value) {
    kind = value;
    draw();
  }

  function kindChoice() {
    const group = newId("kind");
    const inputs = Object.keys(KINDS).map((value) => el("input", { type: "radio", name: group, value, checked: value === kind, on: { change: () => setKind(value) } }));
    const choices = inputs.map((input) => el("label", {}, input, el("span", {}, KINDS[input.value])));
    return el("fieldset", { class: "trip-kind" }, el("legend", { class: "unseen" }, "What the chart shows"), el("div", { class: "segments" }, choices));
  }
}

const minuteText = ({ from_s: from }) => `${number(Math.floor(from / 60))}:${String(Math.floor(from % 60)).padStart(2, "0")} min`;
