// Whether this page is still one of its gateway: same version of its files, and signed in.

/** @import { Arm } from "./arm.js" */

import { text } from "./texts.js";

/** Time in which the gateway has to answer [ms]. */
const PATIENCE = 5000;
/** Characters of a version that people read. */
const SHORT = 8;

/**
 * Ask the gateway at each begin and end of a connection; a page of another version may not move the arm.
 *
 * @param {Arm} arm The arm.
 */
export function watchGateway(arm) {
  const own = document.documentElement.dataset.assets ?? "";
  const { connection } = arm;
  let asking = false;

  async function ask() {
    if (asking) return;
    asking = true;
    try {
      const answer = await fetch("session", { signal: AbortSignal.timeout(PATIENCE) });
      if (!answer.ok) return;
      const { scope, assets } = await answer.json();
      // First: a restart of the gateway, as for another version, signs the page out, also from STOP.
      if (!scope) {
        arm.suspend("signed-out", text("error.no_token"));
        connection.end();
      } else if (assets !== own) {
        arm.suspend("mismatch", text("gateway.versions", { page: own.slice(0, SHORT), server: String(assets).slice(0, SHORT) }));
      }
    } catch {
      // There is no gateway now: the state of the connection shows that.
    } finally {
      asking = false;
    }
  }

  connection.on("welcome", ask);
  connection.on("closed", ask);
  connection.on("refusal", ({ id, failure }) => {
    if (id === null && failure.text.includes("speaks version")) arm.suspend("mismatch", failure.text);
  });
}
