// Why the arm cannot be moved now, in words that say what to do.

/** @import { App } from "../app.js" */

import { text } from "../texts.js";
import { pausedBy } from "./pause_buttons.js";

/**
 * Return why the arm cannot be moved.
 *
 * @param {App} app The page.
 * @param {{homed?: boolean, enabled?: boolean, idle?: boolean, jog?: boolean}} [needs] Whether it has to be homed,
 *   enabled and at rest, by default all; and whether it is a jog, which may begin while the former one comes to rest.
 * @returns {string} The reason; empty if it can.
 */
export function refusal({ arm }, { homed = true, enabled = true, idle = true, jog = false } = {}) {
  const { sample } = arm;
  if (arm.mismatch) return text("refusal.mismatch");
  if (!arm.fresh || !sample) return text("refusal.stale");
  if (arm.scope === "view") return text("refusal.view");
  if (!arm.commands) return arm.lease?.client ? text("refusal.lease_elsewhere", { client: arm.lease.client }) : text("refusal.no_lease");
  if (arm.faulty) return text("refusal.fault");
  if (idle && sample.paused) return text("refusal.paused", { names: pausedBy(sample) });
  const others = sample.moving.filter((name) => !(jog && name === "jog()"));
  if (idle && others.length) return text("refusal.busy", { what: others.join(", ") });
  if (enabled && !sample.enabled) return text("refusal.disabled");
  if (homed && sample.positions.some((position) => position === null)) return text("refusal.not_homed");
  return "";
}
