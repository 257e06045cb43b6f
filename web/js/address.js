/** The address of the page, which follows what is chosen so that it can be shared. */

import { addressOf } from "./journey/journey.js";

const WINDOW_MS = 30_000; // Safari refuses more than 100 changes in that time
const AT_ONCE = 60; // of a window; those beyond them come no faster than this:
const LATER_MS = 1000;

/** Keep the address in step with a journey. */
export function keepAddress(journey) {
  let written = []; // times of the last changes
  let timer = 0;
  const write = () => {
    clearTimeout(timer);
    timer = 0;
    written.push(performance.now());
    history.replaceState(null, "", addressOf(journey.get()) || location.pathname);
  };
  journey.on("*", () => {
    written = written.filter((at) => performance.now() - at < WINDOW_MS);
    if (written.length < AT_ONCE) write();
    else timer ||= setTimeout(write, LATER_MS);
  });
  addEventListener("pagehide", () => timer && write());
}
