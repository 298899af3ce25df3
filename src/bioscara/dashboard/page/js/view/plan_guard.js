// Whether a plan still holds: it was made for one position of the arm, one workspace and one run of the owner.

/** @import { App, Preview } from "../app.js" */

import { text } from "../texts.js";

/** Differences up to which the arm counts as being where the plan begins [rad, m]. */
const AT_BEGIN = { rad: 2e-3, m: 5e-4 };

/** Watches one plan; once it does not hold, it never does again. */
export class PlanGuard {
  /**
   * @param {App} app The page.
   * @param {Preview} preview The plan.
   */
  constructor(app, preview) {
    this.app = app;
    this.preview = preview;
    this.revision = app.arm.workspace?.revision ?? null;
    this.instance = app.arm.instance;
    this.description = app.arm.description;
    /** Why it does not hold any more; empty while it holds. */
    this.reason = "";
  }

  /**
   * Look whether it holds.
   *
   * @returns {string} Why not; empty if it does.
   */
  check() {
    if (this.preview.plan !== null) this.reason ||= this.#look();
    return this.reason;
  }

  #look() {
    const { arm } = this.app;
    if (arm.instance !== this.instance) return text("view.dead_owner");
    if ((arm.workspace?.revision ?? null) !== this.revision) return text("view.dead_workspace");
    if (!this.#sameLimits()) return text("view.dead_limits");
    const moved = this.#moved();
    return moved ? text("view.dead_moved", { joint: moved }) : "";
  }

  #sameLimits() {
    const { description } = this.app.arm;
    if (description === this.description) return true;
    return JSON.stringify(description?.parameters) === JSON.stringify(this.description?.parameters);
  }

  #moved() {
    const { sample, joints } = this.app.arm;
    if (!sample) return "";
    const { joint_names: names, positions } = this.preview.trajectory;
    return names.find((name, column) => {
      const position = sample.positions[sample.names.indexOf(name)];
      const linear = joints.find((joint) => joint.name === name)?.unit === "m";
      // Unknown, as after a loss of the bus: the arm may be anywhere.
      if (position === null || position === undefined) return true;
      return Math.abs(position - positions[0][column]) > (linear ? AT_BEGIN.m : AT_BEGIN.rad);
    });
  }
}
