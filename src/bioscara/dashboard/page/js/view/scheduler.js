// When the view is drawn: only after a change, only while visible, and seldom while that could delay a press.

/** Least time between two frames [ms]: as a rule, and where drawing is slow or something is pressed. */
const FRAME = 1000 / 30;
const SELDOM = 200;
/** While a slow view is turned by hand [ms]. */
const TURNING = 1000 / 15;
/** A frame that takes longer is slow [ms], and this many in a row make the view slow. */
const SLOW = 40;
const IN_A_ROW = 8;

/** Draws on request. */
export class Scheduler {
  /**
   * @param {HTMLElement} element The drawn element; nothing is drawn while it cannot be seen.
   * @param {() => void} draw Draws it.
   */
  constructor(element, draw) {
    this.element = element;
    this.draw = draw;
    /** Called once when frames take too long. */
    this.becameSlow = () => {};
    this.slow = false;
    /** Whether the person turns the view, by which slow frames are allowed more often. */
    this.turning = false;
    /** Number of drawn frames, for tests. */
    this.frames = 0;
    this.visible = true;
    this.wanted = false;
    this.waiting = false;
    this.last = -Infinity;
    this.late = 0;
    new IntersectionObserver((entries) => this.#seen(entries[entries.length - 1].isIntersecting)).observe(element);
    document.addEventListener("visibilitychange", () => this.#wake());
  }

  /** Draw soon. */
  request() {
    this.wanted = true;
    this.#wake();
  }

  /** Whether it can be seen. */
  get seen() {
    return this.visible && !document.hidden && this.element.offsetParent !== null;
  }

  get #period() {
    if (document.documentElement.dataset.pressed) return SELDOM;
    if (this.slow) return this.turning ? TURNING : SELDOM;
    return FRAME;
  }

  /** @param {boolean} seen */
  #seen(seen) {
    this.visible = seen;
    this.#wake();
  }

  #wake() {
    if (!this.wanted || this.waiting || !this.seen) return;
    this.waiting = true;
    const rest = this.last + this.#period - performance.now();
    // Waiting by a timer leaves the frames between to input events.
    if (rest > 8) setTimeout(() => requestAnimationFrame(() => this.#frame()), rest - 8);
    else requestAnimationFrame(() => this.#frame());
  }

  #frame() {
    this.waiting = false;
    if (!this.wanted || !this.seen) return;
    this.wanted = false;
    this.last = performance.now();
    this.frames += 1;
    this.draw();
    requestAnimationFrame(() => this.#judge(performance.now() - this.last));
    this.#wake();
  }

  /** @param {number} took */
  #judge(took) {
    this.late = took > SLOW ? this.late + 1 : 0;
    if (this.slow || this.late < IN_A_ROW) return;
    this.slow = true;
    this.becameSlow();
  }
}
