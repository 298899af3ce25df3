// All that ends a hold except the release of its key or pointer: requirements jog_r3 and jog_r9.

/** @import { App } from "../app.js" */
/** @import { Hold } from "./hold.js" */

import { text } from "../texts.js";

/**
 * End a hold when the page, the connection or the arm changes.
 *
 * @param {App} app The page.
 * @param {Hold} hold The hold.
 */
export function watchHold(app, hold) {
  const { arm, connection } = app;
  /** @param {string} why Where a release may get lost, all presses are forgotten. */
  const leave = (why) => {
    hold.end(text(why));
    hold.forget();
  };
  window.addEventListener("blur", () => leave("jog.end.blur"));
  window.addEventListener("pagehide", () => leave("jog.end.blur"));
  document.addEventListener("freeze", () => leave("jog.end.hidden"));
  document.addEventListener("visibilitychange", () => leave("jog.end.hidden"));
  window.addEventListener("contextmenu", (event) => {
    if (!event.defaultPrevented) hold.end(text("jog.end.menu"));
  });
  connection.on("closed", () => leave("jog.end.closed"));
  app.interrupts.push((why) => hold.end(why));
  arm.on("lease", () => {
    if (!arm.commands) hold.end(text("jog.end.lease"));
  });
  arm.on("link", () => {
    if (!arm.fresh) hold.end(text("jog.end.stale"));
  });
  arm.on("sample", () => {
    if (!hold.active) return;
    if (arm.faulty) hold.end(text("jog.end.fault"));
    else if (arm.sample?.paused) hold.end(text("jog.end.paused"));
  });
  arm.on("faults", () => {
    if (arm.faultList?.faults.length) hold.end(text("jog.end.fault"));
  });
}

/**
 * Keep the screen of a phone or tablet on while it is held; where that ends, so does the hold.
 *
 * @param {Hold} hold The hold.
 */
export async function keepScreenOn(hold) {
  if (!("wakeLock" in navigator) || !matchMedia("(pointer: coarse)").matches) return;
  try {
    const lock = await navigator.wakeLock.request("screen");
    if (!hold.active) await lock.release();
    else {
      lock.addEventListener("release", () => hold.end(text("jog.end.screen")));
      const look = setInterval(() => {
        if (hold.active) return;
        clearInterval(look);
        lock.release();
      }, 200);
    }
  } catch {
    // Refused, as on a low battery: a screen that goes off hides the page, which ends the hold.
  }
}
