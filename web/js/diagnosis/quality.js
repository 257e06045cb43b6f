/** What was noticed in the recordings, and which of them could not be used. */

import { el } from "../dom.js";
import { capital, counted } from "./terms.js";

const KINDS = {
  suspect: "Suspect", stuck: "Stuck channels", gap: "Gaps", repaired: "Repaired", unfit: "Not fitted", checked: "Checked", ignored: "Not used", derived: "Derived",
};
const MOST_NAMED = 3;
/** Kinds that a reader should see before the others. */
const FIRST = ["unfit", "stuck", "suspect"];

const rank = (kind) => (FIRST.includes(kind) ? FIRST.indexOf(kind) : FIRST.length);

const tripsText = (same) => (same.length > MOST_NAMED ? counted(same.length, "drive") : same.map(({ trip }) => trip).join(", "));

/** Files that could not be used, each with the reason. */
export function refusedFiles(refused) {
  if (!refused.length) return null;
  const items = el("ul", { class: "notes" }, refused.map(({ file, error }) => el("li", {}, el("strong", {}, file), " ", error.replace(`${file}, `, ""))));
  const head = `${counted(refused.length, "file")} could not be used`;
  return el("details", { class: "notice warn small", open: refused.length < 4 }, el("summary", {}, head), items);
}

/** Notes grouped by their kind and text, folded. */
export function qualityNotes(notes) {
  if (!notes.length) return el("p", { class: "dim" }, "Nothing was noticed.");
  const kinds = Object.groupBy(notes, ({ kind }) => kind);
  return Object.keys(kinds).toSorted((a, b) => rank(a) - rank(b)).map((kind) => {
    const texts = Map.groupBy(kinds[kind], ({ channel, text }) => (channel ? `${channel}: ${text}` : text));
    const items = [...texts].map(([text, same]) => el("li", {}, el("span", { class: "note-trips" }, tripsText(same)), " ", text));
    const summary = el("summary", { class: "small" }, KINDS[kind] ?? capital(kind), " ", el("span", { class: "dim" }, counted(kinds[kind].length, "note")));
    return el("details", {}, summary, el("ul", { class: "notes small" }, items));
  });
}
