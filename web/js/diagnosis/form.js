/** What is to be diagnosed, and how: recordings dropped in or named, the vehicle, and what is kept from the fit. */

import { el, fill, newId } from "../dom.js";
import { failure } from "../notices.js";
import { number, percentText } from "../units.js";
import { counted } from "./terms.js";
import { droppedFiles } from "./upload.js";

const ACCEPTED = [".csv", ".jsonl", ".json", ".parquet", ".gpx"];
const SHOWN_FILES = 6;
const LEAST = 8; // with a share held out, six are left to fit
const HELD_OUT = 0.3;
const MOST_HELD_OUT = 0.6;

const readable = ({ name }) => ACCEPTED.some((ending) => name.toLowerCase().replace(/\.gz$/, "").endsWith(ending));
const sizeText = (bytes) => (bytes < 1e6 ? `${number(bytes / 1e3)} kB` : `${number(bytes / 1e6, 1)} MB`);
const words = (text, between) => text.split(between).map((word) => word.trim()).filter(Boolean);

export function diagnosisForm(app, diagnoses, pane) {
  const files = new Map(); // by name: the service tells trips apart by it. They stay, to be sent again with other options
  const chosen = el("div", {});
  const sent = el("div", {});
  const sending = sendingCard(diagnoses);
  const begin = el("button", { type: "submit", class: "button primary" }, "Diagnose");
  const zone = dropZone(add);
  const server = serverNames(renew);
  const options = diagnosisOptions(app);
  const form = el(
    "form",
    { class: "card stack", "aria-label": "New diagnosis", on: { submit } },
    el("h2", {}, "What does your car take, and why?"),
    el("p", { class: "dim" }, "Drop in recorded drives. They are replayed through the vehicle's model, and what is left over is traced to its cause."),
    zone.field, chosen, app.settings.recordings_on_server && server.field, options.field, sent, begin,
  );
  for (const type of ["dragenter", "dragover"]) pane.addEventListener(type, (event) => carriesFiles(event) && zone.over(event));
  pane.addEventListener("dragleave", (event) => !pane.contains(event.relatedTarget) && zone.away());
  pane.addEventListener("drop", async (event) => {
    if (!carriesFiles(event)) return;
    event.preventDefault();
    zone.away();
    if (app.journey.get().diagnosis) app.journey.set({ diagnosis: null });
    add(await droppedFiles(event.dataTransfer));
  });
  diagnoses.on(["sending"], showSending);
  renew();
  return form;

  function add(some) {
    const good = some.filter(readable);
    const others = some.length - good.length;
    for (const file of good) files.set(file.name, file);
    if (others) app.toast(`${counted(others, "file")} left aside: ${ACCEPTED.join(", ")} are read, also with .gz.`);
    diagnoses.forgetError();
    renew();
    if (good.length) app.say(`${counted(files.size, "recording")} chosen.`);
  }

  function renew() {
    const named = server.names().length;
    fill(chosen, files.size > 0 && fileList(files, renew));
    begin.disabled = !(files.size || named) || diagnoses.get().sending?.error === null;
    begin.textContent = files.size ? `Diagnose ${counted(files.size, "recording")}` : "Diagnose";
  }

  function submit(event) {
    event.preventDefault();
    diagnoses.send({ files: [...files.values()], recordings: server.names(), options: options.value() });
  }

  function showSending() {
    const { sending: state } = diagnoses.get();
    if (state && !state.error) {
      const first = !sent.contains(sending.field);
      if (first) fill(sent, sending.field);
      sending.show(state.share, first);
    } else fill(sent, state?.error && failure(state.error, () => form.requestSubmit()));
    renew();
  }
}

const carriesFiles = (event) => event.dataTransfer?.types.includes("Files");

/** How much of the recordings has gone, with a button that stops it. */
function sendingCard(diagnoses) {
  const text = el("span", {});
  const percent = el("span", { class: "num" });
  const bar = el("progress", { max: 1, "aria-label": "Share of the recordings that is sent" });
  const stop = el("button", { type: "button", class: "button", on: { click: () => diagnoses.stopSending() } }, "Stop");
  return {
    field: el("div", { class: "stack" }, el("div", { class: "spread" }, text, percent), bar, stop),
    show(share, first) {
      const gone = share >= 1;
      text.textContent = gone ? "The service reads the recordings …" : "Sending recordings …";
      percent.textContent = gone ? "" : percentText(share);
      if (gone) bar.removeAttribute("value");
      else bar.value = share;
      if (first) stop.focus(); // the button that began it is off meanwhile
    },
  };
}

function dropZone(add) {
  const input = el("input", { type: "file", multiple: true, hidden: true, accept: [...ACCEPTED, ".gz"].join(","), on: { change: take } });
  function take() {
    const files = [...input.files];
    input.value = ""; // so that the same files can be chosen again
    add(files);
  }
  const field = el(
    "div", { class: "drop-zone" },
    el("p", { class: "drop-title" }, "Drop recordings or a folder here"),
    el("button", { type: "button", class: "button", on: { click: () => input.click() } }, "Choose files"),
    el("p", { class: "small dim" }, "CSV, JSON lines or Parquet, also with .gz. One file a drive, of one vehicle."),
    input,
  );
  return {
    field,
    over(event) {
      event.preventDefault();
      event.dataTransfer.dropEffect = "copy";
      field.dataset.over = "";
    },
    away: () => delete field.dataset.over,
  };
}

function fileList(files, renew) {
  const all = [...files.values()];
  const total = all.reduce((sum, { size }) => sum + size, 0);
  const drop = (name) => { files.delete(name); renew(); };
  const items = all.map((file) => el(
    "li", { class: "spread" },
    el("span", { class: "file-name" }, file.name),
    el(
      "span", { class: "row" },
      el("span", { class: "small dim num" }, sizeText(file.size)),
      el("button", { type: "button", class: "quiet small", "aria-label": `Leave out ${file.name}`, on: { click: () => drop(file.name) } }, "×"),
    ),
  ));
  const head = `${counted(all.length, "recording")}, ${sizeText(total)}`;
  return el(
    "div", { class: "files" },
    el("div", { class: "spread" }, el("strong", {}, head), el("button", { type: "button", class: "link-button", on: { click: () => { files.clear(); renew(); } } }, "Clear")),
    all.length > SHOWN_FILES ? el("details", {}, el("summary", { class: "small" }, "Names"), el("ul", { class: "file-list" }, items)) : el("ul", { class: "file-list" }, items),
    all.length < LEAST && el("p", { class: "small dim" }, `A cause can be named from some ${LEAST} drives on; more tell more.`),
  );
}

function serverNames(renew) {
  const id = newId("names");
  const input = el("textarea", { id, rows: 2, class: "names", spellcheck: "false", placeholder: "winter/*.csv", on: { input: renew } });
  return {
    field: el(
      "details", {},
      el("summary", { class: "small" }, "Recordings that lie on the server"),
      el(
        "div", { class: "field" },
        el("label", { for: id }, "Files, folders or patterns, one a line"), input,
        el("p", { class: "small dim" }, "Below the folder that the service's settings name. Dropped files go first."),
      ),
    ),
    names: () => words(input.value, "\n"),
  };
}

function diagnosisOptions({ journey, session }) {
  const ids = { vehicle: newId("driven"), graph: newId("matched"), hide: newId("hide"), share: newId("share") };
  let touched = false;
  const vehicle = el("select", { id: ids.vehicle, on: { change: () => { touched = true; } } });
  const graph = el("select", { id: ids.graph });
  const hide = el("input", { type: "text", id: ids.hide, spellcheck: "false", autocomplete: "off", placeholder: "*Heat*, *AirCon*" });
  const output = el("output", { for: ids.share });
  const share = el("input", { type: "range", id: ids.share, min: 0, max: 100 * MOST_HELD_OUT, step: 5, value: 100 * HELD_OUT, on: { input: showShare } });
  session.on(["vehicles"], showVehicles);
  session.on(["graphs"], showGraphs);
  journey.on(["vehicle"], showVehicles);
  showVehicles();
  showGraphs();
  showShare();

  function showVehicles() {
    const list = session.get().vehicles;
    if (!list) return;
    const physical = list.vehicles.filter(({ kind }) => kind === "physical");
    const wanted = touched ? vehicle.value : (journey.get().vehicle ?? list.default);
    fill(vehicle, physical.map((one) => el("option", { value: one.id }, one.name)));
    vehicle.value = physical.some(({ id }) => id === wanted) ? wanted : (physical[0]?.id ?? "");
  }

  function showGraphs() {
    const list = session.get().graphs;
    if (list) fill(graph, el("option", { value: "" }, "None"), list.graphs.map(({ name }) => el("option", { value: name }, name)));
  }

  function showShare() {
    const told = Number(share.value) ? `${share.value} % of drives` : "none";
    output.textContent = told;
    share.setAttribute("aria-valuetext", told);
  }

  return {
    field: el(
      "div", { class: "stack" },
      el(
        "div", { class: "pair" },
        el("div", { class: "field" }, el("label", { for: ids.vehicle }, "Vehicle driven"), vehicle),
        el("div", { class: "field" }, el("label", { for: ids.graph }, "Match to roads of"), graph),
      ),
      el("div", { class: "slider" }, el("label", { for: ids.share }, "Kept from the fit, to test it"), output, share),
      el(
        "details", {},
        el("summary", { class: "small" }, "Hide columns"),
        el(
          "div", { class: "field" },
          el("label", { for: ids.hide }, "Names or patterns, with commas between"), hide,
          el("p", { class: "small dim" }, "Hidden columns are not read. Hide those of the heater, say, to see whether it is found without them."),
        ),
      ),
    ),
    value() {
      const asked = { holdout_fraction: Number(share.value) / 100 };
      if (vehicle.value) asked.vehicle = vehicle.value;
      if (graph.value) asked.graph = graph.value;
      const hidden = words(hide.value, ",");
      return hidden.length ? { ...asked, hide: hidden } : asked;
    },
  };
}
