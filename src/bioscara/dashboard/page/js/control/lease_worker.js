// A worker that renews the lease of its page as long as the page's own thread answers it: a browser that is busy for a
// moment keeps its lease, and a page that hangs does not. It sends on a WebSocket of its own, in the session of the page.

import { Connection } from "../connection.js";

/** Time between two renewals, and between two questions to the page [ms]. */
const RENEWAL = 500;
/** Time without an answer from which the page counts as hung [ms]. */
const HUNG = 5000;

/** @type {Connection | null} */
let connection = null;
/** Epoch of the lease; null without one. @type {number | null} */
let epoch = null;
let answered = -Infinity;

function renew() {
  if (epoch === null || performance.now() - answered > HUNG) return;
  connection?.request({ kind: "renew_lease" }, epoch).catch(() => {});
}

addEventListener("message", ({ data }) => {
  const had = epoch !== null;
  answered = performance.now();
  epoch = data.epoch;
  if (connection === null) {
    connection = new Connection(data.client, data.session);
    connection.on("welcome", renew);
  }
  // Only the page that commands needs one: the gateway has places for few.
  if (epoch !== null && !had) connection.resume();
  else if (epoch === null && had) connection.end();
});

setInterval(() => {
  postMessage(null);
  renew();
}, RENEWAL);
