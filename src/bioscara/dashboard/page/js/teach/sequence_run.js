// Carries a sequence out, goal by goal: each begins when the one before it has succeeded.

/** @import { App } from "../app.js" */
/** @import { AnyTask, FailureValue, GoalValue, TrajectoryValue } from "../../messages.d.ts" */
/** @import { SequenceModel } from "./sequence.js" */

import { ActionError } from "../app.js";
import { duration, readable } from "../format.js";
import { judged, post } from "../http.js";
import { text } from "../texts.js";

/**
 * What planning says of a step, or of several that blends join.
 *
 * @typedef {Object} Verdict
 * @property {number} first Index of the first step.
 * @property {number} number Number of the steps.
 * @property {string} label Their numbers and kinds.
 * @property {number | null} duration How long they take [s].
 * @property {string[]} notes Notes on the plan.
 * @property {FailureValue | null} failure Why they are refused.
 * @property {AnyTask | null} task The task that does them; null if they are refused.
 *
 * @typedef {{verdicts: Verdict[], duration: number, trajectory: TrajectoryValue | null}} DryRun
 */

/** The running sequence. `changed` is called whenever its state changes. */
export class SequenceRun {
  /**
   * @param {App} app The page.
   * @param {SequenceModel} model The sequence.
   * @param {() => void} changed Called after a change.
   */
  constructor(app, model, changed) {
    this.app = app;
    this.model = model;
    this.changed = changed;
    this.running = false;
    this.words = "";
    /** Why it has to end; empty while it goes on. */
    this.ending = "";
    /** @type {number | null} */
    this.goal = null;
    /** @type {() => void} */
    this.wake = () => {};
    const { arm } = app;
    // The event comes later, and not for a STOP that is repeated.
    app.stops.push(() => this.#end(text("teach.was_stopped")));
    arm.on("event", () => {
      if (arm.events.at(-1)?.what === "stop") this.#end(text("teach.was_stopped"));
    });
    arm.on("lease", () => {
      if (this.running && !arm.commands) this.#end(text("teach.lost_control"));
    });
    arm.on("reset", () => this.#end(text("teach.owner_restarted")));
  }

  /**
   * Plan from where the arm is, and mark the steps with the verdicts.
   *
   * @param {number} [first] Index of the first step.
   * @param {number} [last] Index of the step to end before.
   * @returns {Promise<DryRun>} The verdicts.
   */
  async plan(first = 0, last) {
    const query = `first=${first}${last === undefined ? "" : `&last=${last}`}`;
    /** @type {DryRun} */
    const planned = await judged(post(`api/sequences/plan?${query}`, this.model.values()));
    this.model.unmark();
    for (const verdict of planned.verdicts) {
      const { failure, notes } = verdict;
      const words = failure ? "" : [duration(verdict.duration ?? 0), notes.length ? "⚠" : ""].filter(Boolean).join(" ");
      this.model.mark(verdict.first, verdict.number, { state: failure ? "refused" : "ok", text: words });
    }
    return planned;
  }

  /**
   * Carry out steps.
   *
   * @param {number} [first] Index of the first step.
   * @param {number} [last] Index of the step to end before.
   * @throws {Error} They are refused, before anything moves; or they ended early, and the arm is at rest.
   */
  async start(first = 0, last) {
    if (this.running) throw new ActionError(text("teach.runs_already"));
    this.running = true;
    this.ending = "";
    this.#say(text("teach.planning"));
    try {
      const { verdicts } = await this.plan(first, last);
      const refused = verdicts.find(({ failure }) => failure);
      if (refused?.failure) throw new ActionError(text("teach.refused", { why: readable(refused.failure.text) }));
      for (const verdict of verdicts) await this.#carryOut(verdict);
      this.#say(text("teach.finished"));
    } catch (error) {
      this.#say(error instanceof Error ? error.message : String(error));
      throw error;
    } finally {
      this.running = false;
      this.goal = null;
      this.changed();
    }
  }

  /** End it: the arm comes to rest on its path. */
  async cancel() {
    const { goal } = this;
    this.#end(text("teach.was_cancelled"));
    if (goal !== null) await this.app.request({ kind: "cancel", goal });
  }

  /** @param {string} why */
  #end(why) {
    if (!this.running || this.ending) return;
    this.ending = why;
    this.wake();
  }

  /** @param {Verdict} verdict */
  async #carryOut(verdict) {
    const { first, number, label } = verdict;
    this.#check();
    this.model.mark(first, number, { state: "running", text: "" });
    this.#say(text("teach.running", { label: label.split(" ")[0], count: this.model.steps.length }));
    try {
      if (verdict.task) await this.#move(verdict.task);
    } catch (error) {
      this.model.mark(first, number, { state: "failed", text: "" });
      throw error;
    }
    this.model.mark(first, number, { state: "done", text: "" });
  }

  #check() {
    if (this.ending) throw new ActionError(this.ending);
  }

  /** @param {AnyTask} task */
  async #move(task) {
    const { goal } = await this.app.start(task);
    this.goal = goal;
    this.changed();
    // Without a connection its end may never be reported.
    /** @type {Promise<null>} */
    const broken = new Promise((resolve) => {
      this.wake = () => resolve(null);
    });
    const ended = await Promise.race([this.app.ended(goal), broken.then(() => this.#late(goal))]);
    this.goal = null;
    if (ended?.status === "succeeded" && !this.ending) return;
    throw new ActionError(this.ending || (ended?.failure?.text ?? text("teach.was_cancelled")));
  }

  /**
   * Return a goal whose sequence has to end, once it has ended; null if that is not known soon.
   *
   * @param {number} goal
   * @returns {Promise<GoalValue | null>}
   */
  #late(goal) {
    return Promise.race([this.app.ended(goal), new Promise((resolve) => {
      setTimeout(() => resolve(null), 2000);
    })]);
  }

  /** @param {string} words */
  #say(words) {
    this.words = words;
    this.changed();
  }
}
