// A page that is closed, reloaded or left gives control back at once, which stops its motions; before, the browser asks.

/** @import { App } from "../app.js" */

/**
 * Give control back when the page is left, and ask before that while it moves the arm.
 *
 * @param {App} app The page.
 */
export function watchLeaving({ arm, connection }) {
  window.addEventListener("beforeunload", (event) => {
    if (arm.commands && arm.sample?.moving.length) event.preventDefault();
  });
  window.addEventListener("pagehide", () => {
    arm.release().catch(() => {});
    // Sends what waits first; and a browser keeps no page with a connection for its "Back".
    connection.end();
  });
  window.addEventListener("pageshow", (event) => {
    if (event.persisted && !arm.signedOut) connection.resume();
  });
}
