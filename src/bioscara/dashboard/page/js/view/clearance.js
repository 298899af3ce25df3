// The clearance of the arm: its nearest pair of bodies, asked for while that may change.

/** @import { App } from "../app.js" */

import { h, setText } from "../dom.js";
import { millimetres } from "../format.js";
import { text } from "../texts.js";

/** Least time between two questions [ms], and distance above the margin that counts as near [m]. */
const PERIOD = 200;
const NEAR = 0.02;
/** Time for which the gateway may use a scene of before [ms]. */
const SCENE = 1100;
/** Changes of a joint from which the clearance is asked for again [rad or m]. */
const MOVED = 2e-4;

/**
 * The answer of the gateway, with a word for it.
 *
 * @typedef {Object} Clearance
 * @property {number | null} distance Distance of the nearest pair [m]; null if there is no pair.
 * @property {string} link Name of the link.
 * @property {string} other Its counterpart: a zone, the table or a link.
 * @property {[number, number, number] | null} link_point Where the link is nearest [m].
 * @property {[number, number, number] | null} other_point Where its counterpart is.
 * @property {number} margin Distance that motions have to keep [m].
 * @property {"below" | "near" | "clear"} level Its word.
 */

/** Asks for the clearance and shows it as a number and a word. */
export class ClearanceReadout {
  /**
   * @param {App} app The page.
   * @param {() => boolean} seen Whether the view can be seen.
   * @param {(clearance: Clearance | null) => void} found Called with each answer; null if it is unknown.
   */
  constructor(app, seen, found) {
    this.app = app;
    this.seen = seen;
    this.found = found;
    this.element = h("span", { class: "badge view-clearance" });
    this.value = /** @type {Clearance | null} */ (null);
    this.asking = false;
    /** Time before which nothing is asked [ms]. */
    this.next = -Infinity;
    this.due = true;
    /** @type {number[]} */
    this.asked = [];
    /** @type {number | null} */
    this.revision = null;
    app.arm.on("workspace", () => this.#wait());
    app.arm.on("sample", () => this.#look());
    app.arm.on("link", () => {
      if (!app.arm.fresh) this.#take(null);
      else this.due = true;
    });
    this.#show();
  }

  /** The scene is another one: until the gateway has it too, the clearance is unknown. */
  #wait() {
    const revision = this.app.arm.workspace?.revision ?? null;
    if (revision === this.revision) return;
    this.revision = revision;
    this.next = performance.now() + SCENE;
    this.due = true;
    this.#take(null);
  }

  #look() {
    const { sample } = this.app.arm;
    if (!sample) return;
    if (sample.pose === null) {
      if (this.value) this.#take(null);
      return;
    }
    const moved = sample.positions.some((position, joint) => Math.abs(position - (this.asked[joint] ?? Infinity)) > MOVED);
    if (moved || this.due) this.#ask();
  }

  async #ask() {
    const { sample, fresh } = this.app.arm;
    if (this.asking || !fresh || !sample?.pose || !this.seen()) return;
    if (performance.now() < this.next) return;
    const { revision } = this;
    this.asking = true;
    this.due = false;
    this.next = performance.now() + PERIOD;
    this.asked = sample.positions;
    try {
      const answer = await fetch(this.app.clearancePath(sample));
      const found = answer.ok ? withLevel(await answer.json()) : null;
      // Of the scene of before.
      if (revision === this.revision) this.#take(found);
    } catch {
      // The link says that the gateway is gone; an unknown clearance is shown as unknown.
      this.#take(null);
    } finally {
      this.asking = false;
    }
  }

  /** @param {Clearance | null} clearance */
  #take(clearance) {
    this.value = clearance;
    this.found(clearance);
    this.#show();
  }

  #show() {
    const { value, element } = this;
    if (!value) {
      setText(element, text("view.clearance_unknown"));
      element.className = "badge view-clearance";
      return;
    }
    const { distance, link, other, level } = value;
    const kind = { below: "danger", near: "warn", clear: "good" }[level];
    if (element.dataset.level !== level) element.className = `badge view-clearance ${kind}`;
    element.dataset.level = level;
    setText(element, distance === null ? text("view.clearance_none") : text(`view.clearance_${level}`, {
      distance: millimetres(distance),
      link,
      other,
    }));
  }
}

/** @param {Omit<Clearance, "level">} answer @returns {Clearance} */
function withLevel(answer) {
  const { distance, margin } = answer;
  if (distance !== null && distance < margin) return { ...answer, level: "below" };
  return { ...answer, level: distance !== null && distance < margin + NEAR ? "near" : "clear" };
}
