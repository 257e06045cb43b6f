/** Road network, vehicle, charge at departure, and the charge that must be left. */

import { el, fill, newId } from "../dom.js";
import { number, percentText } from "../units.js";

const ELECTRIC = "bev";

export function vehiclePanel({ journey, session }, element) {
  const graphs = select("Road network", (name) => journey.set({ graph: name === session.get().graphs.default ? null : name }));
  const vehicles = select("Vehicle", (id) => journey.set({ vehicle: id === session.get().vehicles.default ? null : id }));
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
    const groups = new Map();
    for (const one of list.vehicles) {
      const group = one.bundled ? one.name.split(" ")[0] : "Your own";
      groups.set(group, [...(groups.get(group) ?? []), one]);
    }
    fill(
      vehicles.input,
      [...groups].map(([label, members]) => el("optgroup", { label }, members.map((one) => el("option", { value: one.id }, one.name)))),
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
