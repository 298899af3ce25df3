// Dialogs. Not those of the browser: they would make STOP unreachable.

/** @import { App } from "./app.js" */

import { at, h } from "./dom.js";

/** What cannot be used while a dialog is open; STOP is not among them. */
const BEHIND = ["identity", "lease", "link", "faults", "tabs", "main", "footer"];
let counted = 0;

/**
 * Open a dialog: it ends motions that are held, takes the focus, and Escape closes it, after it has stopped the arm.
 *
 * @param {App} app The page.
 * @param {string} title Its title.
 * @param {(close: () => void) => (Node | string)[]} build Returns its content; `close` closes it.
 * @param {() => void} [closed] Called when it is closed.
 * @returns {() => void} Closes it.
 */
export function openDialog(app, title, build, closed = () => {}) {
  app.interrupt("a dialog was opened");
  const opener = document.activeElement;
  counted += 1;
  const id = `dialog-${counted}`;
  const box = h("div", { class: "dialog card column", role: "dialog", "aria-labelledby": id, tabindex: "-1" });
  const back = h("div", { class: "dialog-back" }, box);
  box.append(h("h2", { id, text: title }), ...build(close));
  const inert = BEHIND.map(at).filter((element) => !element.inert);
  for (const element of inert) element.inert = true;
  document.body.append(back);
  const first = box.querySelector("input, textarea, select, button");
  (first instanceof HTMLElement ? first : box).focus();
  window.addEventListener("keydown", onKey);

  /** @param {KeyboardEvent} event */
  function onKey(event) {
    if (event.key === "Escape" && back === document.body.lastElementChild) close();
  }

  function close() {
    if (!back.isConnected) return;
    window.removeEventListener("keydown", onKey);
    back.remove();
    for (const element of inert) element.inert = false;
    if (opener instanceof HTMLElement) opener.focus();
    closed();
  }
  return close;
}
