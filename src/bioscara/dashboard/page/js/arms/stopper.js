// STOP of one arm, or of all, by requests: sent at once, and again until each owner has confirmed it.

/** Time in which a request has to be answered; an owner that hangs has 2 s of it [ms]. */
const PATIENCE = 3000;
/** Time from an answer that confirms nothing to the next request [ms]. */
const AGAIN = 1000;
/** Requests after which a person has to act otherwise. */
const MOST = 10;

/** @typedef {{name: string, stopped: boolean, text: string}} Stopped */

/**
 * Send a stop until it is confirmed.
 *
 * @param {string} path Path of the request.
 * @param {(found: Stopped[] | null) => void} show Called with each answer; null where there was none.
 * @param {() => boolean} superseded Whether a later press takes care of it.
 */
export async function stop(path, show, superseded) {
  for (let count = 0; count < MOST && !superseded(); count += 1) {
    const found = await send(path);
    if (superseded()) return;
    show(found);
    if (found?.every((each) => each.stopped)) return;
    await new Promise((resolve) => setTimeout(resolve, AGAIN));
  }
}

/**
 * @param {string} path
 * @returns {Promise<Stopped[] | null>}
 */
async function send(path) {
  try {
    const answer = await fetch(path, { method: "POST", keepalive: true, signal: AbortSignal.timeout(PATIENCE) });
    return answer.ok ? await answer.json() : null;
  } catch {
    return null;
  }
}

/**
 * Let a button stop at the press of a pointer, and at a click that has none, as of a keyboard or a screen reader.
 *
 * @param {HTMLElement} element The button.
 * @param {() => void} press Called at once.
 */
export function pressed(element, press) {
  let byPointer = false;
  element.addEventListener("pointerdown", () => {
    byPointer = true;
    press();
  });
  element.addEventListener("click", () => {
    if (!byPointer) press();
    byPointer = false;
  });
}
