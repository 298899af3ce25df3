// Follows a trajectory from a file: uploaded in parts, then begun, with its progress.

/** @import { App } from "../app.js" */
/** @import { GoalValue, TrajectoryValue } from "../../messages.d.ts" */

import { ActionError } from "../app.js";
import { text } from "../texts.js";

/** Points of one message: with velocities and accelerations of six joints less than 256 KiB. */
const PART = 500;

/** Follows one trajectory at a time. */
export class Follower {
  /**
   * @param {App} app The page.
   * @param {() => void} changed Called after each change.
   */
  constructor(app, changed) {
    this.app = app;
    this.changed = changed;
    /** @type {"idle" | "uploading" | "following"} */
    this.phase = "idle";
    /** Share that is uploaded or followed, 0 to 1; NaN if it is not known. */
    this.progress = NaN;
    /** How the last one ended. */
    this.words = "";
    /** @type {number | null} */
    this.goal = null;
    this.cancelled = false;
  }

  /**
   * Move to the begin of a trajectory and follow it.
   *
   * @param {TrajectoryValue} trajectory The trajectory.
   * @returns {Promise<GoalValue>} The goal as it ended.
   */
  async follow(trajectory) {
    if (this.phase !== "idle") throw new ActionError(text("files.runs_already"));
    this.cancelled = false;
    this.words = "";
    this.#enter("uploading", 0);
    try {
      const { upload, last } = await this.#upload(trajectory);
      const { goal } = await this.app.start({ kind: "follow", trajectory: last, approach: true, planned: false, upload });
      this.goal = goal;
      this.#enter("following", NaN);
      const ended = await this.app.ended(goal, (share) => this.#enter("following", share));
      this.words = ended.status === "succeeded" ? text("files.done") : (ended.failure?.text ?? text("files.was_cancelled"));
      if (ended.status !== "succeeded") throw new ActionError(this.words);
      return ended;
    } catch (error) {
      this.words = error instanceof Error ? error.message : String(error);
      throw error;
    } finally {
      this.goal = null;
      this.#enter("idle", NaN);
    }
  }

  /** End it: the arm comes to rest on its path. */
  async cancel() {
    this.cancelled = true;
    if (this.goal !== null) await this.app.request({ kind: "cancel", goal: this.goal });
  }

  /** @param {TrajectoryValue} trajectory */
  async #upload(trajectory) {
    const count = trajectory.times.length;
    let upload = 0;
    let begin = 0;
    for (; count - begin > PART; begin += PART) {
      const added = await this.app.request({ kind: "add_points", points: part(trajectory, begin, begin + PART), upload });
      upload = added.upload;
      if (this.cancelled) throw new ActionError(text("files.was_cancelled"));
      this.#enter("uploading", (begin + PART) / count);
    }
    return { upload, last: part(trajectory, begin, count) };
  }

  /**
   * @param {Follower["phase"]} phase
   * @param {number} progress
   */
  #enter(phase, progress) {
    this.phase = phase;
    this.progress = progress;
    this.changed();
  }
}

/**
 * @param {TrajectoryValue} trajectory
 * @param {number} begin
 * @param {number} end
 * @returns {TrajectoryValue}
 */
function part({ joint_names, times, positions, velocities, accelerations }, begin, end) {
  return {
    joint_names,
    times: times.slice(begin, end),
    positions: positions.slice(begin, end),
    velocities: velocities?.slice(begin, end) ?? null,
    accelerations: accelerations?.slice(begin, end) ?? null,
  };
}
