/** Markers of places: dragged with the pointer, or moved with the arrow keys. */

import { el } from "../dom.js";
import { placeNear } from "./nearest.js";

const STEP_PX = 12;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class MarkerSet {
  constructor(map, maplibregl) {
    this.map = map;
    this.maplibregl = maplibregl;
    this.shown = new Map();
  }

  /**
   * Show exactly these markers.
   * onMove: places follow the pointer and the arrow keys. onDrop: they are only dropped; onPress: clicked, or Enter.
   * @param {Array<{key: string, kind: "start"|"goal"|"via"|"stop"|"halt"|"furthest", letter: string, title: string,
   *   place: {lat: number, lon: number}, onMove?: (place: {lat: number, lon: number}) => void,
   *   onDrop?: (place: {lat: number, lon: number}) => void, onPress?: () => void}>} wanted
   */
  show(wanted) {
    const keys = new Set(wanted.map(({ key }) => key));
    for (const [key, one] of this.shown) {
      if (keys.has(key)) continue;
      one.marker.remove();
      this.shown.delete(key);
    }
    for (const one of wanted) this.#place(one);
  }

  #place(one) {
    const position = [one.place.lon, one.place.lat];
    const known = this.shown.get(one.key);
    const moves = Boolean(one.onMove);
    const acts = moves || Boolean(one.onDrop);
    const title = moves ? `${one.title}: drag it, or move it with the arrow keys` : one.title;
    if (known) {
      Object.assign(known, { onMove: one.onMove, onDrop: one.onDrop, onPress: one.onPress });
      known.marker.getElement().title = title;
      known.marker.getElement().setAttribute("aria-label", title);
      if (!known.dragged) known.marker.setLngLat(position); // an answer may come while it is dragged
      return;
    }
    const inner = el("div", { class: `marker ${one.kind}` }, el("span", {}, one.letter));
    const element = el("div", { title, "aria-label": title, role: acts ? "button" : "img", tabindex: acts ? "0" : null, dataset: { marker: one.key } }, inner);
    const marker = new this.maplibregl.Marker({ element, draggable: acts, anchor: one.kind === "furthest" ? "center" : "bottom", offset: one.kind === "furthest" ? [0, 0] : [0, -5] });
    marker.setLngLat(position).addTo(this.map);
    element.setAttribute("aria-label", title); // MapLibre puts its own in place
    const entry = { marker, onMove: one.onMove, onDrop: one.onDrop, onPress: one.onPress, dragged: false };
    this.shown.set(one.key, entry);
    const tell = () => {
      const { lat, lng } = marker.getLngLat();
      entry.onMove?.({ lat, lon: lng });
    };
    marker.on("dragstart", () => {
      entry.dragged = true;
    });
    marker.on("dragend", () => {
      entry.dragged = false;
      entry.onMove?.(placeNear(this.map, this.map.project(marker.getLngLat())));
      if (entry.onDrop) {
        const { lat, lng: lon } = marker.getLngLat();
        entry.onDrop({ lat, lon });
      }
    });
    element.addEventListener("click", (event) => {
      event.stopPropagation();
      entry.onPress?.();
    });
    element.addEventListener("keydown", (event) => {
      if (entry.onPress && (event.key === "Enter" || event.key === " ")) {
        event.preventDefault();
        entry.onPress();
      }
      const arrow = ARROWS[event.key];
      if (!arrow || !moves) return;
      event.preventDefault();
      event.stopPropagation();
      const far = event.shiftKey ? 5 : 1;
      const point = this.map.project(marker.getLngLat());
      marker.setLngLat(this.map.unproject([point.x + arrow[0] * STEP_PX * far, point.y + arrow[1] * STEP_PX * far]));
      tell();
    });
  }
}
