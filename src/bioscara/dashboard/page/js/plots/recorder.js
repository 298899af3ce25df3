// The rows behind the plots: from the owner's ring, then from the samples that arrive.

/** @import { App } from "../app.js" */
/** @import { History } from "../../messages.d.ts" */
/** @import { Quantity } from "./quantities.js" */

import { columnsOfHistory, columnsOfSample, quantitiesOf } from "./quantities.js";
import { Ring } from "./ring.js";

/** How far the plots go back [s]. */
export const LONGEST = 600;
/** Least time between two samples that arrive [s]. */
const PERIOD = 0.04;
/** Rows asked of the owner. */
const POINTS = 1500;

/** Keeps the rows while the plots are visible. */
export class Recorder {
  /**
   * @param {App} app The page.
   * @param {() => void} changed Called when there are other quantities.
   */
  constructor(app, changed) {
    this.app = app;
    this.changed = changed;
    /** @type {Quantity[]} */
    this.quantities = [];
    /** @type {Ring | null} */
    this.ring = null;
    /** @type {((sample: import("../../messages.d.ts").StateSample, column: number) => number | null) | null} */
    this.read = null;
    this.running = false;
    this.loading = 0;
    /** Why there is nothing from before; empty if there is. */
    this.problem = "";
  }

  /** Begin, with the history of the owner. */
  async start() {
    this.running = true;
    const { arm } = this.app;
    if (!arm.description || !arm.sample) return;
    const turn = ++this.loading;
    /** @type {History | null} */
    let history = null;
    this.problem = "";
    try {
      const begin = arm.sample.time - LONGEST;
      history = await this.app.ask({ kind: "get_history", begin, end: null, points: POINTS });
    } catch (error) {
      this.problem = error instanceof Error ? error.message : String(error);
    }
    if (turn !== this.loading || !arm.description) return;
    this.#make();
    if (history) this.#take(history);
    this.changed();
  }

  /** End; the rows are void, as the next ones come after a gap. */
  stop() {
    this.running = false;
    this.loading += 1;
  }

  /** Add the newest sample. */
  add() {
    const { sample } = this.app.arm;
    const { ring, read } = this;
    if (!this.running || !ring || !sample || !read) return;
    ring.push(sample.time, (column) => read(sample, column));
  }

  #make() {
    const { description } = this.app.arm;
    if (!description) return;
    this.quantities = quantitiesOf(description);
    const columns = this.quantities.reduce((sum, { lines }) => sum + lines.length, 0);
    if (this.ring?.columns.length === columns) this.ring.clear();
    else this.ring = new Ring(LONGEST / PERIOD + POINTS, columns);
    this.read = columnsOfSample(this.quantities);
  }

  /** @param {History} history */
  #take(history) {
    const read = columnsOfHistory(this.quantities, history);
    history.time.forEach((time, row) => {
      this.ring?.push(time, (column) => read(column, row));
    });
  }
}
