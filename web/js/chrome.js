/** The frame of the page: tabs, theme, units, sharing, and whose data is shown. */

import { byId, el, fill } from "./dom.js";
import { icon } from "./icons.js";
import { addressOf, TABS } from "./journey/journey.js";
import { remember, remembered } from "./remembered.js";

export function attachChrome(app) {
  attachTabs(app);
  attachTheme(app);
  attachUnits(app);
  attachShare(app);
  app.session.on(["graphs", "tiles"], () => showSource(app));
  app.journey.on(["graph"], () => showSource(app));
}

function attachTabs({ journey }) {
  const tabs = TABS.map((name) => byId(`tab-${name}`));
  const show = () => {
    const { tab } = journey.get();
    for (const [i, name] of TABS.entries()) {
      tabs[i].setAttribute("aria-selected", String(name === tab));
      tabs[i].tabIndex = name === tab ? 0 : -1;
    }
    const plan = byId("pane-plan");
    plan.hidden = tab === "diagnosis";
    plan.setAttribute("aria-labelledby", `tab-${tab === "range" ? "range" : "route"}`);
    byId("pane-diagnosis").hidden = tab !== "diagnosis";
    byId("routes").hidden = tab !== "route";
    byId("charging").hidden = tab !== "route";
    byId("range").hidden = tab !== "range";
  };
  for (const [i, name] of TABS.entries()) {
    tabs[i].addEventListener("click", () => journey.set({ tab: name }));
    tabs[i].addEventListener("keydown", ({ key }) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[key];
      const next = key === "Home" ? 0 : key === "End" ? TABS.length - 1 : step ? (i + step + TABS.length) % TABS.length : i;
      if (next === i) return;
      journey.set({ tab: TABS[next] });
      tabs[next].focus();
    });
  }
  journey.on(["tab"], show);
  show();
}

function attachTheme({ session }) {
  const button = byId("theme");
  const preferred = matchMedia("(prefers-color-scheme: dark)");
  const show = (theme) => {
    document.documentElement.dataset.theme = theme;
    fill(button, icon(theme === "dark" ? "sun" : "moon"));
    button.setAttribute("aria-label", theme === "dark" ? "Use light colours" : "Use dark colours");
    session.set({ theme });
  };
  const stored = remembered("theme");
  show(["light", "dark"].includes(stored) ? stored : preferred.matches ? "dark" : "light");
  preferred.addEventListener("change", ({ matches }) => {
    if (!remembered("theme")) show(matches ? "dark" : "light");
  });
  button.addEventListener("click", () => {
    const theme = session.get().theme === "dark" ? "light" : "dark";
    remember("theme", theme);
    show(theme);
  });
}

function attachUnits({ journey, view }) {
  const button = byId("units");
  const show = () => {
    const { units } = journey.get();
    button.textContent = units;
    button.setAttribute("aria-label", units === "km" ? "Units: kilometres. Use miles" : "Units: miles. Use kilometres");
    view.setUnits(units);
  };
  button.addEventListener("click", () => journey.set({ units: journey.get().units === "km" ? "mi" : "km" }));
  journey.on(["units"], show);
  show();
}

function attachShare({ journey, toast }) {
  byId("share").prepend(icon("link"));
  byId("share").addEventListener("click", async () => {
    const link = new URL(addressOf(journey.get()) || location.pathname, location.href).href;
    try {
      await navigator.clipboard.writeText(link);
      toast("The link is in the clipboard.");
    } catch {
      toast(`Copy the address of this page: ${link}`); // without https, browsers keep the clipboard shut
    }
  });
}

function showSource({ journey, session }) {
  const { graphs } = session.get();
  const graph = graphs?.graphs.find(({ name }) => name === (journey.get().graph ?? graphs.default));
  if (!graph) return;
  const heights = { measured: "Heights are measured.", synthetic: "Heights are made up.", absent: "Without heights: every road counts as level." };
  fill(byId("attribution"), `${graph.attribution} (${graph.licence}). `, el("span", {}, heights[graph.terrain]));
}
