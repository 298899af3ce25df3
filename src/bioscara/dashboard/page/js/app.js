// Values that all parts of the page share: the arm, its commands, messages to the person, the texts.

/** @import { AnyTask, GoalValue } from "../messages.d.ts" */
/** @import { Connection } from "./connection.js" */

import { Arm, MismatchError } from "./arm.js";
import { ConnectionError, RequestError } from "./connection.js";
import { text } from "./texts.js";

/**
 * A part of the page that has a tab.
 *
 * @typedef {Object} Panel
 * @property {string} id Its id, also of its texts: `tab.ID`.
 * @property {(host: HTMLElement, app: App) => PanelView} mount Builds it in an element, once.
 * @property {(app: App) => boolean} [available] Whether it is there for this arm; by default it is.
 *
 * @typedef {Object} PanelView
 * @property {() => void} [show] Called when it becomes visible.
 * @property {() => void} [hide] Called when it is not visible any more.
 */

/** A command was given without the lease. */
export class NoLeaseError extends Error {}

/** Something cannot be done, or ended early, for a reason that the page shows. */
export class ActionError extends Error {}

/** Errors that are no mistakes of the page. */
const EXPECTED = [RequestError, ConnectionError, NoLeaseError, MismatchError, ActionError];

/** Time between two requests for the progress of a goal [ms]. */
const PROGRESS = 200;

/** The page's model and its commands. */
export class App {
  /**
   * @param {Connection} connection The connection to the owner.
   * @param {Arm} arm The arm.
   */
  constructor(connection, arm) {
    this.connection = connection;
    this.arm = arm;
    /** @type {((message: string, kind: "info" | "error", holds: () => boolean) => void)[]} */
    this.messageListeners = [];
    /** Called when a jog, or another motion that is held, has to end. @type {((why: string) => void)[]} */
    this.interrupts = [];
    /** How often that was: what waits for an answer before it moves the arm compares it. */
    this.interruptions = 0;
    /** Called when STOP is pressed on this page. @type {(() => void)[]} */
    this.stops = [];
    /** A plan, or another trajectory, that the view shows; null for none. @type {Preview | null} */
    this.preview = null;
    /** @type {(() => void)[]} */
    this.previewListeners = [];
    /** Where the gateway says the clearance. @type {(sample: import("../messages.d.ts").StateSample) => string} */
    this.clearancePath = () => "api/clearance";
  }

  /**
   * Begin a goal.
   *
   * @param {AnyTask} task Its task.
   * @param {{timeout?: number | null}} [options] Limits.
   * @returns {Promise<GoalValue>} The goal as it begins.
   * @throws {NoLeaseError} This page does not command the arm.
   * @throws {RequestError} The owner refuses it.
   */
  async start(task, options = {}) {
    const result = await this.request({ kind: "start", task, timeout: options.timeout ?? null });
    return result.goal;
  }

  /**
   * Send a command that needs the lease.
   *
   * @param {import("../messages.d.ts").AnyCommand} command The command.
   * @returns {Promise<any>} The result.
   */
  request(command) {
    if (this.arm.epoch === null) return Promise.reject(new NoLeaseError(text("error.no_lease")));
    return this.connection.request(command, this.arm.epoch);
  }

  /**
   * Ask a question, which needs no lease.
   *
   * @param {import("../messages.d.ts").AnyCommand} command The question.
   * @returns {Promise<any>} The result.
   */
  ask(command) {
    return this.connection.request(command);
  }

  /**
   * Wait for the end of a goal.
   *
   * @param {number} number The goal.
   * @param {((share: number) => void) | null} [progressed] Called with the share of it that is done, 0 to 1, several times
   *   a second; NaN if it is not known.
   * @returns {Promise<GoalValue>} As it ended.
   */
  ended(number, progressed = null) {
    return new Promise((resolve) => {
      let done = false;
      // No event reports the progress.
      const ask = () =>
        this.ask({ kind: "get_goal", goal: number }).then(({ goal }) => {
          if (!done) progressed?.(goal.progress ?? NaN);
        }, () => {});
      const timer = progressed && setInterval(ask, PROGRESS);
      const look = () => {
        const goal = this.arm.goals.get(number);
        if (!goal || !["succeeded", "cancelled", "failed"].includes(goal.status)) return;
        done = true;
        if (timer !== null) clearInterval(timer);
        forget();
        resolve(goal);
      };
      const forget = this.arm.on("goals", look);
      look();
    });
  }

  /**
   * Do something for the person, and show why if it fails.
   *
   * @param {() => Promise<unknown>} work What to do.
   * @returns {Promise<boolean>} Whether it was done.
   */
  async attempt(work) {
    try {
      await work();
      return true;
    } catch (error) {
      if (!EXPECTED.some((kind) => error instanceof kind)) console.error(error);
      this.say(error instanceof Error ? error.message : String(error), "error", lasting(error, this.arm));
      return false;
    }
  }

  /**
   * Show a message to the person.
   *
   * @param {string} message The message.
   * @param {"info" | "error"} [kind] Its kind.
   * @param {() => boolean} [holds] Whether it is still true; it disappears once it is not.
   */
  say(message, kind = "info", holds = () => true) {
    for (const listener of this.messageListeners) listener(message, kind, holds);
  }

  /**
   * End a motion that is held, such as a jog.
   *
   * @param {string} why Why, for messages.
   */
  interrupt(why) {
    this.interruptions += 1;
    for (const listener of this.interrupts) listener(why);
  }

  /**
   * Show a trajectory in the view; null removes it.
   *
   * @param {Preview | null} preview The trajectory.
   */
  showPreview(preview) {
    this.preview = preview;
    for (const listener of this.previewListeners) listener();
  }

  /**
   * Show another time of the trajectory in the view.
   *
   * @param {number} time Time in it [s].
   */
  seekPreview(time) {
    if (!this.preview) return;
    const { times } = this.preview.trajectory;
    this.preview.time = Math.min(Math.max(time, Math.min(times[0] ?? 0, 0)), times[times.length - 1] ?? 0);
    for (const listener of this.previewListeners) listener();
  }
}

/**
 * Return the check whether the reason of an error lasts.
 *
 * @param {unknown} error The error.
 * @param {Arm} arm The arm.
 * @returns {() => boolean} It; always true for an error whose reason is no state of the arm.
 */
function lasting(error, arm) {
  const reason = error instanceof RequestError ? error.failure.error : error instanceof Error ? error.constructor.name : "";
  const lasts = {
    NoLeaseError: () => !arm.commands,
    LeaseError: () => !arm.commands,
    ConnectionError: () => !arm.connection.open,
    FaultedError: () => arm.faulty,
    BusyError: () => (arm.sample?.moving ?? []).length > 0,
    NotEnabledError: () => !arm.sample?.enabled,
    NotHomedError: () => (arm.sample?.positions ?? []).some((position) => position === null),
  }[reason];
  // A request may be refused because of a state that the page has not seen.
  return lasts?.() ? lasts : () => true;
}

/**
 * @typedef {Object} Preview
 * @property {string} title Its name.
 * @property {import("../messages.d.ts").TrajectoryValue} trajectory The trajectory.
 * @property {number | null} plan Number of the owner's plan; null if it is none.
 * @property {(() => Promise<unknown>) | null} execute Begins it; null if it can only be shown.
 * @property {number} time Time in it that the view shows [s].
 * @property {string[]} [notes] Notes for the person.
 * @property {[number, string][]} [phases] Begin of each of its parts [s], and the part's name.
 * @property {string} [source] Part of the page that shows it.
 */
