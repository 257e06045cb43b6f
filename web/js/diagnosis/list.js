/** Earlier diagnoses: open one, or remove it. */

import { el, fill } from "../dom.js";
import { failure, working } from "../notices.js";
import { percentText } from "../units.js";
import { unfinished } from "./diagnoses.js";
import { removal } from "./removal.js";
import { capital, counted, VERDICTS } from "./terms.js";

const RENEW_MS = 3000;
const STATES = { queued: "Waiting", running: "Under way", failed: "Failed", cancelled: "Cancelled" };
const DATES = new Intl.DateTimeFormat("en-GB", { day: "numeric", month: "short", year: "numeric", hour: "2-digit", minute: "2-digit" });

export const dateText = (iso) => DATES.format(new Date(iso));

export function diagnosisList(app, diagnoses) {
  const body = el("div", {});
  let timer = 0;
  diagnoses.on(["list"], show);
  app.session.on(["vehicles"], show);
  show();
  return el("section", { class: "card", "aria-label": "Earlier diagnoses" }, el("h2", {}, "Earlier diagnoses"), body);

  /** While one is under way, look again now and then, but not while the list is out of sight or a removal is asked about. */
  async function renew() {
    if (body.offsetParent !== null && !body.querySelector(".danger")) await diagnoses.renewList();
    lookAgain();
  }

  function lookAgain() {
    const { status, answer } = diagnoses.get().list;
    clearTimeout(timer);
    if (status === "done" && answer.diagnoses.some(unfinished)) timer = setTimeout(renew, RENEW_MS);
  }

  function show() {
    const { status, answer, error } = diagnoses.get().list;
    lookAgain();
    const focused = document.activeElement?.dataset.entry;
    fill(
      body,
      status === "loading" && !answer && working("Looking them up …"),
      status === "failed" && failure(error, diagnoses.reloadList),
      answer?.diagnoses.length === 0 && el("p", { class: "dim" }, "None yet. What you diagnose is kept here until you remove it."),
      answer && el("ul", { class: "diagnoses" }, answer.diagnoses.map((one) => entry(app, diagnoses, one))),
    );
    if (focused) body.querySelector(`[data-entry="${CSS.escape(focused)}"]`)?.focus();
  }
}

function entry({ journey, session }, diagnoses, one) {
  const vehicle = vehicleName(session, one.vehicle);
  const title = one.state === "done" ? (VERDICTS[one.verdict]?.title ?? "Done") : STATES[one.state];
  const open = () => journey.set({ diagnosis: one.id });
  return el(
    "li", { class: "diagnosis-entry", dataset: { tone: one.state === "failed" ? "bad" : (VERDICTS[one.verdict]?.tone ?? "plain") } },
    el(
      "div", { class: "grow" },
      el("button", { type: "button", class: "entry-open", dataset: { entry: one.id }, on: { click: open } }, title),
      one.text && el("p", { class: "small entry-text" }, one.text),
      el("p", { class: "small dim" }, [vehicle, Number.isInteger(one.recordings) && counted(one.recordings, "recording"), dateText(one.created)].filter(Boolean).join(" · ")),
      unfinished(one) && el("p", { class: "small" }, one.stage ? `${capital(one.stage)}, ${percentText(one.progress)}` : percentText(one.progress)),
      journey.get().effects === one.id && el("p", { class: "small applied" }, "Applied to routes"),
    ),
    unfinished(one) ? null : removal(() => diagnoses.remove(one.id), `${title}, ${vehicle}, ${dateText(one.created)}`),
  );
}

/** What a vehicle is called, or its id. */
export function vehicleName(session, id) {
  if (id === "inline") return "a vehicle that was sent along";
  return session.get().vehicles?.vehicles.find((one) => one.id === id)?.name ?? id;
}
