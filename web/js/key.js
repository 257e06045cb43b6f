/** The key that the service may demand: typed once, kept by this tab until it is closed, sent to this service only. */

import { byId, el, newId } from "./dom.js";

const NAME = "joulepath.key";

/** The key that was typed, empty for none. */
export function typedKey() {
  try {
    return sessionStorage.getItem(NAME) ?? "";
  } catch {
    return "";
  }
}

/** Headers that send the key, if there is one. */
export function keyHeaders() {
  const key = typedKey();
  return key ? { Authorization: `Bearer ${key}` } : {};
}

/** The same for an address: none for that of another host. */
export const keyHeadersFor = (url) => (new URL(url, document.baseURI).origin === location.origin ? keyHeaders() : {});

/** Start again without the key that was typed, so that another can be. */
export function forgetKey() {
  sessionStorage.removeItem(NAME);
  location.reload();
}

/** Ask for a key in place of the panels; the page starts again with it. */
export function askForKey(message) {
  const id = newId("key");
  const input = el("input", { id, type: "password", autocomplete: "off", spellcheck: "false", required: true });
  const submit = (event) => {
    event.preventDefault();
    try {
      sessionStorage.setItem(NAME, input.value.trim());
    } catch {
      said.textContent = "This browser keeps nothing for this page, so that no key can be used.";
      return;
    }
    location.reload();
  };
  const said = el("p", { class: "message" }, message);
  const form = el(
    "form", { class: "stack", "aria-label": "Key", on: { submit } },
    el("p", {}, "This service needs a key. It is kept until this tab is closed."),
    el("div", { class: "field" }, el("label", { for: id }, "Key"), input, el("div", { role: "alert" }, typedKey() ? said : null)),
    el("button", { type: "submit", class: "button primary" }, "Use this key"),
  );
  const panel = byId("panel");
  for (const part of panel.children) if (!part.matches(".foot")) part.hidden = true;
  panel.prepend(el("section", { class: "key", "aria-label": "Key" }, form));
  input.focus();
}
