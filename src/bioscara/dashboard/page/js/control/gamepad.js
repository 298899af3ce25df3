// Jog by a gamepad: a deadman button and two sticks; requirement jog_r10. Reads the pad, knows no page.

/** Buttons of which one has to be held: the shoulders of a standard gamepad. */
const DEADMAN = [4, 5];
/** Deflection below which a stick counts as centred. */
const CENTRE = 0.15;
/** Time without news of the gamepad after which it counts as frozen [ms]. */
const FROZEN = 200;

/**
 * Why a gamepad moves nothing: there is none, all has to be released first, it is frozen, its deadman button is not held.
 *
 * @typedef {"none" | "centre" | "frozen" | "released" | ""} PadState
 */

/** The request of a gamepad, from one reading to the next. */
export class GamepadReader {
  constructor() {
    /** Shares of the speed: x, y, z, yaw or j1 to j4, -1 to 1. */
    this.share = [0, 0, 0, 0];
    /** @type {PadState} */
    this.state = "none";
    this.index = -1;
    this.stamp = NaN;
    this.news = 0;
  }

  /** Whether it asks for motion. */
  get held() {
    return this.state === "" && this.share.some((part) => part !== 0);
  }

  /** Forget that its sticks were centred, as after a connection or a hidden page. */
  reset() {
    this.state = this.index < 0 ? "none" : "centre";
    this.share = [0, 0, 0, 0];
  }

  /**
   * Look at the gamepads.
   *
   * @param {readonly (Gamepad | null)[]} pads Their states in the browser.
   * @param {number} now Time [ms].
   */
  look(pads, now) {
    const pad = pads.find((each) => each?.connected) ?? null;
    if (pad === null) {
      this.index = -1;
      this.reset();
      return;
    }
    if (pad.index !== this.index) {
      this.index = pad.index;
      this.reset();
    }
    if (pad.timestamp !== this.stamp) {
      this.stamp = pad.timestamp;
      this.news = now;
    }
    const share = sharesOf(pad);
    const centred = share.every((part) => part === 0);
    const deadman = DEADMAN.some((each) => pad.buttons[each]?.pressed);
    if (this.state === "centre" || this.state === "frozen") {
      // All released once, so that a stuck stick or button cannot begin to move the arm.
      if (centred && !deadman) this.state = "released";
    } else if (!deadman) this.state = "released";
    else this.state = now - this.news > FROZEN && !centred ? "frozen" : "";
    this.share = this.state === "" ? share : [0, 0, 0, 0];
  }
}

/** @param {Gamepad} pad */
function sharesOf(pad) {
  // Left stick: forwards and to the left; right stick: up and turning.
  return [1, 0, 3, 2].map((axis) => {
    const value = -(pad.axes[axis] ?? 0);
    return Math.abs(value) < CENTRE ? 0 : value;
  });
}
