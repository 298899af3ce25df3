// One plot: some lines over time, with their limits, by uPlot.

/** @import { Line, Quantity } from "./quantities.js" */

import uPlot from "../../vendor/uplot.js";
import { number } from "../format.js";
import { text } from "../texts.js";

/** Height of a plot [px]. */
const HEIGHT = 190;
/** Dashes of the joints' lines, so that they differ also without colour [px]. */
const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3]];
/** Share of its range by which an axis is longer than the values. */
const MARGIN = 0.06;
/** Least such length, in the unit that people read: noise of the encoders fills no plot. */
const LEAST = 0.01;
/** Shortest drag that zooms [px]. */
const DRAG = 6;
const SYNC = "plots";

/**
 * Rows that are plotted, and the part of them that is seen.
 *
 * @typedef {Object} View
 * @property {Float64Array} times Times [s].
 * @property {Float32Array[]} columns Columns.
 * @property {number} from Begin of the visible time [s].
 * @property {number} to End of it [s].
 * @property {number} zero Time that the axis shows as 0 [s].
 */

/** A plot of one quantity. */
export class Chart {
  /**
   * @param {HTMLElement} host Where it is.
   * @param {Quantity} quantity Its quantity.
   * @param {(from: number, to: number) => void} zoom Called when a part is chosen by dragging.
   */
  constructor(host, quantity, zoom) {
    this.host = host;
    this.quantity = quantity;
    this.zoom = zoom;
    this.zero = 0;
    /** @type {boolean} */
    this.limits = true;
    /** @type {boolean[]} */
    this.shown = quantity.lines.map(() => true);
    this.plot = this.#make();
  }

  /** Make the plot again, as after a change of colours. */
  rebuild() {
    this.plot.destroy();
    this.plot = this.#make();
  }

  /** Remove the plot. */
  destroy() {
    this.plot.destroy();
  }

  /**
   * Draw.
   *
   * @param {View} view What to draw.
   */
  draw(view) {
    this.zero = view.zero;
    const lines = this.quantity.lines;
    const data = /** @type {any} */ ([view.times, ...lines.map((line) => view.columns[line.column])]);
    this.plot.batch(() => {
      this.plot.setData(data, false);
      this.plot.setScale("x", { min: view.from, max: view.to });
    });
  }

  /**
   * Show the lines of some joints only.
   *
   * @param {(line: Line) => boolean} wanted Whether a line is shown.
   */
  select(wanted) {
    this.quantity.lines.forEach((line, index) => {
      this.shown[index] = wanted(line);
      this.plot.setSeries(index + 1, { show: this.shown[index] });
    });
  }

  /** Fit the width of the place. */
  resize() {
    const width = this.host.clientWidth;
    if (width > 0 && width !== this.plot.width) this.plot.setSize({ width, height: HEIGHT });
  }

  #make() {
    const style = getComputedStyle(document.documentElement);
    const colour = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const units = [...new Set(this.quantity.lines.map((line) => line.unit))];
    const axis = { stroke: colour("--text"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line") },
      font: "12px sans-serif" };
    /** @type {uPlot.Options} */
    const options = {
      width: Math.max(this.host.clientWidth, 100),
      height: HEIGHT,
      scales: {
        x: { time: false, auto: false, min: 0, max: 1 },
        ...Object.fromEntries(units.map((unit) => [unit, { range: (_plot, low, high) => this.#range(unit, low, high) }])),
      },
      axes: [
        { ...axis, size: 34, splits: (_plot, _index, from, to, step) => this.#ticks(from, to, step),
          values: (_plot, splits, _index, _space, step) => splits.map((at) => label(at - this.zero, step)) },
        ...units.map((unit, index) => /** @type {uPlot.Axis} */ ({
          ...axis,
          scale: unit,
          side: index === 0 ? 3 : 1,
          size: 56,
          label: unit,
          labelSize: 16,
          labelFont: "12px sans-serif",
          grid: { ...axis.grid, show: index === 0 },
          filter: (_, splits) => (this.#has(unit) ? splits : splits.map(() => null)),
        })),
      ],
      series: [
        { label: text("plots.time"), value: (_, at) => (at === null ? "–" : `${number(at - this.zero, 2)} s`) },
        ...this.quantity.lines.map((line, index) => /** @type {uPlot.Series} */ ({
          label: line.joint < 0 ? text(`plots.line_${line.name}`) : line.name,
          scale: line.unit,
          stroke: colour(`--plot-${index + 1}`),
          width: 1.5,
          dash: DASHES[index % DASHES.length],
          show: this.shown[index],
          points: { show: false },
          gaps: (plot, series, from, to) => gaps(plot, series, from, to),
          value: (_, value) => (value === null || Number.isNaN(value) ? "–" : `${number(value, 2)} ${line.unit}`),
        })),
      ],
      cursor: {
        drag: { x: true, y: false, setScale: false },
        // The other plots follow the pointer, and only this one is dragged over.
        sync: { key: SYNC, filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } },
        bind: { dblclick: () => null },
        points: { show: false },
      },
      hooks: {
        setSelect: [(plot) => this.#selected(plot)],
        draw: [(plot) => this.#drawLimits(plot)],
      },
    };
    return new uPlot(options, /** @type {any} */ ([[], ...this.quantity.lines.map(() => [])]), this.host);
  }

  /**
   * Return whether a line of a unit is shown.
   *
   * @param {string} unit
   */
  #has(unit) {
    return this.quantity.lines.some((line, index) => line.unit === unit && this.shown[index]);
  }

  /** @param {uPlot} plot */
  #selected(plot) {
    const { left, width } = plot.select;
    if (width >= DRAG) this.zoom(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  }

  /**
   * Ticks at round distances from the newest value, so that they stand still while time passes.
   *
   * @param {number} from
   * @param {number} to
   * @param {number} step
   */
  #ticks(from, to, step) {
    const ticks = [];
    for (let at = Math.ceil((from - this.zero) / step) * step; at <= to - this.zero + 1e-9; at += step) ticks.push(this.zero + at);
    return ticks;
  }

  /**
   * Return the ends of a vertical axis: of the values that are seen, and of their limits if these are wanted.
   *
   * @param {string} unit
   * @param {number | null} low
   * @param {number | null} high
   * @returns {[number, number]}
   */
  #range(unit, low, high) {
    let [least, most] = low === null || high === null || Number.isNaN(low) ? [Infinity, -Infinity] : [low, high];
    if (this.limits) {
      this.quantity.lines.forEach((line, index) => {
        if (line.unit !== unit || !this.shown[index]) return;
        least = Math.min(least, ...line.limits);
        most = Math.max(most, ...line.limits);
      });
      if (this.quantity.id === "timing") least = Math.min(least, 0);
    }
    if (!(least <= most)) return [-1, 1];
    const margin = Math.max((most - least) * MARGIN, LEAST);
    return [least - margin, most + margin];
  }

  /** @param {uPlot} plot */
  #drawLimits(plot) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
    ctx.globalAlpha = 0.6;
    this.quantity.lines.forEach((line, index) => {
      if (!this.shown[index]) return;
      ctx.strokeStyle = /** @type {string} */ (/** @type {any} */ (plot.series[index + 1]).stroke());
      for (const limit of line.limits) {
        const y = plot.valToPos(limit, line.unit, true);
        if (!(y >= bbox.top && y <= bbox.top + bbox.height)) continue;
        ctx.beginPath();
        ctx.moveTo(bbox.left, y);
        ctx.lineTo(bbox.left + bbox.width, y);
        ctx.stroke();
      }
    });
    ctx.restore();
  }
}

/**
 * Return where a line is interrupted, as its values are unknown.
 *
 * uPlot looks for null, which an array of numbers cannot have.
 *
 * @param {uPlot} plot
 * @param {number} series
 * @param {number} from
 * @param {number} to
 * @returns {[number, number][]} In pixels of the canvas.
 */
function gaps(plot, series, from, to) {
  const times = plot.data[0];
  const values = plot.data[series];
  /** @type {[number, number][]} */
  const found = [];
  for (let index = from; index <= to; index += 1) {
    if (!Number.isNaN(values[index])) continue;
    const begin = index;
    while (index < to && Number.isNaN(values[index + 1])) index += 1;
    const left = plot.valToPos(times[Math.max(begin - 1, 0)], "x", true);
    const right = plot.valToPos(times[Math.min(index + 1, times.length - 1)], "x", true);
    found.push([left, right]);
  }
  return found;
}

/**
 * @param {number} seconds
 * @param {number} step
 */
function label(seconds, step) {
  const whole = Math.abs(seconds);
  const sign = seconds < -step / 2 ? "−" : "";
  const digits = [0, 1].find((count) => Number.isInteger(step * 10 ** count)) ?? 2;
  if (whole < 120) return `${sign}${number(whole, digits)} s`;
  const rest = Math.round(whole % 60);
  return `${sign}${Math.floor(whole / 60)} min${rest ? ` ${rest} s` : ""}`;
}
