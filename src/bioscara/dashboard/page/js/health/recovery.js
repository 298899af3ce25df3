// The steps from a fault to an arm that is ready again: acknowledge, recover, enable; home, where a joint is not homed.

/** @import { App } from "../app.js" */
/** @import { AnyTask } from "../../messages.d.ts" */

import { RequestError } from "../connection.js";
import { text } from "../texts.js";

/** Number of steps where all joints are homed. */
const STEPS = 3;
/** Time for which a step that has just become the next one cannot be taken [ms]: a double click on one
 *  must not take two. */
const GUARD = 600;

/**
 * The next step.
 *
 * @typedef {Object} Step
 * @property {"stopping" | "acknowledge" | "recover" | "enable" | "home"} kind Its kind; `stopping` waits for the arm, and
 *   only `home` moves it.
 * @property {number} number Its number, from 1.
 * @property {number} count Number of all steps.
 * @property {boolean} busy Whether it is being taken.
 */

/** Which step is next, and taking it. */
export class Recovery {
  /** @param {App} app The page. */
  constructor(app) {
    this.app = app;
    /** Whether this page saw faults end, and the arm has not been enabled and homed since. */
    this.recovered = false;
    this.pending = false;
    this.former = "";
    this.changed = 0;
    /** @type {boolean} */
    this.faulty = false;
    app.arm.on("sample", () => this.#watch());
    app.arm.on("reset", () => {
      this.recovered = this.faulty = false;
    });
  }

  /** The next step; null if none is needed. @returns {Step | null} */
  get step() {
    const sample = this.app.arm.sample;
    if (!sample) return null;
    const count = STEPS + (unhomed(this.app) ? 1 : 0);
    /** @type {(kind: Step["kind"], number: number) => Step} */
    const step = (kind, number) => ({ kind, number, count, busy: this.pending || sample.moving.includes(`${kind}()`) });
    switch (sample.fault) {
      case "stopping":
        return { ...step("stopping", 1), busy: true };
      case "latched":
        return step("acknowledge", 1);
      case "acknowledged":
        return step("recover", 2);
    }
    if (!this.recovered) return null;
    return sample.enabled ? step("home", 4) : step("enable", 3);
  }

  /** Why the next step cannot be taken by this page; empty if it can. @returns {string} */
  get hindrance() {
    const { arm } = this.app;
    // Joints that are not read, as on a stuck bus, are what recovery is for.
    if (!arm.told) return text("health.not_live");
    if (arm.scope === "view") return text("health.view_only");
    if (!arm.commands) return text("health.take_control");
    return "";
  }

  /** Whether the step has just become the next one, and takes no press yet. */
  get settling() {
    return performance.now() - this.changed < GUARD;
  }

  /** Take the next step; a reason why not is shown. */
  async take() {
    const step = this.step;
    if (!step || step.busy || this.settling) return;
    const { hindrance } = this;
    if (hindrance) {
      this.app.say(hindrance, "error", () => this.hindrance === hindrance);
      return;
    }
    this.pending = true;
    await this.app.attempt(async () => {
      const goal = await this.app.start(/** @type {AnyTask} */ ({ kind: step.kind }));
      const end = await this.app.ended(goal.goal);
      if (end.failure) throw new RequestError(end.failure);
    });
    this.pending = false;
    // The answer may come long after the sample that made the next step the next one.
    this.changed = performance.now();
  }

  /** Forget that the motors are off, or a joint is not homed, because of a fault. */
  dismiss() {
    this.recovered = false;
  }

  #watch() {
    const sample = this.app.arm.sample;
    if (!sample) return;
    const faulty = this.app.arm.faulty;
    if (this.faulty && !faulty) this.recovered = true;
    if (faulty || (sample.enabled && !unhomed(this.app))) this.recovered = false;
    this.faulty = faulty;
    const kind = this.step?.kind ?? "";
    if (kind !== this.former) {
      this.former = kind;
      this.changed = performance.now();
    }
  }
}

/**
 * Return the joints that have to be homed, as their names with commas.
 *
 * @param {App} app The page.
 * @returns {string} The names; empty if all are homed or none reports.
 */
export function unhomed(app) {
  const { sample } = app.arm;
  if (!sample || sample.stale) return "";
  return sample.names.filter((_, joint) => sample.flags[joint] & 0x04).join(", ");
}
