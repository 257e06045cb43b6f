/** What is chosen for areas: what bands are of and their values, which trip, and how outlines are drawn. */

import { el, fill, newId } from "../dom.js";
import { icon } from "../icons.js";
import { RANGE_MODES, rangeModeOf } from "../journey/journey.js";
import { automaticValues, bandValues, BY, knowsCharge, MAX_BANDS, OUTLINES, plainNumber, valuesFromText } from "../journey/limits.js";
import { number } from "../units.js";

const MODES = { from: "From here", reverse: "To here", round_trip: "Round trip" };
const OUTLINE_NAMES = { roads: "Along roads", filled: "Filled" };

/** The controls; capacity: as batteryCapacity gives it. `show()` brings them in step with the journey. */
export function rangeChoices(app, capacity) {
  const { journey } = app;
  const by = segments("Bands by", BY, (chosen) => journey.set({ by: chosen }));
  const mode = segments("Which area", RANGE_MODES, (chosen) => journey.set({ rangeMode: chosen }));
  const outline = segments("Outline", OUTLINES, (chosen) => journey.set({ outline: chosen }));
  const values = valuesField(app, capacity);
  const count = countSlider(journey);
  const limited = el("p", { class: "small dim" });
  return {
    element: el("div", { class: "stack" }, mode.field, by.field, limited, values.field, count.field, outline.field),
    show() {
      const chosen = journey.get();
      by.show(chosen.by, { charge: "Charge", energy: "Energy", time: "Minutes", distance: chosen.units === "mi" ? "Miles" : "km" });
      mode.show(rangeModeOf(chosen), MODES, knowsCharge(chosen) ? [] : ["reverse", "round_trip"]);
      outline.show(chosen.outline, OUTLINE_NAMES);
      values.show();
      count.show();
      fill(limited, `From here only, whatever the battery holds${chosen.uncertainty ? ", and without how sure it is" : ""}.`);
      limited.hidden = knowsCharge(chosen);
    },
  };
}

/** Some of which one is chosen. */
function segments(title, names, choose) {
  const group = newId("range");
  const parts = names.map((name) => {
    const input = el("input", { type: "radio", name: group, value: name, on: { change: () => choose(name) } });
    const text = el("span", {});
    return { name, input, text, field: el("label", {}, input, text) };
  });
  return {
    field: el("fieldset", { class: "field" }, el("legend", { class: "small dim" }, title), el("div", { class: "segments" }, parts.map(({ field }) => field))),
    show(chosen, texts, disabled = []) {
      for (const { name, input, text } of parts) {
        input.checked = name === chosen;
        input.disabled = disabled.includes(name);
        text.textContent = texts[name];
      }
    },
  };
}

/** How many bands there are where no values are typed. */
function countSlider(journey) {
  const id = newId("bands");
  const input = el("input", { type: "range", id, min: 1, max: MAX_BANDS, step: 1, on: { input: () => journey.set({ bands: Number(input.value) }) } });
  const output = el("output", { for: id });
  const field = el("div", { class: "slider" }, el("label", { for: id }, "Bands"), output, input);
  return {
    field,
    show() {
      const { bands, by, values } = journey.get();
      input.value = String(bands);
      output.textContent = String(bands);
      field.hidden = values[by] !== null;
    },
  };
}

/** Values of one's own in place of those that the service is asked for by itself, which the empty field shows. */
function valuesField(app, capacity) {
  const { journey } = app;
  const id = newId("values");
  const label = el("label", { for: id });
  const message = el("div", { class: "message", id: `${id}-message`, role: "status" });
  const note = el("div", { class: "small dim", id: `${id}-note` });
  const input = el("input", {
    type: "text", id, autocomplete: "off", spellcheck: "false", "aria-describedby": `${id}-message ${id}-note`,
    on: { change: take, keydown: ({ key }) => key === "Enter" && take() },
  });
  const clear = el("button", { type: "button", class: "icon-button", title: "Back to automatic values", "aria-label": "Back to automatic values", on: { click: forget } }, icon("close"));
  let shown = null; // what the field was filled with: {by, units, text}

  /** The unit that stands behind values, and what makes a typed value one of the address. */
  function unitOf({ by, units }) {
    if (by === "distance" && units === "mi") return { unit: "mi", factor: 1 / app.units().length(1000) };
    return { unit: { charge: "%", energy: "kWh", time: "min", distance: "km" }[by], factor: 1 };
  }

  const put = (values) => journey.set({ values: { ...journey.get().values, [journey.get().by]: values } });

  function take() {
    if (input.value === shown.text) {
      say("");
      return;
    }
    const { values, error } = valuesFromText(input.value, journey.get().by, unitOf(journey.get()));
    say(error);
    if (error) return;
    shown = null;
    put(values);
    show();
  }

  function forget() {
    shown = null;
    say("");
    put(null);
    show();
    input.focus();
  }

  function say(error) {
    message.textContent = error;
    input.setAttribute("aria-invalid", String(Boolean(error)));
  }

  function show() {
    const chosen = journey.get();
    const { by, units } = chosen;
    const { unit, factor } = unitOf(chosen);
    const text = (values) => values.map((value) => plainNumber(value / factor)).join(", ");
    const own = chosen.values[by];
    const written = own ? text(own) : "";
    const draft = shown && shown.by === by && shown.units === units && shown.text === written && input.value !== shown.text;
    if (!draft) {
      input.value = written;
      say("");
    }
    shown = { by, units, text: written };
    label.textContent = `Values of your own [${by === "charge" ? "% left" : unit}]`;
    const held = capacity();
    input.placeholder = held === undefined ? "" : text(automaticValues(chosen, held));
    clear.disabled = !own && !input.value;
    fill(note, noteText(chosen, held, text, unit));
    note.hidden = !note.textContent;
  }

  return { field: el("div", { class: "field" }, label, el("div", { class: "row" }, input, clear), message, note), show };
}

/** Which of the typed values are not drawn, and why. */
function noteText(chosen, held, text, unit) {
  if (held === undefined) return "";
  const { beyond } = bandValues(chosen, held);
  if (!beyond.length) return "";
  const { by, soc, reserve } = chosen;
  const room = by === "charge" ? `the reserve is ${number(100 * reserve)} %, the charge now ${number(100 * soc)} %` : `${plainNumber((soc - reserve) * held)} kWh can be taken down to the reserve`;
  return `Not drawn: ${text(beyond)} ${unit}, for ${room}.`;
}
