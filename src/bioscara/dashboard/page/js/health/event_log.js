// Events, newest first, with a filter of kinds and a search.

/** @import { App } from "../app.js" */
/** @import { Event } from "../../messages.d.ts" */

import { button, h, setText } from "../dom.js";
import { readable } from "../format.js";
import { clockTime } from "./clock.js";
import { text } from "../texts.js";

/** Kinds of events by the groups of the filter. @type {Record<string, string[]>} */
const GROUPS = {
  trouble: ["fault", "acknowledged", "faults_cleared", "warning", "stop", "gap"],
  goals: ["goal_accepted", "goal_ended", "pause", "resume", "speed_override"],
  people: ["lease", "client", "report", "gateway"],
  settings: ["workspace", "parameters", "controllers", "owner", "simulation"],
};
/** Colours of kinds. @type {Record<string, string>} */
const COLOURS = { fault: "danger", warning: "warn", stop: "warn", gap: "warn", faults_cleared: "good" };
/** Events that are shown at first, and more at each press. */
const SHOWN = 50;
/** Least time between two drawings [ms]. */
const PERIOD = 250;

/**
 * Build the list of events.
 *
 * @param {App} app The page.
 * @returns {{element: HTMLElement, show: () => void, hide: () => void}} The list; it works only while it is shown.
 */
export function eventLog(app) {
  const group = h("select", { "aria-label": text("health.filter"), on: { change: () => draw() } },
    ...["all", ...Object.keys(GROUPS)].map((name) => h("option", { value: name, text: text(`health.group_${name}`) })));
  const search = h("input", { type: "search", "aria-label": text("health.search"), placeholder: text("health.search"),
    on: { input: () => draw() } });
  const count = h("span", { class: "dim", role: "status" });
  const list = h("ol", { class: "events", tabindex: "0", "aria-label": text("health.events") });
  const more = button(text("health.show_more"), () => {
    limit += SHOWN;
    draw();
  });
  let limit = SHOWN;
  let visible = false;
  let due = 0;

  function draw() {
    due = 0;
    if (!visible) return;
    const found = matching(app.arm.events, group.value, search.value);
    list.replaceChildren(...found.slice(0, limit).map(row));
    more.hidden = found.length <= limit;
    setText(count, text("health.events_count", { count: found.length, all: app.arm.events.length }));
  }

  app.arm.on("event", () => {
    // A burst of events is drawn once.
    if (visible && due === 0) due = window.setTimeout(draw, PERIOD);
  });
  app.arm.on("reset", draw);
  const element = h("div", { class: "column" }, h("div", { class: "row" }, group, search, count), list, more);
  return {
    element,
    show() {
      visible = true;
      draw();
    },
    hide() {
      visible = false;
      clearTimeout(due);
      due = 0;
    },
  };
}

/**
 * Return the events of a group that contain a text, newest first.
 *
 * @param {Event[]} events Newest last.
 * @param {string} group Name of the group; `all` for every event.
 * @param {string} wanted The text, in any case; several words must all be in it.
 * @returns {Event[]} The events.
 */
function matching(events, group, wanted) {
  const words = wanted.toLowerCase().split(/\s+/).filter(Boolean);
  const kinds = GROUPS[group];
  return events.filter(({ what, text: sentence, client }) => {
    // A gap is never hidden: missing events may have been of this kind.
    if (kinds && what !== "gap" && !kinds.includes(what)) return false;
    const all = `${what} ${sentence} ${client}`.toLowerCase();
    return what === "gap" || words.every((word) => all.includes(word));
  }).reverse();
}

/** @param {Event} event */
function row(event) {
  return h("li", { class: event.what === "gap" ? "gap" : null },
    h("time", { class: "dim", text: clockTime(event.wall), datetime: new Date(1000 * event.wall).toISOString() }),
    h("span", { class: `badge ${COLOURS[event.what] ?? ""}`, text: event.what.replaceAll("_", " ") }),
    h("span", { text: readable(event.text) }));
}
