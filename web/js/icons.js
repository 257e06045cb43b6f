/** Small pictures for buttons; each button says in words what it does besides. */

import { svg } from "./dom.js";

const PATHS = {
  aim: "M12 3v4M12 17v4M3 12h4M17 12h4M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8z",
  close: "M6 6l12 12M18 6L6 18",
  plus: "M12 5v14M5 12h14",
  swap: "M8 4v15M8 19l-4-4M8 19l4-4M16 20V5M16 5l-4 4M16 5l4 4",
  down: "M12 4v12M12 16l-5-5M12 16l5-5M5 20h14",
  link: "M10 14l4-4M8.5 11.500l-2 2a3.5 3.5 0 0 0 5 5l2-2M15.5 12.500l2-2a3.5 3.5 0 0 0-5-5l-2 2",
  sun: "M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8zM12 2v2M12 20v2M2 12h2M20 12h2M5 5l1.4 1.4M17.6 17.6L19 19M5 19l1.4-1.4M17.6 6.4L19 5",
  bolt: "M13 3L5 14h6l-1 7 8-11h-6l1-7z",
  search: "M11 5a6 6 0 1 0 0 12 6 6 0 0 0 0-12zM15.5 15.500L20 20",
  moon: "M19 14.500A7.5 7.5 0 0 1 9.5 5a7.5 7.5 0 1 0 9.5 9.500z",
};

/** A picture of 18 pixels in the colour of the text. name: one of PATHS. */
export function icon(name) {
  return svg(
    "svg",
    { viewBox: "0 0 24 24", width: 18, height: 18, "aria-hidden": "true", fill: "none", stroke: "currentColor", "stroke-width": 2, "stroke-linecap": "round", "stroke-linejoin": "round" },
    svg("path", { d: PATHS[name] }),
  );
}
