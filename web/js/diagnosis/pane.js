/** Diagnoses of recorded drives: a new one and the earlier ones, or the one that is looked at. */

import { el, fill } from "../dom.js";
import { bringGround, losesPlaces, missingGround } from "../journey/ground.js";
import { failure, working } from "../notices.js";
import { createDiagnoses, unfinished } from "./diagnoses.js";
import { tripDrawer } from "./drawer.js";
import { diagnosisForm } from "./form.js";
import { diagnosisList } from "./list.js";
import { progressCard } from "./progress.js";
import { removal } from "./removal.js";
import { residualMap } from "./residuals.js";
import { endedCard, resultCards } from "./result.js";
import { VERDICTS, verdictSentence } from "./terms.js";

export function diagnosisPane(app, element) {
  const { journey, session } = app;
  const diagnoses = createDiagnoses(app);
  const drawer = tripDrawer(app, diagnoses);
  const residuals = residualMap(app, diagnoses, pick);
  const begin = el("div", { class: "stack" }, diagnosisForm(app, diagnoses, element), diagnosisList(app, diagnoses));
  const back = el("button", { type: "button", class: "link-button", on: { click: leave } }, "← All diagnoses");
  const removing = el("div", {});
  const body = el("div", {});
  const one = el("div", { class: "stack" }, el("div", { class: "spread diagnosis-bar" }, back, removing), body);
  const progress = progressCard(app, diagnoses);
  let shownAs = ""; // what `body` holds, so that progress does not rebuild it
  let cards = null; // of a result
  let seek = null; // {trip, seconds} that was picked on the map
  let opened = false;
  let placed = null; // id of the diagnosis whose drives the map was brought to

  fill(element, begin, one);
  diagnoses.on(["shown"], show);
  diagnoses.on(["residuals"], toDrives);
  journey.on(["tab"], toDrives);
  session.on(["graphs"], toDrives);
  session.on(["tiles"], () => placed && placed === journey.get().diagnosis && journey.get().tab === "diagnosis" && residuals.fit());
  diagnoses.on(["trip"], showTrip);
  journey.on(["tab"], openOnce);
  openOnce();
  show();

  /** Nothing is asked for before the tab is looked at. */
  function openOnce() {
    if (opened || journey.get().tab !== "diagnosis") return;
    opened = true;
    diagnoses.open();
  }

  function show() {
    const { shown } = diagnoses.get();
    const id = journey.get().diagnosis;
    const moved = begin.contains(document.activeElement);
    begin.hidden = id !== null;
    one.hidden = id === null;
    if (moved && id !== null) back.focus();
    const as = id === null ? "" : [id, shown.status, shown.answer && (unfinished(shown.answer) ? "progress" : shown.answer.state)].join(":");
    if (as !== shownAs) {
      shownAs = as;
      cards?.end();
      cards = null;
      fill(removing, shown.answer && !unfinished(shown.answer) && removal(() => diagnoses.remove(id), "this diagnosis"));
      fill(body, id !== null && content(shown));
      element.closest("main").scrollTop = 0;
    }
    if (shown.answer && unfinished(shown.answer)) progress.show(shown.answer);
  }

  function content({ status, answer, error }) {
    if (status === "failed") return failure(error, diagnoses.open);
    if (!answer) return working("Looking it up …");
    if (unfinished(answer)) return progress.field;
    if (answer.state !== "done") {
      app.say(answer.state === "failed" ? "The diagnosis could not be carried out." : "The diagnosis is cancelled.");
      return endedCard(answer, leave);
    }
    cards = resultCards(app, diagnoses, residuals, answer);
    if (journey.get().tab === "diagnosis") app.say(`${VERDICTS[answer.result.verdict].title}. ${verdictSentence(answer.result)}`);
    return cards.element;
  }

  function leave() {
    journey.set({ diagnosis: null });
    begin.querySelector("button")?.focus();
  }

  function pick(trip, seconds) {
    if (diagnoses.get().chosen === trip) {
      drawer.seek(seconds);
      return;
    }
    seek = { trip, seconds };
    diagnoses.choose(trip);
  }

  /** Bring the map to the drives, with the roads that they are on below them; once, and not where places would go. */
  function toDrives() {
    const { status, answer } = diagnoses.get().residuals;
    const { diagnosis, tab } = journey.get();
    if (diagnosis === null || status === "loading") placed = null;
    if (status !== "done" || tab !== "diagnosis" || !session.get().graphs || placed === diagnosis) return;
    placed = diagnosis;
    residuals.fit();
    const missing = missingGround(app, answer.graph, residuals.extent());
    if (!missing || losesPlaces(app, missing)) return;
    bringGround(app, missing);
    app.toast(`The map shows the roads of ${missing.name}, which these drives are on.`);
  }

  function showTrip({ trip, chosen }) {
    if (trip.status !== "done") return;
    residuals.fit();
    if (seek?.trip === chosen) drawer.seek(seek.seconds);
    seek = null;
  }
}
