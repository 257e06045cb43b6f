/** What the battery of the chosen vehicle holds, as its file says or as a diagnosis that applies found it. */

import { ApiError, call } from "../api.js";

const WH_PER_KWH = 1000;

/**
 * `kwh()` is the usable capacity, null where it can't be known and undefined while it is being asked for. `changed` is
 * called when it may have become another one.
 */
export function batteryCapacity({ journey, session }, changed) {
  const found = new Map(); // by the id of a diagnosis, undefined while it is asked for, null where it found none

  async function learn(id) {
    found.set(id, undefined);
    try {
      const { parameters } = await call(`diagnoses/${encodeURIComponent(id)}/effects`);
      found.set(id, parameters?.usable_capacity_wh ? parameters.usable_capacity_wh / WH_PER_KWH : null);
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      found.set(id, null); // the request that names it says what is wrong
    }
    changed();
  }

  session.on(["vehicles"], changed);
  return {
    kwh() {
      const { vehicle, effects } = journey.get();
      const { vehicles: list } = session.get();
      if (effects && !found.has(effects)) learn(effects);
      if (!list || (effects && found.get(effects) === undefined)) return undefined;
      const known = list.vehicles.find(({ id }) => id === (vehicle ?? list.default));
      return (effects ? found.get(effects) : null) ?? known?.usable_capacity_kwh ?? null;
    },
  };
}
