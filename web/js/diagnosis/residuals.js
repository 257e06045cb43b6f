/** Where measured and modelled energy part, on the map: links or tracks in colours, with a legend. */

import { byId, el, fill } from "../dom.js";
import { extentOf } from "../map/view.js";
import { quantile } from "../chart/scales.js";
import { number } from "../units.js";
import { binsOf, positionsOf } from "./timeline.js";
import { counted, intervalText, valueText } from "./terms.js";

/** From less than modelled to more: nine classes of ColorBrewer's RdBu, as the service colours links and tracks. */
const RAMP = ["#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7", "#fddbc7", "#f4a582", "#d6604d", "#b2182b"];
const FULL_SHARE = 0.95; // of the places' size, beyond which colours don't change
const MOST_PIECES = 150;
const FAINTEST = 0.55; // fainter lines are lost among the roads
const OF = "diagnosis";

/** Draw what the chosen diagnosis leaves; picked(trip, t_s): called where a stretch of a drive is clicked. */
export function residualMap(app, diagnoses, picked) {
  const { journey, view } = app;
  let pieces = []; // what is drawn: {geometry, colour, opacity, title, mean_w, ci95, wh_per_km, trip, t_s}
  let hovered = null;
  const readout = el("p", { class: "residual-readout" });
  const ends = el("div", { class: "ends num" });
  const whose = el("p", { class: "small dim" });
  const legend = el(
    "div", {},
    el("h2", {}, "Measured less modelled"),
    el("div", { class: "ramp residual-ramp", role: "img", "aria-label": "From blue, less than modelled, over white to red, more" }),
    ends, whose, readout,
  );

  diagnoses.on(["residuals", "trip", "chosen"], show);
  journey.on(["tab"], show);
  view.on("hover", (hit) => {
    const index = hit?.source === "residual" ? hit.properties.index : null;
    if (index === hovered) return;
    hovered = index;
    tell();
  });
  view.on("pick", (hit) => {
    if (hit.source !== "residual") return;
    hovered = hit.properties.index;
    tell();
    const piece = pieces[hovered];
    if (piece?.trip) picked(piece.trip, piece.t_s);
  });
  return { fit, extent };

  function show() {
    const { residuals, chosen, trip } = diagnoses.get();
    const shown = journey.get().tab === "diagnosis";
    pieces = shown ? piecesOf(residuals.answer, chosen, trip.answer) : [];
    hovered = null;
    view.draw("residual", pieces.map(({ geometry, colour, opacity }, index) => ({ type: "Feature", geometry, properties: { colour, opacity, index } })));
    const box = byId("legend");
    if (!pieces.length) {
      if (box.dataset.of === OF) {
        box.hidden = true;
        delete box.dataset.of;
      }
      return;
    }
    box.dataset.of = OF;
    box.hidden = false;
    fill(box, legend);
    const full = scaleText(fullScale(pieces.map(({ mean_w: mean }) => mean)));
    fill(ends, el("span", {}, `−${full}`), el("span", {}, "0"), el("span", {}, `+${full}`));
    fill(whose, chosen && trip.answer ? `Drive ${chosen}` : residuals.answer.kind === "links" ? "All drives, by road. Faint: may be chance" : "All drives, by stretch");
    tell();
  }

  function tell() {
    const piece = pieces[hovered];
    readout.classList.toggle("dim", !piece);
    if (!piece) {
      fill(readout, "Point at a road to read it.");
      return;
    }
    const between = intervalText(piece.mean_w, piece.ci95);
    fill(readout, el("b", {}, valueText(piece.mean_w, "W", piece.ci95, true)), between && ` (95 %: ${between})`, el("br"), piece.title);
  }

  /** Where the residuals lie, null for nowhere. */
  function extent() {
    const { residuals } = diagnoses.get();
    const positions = residuals.answer?.features.flatMap(({ geometry }) => geometry.coordinates) ?? [];
    return positions.length ? extentOf(positions) : null;
  }

  /** Show the chosen drive, or all. */
  function fit() {
    const { trip } = diagnoses.get();
    const positions = trip.answer ? positionsOf(trip.answer) : [];
    const bounds = positions.length ? extentOf(positions) : extent();
    if (bounds) view.fit(bounds);
  }
}

const fullScale = (means) => Math.max(1, quantile(means.map(Math.abs), FULL_SHARE));

const scaleText = (watts) => (watts < 1000 ? `${number(watts)} W` : `${number(watts / 1000, 1)} kW`);

function colourOf(mean, full) {
  const middle = (RAMP.length - 1) / 2;
  return RAMP[Math.round(middle + middle * Math.max(-1, Math.min(1, mean / full)))];
}

function piecesOf(residuals, chosen, trip) {
  if (chosen && trip?.lat) return piecesAlong(trip);
  if (!residuals) return [];
  return residuals.features.map(({ geometry, properties: own }) => ({
    geometry,
    colour: own.stroke, opacity: Math.max(FAINTEST, own["stroke-opacity"]),
    title: own.trip ? `Drive ${own.trip}` : `${own.name || "Road without a name"}, ${counted(own.trips, "drive")}`,
    mean_w: own.mean_w, ci95: own.ci95, trip: own.trip ?? null, t_s: own.t_s ?? null,
  }));
}

const left = (bin) => 1000 * (bin.measured.kw - bin.after.kw);

/** Pieces of one drive, from one bin's middle to the next. */
function piecesAlong(trip) {
  const bins = binsOf(trip, MOST_PIECES);
  const full = fullScale(bins.map(left));
  return bins.slice(1).flatMap((bin, i) => {
    if (!bin.position || !bins[i].position || bin.broken) return [];
    const mean = (left(bins[i]) + left(bin)) / 2;
    return [{
      geometry: { type: "LineString", coordinates: [bins[i].position, bin.position] },
      colour: colourOf(mean, full), opacity: 1, title: `Drive ${trip.id}, after ${Math.round(bin.from_s / 60)} min`,
      mean_w: mean, ci95: null, trip: trip.id, t_s: bin.from_s,
    }];
  });
}
