// The state of the whole page: one word on its root, by which styles and tests go.

/** @import { Arm } from "./arm.js" */

import { setValues } from "./dom.js";

/**
 * State of the page, of which the worst one counts.
 *
 * @typedef {"signed-out" | "mismatch" | "connecting" | "gone" | "stale" | "fault" | "recovering" |
 *   "lease-elsewhere" | "no-lease" | "commanding"} PageState
 */

/**
 * Return the state of the page.
 *
 * @param {Arm} arm The arm.
 * @returns {PageState} The state.
 */
export function pageState(arm) {
  const { link } = arm;
  if (link !== "live") return link;
  if (arm.sample?.moving.some((name) => name === "recover()" || name === "acknowledge()")) return "recovering";
  if (arm.faulty) return "fault";
  if (arm.commands) return "commanding";
  return arm.lease?.client ? "lease-elsewhere" : "no-lease";
}

/**
 * Keep the root of the document in the state of the page.
 *
 * @param {Arm} arm The arm.
 */
export function showState(arm) {
  const root = document.documentElement;
  const update = () => {
    setValues(root.dataset, {
      state: pageState(arm),
      simulated: String(arm.description?.simulated ?? false),
      moving: String((arm.sample?.moving.length ?? 0) > 0),
    });
  };
  arm.follow(["sample", "link", "lease", "description"], update);
}
