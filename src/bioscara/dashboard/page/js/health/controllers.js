// Controllers and hardware components with their lifecycle states, as ros2_control names them.

/** @import { ControllerList } from "../../messages.d.ts" */

import { h } from "../dom.js";
import { text } from "../texts.js";

/** Colours of lifecycle states. @type {Record<string, string>} */
const COLOURS = { active: "good", inactive: "", unconfigured: "warn", finalized: "danger" };

/**
 * Build the tables.
 *
 * @returns {{element: HTMLElement, report: (list: ControllerList) => void}} The tables, and what brings them up to date.
 */
export function controllerTables() {
  const controllers = h("tbody");
  const components = h("tbody");
  const element = h("div", { class: "column" }, table("health.controllers", ["name", "state", "type", "rate", "claimed"], controllers),
    table("health.components", ["name", "state", "kind", "rate", "interfaces"], components));
  let shown = "";
  return {
    element,
    report(list) {
      const now = JSON.stringify(list);
      // Left alone unless it changed: the screen reader may be in it.
      if (now === shown) return;
      shown = now;
      controllers.replaceChildren(...list.controllers.map((each) =>
        row(each.name, each.state, [
          each.type,
          rate(each.update_rate),
          each.claimed.join(", ") || text("health.nothing"),
        ])
      ));
      components.replaceChildren(...list.components.map((each) =>
        row(each.name, each.state, [
          `${each.type}: ${each.plugin}`,
          rate(each.rate),
          interfaces([...each.states, ...each.commands]),
        ])
      ));
    },
  };
}

/**
 * @param {string} title
 * @param {string[]} columns
 * @param {HTMLElement} body
 */
function table(title, columns, body) {
  return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": text(title) },
    h("table", {}, h("caption", { text: text(title) }),
      h("thead", {}, h("tr", {}, ...columns.map((name) => h("th", { scope: "col", text: text(`health.col_${name}`) })))), body));
}

/**
 * @param {string} name
 * @param {string} state
 * @param {string[]} rest
 */
function row(name, state, rest) {
  return h("tr", {}, h("th", { scope: "row", text: name }), h("td", {}, h("span", { class: `badge ${COLOURS[state] ?? ""}`, text: state })),
    ...rest.map((cell) => h("td", { text: cell })));
}

/** @param {number} hertz */
function rate(hertz) {
  return `${hertz} Hz`;
}

/** @param {import("../../messages.d.ts").InterfaceValue[]} all */
function interfaces(all) {
  const missing = all.filter((each) => !each.available).map((each) => each.name);
  const count = text("health.interfaces_count", { count: all.length - missing.length });
  return missing.length ? text("health.interfaces_missing", { count, names: missing.join(", ") }) : count;
}
