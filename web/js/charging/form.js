/** The form of charging stops: whether they are planned, and what they may be like. */

import { el, fill, newId } from "../dom.js";
import { shownGround } from "../journey/ground.js";
import { capsFromText, CONFIDENCES, CONNECTORS, INITIAL_CHARGING, LEAST_POWERS_KW, OBJECTIVES, STAY_POWERS_KW, STAYS_MIN, withAnyStation, withNetworks } from "../journey/charging.js";
import { chosenVehicle } from "../journey/vehicle.js";
import { hasStations } from "../stations/box.js";
import { nameOf } from "../stations/names.js";
import { durationText, number, percentText } from "../units.js";

const LEAST_ROOM = 0.1; // between the charges of arrival and departure, which the service wants apart
const OBJECTIVE_NAMES = { time: "Fastest", energy: "Least energy", cost: "Cheapest" };

export function chargingForm(app, element) {
  const { journey, session } = app;
  const set = (patch) => {
    const next = { ...journey.get().charging, ...patch };
    if ("most" in patch) next.arrive = Number(Math.min(next.arrive, next.most - LEAST_ROOM).toFixed(4));
    else next.most = Number(Math.max(next.arrive + LEAST_ROOM, next.most).toFixed(4));
    journey.set({ charging: next });
  };
  const setNetworks = (which, names) => journey.set({ charging: withNetworks(journey.get().charging, which, names) });
  const shows = [];
  const part = ({ field, show }) => {
    shows.push(show);
    return field;
  };
  const id = newId("stops");
  const box = el("input", { type: "checkbox", id, role: "switch", on: { change: () => set({ on: box.checked }) } });
  const warning = el("div", {});
  const failed = el("div", { hidden: true }, el("p", { class: "charging-failed" }, "No plan with these choices. ", el("button", { type: "button", class: "link-button", on: { click: showWhy } }, "What would help")));
  const stations = el("div", {});
  const form = el(
    "div",
    { class: "stack" },
    warning,
    failed,
    part(departure(set)),
    part(segments("Plan for", "objective", OBJECTIVES, OBJECTIVE_NAMES, set)),
    el("div", { class: "pair" }, part(percent("On arrival at least", "arrive", 0, 50, set)), part(percent("At the goal at least", "atGoal", 0, 90, set))),
    part(percent("Charge to at most", "most", 30, 100, set)),
    part(stay(set)),
    part(choice("How sure", "confidence", [[null, "By the mean"], ...CONFIDENCES.map((value) => [value, sureText(value)])], set, sureText)),
    stations,
    el(
      "details",
      {},
      el("summary", {}, "Stations and speed ", el("span", { class: "dim small" })),
      el(
        "div",
        { class: "stack" },
        el("div", { class: "pair" }, part(choice("Power at least", "leastKw", [[0, "any"], ...LEAST_POWERS_KW.map((kw) => [kw, kwText(kw)])], set, kwText)), part(minutes(set))),
        part(plugs(app, set)),
        part(networks("Networks to prefer", "prefer", setNetworks)),
        part(networks("Networks to avoid", "avoid", setNetworks)),
        part(never(set)),
        part(caps(app, set)),
        el("button", { type: "button", class: "quiet", on: { click: () => set({ ...INITIAL_CHARGING, on: true }) } }, "Back to defaults"),
      ),
    ),
  );
  const summary = form.querySelector("summary span");
  fill(element, el("div", { class: "card stack charging-card" }, el("h2", { class: "unseen" }, "Charging stops"), el("div", { class: "check" }, box, el("label", { for: id }, el("b", {}, "Charging stops"), el("span", { class: "small dim" }, " where the charge does not suffice"))), form));

  journey.on(["charging", "vehicle", "units", "graph"], render);
  session.on(["vehicles", "tiles", "graphs", "stationNames"], render);
  session.on(["routes"], showFailure);
  render();

  /** Where the answer is out of sight below the form, a word about it stands in the form as well. */
  function showFailure({ routes: { status, answer } }) {
    if (status === "done" || status === "none") failed.hidden = !answer?.no_plan;
  }

  function render() {
    const { charging } = journey.get();
    box.checked = charging.on;
    form.hidden = !charging.on;
    for (const show of shows) show(charging);
    summary.textContent = summaryOf(charging, app.units());
    const said = charging.on ? hindrances(app) : [];
    fill(warning, said.length > 0 && el("div", { class: "notice warn small" }, said.map((text) => el("p", {}, text))));
    fill(stations, chosenStations(app, charging, (next) => journey.set({ charging: next })));
  }
}

function showWhy() {
  const notice = document.querySelector("#routes .out-of-reach");
  notice?.querySelector("h3").scrollIntoView({ block: "center" });
  notice?.querySelector("button")?.focus({ preventScroll: true });
}

/** What keeps stops from being planned, in words. */
function hindrances(app) {
  const vehicle = chosenVehicle(app);
  const ground = shownGround(app);
  return [
    vehicle && !vehicle.connectors?.length && `It is not known how the ${vehicle.name} charges: no plug, no power. Stops can't be planned for it.`,
    ground && hasStations(app.session.get()) === false && `There are no charging stations on the map ${ground.name}.`,
  ].filter(Boolean);
}

function summaryOf({ leastKw, plugs: chosen, prefer, avoid, never: shunned, capsKmh }, units) {
  return [leastKw && `from ${leastKw} kW`, chosen.length && chosen.map((plug) => CONNECTORS[plug]).join(", "), prefer.length && `rather ${prefer.join(", ")}`, avoid.length && `${shunned ? "without" : "rather not"} ${avoid.join(", ")}`, capsKmh.length && capsKmh.map((kmh) => units.speedText(kmh)).join(", ")].filter(Boolean).join(" · ");
}

/** Stations that were chosen to charge at or not, each with a button that forgets it. */
function chosenStations(app, charging, put) {
  const rows = [...charging.at.map(({ id }) => [id, "Charge at"]), ...charging.not.map((id) => [id, "Not at"])];
  if (!rows.length) return null;
  return el("ul", { class: "chosen-stations", "aria-label": "Chosen stations" }, rows.map(([id, what]) => el(
    "li", {},
    el("span", { class: "grow" }, el("span", { class: "dim" }, `${what} `), nameOf(app, id)),
    el("button", { type: "button", class: "link-button", "aria-label": `Forget: ${what} ${nameOf(app, id)}`, on: { click: () => put(withAnyStation(charging, id)) } }, "Forget"),
  )));
}

function departure(set) {
  const id = newId("departure");
  const input = el("input", { type: "datetime-local", id, on: { change: () => set({ departure: input.value || null }) } });
  const now = el("button", { type: "button", class: "button", on: { click: () => set({ departure: localNow() }) } }, "Now");
  return {
    field: el("div", { class: "field" }, el("label", { for: id }, "Departure"), el("div", { class: "row" }, input, now)),
    show({ departure: value }) {
      if (input.value !== (value ?? "")) input.value = value ?? "";
    },
  };
}

function localNow() {
  const now = new Date();
  return new Date(now.getTime() - 60_000 * now.getTimezoneOffset()).toISOString().slice(0, 16);
}

function segments(title, name, values, texts, set) {
  const group = newId("segments");
  const inputs = values.map((value) => {
    const input = el("input", { type: "radio", name: group, value, on: { change: () => set({ [name]: value }) } });
    return { value, input, field: el("label", {}, input, el("span", {}, texts[value])) };
  });
  return {
    field: el("fieldset", { class: "field" }, el("legend", { class: "small dim" }, title), el("div", { class: "segments" }, inputs.map(({ field }) => field))),
    show(charging) {
      for (const { value, input } of inputs) input.checked = value === charging[name];
    },
  };
}

function percent(label, name, min, max, set) {
  const id = newId("percent");
  const output = el("output", { for: id });
  const input = el("input", { type: "range", id, min, max, step: 1, on: { input: () => set({ [name]: Number(input.value) / 100 }) } });
  return {
    field: el("div", { class: "slider" }, el("label", { for: id }, label), output, input),
    show(charging) {
      const value = charging[name];
      if (Math.round(Number(input.value)) !== Math.round(100 * value)) input.value = String(Math.round(100 * value));
      input.setAttribute("aria-valuetext", percentText(value));
      output.textContent = percentText(value);
    },
  };
}

function minutes(set) {
  const id = newId("minutes");
  const output = el("output", { for: id });
  const input = el("input", { type: "range", id, min: 0, max: 30, step: 1, on: { input: () => set({ overheadMin: Number(input.value) }) } });
  return {
    field: el("div", { class: "slider" }, el("label", { for: id, title: "Leaving the road, plugging in, paying" }, "Stopping itself"), output, input),
    show({ overheadMin: value }) {
      input.value = String(value);
      input.setAttribute("aria-valuetext", `${number(value)} minutes`);
      output.textContent = `${number(value)} min`;
    },
  };
}

const kwText = (kw) => `${number(kw, kw % 1 ? 1 : 0)} kW`;
const sureText = (value) => `${percentText(value)} sure at every stop`;
const stayText = (min) => (min ? (min % 60 ? durationText(60 * min) : `${number(min / 60)} h`) : "none");

/** A stay at the goal that charges, and its power, which is asked for only then. */
function stay(set) {
  const time = choice("Charge at the goal", "stayMin", [0, ...STAYS_MIN].map((value) => [value, stayText(value)]), set, stayText);
  const power = choice("Power there", "stayKw", STAY_POWERS_KW.map((kw) => [kw, kwText(kw)]), set, kwText);
  return {
    field: el("div", { class: "pair" }, time.field, power.field),
    show(charging) {
      time.show(charging);
      power.show(charging);
      power.field.hidden = !charging.stayMin;
    },
  };
}

/** One of some values, or another that an address has brought; textOf(value): how that is said. */
function choice(label, name, options, set, textOf) {
  const id = newId("choice");
  const input = el("select", { id, on: { change: () => set({ [name]: JSON.parse(input.value) }) } });
  return {
    field: el("div", { class: "field" }, el("label", { for: id }, label), input),
    show(charging) {
      const value = charging[name];
      const known = options.some(([other]) => other === value);
      const all = known ? options : [...options, [value, textOf(value)]];
      if (input.options.length !== all.length || !known) fill(input, all.map(([other, text]) => el("option", { value: JSON.stringify(other) }, text)));
      input.value = JSON.stringify(value);
    },
  };
}

function plugs(app, set) {
  const place = el("div", { class: "row wrap" });
  const field = el("fieldset", { class: "field" }, el("legend", { class: "small dim" }, "Plugs, none ticked: all that fit"), place);
  let shown = null;
  return {
    field,
    show(charging) {
      const fitting = [...new Set([...(chosenVehicle(app)?.connectors ?? []), ...charging.plugs])];
      field.hidden = !fitting.length;
      if (shown !== fitting.join()) {
        shown = fitting.join();
        fill(place, fitting.map((plug) => {
          const id = newId("plug");
          const box = el("input", { type: "checkbox", id, value: plug, on: { change: () => set({ plugs: [...place.querySelectorAll("input:checked")].map(({ value }) => value) }) } });
          return el("div", { class: "check" }, box, el("label", { for: id }, CONNECTORS[plug] ?? plug));
        }));
      }
      for (const box of place.querySelectorAll("input")) box.checked = charging.plugs.includes(box.value);
    },
  };
}

/** Names of networks with commas between; which: "prefer" or "avoid". */
function networks(label, which, take) {
  const id = newId("networks");
  const input = el("input", { type: "text", id, autocomplete: "off", spellcheck: "false", placeholder: "names with commas between", on: { change: () => take(which, input.value.split(",").map((name) => name.trim()).filter(Boolean)) } });
  return {
    field: el("div", { class: "field" }, el("label", { for: id }, label), input),
    show(charging) {
      if (document.activeElement !== input) input.value = charging[which].join(", ");
    },
  };
}

function never(set) {
  const id = newId("never");
  const box = el("input", { type: "checkbox", id, on: { change: () => set({ never: box.checked }) } });
  return {
    field: el("div", { class: "check" }, box, el("label", { for: id }, "Never stop at those")),
    show(charging) {
      box.checked = charging.never;
      box.disabled = !charging.avoid.length;
    },
  };
}

function caps(app, set) {
  const id = newId("caps");
  const label = el("label", { for: id });
  const message = el("div", { class: "message", id: `${id}-message`, role: "status" });
  const input = el("input", { type: "text", id, inputmode: "numeric", autocomplete: "off", placeholder: "none", "aria-describedby": `${id}-message`, on: { change: take, keydown: ({ key }) => key === "Enter" && take() } });
  const factor = () => 1 / app.units().speed(1);

  function take() {
    const { caps: found, error } = capsFromText(input.value, factor());
    message.textContent = error;
    input.setAttribute("aria-invalid", String(Boolean(error)));
    if (!error) set({ capsKmh: found ?? [] });
  }

  return {
    field: el("div", { class: "field" }, label, input, message),
    show({ capsKmh }) {
      label.textContent = `Slower speeds to try [${app.units().speedUnit}]`;
      if (document.activeElement !== input && !message.textContent) input.value = capsKmh.map((kmh) => number(app.units().speed(kmh))).join(", ");
    },
  };
}
