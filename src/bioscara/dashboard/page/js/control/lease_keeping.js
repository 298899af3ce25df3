// Keeps the lease of a page that has it, and measures the round trip.

/** @import { Arm } from "../arm.js" */

/** Time between two questions for the lease, and the least [ms]: timers and samples are not exact. */
const LOOK = 500;
const LEAST_LOOK = 400;

/**
 * Let a worker renew the lease whenever the page has it, and look at the lease often.
 *
 * @param {Arm} arm The arm.
 */
export function keepLease(arm) {
  const { connection } = arm;
  let last = -Infinity;

  function look() {
    const now = performance.now();
    if (!connection.open || now - last < LEAST_LOOK) return;
    last = now;
    arm.refreshLease();
  }

  setInterval(look, LOOK);
  // The browser lets the timers of a hidden page run once a minute; messages come in time.
  connection.on("state", look);
  if (arm.scope === "view") return;
  // Begun with the page: a slow network must not delay the first renewal.
  const worker = new Worker(new URL("lease_worker.js", import.meta.url), { type: "module" });
  const answer = () => {
    const { client, session } = connection;
    worker.postMessage({ client, session, epoch: arm.commands ? arm.epoch : null });
  };
  worker.onmessage = answer;
  arm.on("lease", answer);
}
