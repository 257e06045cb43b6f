/** Weather, load and habits; what stays at its default is not sent at all. */

import { el, fill, newId } from "../dom.js";
import { DIRECTIONS, directionText, number } from "../units.js";
import { CONDITIONS, withCondition } from "./journey.js";

const ROADS = { dry: "Dry", wet: "Wet", snow: "Snow" };
const REFERENCE_C = 20;

export function conditionsPanel(app, element) {
  const { journey } = app;
  const set = (name, value) => journey.set({ conditions: withCondition(journey.get().conditions, name, value) });
  const summary = el("span", { class: "dim small" });
  const shows = [];

  const part = (made) => {
    shows.push(made.show);
    return made.field;
  };
  const form = el(
    "div",
    { class: "stack" },
    part(temperature(set)),
    part(choice("Road", "road", ROADS, set)),
    el("div", { class: "pair" }, part(wind(app, set)), part(windFrom(set))),
    part(amount("Payload beyond the driver", "payload_kg", 10, (v) => `${number(v)} kg`, set)),
    part(amount("Drag, with a roof box 1.25", "drag_factor", 0.05, (v) => `× ${number(v, 2)}`, set)),
    part(amount("Driven speed over the limit", "speed_factor", 0.05, (v) => `${number(100 * v)} %`, set)),
    part(flag("Heating and cooling", "climate", set)),
    part(flag("Recuperation limited in the cold and near full", "regen_limited", set)),
    uncertainty(journey),
    el("button", { type: "button", class: "quiet", on: { click: () => journey.set({ conditions: {} }) } }, "Back to defaults"),
  );
  fill(
    element,
    el("details", { class: "card" }, el("summary", {}, "Weather and load ", summary), form),
  );
  journey.on(["conditions", "units"], render);
  render();

  function render() {
    const { conditions } = journey.get();
    for (const show of shows) show(conditions);
    summary.textContent = summaryOf(conditions, app.units());
  }
}

function summaryOf(conditions, units) {
  const said = [];
  if (conditions.ambient_c !== undefined) said.push(`${number(conditions.ambient_c)} °C`);
  if (conditions.road) said.push(conditions.road);
  if (conditions.wind_speed_mps) said.push(`wind ${units.speedText(3.6 * conditions.wind_speed_mps)} from ${directionText(conditions.wind_from_deg ?? 0)}`);
  if (conditions.payload_kg) said.push(`${number(conditions.payload_kg)} kg`);
  if (conditions.drag_factor) said.push(`drag × ${number(conditions.drag_factor, 2)}`);
  if (conditions.speed_factor) said.push(`speed ${number(100 * conditions.speed_factor)} %`);
  if (conditions.climate === false) said.push("climate off");
  if (conditions.regen_limited) said.push("limited recuperation");
  return said.length ? said.join(", ") : "none assumed";
}

function temperature(set) {
  const slider = amount("Air temperature", "ambient_c", 1, (v) => `${number(v)} °C`, set, REFERENCE_C);
  const id = newId("known");
  const box = el("input", { type: "checkbox", id, on: { change: () => set("ambient_c", box.checked ? REFERENCE_C : null) } });
  const inner = slider.field;
  return {
    field: el("div", {}, el("div", { class: "check" }, box, el("label", { for: id }, "Count the air temperature")), inner),
    show(conditions) {
      box.checked = conditions.ambient_c !== undefined;
      inner.hidden = !box.checked;
      slider.show(conditions);
    },
  };
}

function wind(app, set) {
  const text = (v) => app.units().speedText(3.6 * v);
  return amount("Wind", "wind_speed_mps", 0.5, text, set);
}

function windFrom(set) {
  const id = newId("wind");
  const input = el("select", { id, on: { change: () => set("wind_from_deg", Number(input.value)) } }, DIRECTIONS.map((name, i) => el("option", { value: String(45 * i) }, name)));
  return {
    field: el("div", { class: "field" }, el("label", { for: id }, "Wind from"), input),
    show(conditions) {
      input.value = String((45 * Math.round((conditions.wind_from_deg ?? 0) / 45)) % 360);
      input.disabled = !conditions.wind_speed_mps;
    },
  };
}

function amount(label, name, step, text, set, otherwise = CONDITIONS[name].default) {
  const id = newId("amount");
  const { min, max } = CONDITIONS[name];
  const output = el("output", { for: id });
  const input = el("input", { type: "range", id, min, max, step, on: { input: () => set(name, Number(input.value)) } });
  return {
    field: el("div", { class: "slider" }, el("label", { for: id }, label), output, input),
    show(conditions) {
      const value = conditions[name] ?? otherwise;
      if (Number(input.value) !== value) input.value = String(value);
      input.setAttribute("aria-valuetext", text(value));
      output.textContent = text(value);
    },
  };
}

function choice(label, name, texts, set) {
  const group = newId("choice");
  const inputs = Object.entries(texts).map(([value, text]) => {
    const input = el("input", { type: "radio", name: group, value, on: { change: () => set(name, value) } });
    return { value, input, field: el("label", {}, input, el("span", {}, text)) };
  });
  return {
    field: el("fieldset", { class: "field" }, el("legend", { class: "small dim" }, label), el("div", { class: "segments" }, inputs.map(({ field }) => field))),
    show(conditions) {
      for (const { value, input } of inputs) input.checked = value === (conditions[name] ?? CONDITIONS[name].default);
    },
  };
}

function flag(label, name, set) {
  const id = newId("flag");
  const box = el("input", { type: "checkbox", id, on: { change: () => set(name, box.checked) } });
  return {
    field: el("div", { class: "check" }, box, el("label", { for: id }, label)),
    show(conditions) {
      box.checked = conditions[name] ?? CONDITIONS[name].default;
    },
  };
}

function uncertainty(journey) {
  const id = newId("uncertainty");
  const box = el("input", { type: "checkbox", id, on: { change: () => journey.set({ uncertainty: box.checked }) } });
  const show = () => {
    box.checked = journey.get().uncertainty;
  };
  journey.on(["uncertainty"], show);
  show();
  return el("div", { class: "check" }, box, el("label", { for: id }, "Show how sure the answer is"));
}
