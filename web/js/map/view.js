/** The map: its ground, the layers that answers are drawn on, markers, and what the user does with them. */

import { el } from "../dom.js";
import { keyHeadersFor } from "../key.js";
import { basemapStyle } from "./basemap.js";
import { GLYPHS_URL, installGlyphs } from "./glyphs.js";
import { MarkerSet } from "./markers.js";
import { placeNear } from "./nearest.js";
import { EMPTY, overlayLayers, OVERLAYS } from "./overlays.js";
import { stationLayers } from "../stations/power.js";

const STATIONS = "stations";
const STATION_LAYERS = ["station-halo", "station-point", "station-kw"];
const FIT_PX = 60;
const FIT_ZOOM = 15;
const LEAST_ROOM_PX = 40; // below which a map is too low to show anything under its legend

/** The address of a tile template at the page's own host, whose braces stay; below the page's prefix also where a proxy hides that from the service. */
function addressOf(template) {
  const path = template.replace(/^https?:\/\/[^/]+/, "");
  const prefix = new URL(".", document.baseURI).pathname;
  const below = path.startsWith("/") && !path.startsWith(prefix) ? prefix + path.slice(1) : path;
  return new URL(below, document.baseURI).href.replaceAll("%7B", "{").replaceAll("%7D", "}");
}

export class MapView {
  /** @param {HTMLElement} container */
  constructor(container, { styleUrl = null } = {}) {
    this.container = container;
    this.styleUrl = styleUrl;
    this.data = Object.fromEntries(OVERLAYS.map((name) => [name, EMPTY]));
    this.listeners = { click: [], pick: [], hover: [] };
    this.error = null; // what stands in place of the map
    this.theme = "light";
    this.units = "km";
    this.wanted = { places: [], notes: [] };
    this.aiming = false;
    this.stations = false; // whether charging stations are drawn
    this.tiles = null;
  }

  /** Draw a graph's ground for the first time or anew. Throws where the browser can't draw maps. */
  show(tiles, theme) {
    this.error?.remove();
    this.theme = theme;
    this.tiles = tiles;
    const style = this.styleUrl ?? basemapStyle(tiles, theme, addressOf);
    if (!this.map) this.#begin(tiles);
    this.container.dataset.state = "loading";
    this.map.setStyle(style, { diff: false, transformStyle: (_, next) => this.#withOverlays(next) });
    this.map.once("idle", () => {
      if (!performance.getEntriesByName("map-drawn").length) performance.mark("map-drawn");
      this.container.dataset.state = "drawn";
    });
  }

  #begin(tiles) {
    const { maplibregl } = globalThis;
    installGlyphs(maplibregl);
    this.map = new maplibregl.Map({
      container: this.container, bounds: this.extent ?? tiles.bounds, fitBoundsOptions: { padding: this.extent ? this.#paddings()[0] : 20 }, attributionControl: false,
      dragRotate: false, pitchWithRotate: false, touchPitch: false, maxPitch: 0, fadeDuration: 0, maxZoom: 18.5,
      locale: { "Map.Title": "Map of the roads" },
      transformRequest: (url) => ({ url, headers: keyHeadersFor(url) }),
    });
    this.map.touchZoomRotate.disableRotation();
    this.map.keyboard.disableRotation();
    this.map.addControl(new maplibregl.NavigationControl({ showCompass: false }), "top-right");
    this.scale = new maplibregl.ScaleControl({ unit: this.units === "mi" ? "imperial" : "metric" });
    this.map.addControl(this.scale, "bottom-left");
    this.map.addControl(new maplibregl.AttributionControl({ compact: false }), "bottom-right");
    this.markers = new MarkerSet(this.map, maplibregl);
    this.#mark({});
    this.#listen();
  }

  #withOverlays(style) {
    const sources = { ...style.sources };
    for (const name of OVERLAYS) sources[name] = { type: "geojson", data: this.data[name] };
    const first = (type) => {
      const at = style.layers.findIndex((layer) => layer.type === type);
      return at < 0 ? style.layers.length : at;
    };
    const [roads, names] = [Math.min(first("line"), first("symbol")), first("symbol")];
    const { areas, lines } = overlayLayers(this.theme);
    const top = lines.findIndex(({ id }) => id === "cursor-point");
    const layers = [
      ...style.layers.slice(0, roads), ...areas, ...style.layers.slice(roads, names), ...lines.slice(0, top), ...style.layers.slice(names), ...this.#stationLayers(sources, style.glyphs), ...lines.slice(top),
    ];
    return { glyphs: GLYPHS_URL, ...style, sources, layers }; // a style without letters of its own may lack them
  }

  /** Layers of the graph's charging stations, none where it has none; a style of one's own lacks their source, which is added. */
  #stationLayers(sources, glyphs = GLYPHS_URL) {
    const { tiles } = this;
    if (!tiles?.vector_layers?.some(({ id }) => id === STATIONS)) return [];
    if (this.styleUrl) sources[STATIONS] = { type: "vector", tiles: tiles.tiles.map(addressOf), bounds: tiles.bounds, minzoom: tiles.minzoom, maxzoom: tiles.maxzoom, attribution: tiles.attribution };
    const layers = stationLayers(this.theme, this.styleUrl ? STATIONS : "roads", this.#stationVisibility());
    return glyphs === GLYPHS_URL ? layers : layers.filter(({ type }) => type !== "symbol"); // other letters lack our font
  }

  #stationVisibility() {
    return this.stations ? "visible" : "none";
  }

  /** Draw the graph's charging stations, or not. */
  showStations(shown) {
    this.stations = shown;
    for (const id of STATION_LAYERS) if (this.map?.getLayer(id)) this.map.setLayoutProperty(id, "visibility", this.#stationVisibility());
  }

  /** What is in view: [west, south, east, north]; all of the graph while there is no map. */
  extentShown() {
    return this.map ? this.map.getBounds().toArray().flat() : this.tiles.bounds;
  }

  #listen() {
    this.map.on("click", (event) => {
      const hit = this.aiming ? null : this.#hit(event.point);
      if (hit) for (const listener of this.listeners.pick) listener(hit, placeOf(event), this.map.getZoom());
      else for (const listener of this.listeners.click) listener(placeNear(this.map, event.point));
    });
    this.map.on("mousemove", (event) => {
      const hit = this.#hit(event.point);
      this.map.getCanvas().style.cursor = this.aiming ? "crosshair" : hit ? "pointer" : "";
      for (const listener of this.listeners.hover) listener(hit, placeOf(event));
    });
    this.map.on("mouseout", () => {
      for (const listener of this.listeners.hover) listener(null, null);
    });
  }

  /** What was hit of that which can be picked: {source, properties}, or null. */
  #hit(point) {
    const [station] = this.stations && this.map.getLayer("station-point") ? this.map.queryRenderedFeatures([point.x, point.y], { layers: ["station-halo", "station-point"] }) : [];
    if (station) return { source: "station", properties: station.properties };
    const layers = ["route-other-hit", "route-hit", "stretch-hit", "residual-hit"].filter((id) => this.map.getLayer(id));
    const near = [[point.x - 4, point.y - 4], [point.x + 4, point.y + 4]];
    const [found] = layers.length ? this.map.queryRenderedFeatures(near, { layers }) : [];
    return found ? { source: found.source, properties: found.properties } : null;
  }

  /**
   * Listen to what the user does. "click": (place) beside everything that can be picked; "pick": ({source, properties},
   * place, zoom), of which source "station" is a charging station; "hover": ({source, properties} | null, place | null).
   */
  on(event, listener) {
    this.listeners[event].push(listener);
  }

  /** While a place is aimed at, a click is for it also where something could be picked. */
  aim(aiming) {
    this.aiming = aiming;
  }

  /** Replace what one overlay shows. name: one of OVERLAYS. features: GeoJSON features. */
  draw(name, features) {
    this.data[name] = { type: "FeatureCollection", features };
    this.map?.getSource(name)?.setData(this.data[name]);
  }

  /** Show these markers of places (markers.js), and no others. */
  placeMarkers(wanted) {
    this.#mark({ places: wanted });
  }

  /** Show these markers of answers, such as where the charge ends, and no others. */
  noteMarkers(wanted) {
    this.#mark({ notes: wanted });
  }

  #mark(patch) {
    this.wanted = { ...this.wanted, ...patch };
    this.markers?.show([...this.wanted.places, ...this.wanted.notes]);
  }

  /** The scale in "km" or "mi". */
  setUnits(units) {
    this.units = units;
    this.scale?.setUnit(units === "mi" ? "imperial" : "metric");
  }

  /** A cursor on the map, null for none. */
  cursor(position) {
    this.draw("cursor", position ? [{ type: "Feature", properties: {}, geometry: { type: "Point", coordinates: position } }] : []);
  }

  /** Show all of an extent [west, south, east, north], beside or below what lies over the map's upper left corner. */
  fit(bounds, { animate = true } = {}) {
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.extent = bounds; // the map begins there if it does not exist yet
    this.map?.resize(); // the chart below the map may just have come or gone
    if (!this.map) return;
    const [beside, below] = this.#paddings().map((padding) => ({ padding, maxZoom: FIT_ZOOM }));
    const zoom = (options) => this.map.cameraForBounds(bounds, options)?.zoom ?? -1;
    const best = zoom(beside) > zoom(below) ? beside : below;
    this.map.fitBounds(bounds, { ...best, animate: animate && !calm, duration: 500 });
  }

  /** Room to leave [px] so that an extent lies beside the legend, and so that it lies below it. */
  #paddings() {
    const { clientWidth, clientHeight } = this.container;
    const least = Math.max(10, Math.min(FIT_PX, clientWidth / 8, clientHeight / 8));
    const { offsetLeft: x, offsetTop: y, offsetWidth, offsetHeight } = this.container.parentElement.querySelector(".legend");
    const all = { left: least, right: least, top: least, bottom: least };
    if (!offsetWidth) return [all, all];
    const beside = { ...all, left: Math.max(least, x + offsetWidth + 20) };
    const below = { ...all, top: Math.max(least, y + offsetHeight + 40) };
    return clientHeight - below.top - least < LEAST_ROOM_PX ? [beside, beside] : [beside, below];
  }

  /** Move the map so that a place is in view. */
  bring(place) {
    if (this.map && !this.shows(place)) this.map.panTo([place.lon, place.lat], { animate: false });
  }

  /** How far two places are apart on the map [px]; 0 while there is no map. */
  apartPx(a, b) {
    if (!this.map) return 0;
    const [from, to] = [a, b].map(({ lon, lat }) => this.map.project([lon, lat]));
    return Math.hypot(to.x - from.x, to.y - from.y);
  }

  /** Whether a place is in view. */
  shows(place) {
    return this.map?.getBounds().contains([place.lon, place.lat]) ?? false;
  }

  /** Say instead of the map why there is none; again: what a button to try again does, null for no button. */
  fail(message, again = null) {
    this.container.dataset.state = "failed";
    this.error?.remove();
    this.error = el("div", { class: "map-error", role: "alert" }, el("p", {}, message), again && el("button", { type: "button", class: "button", on: { click: again } }, "Try again"));
    this.container.after(this.error);
  }
}

/** Where the pointer is, also on a copy of the world beside the first one. */
function placeOf({ lngLat }) {
  const { lng: lon, lat } = lngLat.wrap();
  return { lat, lon };
}

/** The extent of positions [lon, lat]: [west, south, east, north], east beyond 180 where it is smaller over 180° than round the world. */
export function extentOf(positions) {
  let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
  let [turnedWest, turnedEast] = [Infinity, -Infinity];
  for (const [lon, lat] of positions) {
    const turned = lon < 0 ? lon + 360 : lon;
    west = Math.min(west, lon);
    east = Math.max(east, lon);
    turnedWest = Math.min(turnedWest, turned);
    turnedEast = Math.max(turnedEast, turned);
    south = Math.min(south, lat);
    north = Math.max(north, lat);
  }
  return east - west > 180 && turnedEast - turnedWest < east - west ? [turnedWest, south, turnedEast, north] : [west, south, east, north];
}
