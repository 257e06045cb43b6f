/** The ground of the map: the graph's own roads, and shading from its heights, as a MapLibre style. */

import { GLYPHS_URL } from "./glyphs.js";

const THEMES = {
  light: {
    land: "#eef0e8", label: "#333b3a", halo: "#ffffffdd", place: "#1f2726",
    cover: { wood: "#d3e2cb", grass: "#e2ebd3", farmland: "#eeecd9", rock: "#e3e1dc", sand: "#f1e9cf", ice: "#f4f8fa", wetland: "#d6e4dd" },
    built: "#e4e1dc", water: "#b4d0dc", stream: "#9cbfce", border: "#9b8aa0",
    shade: { exaggeration: 0.38, shadow: "#4a4f45", highlight: "#ffffff", accent: "#6b7263" },
    fills: ["#ffffff", "#ffffff", "#ffffff", "#fffdf5", "#fbf0c0", "#f9dd92", "#f4b87a", "#ea8f6c"],
    casings: ["#d9d4cc", "#cfc9bf", "#cfc9bf", "#c4bba8", "#c9b273", "#c79a45", "#bd7a34", "#a9502f"],
  },
  dark: {
    land: "#1a2223", label: "#c3cfce", halo: "#10181add", place: "#e4ebea",
    cover: { wood: "#1b2b24", grass: "#202d25", farmland: "#232b24", rock: "#262b2b", sand: "#2d2c25", ice: "#2f393c", wetland: "#1c2b2b" },
    built: "#232a2c", water: "#15303c", stream: "#1d4050", border: "#6d5f75",
    shade: { exaggeration: 0.6, shadow: "#030606", highlight: "#465857", accent: "#1d2a2a" },
    fills: ["#2f3a3b", "#354142", "#3a4748", "#425051", "#5a5740", "#6d6136", "#82653a", "#8f5a44"],
    casings: ["#3c494a", "#414f50", "#475556", "#55625f", "#77714c", "#8a7a42", "#a07a42", "#b06e52"],
  },
};
/** Road classes from below to above: the zooms and widths [px] between which a line grows. */
const ROADS = [
  ["service", [12, 0.4, 14, 1.6, 18, 10]],
  ["residential", [11, 0.5, 14, 2.4, 18, 16]],
  ["unclassified", [10, 0.5, 14, 2.8, 18, 18]],
  ["tertiary", [8, 0.6, 11, 1.3, 14, 4, 18, 22]],
  ["secondary", [7, 0.6, 11, 1.9, 14, 5, 18, 26]],
  ["primary", [6, 0.7, 11, 2.4, 14, 6, 18, 28]],
  ["trunk", [5, 0.8, 11, 2.8, 14, 7, 18, 30]],
  ["motorway", [4, 0.9, 11, 3.2, 14, 8, 18, 32]],
];
/** Places from below to above: classes, first zoom, sizes of text [px] there and at zoom 14. */
const PLACES = [
  ["place-part", ["suburb", "borough", "quarter", "neighbourhood", "hamlet", "isolated_dwelling", "locality"], 12, 10, 12],
  ["place-village", ["village", "island"], 10, 10, 14],
  ["place-town", ["town"], 7, 11, 17],
  ["place-city", ["city"], 4, 12, 21],
];
const CASED_FROM = 11; // farther out a road is one line, in the colour of its casing
const CASING_PX = 1.4;

/** The style over which routes and areas are laid. tiles: the graph's tiles.json. */
export function basemapStyle(tiles, theme, base) {
  const colours = THEMES[theme];
  const sources = {
    roads: {
      type: "vector", tiles: tiles.tiles.map(base), bounds: tiles.bounds, minzoom: tiles.minzoom, maxzoom: tiles.maxzoom,
      attribution: tiles.attribution,
    },
  };
  const layers = [{ id: "land", type: "background", paint: { "background-color": colours.land } }];
  if (tiles.heights) {
    const { encoding, minzoom, maxzoom, bounds } = tiles.heights;
    // twice the size of its pixels: roads carry no finer heights than that, and a quarter of the tiles is fetched
    const tileSize = 2 * tiles.heights.tileSize;
    sources.heights = { type: "raster-dem", tiles: tiles.heights.tiles.map(base), encoding, tileSize, minzoom, maxzoom, bounds };
    const { exaggeration, shadow, highlight, accent } = colours.shade;
    layers.push({
      id: "shading", type: "hillshade", source: "heights",
      paint: {
        "hillshade-exaggeration": exaggeration, "hillshade-shadow-color": shadow, "hillshade-highlight-color": highlight,
        "hillshade-accent-color": accent, "hillshade-illumination-direction": 315,
      },
    });
  }
  const grounds = new Set(tiles.vector_layers.map((layer) => layer.id));
  layers.push(...groundLayers(colours).filter((layer) => grounds.has(layer["source-layer"])));
  layers.push(...ROADS.map((road, i) => casingLayer(road, colours.casings[i])));
  layers.push(...ROADS.map((road, i) => roadLayer(road, colours.casings[i], colours.fills[i])));
  layers.push(nameLayer(colours));
  if (grounds.has("place")) layers.push(...PLACES.map((place) => placeLayer(place, colours)));
  return { version: 8, name: `joulepath ${theme}`, glyphs: GLYPHS_URL, sources, layers };
}

const layer = (id, type, paint, rest) => ({ id, type, source: "roads", "source-layer": id, paint, ...rest });
const width = (at8, at14) => ["interpolate", ["exponential", 1.4], ["zoom"], 8, at8, 14, at14, 18, at14 * 4];

/** Land, water and borders, from below to above; they shade through, so that hills stay visible in woods. */
function groundLayers(colours) {
  const cover = ["match", ["get", "class"], ...Object.entries(colours.cover).flat(), colours.land];
  return [
    layer("landcover", "fill", { "fill-color": cover, "fill-opacity": 0.75, "fill-antialias": false }),
    layer("landuse", "fill", { "fill-color": colours.built, "fill-opacity": 0.7, "fill-antialias": false }, { minzoom: 8 }),
    layer("waterway", "line", {
      "line-color": colours.stream, "line-width": ["match", ["get", "class"], "river", 1.4, 0.8],
    }, { layout: { "line-cap": "round", "line-join": "round" } }),
    layer("water", "fill", { "fill-color": colours.water }),
    layer("boundary", "line", {
      "line-color": colours.border, "line-width": width(0.8, 1.6), "line-dasharray": [4, 2, 1, 2],
      "line-opacity": ["match", ["get", "admin_level"], 2, 0.9, 4, 0.6, 0.35],
    }),
  ];
}

function placeLayer([id, classes, minzoom, from, to], colours) {
  return {
    id, type: "symbol", source: "roads", "source-layer": "place", minzoom, filter: ["in", ["get", "class"], ["literal", classes]],
    layout: {
      "text-field": ["coalesce", ["get", `name:${language()}`], ["get", "name"]], "text-font": ["local"],
      "text-size": ["interpolate", ["linear"], ["zoom"], minzoom, from, 14, to], "symbol-sort-key": ["get", "rank"],
      "text-max-width": 8, "text-padding": 6,
    },
    paint: { "text-color": colours.place, "text-halo-color": colours.halo, "text-halo-width": 1.6 },
  };
}

/** The browser's language, as names in other languages are marked with it. */
function language() {
  return navigator.language.split("-")[0];
}

function roadLayer([name, stops], casing, fill) {
  return lineLayer(`road-${name}`, name, stops, ["step", ["zoom"], casing, CASED_FROM, fill], stops[0]);
}

function casingLayer([name, stops], casing) {
  const wider = stops.map((stop, i) => (i % 2 ? stop + CASING_PX : stop));
  return lineLayer(`road-${name}-casing`, name, wider, casing, Math.max(CASED_FROM, stops[0]));
}

function lineLayer(id, name, stops, colour, minzoom) {
  return {
    id, type: "line", source: "roads", "source-layer": "roads", minzoom, filter: ["==", ["get", "class"], name],
    layout: { "line-cap": "round", "line-join": "round" },
    paint: { "line-color": colour, "line-width": ["interpolate", ["exponential", 1.5], ["zoom"], ...stops] },
  };
}

function nameLayer(colours) {
  return {
    id: "road-names", type: "symbol", source: "roads", "source-layer": "roads", minzoom: 11,
    filter: ["has", "name"],
    layout: {
      "symbol-placement": "line", "text-field": ["get", "name"], "text-font": ["local"],
      "text-size": ["interpolate", ["linear"], ["zoom"], 11, 10, 16, 13],
      "symbol-spacing": 350, "text-max-angle": 35,
    },
    paint: { "text-color": colours.label, "text-halo-color": colours.halo, "text-halo-width": 1.4 },
  };
}
