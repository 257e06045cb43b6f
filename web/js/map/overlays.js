/**
 * The layers that answers are drawn on. Each overlay is a GeoJSON source of its own name; its features say by their
 * properties how they look:
 *
 * lead: lines from a place to where the drive begins or ends; area: polygons {colour, opacity}, drawn in their order; area-edge: lines {colour, dashed}
 * map-edge: lines where an area ends because the map does
 * route-other: lines of routes that are not looked at {name, colour}
 * route: pieces of the route that is looked at {colour, first, last, beyond}, dashed where beyond the charge
 * stretch: lines of named stretches {index, active}
 * residual: lines or points {colour, opacity, …}; cursor: a point
 * station-looked: the point of the station that is looked at
 */

export const OVERLAYS = ["lead", "area", "area-edge", "map-edge", "residual", "route-other", "route", "stretch", "station-looked", "cursor"];
export const EMPTY = { type: "FeatureCollection", features: [] };

const width = (thin, thick) => ["interpolate", ["linear"], ["zoom"], 7, thin, 15, thick];

/** Layers of all overlays, from below to above: `areas` below the roads, `lines` above them and below their names. */
export function overlayLayers(theme) {
  const dark = theme === "dark";
  const outline = dark ? "#0b1011" : "#ffffff";
  const opacity = ["coalesce", ["get", "opacity"], 1];
  const round = { "line-cap": "round", "line-join": "round" };
  const butt = { "line-cap": "butt", "line-join": "round" }; // round caps of faint lines would show as beads
  const line = (id, source, paint, more = {}) => ({ id, type: "line", source, layout: round, paint, ...more });
  const areas = [
    { id: "area-fill", type: "fill", source: "area", paint: { "fill-color": ["get", "colour"], "fill-opacity": ["get", "opacity"], "fill-antialias": false } },
    line("area-edge-line", "area-edge", { "line-color": ["get", "colour"], "line-width": 1.6 }, { filter: ["!", ["get", "dashed"]] }),
    line("area-edge-dashed", "area-edge", { "line-color": ["get", "colour"], "line-width": 1.6, "line-dasharray": [3, 2] }, { filter: ["get", "dashed"] }),
    line("map-edge-casing", "map-edge", { "line-color": outline, "line-width": 4.5 }), // hides the area's own edge
    line("map-edge-dashed", "map-edge", { "line-color": dark ? "#e9f0ef" : "#14211f", "line-width": 2.2, "line-dasharray": [1.6, 1.8] }, { layout: butt }),
  ];
  const lines = [
    line("residual-casing", "residual", { "line-color": dark ? outline : "#7d8887", "line-width": width(5, 8.4), "line-opacity": opacity }, { layout: butt, filter: ["==", ["geometry-type"], "LineString"] }),
    line("residual-line", "residual", { "line-color": ["get", "colour"], "line-width": width(3.4, 6.4), "line-opacity": opacity }, { layout: butt, filter: ["==", ["geometry-type"], "LineString"] }),
    {
      id: "residual-point", type: "circle", source: "residual", filter: ["==", ["geometry-type"], "Point"],
      paint: { "circle-color": ["get", "colour"], "circle-radius": width(3, 7), "circle-stroke-color": outline, "circle-stroke-width": 1 },
    },
    { id: "residual-hit", type: "line", source: "residual", filter: ["==", ["geometry-type"], "LineString"], paint: { "line-width": 14, "line-opacity": 0.001 } },
    line("route-other-casing", "route-other", { "line-color": outline, "line-width": width(4, 8) }),
    line("route-other-line", "route-other", { "line-color": ["get", "colour"], "line-width": width(2.4, 5), "line-opacity": 0.75 }),
    { id: "route-other-hit", type: "line", source: "route-other", paint: { "line-width": 16, "line-opacity": 0.001 } },
    line("stretch-halo", "stretch", { "line-color": dark ? "#ffffff" : "#14211f", "line-width": width(9, 16), "line-opacity": ["case", ["get", "active"], 0.85, 0.22] }),
    line("lead-line", "lead", { "line-color": dark ? "#e9f0ef" : "#14211f", "line-width": 1.6, "line-dasharray": [1, 1.6] }),
    line("route-casing", "route", { "line-color": dark ? "#0b1011" : "#1b2a29", "line-width": width(6, 10) }),
    line("route-line", "route", { "line-color": ["get", "colour"], "line-width": width(4, 7) }, { filter: ["!", ["get", "beyond"]] }),
    {
      id: "route-beyond", type: "line", source: "route", filter: ["get", "beyond"], layout: { "line-join": "round" },
      paint: { "line-color": ["get", "colour"], "line-width": width(4, 7), "line-dasharray": [1.6, 1.2] },
    },
    { id: "route-hit", type: "line", source: "route", paint: { "line-width": 16, "line-opacity": 0.001 } },
    {
      id: "station-looked-ring", type: "circle", source: "station-looked",
      paint: { "circle-radius": 13, "circle-color": "rgba(0,0,0,0)", "circle-stroke-color": dark ? "#e9f0ef" : "#14211f", "circle-stroke-width": 3 },
    },
    {
      id: "cursor-point", type: "circle", source: "cursor",
      paint: { "circle-radius": 7, "circle-color": "#ffffff", "circle-stroke-color": "#14211f", "circle-stroke-width": 3 },
    },
  ];
  return { areas, lines };
}
