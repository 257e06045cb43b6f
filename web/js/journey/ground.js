/** The graph that drives are on, brought onto the map below them. */

/** The graph that is on the map: its entry in the list of graphs, null before that is known. */
export function shownGround({ journey, session }) {
  const { graphs } = session.get();
  return graphs?.graphs.find(({ name }) => name === (journey.get().graph ?? graphs.default)) ?? null;
}

/**
 * The graph that should be on the map and is not: the one of a name, or without a name one that an extent [west, south,
 * east, north] lies in where the graph on the map does not hold it. Null where there is none, or it is there.
 */
export function missingGround(app, name, extent) {
  const { graphs } = app.session.get();
  const shown = shownGround(app);
  if (!graphs || (!name && (!extent || (shown && holds(shown.bbox, extent))))) return null;
  const found = graphs.graphs.find((graph) => (name ? graph.name === name : holds(graph.bbox, extent)));
  return !found || found === shown ? null : found;
}

/** Whether a change to a graph would remove places that are chosen. */
export function losesPlaces({ journey }, { bbox: [west, south, east, north] }) {
  const { start, goal, via } = journey.get();
  return [start, goal, ...via].some((place) => place && !holds([west, south, east, north], [place.lon, place.lat, place.lon, place.lat]));
}

/** Put a graph on the map. */
export function bringGround({ journey, session }, { name }) {
  journey.set({ graph: name === session.get().graphs.default ? null : name });
}

const holds = ([w, s, e, n], [west, south, east, north]) => w <= west && s <= south && e >= east && n >= north;
