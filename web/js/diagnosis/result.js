/** What a diagnosis found, as the pane shows it. */

import { pageText } from "../api.js";
import { el, fill, newId } from "../dom.js";
import { saveFile } from "../download.js";
import { bringGround, losesPlaces, missingGround, shownGround } from "../journey/ground.js";
import { typedKey } from "../key.js";
import { failure, warningsOf, working } from "../notices.js";
import { energyText, number } from "../units.js";
import { applying } from "./apply.js";
import { attributionPart } from "./attribution.js";
import { pathOf } from "./diagnoses.js";
import { findingCards, parameterCards, unexplainedCards } from "./findings.js";
import { fitPart } from "./fit.js";
import { dateText, vehicleName } from "./list.js";
import { qualityNotes, refusedFiles } from "./quality.js";
import { counted, VERDICTS, verdictSentence } from "./terms.js";

const WHAT_COLOURS_SAY = " by what drives took more (red) or less (blue) there than the model with all findings says.";

/** The cards of a diagnosis that is done. residuals: what residualMap gives. */
export function resultCards(app, diagnoses, residuals, answer) {
  const { result } = answer;
  const apply = applying(app, answer);
  const energy = attributionPart(app, diagnoses, result);
  const place = el("div", { class: "stack" });
  const ground = el("div", { class: "notice warn", hidden: true });
  const extentLine = el("p", { class: "small dim" });
  const ends = [
    app.journey.on(["effects"], apply.show),
    app.journey.on(["units"], () => { energy.show(); showExtent(); }),
    app.journey.on(["graph", "start", "goal", "via"], showPlace),
    app.session.on(["graphs"], showPlace),
    app.session.on(["vehicles"], () => { apply.show(); showExtent(); }),
    diagnoses.on(["chosen"], energy.mark),
    diagnoses.on(["residuals"], showPlace),
    apply.end,
  ];
  showExtent();
  showPlace();
  const findings = [...findingCards(result)];
  const element = el(
    "div", { class: "stack result" },
    ground,
    verdictCard(answer, extentLine, apply.field),
    part("How well drives are met", fitPart(result, diagnoses.choose)),
    findings.length > 0 && part("What the model leaves out", findings),
    result.parameter_errors.length > 0 && part("Numbers of the vehicle that are off", parameterCards(result)),
    result.unexplained.length > 0 && part("What no effect explains", unexplainedCards(result)),
    part("Where the energy went", energy.field),
    part("On the map", place),
    result.profile.length > 0 && part("Planning and driving", profileTable(result.profile)),
    part("Recordings", refusedFiles(answer.refused), answer.warnings && warningsOf(answer.warnings), qualityNotes(result.data_quality)),
    part("Files", downloads(answer)),
  );
  return { element, end: () => ends.forEach((end) => end()) };

  function showExtent() {
    const kilometres = result.trips.reduce((sum, { distance_km: km }) => sum + km, 0);
    const energyAll = result.trips.reduce((sum, { measured_kwh: kwh }) => sum + kwh, 0);
    const held = result.fit.held_out_trips.length;
    const told = [
      vehicleName(app.session, answer.vehicle),
      counted(result.trips.length, "drive"),
      app.units().lengthText(1000 * kilometres),
      energyText(energyAll),
      held ? `${held} kept from the fit` : "none kept from the fit",
      dateText(answer.created),
    ];
    fill(extentLine, told.join(" · "));
  }

  function showPlace() {
    const { status, error, answer: shown } = diagnoses.get().residuals;
    const extent = residuals.extent();
    fill(
      place,
      status === "loading" && working("Fetching where it differs …"),
      status === "failed" && failure(error, diagnoses.reloadResiduals),
      status === "none" && el("p", { class: "dim" }, "This diagnosis keeps no places. Run it again to have them."),
      shown && !extent && el("p", { class: "dim" }, "These recordings have no positions, so there is nothing to draw on the map."),
      extent && el("p", {}, shown.kind === "links" ? `Roads of ${shown.graph} are coloured` : "The tracks are coloured", WHAT_COLOURS_SAY),
      extent && el("button", { type: "button", class: "button", on: { click: residuals.fit } }, "Show it on the map"),
    );
    showGround(missingGround(app, shown?.graph, extent));
  }

  /** Say above all where the map shows other roads than those that the drives are on. */
  function showGround(missing) {
    ground.hidden = !missing;
    if (!missing) return;
    const shown = shownGround(app)?.name ?? "other roads";
    fill(
      ground,
      el("p", {}, `These drives are on the roads of ${missing.name}, the map shows ${shown}.`, losesPlaces(app, missing) && ` Places on ${shown} are removed where it changes.`),
      el("button", { type: "button", class: "button", on: { click: () => bringGround(app, missing) } }, `Show ${missing.name}`),
    );
  }
}

/** A diagnosis that came to no result. */
export function endedCard(answer, again) {
  const failed = answer.state === "failed";
  return el(
    "div", { class: "card stack" },
    el("h2", {}, failed ? "It could not be carried out" : "It was cancelled"),
    failed && answer.problem && el("div", { class: "notice bad" }, el("p", {}, answer.refused.length ? answer.problem.title : answer.problem.detail)),
    refusedFiles(answer.refused),
    el("div", {}, el("button", { type: "button", class: "button primary", on: { click: again } }, "Start another")),
  );
}

function verdictCard(answer, extentLine, apply) {
  const { title, meaning, tone } = VERDICTS[answer.result.verdict];
  return el(
    "section", { class: `card verdict tone-${tone}`, "aria-label": "Verdict" },
    el("h2", { tabindex: "-1", class: "verdict-title" }, title),
    el("p", { class: "verdict-sentence" }, verdictSentence(answer.result)),
    el("p", { class: "dim" }, meaning),
    extentLine,
    apply,
  );
}

function part(title, ...children) {
  const id = newId("part");
  return el("section", { class: "card stack", "aria-labelledby": id }, el("h2", { id }, title), children);
}

function profileTable(profile) {
  const rows = profile.map((one) => el(
    "tr", {},
    el("th", { scope: "row" }, one.trip),
    [one.planned_kwh, one.forecast_kwh, one.driven_kwh, one.measured_kwh].map((kwh) => el("td", { class: "num" }, kwh === null ? "–" : number(kwh, 2))),
    el("td", { class: "num" }, `${number(one.planned_s / 60)} / ${number(one.driven_s / 60)}`),
  ));
  const heads = ["Drive", "Planned", "Forecast", "Driven", "Measured", "min"];
  return [
    el(
      "p", { class: "small dim" },
      "kWh of drives that were matched to roads. Planned: by the map's speeds and stops. Forecast: the same with what was learned. ",
      "Driven: the vehicle's own numbers at the driven speed. Minutes: planned / driven.",
    ),
    el(
      "div", { class: "wide", role: "region", tabindex: "0", "aria-label": "Planned and driven energy" },
      el("table", { class: "dense" }, el("thead", {}, el("tr", {}, heads.map((text, i) => el("th", { scope: "col", class: i ? "num" : null }, text)))), el("tbody", {}, rows)),
    ),
  ];
}

function downloads({ id, result }) {
  const save = () => saveFile("diagnosis.json", JSON.stringify(result, null, 1), "application/json");
  const file = (name, type, below, text) =>
    el("button", { type: "button", class: "button", on: { click: async () => saveFile(name, await pageText(pathOf(id, below)), type) } }, text);
  // a link can send no key: with one, both are fetched and saved
  const [report, effects] = typedKey()
    ? [file("report.html", "text/html", "report", "Report"), file("effects.json", "application/json", "effects", "effects.json")]
    : [
        el("a", { class: "button", href: pathOf(id, "report"), target: "_blank", rel: "noopener" }, "Report"),
        el("a", { class: "button", href: pathOf(id, "effects"), download: "effects.json" }, "effects.json"),
      ];
  return el("div", { class: "row wrap" }, report, el("button", { type: "button", class: "button", on: { click: save } }, "diagnosis.json"), effects);
}
