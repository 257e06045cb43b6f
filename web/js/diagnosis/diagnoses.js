/** The service's diagnoses as the pane knows them: the list, the one that is looked at, and what belongs to it. */

import { ApiError, call } from "../api.js";
import { createStore } from "../store.js";
import { sendForm } from "./upload.js";

const FIRST_POLL_MS = 1000;
const LAST_POLL_MS = 5000;
const MOST_FAILURES = 5;
const UNFINISHED = new Set(["queued", "running"]);
const NONE = { status: "none", answer: null, error: null };

export const unfinished = ({ state }) => UNFINISHED.has(state);
export const pathOf = (id, ...parts) => ["diagnoses", id, ...parts].map(encodeURIComponent).join("/");

/**
 * A store of: `list`, `shown` (GET /diagnoses/{id}), `residuals`, `trip` (timeline of the chosen trip), each as {status:
 * "none"|"loading"|"done"|"failed", answer, error}; `chosen`: id of the chosen trip; `sending`: null or {share, error}.
 */
export function createDiagnoses({ journey, say, toast }) {
  const store = createStore({ list: NONE, shown: NONE, residuals: NONE, trip: NONE, chosen: null, sending: null });
  let watching = new AbortController();
  let sending = new AbortController();
  let looking = new AbortController();
  journey.on(["diagnosis"], open);

  /** Fill one field with what a call answers; quietly: without saying that it is under way. */
  async function load(field, path, signal, quietly = false) {
    if (!quietly) store.set({ [field]: { status: "loading", answer: store.get()[field].answer, error: null } });
    try {
      store.set({ [field]: { status: "done", answer: await call(path, { signal }), error: null } });
    } catch (error) {
      if (error.name === "AbortError") return;
      if (!(error instanceof ApiError)) throw error;
      store.set({ [field]: { status: "failed", answer: null, error } });
    }
  }

  function open() {
    const { diagnosis } = journey.get();
    watching.abort();
    watching = new AbortController();
    store.set({ shown: diagnosis ? { ...NONE, status: "loading" } : NONE, residuals: NONE });
    choose(null);
    if (diagnosis) watch(diagnosis, watching.signal);
    else load("list", "diagnoses");
  }

  async function watch(id, signal) {
    let [wait, stage, failures, waited] = [FIRST_POLL_MS, null, 0, false];
    for (;;) {
      try {
        const answer = await call(pathOf(id), { signal });
        failures = 0;
        store.set({ shown: { status: "done", answer, error: null } });
        if (!unfinished(answer)) {
          finished(answer, waited);
          return;
        }
        wait = answer.stage === stage ? Math.min(1.2 * wait, LAST_POLL_MS) : FIRST_POLL_MS;
        stage = answer.stage;
        waited = true;
      } catch (error) {
        if (error.name === "AbortError") return;
        if (!(error instanceof ApiError)) throw error;
        failures += 1;
        const lasting = error.status >= 400 && error.status < 500;
        if (lasting || failures >= MOST_FAILURES || !waited) {
          store.set({ shown: { status: "failed", answer: null, error } });
          return;
        }
      }
      await new Promise((resolve) => { setTimeout(resolve, wait); });
      if (signal.aborted) return;
    }
  }

  function finished(answer, waited) {
    const text = { done: "The diagnosis is done.", failed: "The diagnosis failed.", cancelled: "The diagnosis is cancelled." }[answer.state];
    if (waited && journey.get().tab !== "diagnosis") toast(text); // else the pane tells of it
    if (answer.state === "done" && answer.links.residuals) load("residuals", pathOf(answer.id, "residuals"), watching.signal);
  }

  /** Look at one trip along time, null for none. */
  function choose(trip) {
    looking.abort();
    looking = new AbortController();
    store.set({ chosen: trip, trip: NONE });
    const { answer } = store.get().shown;
    if (trip && answer?.links.trips) load("trip", pathOf(answer.id, "trips", trip), looking.signal);
  }

  /** Send recordings: files as a form, or names of files on the server. */
  async function send({ files, recordings, options }) {
    sending = new AbortController();
    store.set({ sending: { share: 0, error: null } });
    try {
      const queued = files.length
        ? await sendForm("diagnoses", formOf(files, options), { told: (share) => store.set({ sending: { share, error: null } }), signal: sending.signal })
        : await call("diagnoses", { body: { recordings, ...options }, signal: sending.signal });
      journey.set({ diagnosis: queued.id });
      store.set({ sending: null });
    } catch (error) {
      if (error.name === "AbortError") store.set({ sending: null });
      else if (error instanceof ApiError) store.set({ sending: { share: 0, error } });
      else throw error;
    }
  }

  /** Cancel a diagnosis that runs, or remove one that is finished. */
  async function remove(id) {
    try {
      const cancelled = await call(pathOf(id), { method: "DELETE" });
      if (cancelled) {
        if (journey.get().diagnosis === id) open();
        else load("list", "diagnoses");
        return;
      }
      if (journey.get().effects === id) journey.set({ effects: null });
      say("The diagnosis is removed.");
    } catch (error) {
      if (!(error instanceof ApiError)) throw error;
      toast(error.message);
      if (error.status !== 404) return;
    }
    if (journey.get().diagnosis === id) journey.set({ diagnosis: null });
    else load("list", "diagnoses");
  }

  return {
    ...store,
    open,
    choose,
    send,
    remove,
    stopSending: () => sending.abort(),
    forgetError: () => store.get().sending?.error && store.set({ sending: null }),
    reloadList: () => load("list", "diagnoses"),
    renewList: () => load("list", "diagnoses", null, true),
    reloadResiduals: () => load("residuals", pathOf(journey.get().diagnosis, "residuals"), watching.signal),
  };
}

function formOf(files, options) {
  const form = new FormData();
  for (const file of files) form.append("recordings", file, file.name);
  for (const [name, value] of Object.entries(options)) for (const one of [value].flat()) form.append(name, String(one));
  return form;
}
