/** Another station in place of a stop: chosen from a list, or the one that a stop was dragged to. */

import { ApiError } from "../api.js";
import { el, fill } from "../dom.js";
import { withoutStation, withStation } from "../journey/charging.js";
import { failure, working } from "../notices.js";
import { classColour, classOf, powerText } from "../stations/power.js";
import { placeOfFeature, stationsNear, usableFilters } from "../stations/details.js";
import { nameStations } from "../stations/names.js";
import { hindranceText, priceText, stationName } from "../stations/words.js";
import { chosenVehicle } from "../journey/vehicle.js";

const DROP_PX = 60; // from where a stop is dropped to the station that is meant

/** Both ways to move a stop; list: of the stops (stops.js). */
export function createOthers(app, list) {
  const { journey, session, view } = app;
  let asked = 0;
  let opened = null; // the list of near stations: {id of the stop's station, place}

  const filters = () => usableFilters(journey.get().charging, chosenVehicle(app)?.connectors ?? []);

  function take(stop, station) {
    list.keepFocus(stop);
    opened = null;
    const name = stationName(station.properties);
    nameStations(app, { [station.id]: name });
    const others = withoutStation(journey.get().charging, stop.station.id);
    journey.set({ charging: withStation(others, { id: station.id, ...placeOfFeature(station) }) });
    app.say(`Planning again with ${name}.`);
  }

  /** Offer near stations below the card of a stop; a second press closes the list. */
  async function choose(stop, i, opener) {
    const place = list.othersOf(i);
    asked += 1;
    const mine = asked;
    opener.setAttribute("aria-expanded", String(!place.firstChild));
    if (place.firstChild) {
      fill(place);
      opened = null;
      return;
    }
    const offered = { id: stop.station.id, place };
    opened = offered;
    fill(place, working("Looking for stations near …"));
    try {
      const near = await stationsNear(app, stop.station.at, filters(), { besides: [stop.station.id], at: stop.arrive_time });
      if (mine !== asked || !offered.place.isConnected) return;
      const { theme } = session.get();
      fill(offered.place, near.length ? el("ul", { class: "stations-list", "aria-label": `Stations near ${stationName(stop.station)}` }, near.map((one) => entry(one, theme, stop.arrive_time, () => take(stop, one.station)))) : el("p", { class: "small dim" }, "No other station that fits is near."));
      offered.place.querySelector("button")?.focus();
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      if (mine === asked) fill(offered.place, failure(error, null));
    }
  }

  function entry({ station: { properties: facts }, apart_m: apart, closed }, theme, at, act) {
    const more = [app.units().lengthText(apart), priceText(facts), hindranceText(facts), closed && `closed at ${at.slice(11, 16)}`].filter(Boolean);
    return el(
      "li", {},
      el("button", { type: "button", class: "stations-entry", on: { click: act } },
        el("span", { class: "station-dot", style: { "background-color": classColour(classOf(facts.power_kw), theme) } }),
        el("span", { class: "grow" }, stationName(facts), el("span", { class: "small dim" }, ` ${more.join(" · ")}`)),
        el("span", { class: "num" }, powerText(facts.power_kw))),
    );
  }

  /** Move a stop to the station that it was dropped on; again(): put the marker back where none is. */
  async function drop(stop, place, again) {
    asked += 1;
    try {
      const [nearest] = await stationsNear(app, place, filters());
      const near = nearest && view.apartPx(place, placeOfFeature(nearest.station)) <= DROP_PX;
      if (near && nearest.station.id !== stop.station.id) take(stop, nearest.station);
      else {
        again();
        if (!near) app.toast("No station that fits the vehicle is there; the stop stays where it was.");
      }
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      again();
      app.toast(error.message);
    }
  }

  /** Draw the list of stops anew, as further plans arrive; what is offered below a stop that is still in it stays. */
  function keep(draw, stopsOf) {
    const focused = opened?.place.contains(document.activeElement) ? document.activeElement : null;
    draw();
    const i = opened ? stopsOf().findIndex(({ station }) => station?.id === opened.id) : -1;
    if (i < 0) {
      opened = null;
      return;
    }
    const place = list.othersOf(i);
    place.replaceChildren(...opened.place.childNodes);
    opened.place = place;
    list.openerOf(i).setAttribute("aria-expanded", "true");
    focused?.focus();
  }

  return { choose, drop, keep };
}
