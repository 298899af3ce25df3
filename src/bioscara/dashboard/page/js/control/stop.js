// STOP: requirements stop_s1 to stop_s6, without its button. Sends at once and until the owner has confirmed it.

/** Time without a message of the owner after which the socket is doubtful [ms]. */
export const DOUBTFUL = 300;
/** Time without a confirmation after which the page reports it [ms]. */
export const UNCONFIRMED = 300;
/** Time between two repetitions [ms]. */
export const REPEAT = 200;

/**
 * What STOP needs of the page.
 *
 * @typedef {Object} StopPort
 * @property {() => number} now Time that never goes back [ms].
 * @property {() => boolean} doubtful Whether the socket may not reach the owner.
 * @property {() => Promise<unknown>} bySocket Sends the stop on the socket; done when the owner has answered.
 * @property {() => Promise<unknown>} byPost Sends it by a request of its own.
 * @property {() => boolean | null} resting Whether the arm is at rest; null while that is unknown.
 * @property {() => void} changed Called after each change.
 */

/** @typedef {"idle" | "sent" | "unconfirmed" | "decelerating" | "resting"} StopState */

/** One STOP after another; a new press begins anew. */
export class Stop {
  /** @param {StopPort} port Functions of the page. */
  constructor(port) {
    this.port = port;
    /** @type {StopState} */
    this.state = "idle";
    /** When it was pressed [ms]. */
    this.pressed = 0;
    /** Time from the press to the confirmation [ms]; NaN without one. */
    this.took = NaN;
    /** Number of the press, which distinguishes late answers. */
    this.press = 0;
    this.sent = 0;
  }

  /** Stop all motion. Never refused, and never delayed. */
  stop() {
    this.press += 1;
    this.pressed = this.port.now();
    this.took = NaN;
    this.state = "sent";
    this.#send();
    this.port.changed();
  }

  /** Update its state; called often. */
  tick() {
    const { port, state } = this;
    const now = port.now();
    if (state === "sent" && now - this.pressed >= UNCONFIRMED) this.#become("unconfirmed");
    if ((state === "sent" || state === "unconfirmed") && now - this.pressed >= UNCONFIRMED && now - this.sent >= REPEAT) this.#send(true);
    if (state === "decelerating" && port.resting() === true) this.#become("resting");
  }

  /** Show nothing of it any more, once it is confirmed. */
  dismiss() {
    if (this.state === "resting" || this.state === "decelerating") this.#become("idle");
  }

  /** @param {boolean} [again] Whether it is repeated: on every way, as the first one did not arrive. */
  #send(again = false) {
    const { port, press } = this;
    this.sent = port.now();
    const ways = [port.bySocket];
    if (again || port.doubtful()) ways.push(port.byPost);
    for (const way of ways) way().then(() => this.#confirm(press), () => {});
  }

  /** @param {number} press */
  #confirm(press) {
    if (press !== this.press || !(this.state === "sent" || this.state === "unconfirmed")) return;
    this.took = this.port.now() - this.pressed;
    this.#become("decelerating");
  }

  /** @param {StopState} state */
  #become(state) {
    if (state === this.state) return;
    this.state = state;
    this.port.changed();
  }
}
