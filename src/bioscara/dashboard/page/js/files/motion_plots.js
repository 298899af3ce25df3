// Plots of a motion that is known as a whole, position and velocity against the limits of the arm.

/** @import { App } from "../app.js" */
/** @import { TrajectoryValue } from "../../messages.d.ts" */
/** @import { Quantity } from "../plots/quantities.js" */

import { button, h } from "../dom.js";
import { Chart } from "../plots/chart.js";
import { jointLine } from "../plots/quantities.js";
import { text } from "../texts.js";
import { TrajectoryCurve } from "../view/trajectory_curve.js";

/** Points of a drawn line. */
const POINTS = 1500;

/**
 * A motion as rows of numbers.
 *
 * @typedef {Object} Rows
 * @property {string[]} names The joints.
 * @property {ArrayLike<number>} times Times [s].
 * @property {(number | null)[][]} positions For each time one for each joint [rad or m].
 * @property {(number | null)[][]} velocities Likewise [rad/s or m/s].
 */

/** The plots. */
export class MotionPlots {
  /** @param {App} app The page. */
  constructor(app) {
    this.app = app;
    /** @type {Rows | null} */
    this.rows = null;
    /** @type {Chart[]} */
    this.charts = [];
    this.limits = true;
    /** @type {import("../plots/chart.js").View | null} */
    this.view = null;
    this.places = h("div", { class: "column plots" });
    this.whole = button(text("files.whole"), () => this.#seen(this.#begin, this.#end));
    this.whole.hidden = true;
    const limits = h("input", { type: "checkbox", checked: true, on: { change: () => this.#limit(limits.checked) } });
    this.element = h("div", { class: "column motion-plots" },
      h("div", { class: "row" }, h("label", {}, limits, text("files.with_limits")), this.whole), this.places);
    new ResizeObserver(() => {
      for (const chart of this.charts) chart.resize();
    }).observe(this.places);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      for (const chart of this.charts) chart.rebuild();
      this.#draw();
    });
  }

  /**
   * Plot a motion; null removes the plots.
   *
   * @param {Rows | null} rows The motion.
   */
  show(rows) {
    for (const chart of this.charts) chart.destroy();
    this.charts = [];
    this.places.replaceChildren();
    this.rows = rows;
    this.whole.hidden = true;
    if (!rows || rows.times.length < 2) return;
    const { names } = rows;
    const quantities = [this.#quantity("position", names, 0), this.#quantity("velocity", names, names.length)];
    this.view = {
      times: Float64Array.from(rows.times),
      zero: 0,
      from: this.#begin,
      to: this.#end,
      columns: quantities.flatMap(({ lines }, which) =>
        lines.map(({ factor }, joint) => column(which ? rows.velocities : rows.positions, joint, factor))
      ),
    };
    for (const quantity of quantities) {
      const title = text(`files.${quantity.id}`);
      const place = h("div", { class: "plot", role: "img", "aria-label": title });
      this.places.append(h("section", {}, h("h3", { text: title }), place));
      this.charts.push(new Chart(place, quantity, (from, to) => this.#seen(from, to)));
    }
    this.#draw();
  }

  /** @param {boolean} shown */
  #limit(shown) {
    this.limits = shown;
    this.#draw();
  }

  get #begin() {
    return this.rows?.times[0] ?? 0;
  }

  get #end() {
    return this.rows?.times[this.rows.times.length - 1] ?? 1;
  }

  /**
   * @param {number} from
   * @param {number} to
   */
  #seen(from, to) {
    if (!this.view) return;
    this.view.from = Math.max(from, this.#begin);
    this.view.to = Math.min(to, this.#end);
    this.whole.hidden = this.view.from <= this.#begin && this.view.to >= this.#end;
    this.#draw();
  }

  #draw() {
    if (!this.view) return;
    for (const chart of this.charts) {
      chart.limits = this.limits;
      chart.draw(this.view);
    }
  }

  /**
   * @param {"position" | "velocity"} id
   * @param {string[]} names
   * @param {number} first
   * @returns {Quantity}
   */
  #quantity(id, names, first) {
    const speed = id === "velocity";
    const line = (/** @type {string} */ name, /** @type {number} */ index) => {
      const joint = this.app.arm.joints.find((each) => each.name === name);
      const limits = !joint ? [] : speed ? [-joint.max_velocity, joint.max_velocity] : [joint.lower, joint.upper];
      return jointLine({ name, unit: joint?.unit ?? "rad" }, index, first + index, speed ? "/s" : "", limits);
    };
    return { id, lines: names.map(line) };
  }
}

/**
 * @param {(number | null)[][]} rows
 * @param {number} joint
 * @param {number} factor
 */
function column(rows, joint, factor) {
  return Float32Array.from(rows, (row) => {
    const value = row[joint];
    return value === null ? NaN : value / factor;
  });
}

/**
 * Return a trajectory as rows: the curve between its points as the arm would follow it.
 *
 * @param {TrajectoryValue} trajectory The trajectory.
 * @returns {Rows} The rows.
 */
export function rowsOf(trajectory) {
  const curve = new TrajectoryCurve(trajectory);
  const { joint_names: names } = trajectory;
  const count = Math.max(2, Math.min(POINTS, 40 * trajectory.times.length));
  const times = Array.from({ length: count }, (_, index) => curve.begin + ((curve.duration - curve.begin) * index) / (count - 1));
  const positions = times.map((time) => {
    const at = curve.at(time);
    return names.map((name) => at[name]);
  });
  const last = count - 1;
  const velocities = times.map((_, index) => {
    const [before, after] = [Math.max(index - 1, 0), Math.min(index + 1, last)];
    return names.map((_name, joint) => {
      const [from, to] = [positions[before][joint], positions[after][joint]];
      return from === null || to === null ? null : (to - from) / (times[after] - times[before]);
    });
  });
  return { names, times, positions, velocities };
}
