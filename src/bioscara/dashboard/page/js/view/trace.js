// Where the tool was in the last time.

/** @import { Pose } from "../../messages.d.ts" */

/** Time for which a place is kept [s], places that are kept, and their least distance [m]. */
const KEPT = 30;
export const TRACE_POINTS = 800;
const STEP = 5e-4;

/** The path of the tool; its room is allocated once. */
export class Trace {
  constructor() {
    /** x, y, z of each place [m], oldest first. */
    this.points = new Float32Array(3 * TRACE_POINTS);
    this.times = new Float64Array(TRACE_POINTS);
    this.count = 0;
  }

  /** Forget all places. */
  clear() {
    this.count = 0;
  }

  /**
   * Add a place if it is another one.
   *
   * @param {number} time Time of the arm [s].
   * @param {Pose} pose Pose of the tool.
   * @returns {boolean} Whether the trace has changed.
   */
  add(time, [x, y, z]) {
    const last = this.count - 1;
    if (last >= 0 && time < this.times[last]) this.clear();
    const dropped = this.#drop(time - KEPT);
    const end = 3 * (this.count - 1);
    const { points } = this;
    if (this.count && Math.hypot(points[end] - x, points[end + 1] - y, points[end + 2] - z) < STEP) return dropped;
    if (this.count === TRACE_POINTS) this.#shift(TRACE_POINTS >> 2);
    points.set([x, y, z], 3 * this.count);
    this.times[this.count] = time;
    this.count += 1;
    return true;
  }

  /** @param {number} before */
  #drop(before) {
    let old = 0;
    while (old < this.count && this.times[old] < before) old += 1;
    if (old) this.#shift(old);
    return old > 0;
  }

  /** @param {number} by */
  #shift(by) {
    this.points.copyWithin(0, 3 * by, 3 * this.count);
    this.times.copyWithin(0, by, this.count);
    this.count -= by;
  }
}
