/** Road network, vehicle, charge at departure, and the charge that must be left. */

import { el, fill, newId } from "../dom.js";
import { number, percentText } from "../units.js";

const ELECTRIC = "bev";
const MANY = 12; // vehicles from which on they can be searched
const MOST_MATCHES = 8;
const MAKES_OF_TWO = ["Alfa Romeo", "Aston Martin", "Great Wall", "Land Rover", "Lynk & Co", "Mercedes EQ", "Rolls Royce", "Xpeng Motors"];

/** The chosen vehicle as the list has it; null before that is known, or where there is none of that name. */
export function chosenVehicle({ journey, session }) {
  const { vehicles: list } = session.get();
  return list?.vehicles.find(({ id }) => id === (journey.get().vehicle ?? list.default)) ?? null;
}

/** Who makes a vehicle, by the first words of its name. */
const makeOf = ({ name }) => MAKES_OF_TWO.find((make) => name.toLowerCase().startsWith(`${make.toLowerCase()} `)) ?? name.split(" ")[0];

const plain = (text) => text.toLowerCase().normalize("NFD").replaceAll(/[\u0300-\u036f]/g, "").replaceAll(/[^a-z0-9]+/g, " ");

/** Vehicles in whose names each word begins some word, or is found in all of it written together. */
export function vehiclesFound(vehicles, text) {
  const words = plain(text).trim().split(" ").filter(Boolean);
  if (!words.length) return [];
  return vehicles.filter(({ name, id }) => {
    const known = plain(`${name} ${id}`);
    const together = known.replaceAll(" ", "");
    return words.every((word) => known.split(" ").some((part) => part.startsWith(word)) || (word.length > 1 && together.includes(word)));
  });
}

export function vehiclePanel({ journey, session }, element) {
  const graphs = select("Road network", (name) => journey.set({ graph: name === session.get().graphs.default ? null : name }));
  const vehicles = select("Vehicle", (id) => journey.set({ vehicle: id === session.get().vehicles.default ? null : id }));
  const search = vehicleSearch((id) => journey.set({ vehicle: id === session.get().vehicles.default ? null : id }));
  const note = el("p", { class: "small dim" });
  let wished = journey.get().reserve; // what the reserve goes back to when the charge is above it again
  const soc = slider("Charge now", (value) => journey.set({ soc: value, reserve: Math.min(wished, value) }));
  const reserve = slider("Reserve", (value) => journey.set({ reserve: Math.min(value, journey.get().soc) }));
  const learned = el("div", { hidden: true });
  fill(
    element,
    el(
      "div",
      { class: "card stack" },
      el("h2", { class: "unseen" }, "Vehicle and charge"),
      el("div", { class: "pair" }, vehicles.field, graphs.field),
      search.field,
      note,
      el("div", { class: "pair" }, soc.field, reserve.field),
      learned,
    ),
  );

  session.on(["graphs"], showGraphs);
  session.on(["vehicles"], showVehicles);
  journey.on(["graph"], showGraphs);
  journey.on(["vehicle"], showVehicles);
  journey.on(["soc", "reserve"], showCharge);
  journey.on(["effects"], showLearned);
  showCharge();
  showLearned();

  function showGraphs() {
    const { graphs: list } = session.get();
    if (!list) return;
    fill(graphs.input, list.graphs.map(({ name }) => el("option", { value: name }, name)));
    graphs.input.value = journey.get().graph ?? list.default;
  }

  function showVehicles() {
    const { vehicles: list } = session.get();
    if (!list) return;
    if (list.error) {
      fill(note, `The vehicles could not be loaded: ${list.error}`);
      return;
    }
    search.show(list.vehicles);
    const groups = new Map([["Your own", []]].filter(() => list.vehicles.some(({ bundled }) => !bundled)));
    for (const one of list.vehicles) {
      const group = one.bundled ? makeOf(one) : "Your own";
      groups.set(group, [...(groups.get(group) ?? []), one]);
    }
    fill(
      vehicles.input,
      [...groups].toSorted(([a], [b]) => (a === "Your own" ? -1 : b === "Your own" ? 1 : a.localeCompare(b, "en"))).map(([label, members]) => el("optgroup", { label }, members.map((one) => el("option", { value: one.id }, one.name)))),
    );
    const wanted = journey.get().vehicle ?? list.default;
    const known = list.vehicles.find(({ id }) => id === wanted);
    if (!known) vehicles.input.prepend(el("option", { value: wanted }, `${wanted} (unknown)`));
    vehicles.input.value = wanted;
    const facts = known && [
      known.powertrain === ELECTRIC ? `${number(known.usable_capacity_kwh, 1)} kWh usable` : `not electric (${known.powertrain})`,
      known.mass_kg && `${number(known.mass_kg)} kg`,
      known.kind === "consumption_table" && "by a consumption table",
    ];
    fill(note, facts ? facts.filter(Boolean).join(" · ") : "The service does not know this vehicle.");
  }

  function showCharge() {
    const { soc: charge, reserve: least } = journey.get();
    if (least < charge) wished = least;
    soc.show(charge);
    reserve.show(least);
  }

  function showLearned() {
    const { effects } = journey.get();
    learned.hidden = !effects;
    fill(
      learned,
      effects &&
        el(
          "div",
          { class: "notice good spread" },
          el("span", {}, "With what diagnosis ", el("span", { class: "num" }, effects), " has learned"),
          el("button", { type: "button", class: "link-button", on: { click: () => journey.set({ effects: null }) } }, "Leave out"),
        ),
    );
  }
}

/** A field that vehicles are found by in a long list. choose(id) is called where one is taken. */
function vehicleSearch(choose) {
  const id = newId("find");
  let list = [];
  const matches = el("ul", { class: "vehicle-matches", "aria-label": "Vehicles found" });
  const said = el("div", { class: "small dim", role: "status" });
  const input = el("input", { type: "search", id, autocomplete: "off", spellcheck: "false", placeholder: "Search vehicles", on: { input: show, keydown: press } });
  const field = el("div", { class: "vehicle-search", hidden: true, on: { keydown: walk } }, el("label", { for: id, class: "unseen" }, "Search vehicles"), input, said, matches);

  const found = () => vehiclesFound(list, input.value);

  function take(vehicle) {
    input.value = "";
    show();
    input.focus();
    choose(vehicle.id);
  }

  function press(event) {
    const [first] = found();
    if (event.key === "Enter" && first) take(first);
    if (event.key === "Escape" && input.value) {
      input.value = "";
      show();
      event.stopPropagation();
    }
  }

  /** Up and down walk from the field through what was found. */
  function walk(event) {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!step) return;
    const stops = [input, ...matches.querySelectorAll("button")];
    const next = stops[stops.indexOf(document.activeElement) + step];
    if (!next) return;
    event.preventDefault();
    next.focus();
  }

  function show() {
    const all = found();
    fill(matches, all.slice(0, MOST_MATCHES).map((vehicle) => el("li", {}, el("button", { type: "button", class: "stations-entry", on: { click: () => take(vehicle) } }, el("span", { class: "grow" }, vehicle.name), el("span", { class: "num dim" }, `${number(vehicle.usable_capacity_kwh)} kWh`)))));
    said.textContent = input.value.trim() ? (all.length > MOST_MATCHES ? `${all.length} found, the first ${MOST_MATCHES}:` : all.length ? "" : "None found") : "";
  }

  return {
    field,
    show(vehicles) {
      list = vehicles;
      field.hidden = vehicles.length < MANY;
      input.placeholder = `Search ${vehicles.length} vehicles`;
      show();
    },
  };
}

function select(label, choose) {
  const id = newId("select");
  const input = el("select", { id, on: { change: () => choose(input.value) } });
  return { input, field: el("div", { class: "field" }, el("label", { for: id }, label), input) };
}

function slider(label, change) {
  const id = newId("charge");
  const output = el("output", { for: id });
  const input = el("input", {
    type: "range", id, min: "0", max: "100", step: "1",
    on: { input: () => change(Number(input.value) / 100) },
  });
  return {
    field: el("div", { class: "slider" }, el("label", { for: id }, label), output, input),
    show(share) {
      if (document.activeElement !== input || Math.round(Number(input.value)) !== Math.round(100 * share)) input.value = String(Math.round(100 * share));
      input.setAttribute("aria-valuetext", percentText(share));
      output.textContent = percentText(share);
    },
  };
}
