// Hold to run, without a page: requirements jog_r1 to jog_r10. A press opens a jog at the owner, beats keep it alive,
// and each end of the press ends the jog. The owner ends it too, when no beat has come for EXPIRY.

import { text } from "../texts.js";

/** Time between two beats [ms]. */
export const BEAT = 50;
/** Time after which the owner ends a jog without beats [s]. */
export const EXPIRY = 0.25;
/** Time for which beats may wait for the network: messages of this turn of the page wait, too [ms]. */
const PATIENCE = 200;

/**
 * A velocity: of the joints [rad/s or m/s], or of the tool in the base [m/s, rad/s].
 *
 * @typedef {{joints: [number, number, number, number]} | {tool: [number, number, number, number]}} Velocity
 *
 * The functions of the page that a hold calls.
 *
 * @typedef {Object} HoldPort
 * @property {() => number} now Time that never goes back [ms].
 * @property {() => string} refusal Why nothing may be moved; empty if it may.
 * @property {() => string} doubt Why nothing may move on, as an old sample or no lease; empty if it may.
 * @property {() => string} backlog Why a beat may not be sent now, as others still wait; empty if it may.
 * @property {(velocity: Velocity) => Promise<number>} start Opens a jog; returns the number of its goal.
 * @property {(goal: number, velocity: Velocity) => Promise<unknown>} beat Keeps it alive, with its velocity.
 * @property {(goal: number) => void} end Ends it.
 * @property {(goal: number) => Promise<unknown>} over Waits until the arm rests again.
 * @property {() => void} changed Called after each change.
 */

/** @typedef {"idle" | "waiting" | "starting" | "running"} HoldState */

/** The one press that moves the arm. */
export class Hold {
  /** @param {HoldPort} port Functions of the page. */
  constructor(port) {
    this.port = port;
    /** @type {HoldState} */
    this.state = "idle";
    /** Why the latest press has ended, or did nothing. */
    this.why = "";
    /** Keys, pointers and sticks that are pressed, also those that move nothing any more. @type {Set<string>} */
    this.down = new Set();
    /** @type {() => Velocity} */
    this.velocity = () => ({ joints: [0, 0, 0, 0] });
    /** @type {number | null} */
    this.goal = null;
    /** Number of the press: it distinguishes answers to a former one. */
    this.count = 0;
    this.beaten = 0;
    /** The former jog, until the arm rests. @type {Promise<unknown> | null} */
    this.former = null;
  }

  /** Whether a press moves the arm, or is about to. */
  get active() {
    return this.state !== "idle";
  }

  /**
   * Take a press; ignored if it is one already, as a key that repeats.
   *
   * @param {string} source Which key, pointer or stick.
   * @param {() => Velocity} velocity Returns the velocity, asked for at each beat.
   */
  press(source, velocity) {
    if (this.down.has(source)) return;
    this.down.add(source);
    if (this.down.size > 1) {
      const second = text("jog.end.second");
      if (this.active) this.end(second);
      else this.#become("idle", second);
      return;
    }
    const why = this.port.refusal() || this.port.doubt();
    if (why) {
      this.#become("idle", why);
      return;
    }
    this.velocity = velocity;
    this.count += 1;
    if (this.former === null) this.#open();
    else this.#become("waiting", "");
  }

  /**
   * Take the end of a press.
   *
   * @param {string} source Which key, pointer or stick.
   */
  release(source) {
    if (this.down.delete(source) && this.active) this.end("");
  }

  /** Forget all presses: their releases may never come. */
  forget() {
    this.down.clear();
  }

  /**
   * End the jog. Only a new press moves the arm again.
   *
   * @param {string} why Why, for the person; empty for a release.
   */
  end(why) {
    // A later event does not replace the reason why a press did nothing.
    if (!this.active) return;
    this.count += 1;
    const { goal } = this;
    this.goal = null;
    if (goal !== null) this.port.end(goal);
    this.#become("idle", why);
  }

  /** Send a beat if it is due and allowed; called each BEAT by the main thread, so that a page that hangs sends none. */
  tick() {
    if (!this.active) return;
    const late = this.port.now() - this.beaten > 1000 * EXPIRY;
    const why = this.port.doubt() || (this.goal !== null && late ? text("jog.end.slow") : "");
    if (why) {
      this.end(why);
      return;
    }
    if (this.goal === null) return;
    const backlog = this.port.backlog();
    if (backlog) {
      if (this.port.now() - this.beaten > PATIENCE) this.end(backlog);
      return;
    }
    const press = this.count;
    this.beaten = this.port.now();
    this.port.beat(this.goal, this.velocity()).catch((error) => {
      if (press === this.count) this.end(error.message);
    });
  }

  #open() {
    const press = this.count;
    this.#become("starting", "");
    const begun = this.port.start(this.velocity());
    this.former = begun.then(
      (goal) => {
        this.beaten = this.port.now();
        if (press === this.count) {
          this.goal = goal;
          this.#become("running", "");
        } else {
          // Released before the owner had answered.
          this.port.end(goal);
        }
        return this.port.over(goal);
      },
      (error) => {
        if (press === this.count) this.end(error.message);
      },
    ).then(() => this.#rest(press));
  }

  /** @param {number} press */
  #rest(press) {
    this.former = null;
    // The owner has ended it while it was held.
    if (press === this.count && this.active) this.end(text("jog.end.ended"));
    if (this.state === "waiting") this.#open();
  }

  /**
   * @param {HoldState} state
   * @param {string} why
   */
  #become(state, why) {
    this.state = state;
    this.why = why;
    this.port.changed();
  }
}
