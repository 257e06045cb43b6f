/** Classes of stations by their greatest output, drawn the larger and the farther from the ground's tone the more power they have. */

import { number } from "../units.js";

/**
 * From little to much power: bound below [kW], name, radius [px] and the ring's width. One hue in steps of lightness, so
 * that neither size nor colour is needed alone.
 */
export const CLASSES = [
  { from: 0, name: "not known", radius: 3.6 },
  { from: 0.1, name: "up to 22 kW", radius: 4.2 },
  { from: 22.5, name: "23 to 99 kW", radius: 5.6 },
  { from: 100, name: "100 to 249 kW", radius: 7 },
  { from: 250, name: "250 kW and more", radius: 8.6 },
];

const COLOURS = {
  light: { fills: ["#ffffff", "#a9c4ee", "#5d8fe0", "#2a56b8", "#101f5e"], ring: "#ffffff", edge: "#101f5e", text: "#101f5e", halo: "#ffffff" },
  dark: { fills: ["#182122", "#46628f", "#6f9be0", "#a9c8ff", "#ffffff"], ring: "#0b1011", edge: "#c3d6ff", text: "#dbe7ff", halo: "#10181a" },
};

/** The class of a station by its output [kW], null or 0 where that is not known: position in CLASSES. */
export const classOf = (kw) => CLASSES.findLastIndex(({ from }) => (kw ?? 0) >= from);

/** The colour of a class. */
export const classColour = (i, theme) => COLOURS[theme].fills[i];

/** Output as text. */
export const powerText = (kw) => (kw ? `${number(kw, kw < 10 ? 1 : 0)} kW` : "power not known");

const step = (values) => ["step", ["get", "power_kw"], values[0], ...CLASSES.slice(1).flatMap(({ from }, i) => [from, values[i + 1]])];

/** MapLibre layers of stations over a vector source; from below to above; visibility: "visible" or "none". */
export function stationLayers(theme, source, visibility) {
  const { fills, ring, edge, text, halo } = COLOURS[theme];
  const from = { source, "source-layer": "stations" };
  const radius = (share) => step(CLASSES.map((one) => Number((one.radius * share).toFixed(2))));
  const works = ["case", ["==", ["get", "operational"], false], 0.4, 1];
  const paint = {
    "circle-radius": ["interpolate", ["linear"], ["zoom"], 6, radius(0.62), 10, radius(0.85), 14, radius(1.15)],
    "circle-color": step(fills),
    "circle-stroke-color": ["step", ["get", "power_kw"], edge, 0.1, ring],
    "circle-stroke-width": 1.4,
    "circle-opacity": works,
    "circle-stroke-opacity": works,
  };
  return [
    { id: "station-halo", type: "circle", ...from, layout: { visibility }, paint: { ...paint, "circle-color": edge, "circle-stroke-color": edge, "circle-stroke-width": 2.4 } },
    { id: "station-point", type: "circle", ...from, layout: { visibility }, paint },
    {
      id: "station-kw", type: "symbol", ...from, minzoom: 12, filter: [">", ["get", "power_kw"], 0],
      layout: { visibility, "text-field": ["concat", ["to-string", ["get", "power_kw"]], " kW"], "text-font": ["local"], "text-size": 11, "text-anchor": "top", "text-offset": [0, 0.75], "text-optional": true },
      paint: { "text-color": text, "text-halo-color": halo, "text-halo-width": 1.6 },
    },
  ];
}
