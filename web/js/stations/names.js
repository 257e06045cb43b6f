/** Names of stations that were seen, for those that an address names by their ids only. */

/** Remember names by id. */
export function nameStations({ session }, names) {
  session.set({ stationNames: { ...session.get().stationNames, ...names } });
}

/** The name of a station, or its id where it was never seen. */
export const nameOf = ({ session }, id) => session.get().stationNames[id] ?? id;
