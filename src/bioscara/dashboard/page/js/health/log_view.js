// The latest lines of the owner's log.

/** @import { App } from "../app.js" */

import { h } from "../dom.js";
import { text } from "../texts.js";

/** Lines that are kept. */
const KEPT = 500;

/**
 * Build the view of the log.
 *
 * @param {App} app The page.
 * @returns {{element: HTMLElement, refresh: () => Promise<void>}} The view, and what asks for new lines.
 */
export function logView(app) {
  const element = h("pre", { class: "log", tabindex: "0", role: "log", "aria-live": "off", "aria-label": text("health.log") });
  /** @type {string[]} */
  let lines = [];
  let last = 0;
  app.arm.on("reset", () => {
    lines = [];
    last = 0;
  });
  return {
    element,
    async refresh() {
      const result = await app.ask({ kind: "get_log", after: last });
      if (result.last < last) lines = [];
      last = result.last;
      if (result.lines.length === 0 && element.textContent) return;
      const below = element.scrollHeight - element.scrollTop - element.clientHeight < 20;
      lines = [...lines, ...result.lines].slice(-KEPT);
      element.replaceChildren(h("span", { text: lines.join("\n") || text("health.no_log") }));
      // A position further up, where a person reads, is kept.
      if (below) element.scrollTop = element.scrollHeight;
    },
  };
}
