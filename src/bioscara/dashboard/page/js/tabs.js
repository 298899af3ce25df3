// The tabs, and which part of the page is visible.

/** @import { App, Panel } from "./app.js" */

import { at, h, PHONE } from "./dom.js";
import { text } from "./texts.js";

/** Parts that a wide page shows next to the panels, and a phone as a tab. */
const NARROW = [{ id: "watch", section: "view" }, { id: "jog", section: "jog" }];
/** The tabs that are first on a phone, in a row of their own, as they are needed in front of the arm. */
const FIRST = ["watch", "jog", "run", "health"];

/**
 * Build the tabs with their panels.
 *
 * @param {App} app The page.
 * @param {Panel[]} panels The panels.
 */
export function buildTabs(app, panels) {
  const list = at("tabs");
  const host = at("panels");
  list.setAttribute("role", "tablist");
  /** @type {{id: string, place: number, tab: HTMLElement, section: HTMLElement, element: HTMLElement | null, view: import("./app.js").PanelView, panel: Panel | null}[]} */
  const entries = [];
  for (const { id, section } of NARROW) {
    entries.push({ id, place: entries.length, tab: makeTab(id, "narrow"), section: at(section), element: null, view: {}, panel: null });
  }
  for (const panel of panels) {
    const element = h("div", { id: `panel-${panel.id}`, role: "tabpanel", "aria-labelledby": `tab-${panel.id}`, hidden: true });
    host.append(element);
    entries.push({ id: panel.id, place: entries.length, tab: makeTab(panel.id, ""), section: host, element, view: panel.mount(element, app),
      panel });
  }
  /** @type {typeof entries[number] | null} */
  let current = null;

  /**
   * @param {string} id
   * @param {string} kind
   */
  function makeTab(id, kind) {
    return h("button", {
      type: "button",
      id: `tab-${id}`,
      role: "tab",
      class: kind,
      text: text(`tab.${id}`),
      "aria-selected": "false",
      tabindex: "-1",
      on: { click: () => select(id) },
    });
  }

  /** @param {string} id */
  function select(id) {
    const chosen = entries.find((entry) => entry.id === id);
    if (!chosen || chosen === current) return;
    app.interrupt("another part of the page was opened");
    current?.view.hide?.();
    current = chosen;
    for (const entry of entries) {
      const is = entry === chosen;
      entry.tab.setAttribute("aria-selected", String(is));
      entry.tab.setAttribute("tabindex", is ? "0" : "-1");
      if (entry.element) entry.element.hidden = !is;
      if (is && entry.element) entry.tab.setAttribute("aria-controls", entry.element.id);
    }
    for (const section of ["view", "jog", "panels"]) at(section).classList.toggle("current", at(section) === chosen.section);
    chosen.view.show?.();
    chosen.tab.scrollIntoView({ block: "nearest", inline: "nearest" });
    history.replaceState(null, "", `#${id}`);
  }

  // In the document, and not by style alone: the order of the focus is that of the eye.
  const arrange = () => {
    const rank = (/** @type {string} */ id) => (PHONE.matches && FIRST.includes(id) ? FIRST.indexOf(id) : FIRST.length);
    entries.sort((one, other) => rank(one.id) - rank(other.id) || one.place - other.place);
    const focused = document.activeElement;
    list.append(...entries.map((entry) => entry.tab));
    if (focused instanceof HTMLElement && list.contains(focused)) focused.focus();
  };
  PHONE.addEventListener("change", arrange);
  arrange();
  list.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const seen = entries.filter((entry) => entry.tab.offsetParent !== null);
    const index = current ? seen.indexOf(current) : -1;
    const next = seen[(index + step + seen.length) % seen.length];
    select(next.id);
    next.tab.focus();
    event.preventDefault();
  });
  const offer = () => {
    for (const { panel, tab } of entries) tab.hidden = panel?.available ? !panel.available(app) : false;
  };
  app.arm.follow(["description"], offer);
  let seen = app.preview;
  app.previewListeners.push(() => {
    // Where the view is a tab, a preview is not visible from other tabs in another one.
    if (app.preview && app.preview !== seen && PHONE.matches) select("watch");
    seen = app.preview;
  });
  select(location.hash.slice(1) || "run");
  if (!current) select("run");
}
