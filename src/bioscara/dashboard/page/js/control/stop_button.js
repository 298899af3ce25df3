// The STOP button, Escape from anywhere, and the progress of the stop.

/** @import { App } from "../app.js" */

import { pressed } from "../arms/stopper.js";
import { at, button, h, setText } from "../dom.js";
import { text } from "../texts.js";
import { DOUBTFUL, Stop } from "./stop.js";

/** Time between two updates of a stop in work [ms]. */
const LOOK = 20;
/** Time after which a request by POST is given up [ms]. */
const GIVEN_UP = 2000;

/**
 * Build STOP. It works before anything else does, in every view of the page.
 *
 * @param {App} app The page.
 */
export function buildStop(app) {
  const { arm, connection } = app;
  let confirmed = 0;
  /** @type {ReturnType<typeof setInterval> | undefined} */
  let timer;
  const stop = new Stop({
    now: () => performance.now(),
    doubtful: () => !connection.open || connection.backlog > 0 || performance.now() - connection.heard > DOUBTFUL,
    bySocket: () => connection.request({ kind: "stop" }),
    byPost: () => post(connection.session),
    // A sample from before the confirmation shows the arm as it was.
    resting: () => (arm.fresh && arm.arrival > confirmed ? arm.sample?.moving.length === 0 : null),
    changed: show,
  });
  const status = h("p", { class: "stop-state", role: "alert" });
  const onward = button(text("stop.close"), () => {
    stop.dismiss();
    stopButton.focus();
  });
  const box = h("div", { class: "stop-box card", hidden: true }, status, onward);
  const stopButton = h("button", { type: "button", id: "stop-button", "aria-describedby": "stop-description", text: text("stop.button") });
  pressed(stopButton, begin);
  window.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && !event.repeat) begin();
  }, { capture: true });
  at("stop").append(stopButton, h("span", { id: "stop-description", class: "hidden-text", text: text("stop.description") }), box);
  arm.on("lease", show);
  arm.on("goals", () => {
    if (stop.state === "resting" && arm.sample?.moving.length) stop.dismiss();
  });

  function begin() {
    stop.stop();
    app.interrupt(text("stop.interrupt"));
    for (const listener of app.stops) listener();
    clearInterval(timer);
    timer = setInterval(() => stop.tick(), LOOK);
  }

  function show() {
    const { state } = stop;
    if (state === "decelerating" && confirmed < stop.pressed) confirmed = performance.now();
    if (state === "idle" || state === "resting") clearInterval(timer);
    box.hidden = state === "idle";
    box.dataset.state = at("stop").dataset.state = state;
    const received = Number.isNaN(stop.took) ? "" : text("stop.received", { took: Math.round(stop.took) });
    onward.hidden = state !== "resting";
    const way = state === "resting" && !arm.commands && arm.scope !== "view" ? text("stop.onward") : "";
    setText(status, state === "idle" ? "" : [received, text(`stop.${state}`), way].filter(Boolean).join(" "));
  }
}

/**
 * Stop by a request of its own; done when the owner has stopped the arm.
 *
 * @param {string} session Name of the page's session: the STOP of both ways is that of one client.
 */
async function post(session) {
  const headers = { "Bioscara-Session": session };
  const answer = await fetch("api/stop", { method: "POST", headers, keepalive: true, signal: AbortSignal.timeout(GIVEN_UP) });
  if (!answer.ok) throw new Error(`STOP was answered with ${answer.status}`);
}
