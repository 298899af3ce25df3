// Pause and Resume of all motion, and the authors of the pauses. Another pause may be added to one of another client.

/** @import { App } from "../app.js" */

import { button, h, setText } from "../dom.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";

/**
 * Build the buttons.
 *
 * @param {App} app The page.
 * @param {string} [name] Class of the element.
 * @returns {HTMLElement} The element.
 */
export function pauseButtons(app, name = "") {
  const { arm } = app;
  const pause = button(text("pause.pause"), () => app.attempt(() => app.ask({ kind: "pause" })));
  // Without the lease: whose pause it may lift is decided by the owner, which names the clients that can resume.
  const resume = button(text("pause.resume"), () => {
    if (arm.scope === "view") app.say(`${text("pause.resume")}: ${text("refusal.view")}`, "error");
    else app.attempt(() => app.ask({ kind: "resume" }));
  });
  const authors = h("span", { class: "dim small" });

  function update() {
    const paused = Boolean(arm.sample?.paused);
    if (!paused && document.activeElement === resume) pause.focus();
    resume.hidden = authors.hidden = !paused;
    resume.setAttribute("aria-disabled", String(arm.scope === "view"));
    setText(authors, text("pause.by", { names: pausedBy(arm.sample) }));
  }
  arm.follow(["sample"], update);
  return h("div", { class: `row ${name}` }, pause, resume, copyButton(() => (arm.sample?.paused ? "robot.resume()" : "robot.pause()")),
    authors);
}

/**
 * Return the authors of an arm's pauses.
 *
 * @param {import("../../messages.d.ts").StateSample | null} sample Its state.
 * @returns {string} The names.
 */
export function pausedBy(sample) {
  return sample?.paused_by?.join(", ") ?? "";
}
