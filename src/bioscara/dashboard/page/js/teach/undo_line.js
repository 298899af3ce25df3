// A line that reports a change, with a button that undoes it.

/** @import { App } from "../app.js" */

import { button, h, setText } from "../dom.js";
import { text } from "../texts.js";

/**
 * Return the line.
 *
 * @param {App} app The page.
 */
export function undoLine(app) {
  const words = h("span");
  /** @type {(() => Promise<unknown>) | null} */
  let back = null;
  const undo = button(text("teach.undo"), () => {
    const work = back;
    if (!work) return;
    app.attempt(async () => {
      await work();
      say(text("teach.undone"));
    });
  }, { class: "undo" });
  const element = h("p", { class: "row undo-line", role: "status" }, words, undo);
  undo.hidden = true;

  /**
   * Report a change.
   *
   * @param {string} message The report.
   * @param {(() => Promise<unknown>) | null} [work] Undoes it; null if it cannot be undone.
   */
  function say(message, work = null) {
    back = work;
    setText(words, message);
    undo.hidden = work === null;
  }
  return { element, say };
}
