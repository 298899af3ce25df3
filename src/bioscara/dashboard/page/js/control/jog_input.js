// Pointers and keys on the jog pad: requirements jog_r3 to jog_r5.

/** @import { Hold } from "./hold.js" */
/** @import { Axis } from "./jog_motion.js" */

import { text } from "../texts.js";

/** How far a pointer may drift off its button [pixel]. */
const DRIFT = 12;
const MODIFIERS = new Set(["Shift", "Control", "Alt", "Meta", "AltGraph"]);

/** @typedef {{press: (source: string, axis: number, sign: number) => void}} JogActions */

/**
 * Press and release by pointer and touch.
 *
 * @param {HTMLElement} pad The pad; its buttons have `data-axis` and `data-sign`.
 * @param {Hold} hold The hold.
 * @param {JogActions} actions Called for each press.
 * @param {() => boolean} stepping Whether a press is a step, done by the click at its end.
 */
export function watchPointers(pad, hold, actions, stepping) {
  /** @type {{id: number, box: DOMRect} | null} */
  let held = null;
  pad.addEventListener("contextmenu", (event) => event.preventDefault());
  pad.addEventListener("pointerdown", (event) => {
    const pressed = buttonOf(event);
    if (!pressed || event.button !== 0 || stepping()) return;
    // Moved here already, so that the focus does not move during the hold.
    pressed.focus();
    held = { id: event.pointerId, box: pressed.getBoundingClientRect() };
    try {
      pressed.setPointerCapture(event.pointerId);
    } catch {
      // The pointer is gone already: its release follows.
    }
    actions.press(`pointer ${event.pointerId}`, Number(pressed.dataset.axis), Number(pressed.dataset.sign));
  });
  pad.addEventListener("click", (event) => {
    const pressed = buttonOf(event);
    if (pressed && stepping()) actions.press("click", Number(pressed.dataset.axis), Number(pressed.dataset.sign));
  });

  /** @param {PointerEvent} event */
  const release = (event) => {
    hold.release(`pointer ${event.pointerId}`);
    if (held?.id === event.pointerId) held = null;
  };
  // On the window: a button that was removed or drawn again gets neither of them.
  for (const name of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) {
    window.addEventListener(name, release, { capture: true });
  }
  window.addEventListener("pointermove", (event) => {
    if (held === null || event.pointerId !== held.id) return;
    const { box } = held;
    const off = event.clientX < box.left - DRIFT || event.clientX > box.right + DRIFT
      || event.clientY < box.top - DRIFT || event.clientY > box.bottom + DRIFT;
    // The primary button may be released while another one is held, which is no pointerup.
    if (!(event.buttons & 1)) release(event);
    else if (event.buttons !== 1) hold.end(text("jog.end.second"));
    else if (off) hold.end(text("jog.end.left"));
  }, { capture: true });
  window.addEventListener("pointerdown", (event) => {
    if (held !== null && event.pointerId !== held.id) hold.end(text("jog.end.second"));
  }, { capture: true });
}

/**
 * Press and release by the keyboard, while the focus is in the pad.
 *
 * @param {HTMLElement} pad The pad.
 * @param {Hold} hold The hold.
 * @param {JogActions} actions Called for each press.
 * @param {() => Axis[]} axes Returns the axes with their keys.
 * @param {(why: string) => void} refuse Called where a key does nothing.
 */
export function watchKeys(pad, hold, actions, axes, refuse) {
  pad.addEventListener("keydown", (event) => {
    const { key, code } = event;
    if (MODIFIERS.has(key)) {
      hold.end(text("jog.end.modifier"));
      return;
    }
    const meant = meantBy(event, axes());
    if (!meant) {
      if (!event.repeat) hold.end(text("jog.end.second"));
      return;
    }
    // Neither scrolling nor a click.
    event.preventDefault();
    if (event.repeat) return;
    if (event.ctrlKey || event.altKey || event.metaKey || event.shiftKey) {
      refuse(text("jog.end.modifier"));
      return;
    }
    actions.press(`key ${code}`, meant.axis, meant.sign);
  });
  pad.addEventListener("keyup", (event) => {
    // A button is clicked by the release of the space bar.
    if (event.key === " " && event.target instanceof HTMLElement && event.target.dataset.axis) event.preventDefault();
  });
  window.addEventListener("keyup", (event) => {
    hold.release(`key ${event.code}`);
    if (MODIFIERS.has(event.key)) hold.end(text("jog.end.modifier"));
  }, { capture: true });
  // Another element gets the focus, in the pad or elsewhere.
  pad.addEventListener("focusout", () => hold.end(text("jog.end.focus")));
}

/**
 * @param {KeyboardEvent} event
 * @param {Axis[]} axes
 */
function meantBy(event, axes) {
  const target = event.target;
  if ((event.key === " " || event.key === "Enter") && target instanceof HTMLElement && target.dataset.axis) {
    return { axis: Number(target.dataset.axis), sign: Number(target.dataset.sign) };
  }
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  for (const [axis, { plus, minus }] of axes.entries()) {
    if (key === plus) return { axis, sign: 1 };
    if (key === minus) return { axis, sign: -1 };
  }
  return null;
}

/** @param {Event} event */
function buttonOf(event) {
  const target = event.target instanceof Element ? event.target.closest("[data-axis]") : null;
  return target instanceof HTMLElement ? target : null;
}
