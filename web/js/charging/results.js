/** What an answer with charging stops shows besides its routes: the plan, its timeline, its stops on the map, or why there is none. */

import { el } from "../dom.js";
import { withoutStation } from "../journey/charging.js";
import { noPlanNotice } from "./noplan.js";
import { createOthers } from "./others.js";
import { courseAt, departureOf, stopName, timeOf } from "./plan.js";
import { nameOf, nameStations } from "../stations/names.js";
import { stationName } from "../stations/words.js";
import { createStopList } from "./stops.js";
import { createTimeline } from "./timeline.js";

/**
 * Results of plans. moved(along_m | null): the cursor was moved here; change(patch): something else is chosen.
 * Gives {list, timeline: elements, show(looked | null), cursor(along_m | null), markers(): of the stops, notice()}.
 */
export function createPlanResults(app, moved, change) {
  const { journey, view } = app;
  let looked = null;
  const timeline = createTimeline((moment) => {
    list.mark(moment ? stopAt(moment.at_s) : null);
    moved(moment?.along_m ?? null);
  });
  const list = createStopList({
    look: (i, from) => {
      const { station } = stopsOf()[i];
      app.stationCard.open(station.id, station.at, { from });
      view.bring(station.at);
    },
    choose: (i, opener) => others.choose(stopsOf()[i], i, opener),
    leave(i) {
      const { station } = stopsOf()[i];
      app.say(`Planning again without ${stopName(stopsOf()[i])}.`);
      change({ charging: withoutStation(journey.get().charging, station.id) });
    },
    point(at) {
      timeline.cursor(at);
      moved(at === null || !looked ? null : courseAt(timeline.course, at).along_m);
    },
  });
  const others = createOthers(app, list);
  const card = el("div", { class: "card", hidden: true }, el("h2", {}, "Plan"), list.element);

  const stopsOf = () => looked?.route.charging?.stops ?? [];
  const stopAt = (at) => {
    const i = stopsOf().findIndex(({ arrive_s: from, depart_s: to }) => at >= from && at <= to);
    return i < 0 ? null : i;
  };

  function show(next) {
    looked = next?.route.charging ? next : null;
    card.hidden = !looked;
    if (!looked) return;
    nameStations(app, Object.fromEntries(stopsOf().flatMap(({ station }) => (station ? [[station.id, stationName(station)]] : []))));
    others.keep(() => list.show(looked.answer, looked.route, app.units()), stopsOf);
    timeline.show(looked.answer, looked.route, app.units());
  }

  function cursor(along) {
    if (!looked) return;
    const at = along === null ? null : timeOf(timeline.course, along);
    timeline.cursor(at);
    list.mark(at === null ? null : stopAt(at));
  }

  /** Markers of the stops and of halts; again(): draw them where they were. */
  const markers = (again) => [...stopMarkers(again), ...haltMarkers()];
  const haltMarkers = () =>
    (looked?.route.charging?.halts ?? []).map(({ station }, i) => ({ key: `halt-${i}`, kind: "halt", letter: "H", place: station.at, title: `Halt without charging, ${stationName(station)}` }));
  const stopMarkers = (again) =>
    stopsOf().map((stop, i) => {
      const name = stopName(stop);
      const moves = stop.station !== null;
      return {
        key: `stop-${i}`, kind: "stop", letter: String(i + 1), place: stop.station?.at ?? stop.at,
        title: moves ? `Stop ${i + 1}, ${name}: drag it to another station, or press Enter to choose one` : `Stop ${i + 1}, ${name}`,
        onDrop: moves ? (place) => others.drop(stop, place, again) : null,
        onPress: moves ? () => list.focus(i) : null,
      };
    });

  /** Why there is no plan, or which chosen stations it passes; null where there is nothing to say. */
  function notice(answer) {
    if (answer.no_plan) return noPlanNotice(answer.no_plan, journey.get(), app.units(), change);
    const passed = (answer.request.charging?.via_stations ?? []).filter(({ station: id }) => !stopsOf().some(({ station }) => station?.id === id));
    return passed.length && looked ? el("div", { class: "notice plain" }, passed.map(({ station: id }) => el("p", {}, `The plan goes over ${nameOf(app, id)} without charging: that would not help${departureOf(answer) ? ", or it is closed then" : ""}.`))) : null;
  }

  return { list: card, timeline: timeline.element, show, cursor, markers, notice };
}

