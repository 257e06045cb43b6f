/** Routes on the map: drawn, fitted into the view, and picked there. */

import { leadFeatures } from "../map/leads.js";
import { extentOf } from "../map/view.js";
import { BEYOND } from "./colours.js";
import { slugOf } from "./compare.js";
import { otherFeatures, routeFeatures, scaleFor, stretchFeatures } from "./drawing.js";
import { createLegend } from "./legend.js";
import { alongAt, positionAt, stretchAt, stretchLine } from "./profile.js";

const colourOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${slugOf(name)}`).trim() || "#0b7a55";
const extentOfAll = ({ routes }) => extentOf(routes.flatMap(({ geometry }) => geometry.coordinates));

/**
 * Routes on the map of an app. told: {choose(name): another route was clicked, stretch(index): a hot stretch was,
 * along(distance | null): the pointer is on the route that is looked at}.
 */
export function createRoutesOnMap({ journey, session, view, units }, told) {
  const legend = createLegend((colour) => journey.set({ colour }));
  let looked = null;
  let fitted = null; // start, goal and graph that the view was fitted to
  let following = false;
  view.on("pick", pick);
  view.on("hover", follow);

  /** Draw what is looked at, null for nothing. stretch: position of the hot stretch that is marked. notes: markers besides. */
  function draw(next, stretch, notes = []) {
    looked = next;
    if (!looked) {
      for (const name of ["route", "route-other", "stretch", "lead"]) view.draw(name, []);
      view.noteMarkers([]);
      view.cursor(null);
      legend.hide();
      return;
    }
    const { answer, route, profile, reach } = looked;
    const { colour: colouring } = journey.get();
    const { theme } = session.get();
    const scale = scaleFor(colouring, answer, route, theme);
    view.draw("route", routeFeatures(profile, { colouring, scale, plain: colourOf(route.name), reach, theme }));
    view.draw("route-other", otherFeatures(answer.routes, route, colourOf));
    const { start, goal, via = [] } = answer.snapped;
    view.draw("lead", leadFeatures([start, ...via, goal]));
    mark(stretch);
    view.noteMarkers([...notes, ...(reach === null ? [] : [{ key: "furthest", kind: "furthest", letter: "!", title: "Here the charge is used up", place: route.furthest }])]);
    const names = answer.routes.map(({ name }) => name);
    legend.show(scale, { colouring, units: units(), names, beyond: reach !== null, grey: BEYOND[theme], hot: route.hot_links.length > 0 });
  }

  const mark = (stretch) => view.draw("stretch", stretchFeatures(looked.profile, stretch));
  const showStretch = (index) => view.fit(extentOf(stretchLine(looked.profile, looked.route.hot_links[index])));
  const showAll = () => view.fit(extentOfAll(looked.answer));

  /** Show all routes where start, goal or map are others than before and something lies out of view; whether they are. */
  function fitWhereNew() {
    const { start, goal, graph } = looked.answer.request;
    const wanted = JSON.stringify([start, goal, graph]);
    if (fitted === wanted) return false;
    const [west, south, east, north] = extentOfAll(looked.answer);
    const inView = [[south, west], [south, east], [north, west], [north, east]].every(([lat, lon]) => view.shows({ lat, lon }));
    if (fitted === null || !inView) showAll();
    fitted = wanted;
    return true;
  }

  /** Show all routes where nothing of the one that is looked at can be seen. */
  function fitWhereLost() {
    if (!looked.profile.coordinates.some(([lon, lat]) => view.shows({ lat, lon }))) showAll();
  }

  /** The next routes are fitted into the view wherever it is. */
  function forget() {
    fitted = null;
  }

  const alongOf = (properties, place) => alongAt(looked.profile, place, properties.first, properties.last);

  function pick({ source, properties }, place) {
    if (source === "route-other") told.choose(properties.name);
    if (source !== "route" || !looked) return;
    const index = stretchAt(looked.route, alongOf(properties, place));
    if (index >= 0) told.stretch(index);
  }

  function follow(hit, place) {
    const onRoute = Boolean(looked) && hit?.source === "route";
    if (!onRoute && !following) return;
    following = onRoute;
    const along = onRoute ? alongOf(hit.properties, place) : null;
    cursor(along);
    told.along(along);
  }

  function cursor(along) {
    view.cursor(along === null || !looked ? null : positionAt(looked.profile, along));
  }

  return { draw, mark, cursor, showStretch, showAll, fitWhereNew, fitWhereLost, forget };
}
