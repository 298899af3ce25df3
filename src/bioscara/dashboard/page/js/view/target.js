// The target of the tool: a pose that a person chooses, of which a plan can be made.

/** @import { MoveLinear, MoveTo, PlanMade, Pose } from "../../messages.d.ts" */
/** @import { App } from "../app.js" */

import { RequestError } from "../connection.js";
import { text } from "../texts.js";

/** Largest coordinate that can be chosen [m]. */
const FARTHEST = 2;

/**
 * Why there is no plan.
 *
 * @typedef {Object} Refusal
 * @property {string} text In words.
 * @property {string[]} names What would come too near to each other; none for other reasons.
 */

/** The target. */
export class Target {
  /** @param {App} app The page. */
  constructor(app) {
    this.app = app;
    /** Null while it is not shown. @type {Pose | null} */
    this.pose = null;
    /** @type {"ptp" | "lin"} */
    this.kind = "ptp";
    /** Share of the largest speed. */
    this.speed = 0.25;
    /** @type {Refusal | null} */
    this.refusal = null;
    this.planning = false;
    /** @type {(() => void)[]} */
    this.listeners = [];
  }

  /** Whether it is shown. */
  get shown() {
    return this.pose !== null;
  }

  /**
   * Show it at the tool, or hide it.
   *
   * @param {boolean} shown Whether it is shown.
   */
  show(shown) {
    this.refusal = null;
    this.pose = shown ? this.#here() : null;
    this.#tell();
  }

  /** @returns {Pose} */
  #here() {
    const [x, y, z, yaw] = this.app.arm.sample?.pose ?? [0.4, 0, 0.2, 0];
    return [x, y, z, wrapped(yaw)];
  }

  /** Move it to the tool. */
  toTool() {
    this.set(this.#here());
  }

  /**
   * Move it.
   *
   * @param {Pose} pose Where to, in the base.
   */
  set(pose) {
    const [x, y, z, yaw] = pose;
    const [a, b, c] = [x, y, z].map((value) => Math.min(Math.max(value, -FARTHEST), FARTHEST));
    this.pose = [a, b, c, wrapped(yaw)];
    this.refusal = null;
    // The plan of another target is none of this one.
    if (this.app.preview?.source === "target") this.app.showPreview(null);
    this.#tell();
  }

  /**
   * Choose how it is reached.
   *
   * @param {{kind?: "ptp" | "lin", speed?: number}} choice The choice.
   */
  choose(choice) {
    Object.assign(this, choice);
    if (this.app.preview?.source === "target") this.app.showPreview(null);
    this.#tell();
  }

  /** The motion to it. @returns {MoveTo | MoveLinear} */
  get motion() {
    const pose = this.pose ?? [0, 0, 0, 0];
    const kind = this.kind === "lin" ? "move_linear" : "move_to";
    return { kind, pose, velocity_scaling: this.speed };
  }

  /** The same in Python. */
  get python() {
    const [x, y, z, yaw] = (this.pose ?? [0, 0, 0, 0]).map((value) => value.toFixed(4));
    const method = this.kind === "lin" ? "move_linear" : "move_to";
    const planned = `plan = robot.plan.${method}(Pose(${x}, ${y}, ${z}, ${yaw}), velocity_scaling=${this.speed})`;
    return `${planned}\nrobot.execute(plan)`;
  }

  /** Ask for a plan and show it; nothing moves. */
  async plan() {
    if (this.pose === null || this.planning) return;
    const asked = this.motion;
    this.planning = true;
    this.refusal = null;
    if (this.app.preview?.source === "target") this.app.showPreview(null);
    this.#tell();
    try {
      const made = /** @type {PlanMade} */ (await this.app.ask({ kind: "make_plan", motion: asked }));
      // The target was moved while the plan was made.
      if (JSON.stringify(this.motion) === JSON.stringify(asked) && this.pose !== null) this.#preview(made);
    } catch (error) {
      this.refusal = refusalOf(error);
    } finally {
      this.planning = false;
      this.#tell();
    }
  }

  /** @param {PlanMade} made */
  #preview({ plan, trajectory, notes }) {
    const title = text(this.kind === "lin" ? "view.plan_lin" : "view.plan_ptp");
    const execute = () => this.app.start({ kind: "execute", plan });
    // At its end: where it begins, it is hidden by the arm.
    this.app.showPreview({ title, trajectory, plan, notes, execute, time: trajectory.times.at(-1) ?? 0, source: "target" });
  }

  #tell() {
    for (const listener of this.listeners) listener();
  }
}

/**
 * @param {unknown} error
 * @returns {Refusal}
 */
function refusalOf(error) {
  if (!(error instanceof RequestError)) return { text: error instanceof Error ? error.message : String(error), names: [] };
  const { failure } = error;
  const names = failure.error === "ZoneError" ? [failure.data.link, failure.data.zone] : [];
  return { text: error.message, names: names.filter((name) => typeof name === "string") };
}

/** @param {number} angle */
function wrapped(angle) {
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}
