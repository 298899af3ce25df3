// The joints within their ranges: sliders to move the shown arm, or bars.

import { h, setText } from "../dom.js";
import { DEGREE, MM, position } from "../format.js";
import { text } from "../texts.js";

/** Share of a joint's range at each end within which it is near the limit, and excess that is rounding [rad or m]. */
const NEAR = 0.05;
const ROUNDING = 1e-6;

/** @typedef {{name: string, unit: string, lower: number, upper: number}} Range In rad or m. */

/** The rows. */
export class JointRanges {
  /**
   * @param {Range[]} ranges The joints.
   * @param {((name: string, value: number) => void) | null} move Called when a slider is moved [rad or m]; null for bars.
   */
  constructor(ranges, move) {
    this.rows = ranges.map((range) => {
      const { name, unit, lower, upper } = range;
      const factor = unit === "m" ? MM : DEGREE;
      const bounds = { min: (lower / factor).toFixed(1), max: (upper / factor).toFixed(1),
        "aria-label": text("viewer.joint", { name, unit: unit === "m" ? "mm" : "°" }) };
      const control = move ? h("input", { type: "range", step: 0.1, ...bounds }) : h("meter", bounds);
      if (control instanceof HTMLInputElement) {
        // The ends of a slider are rounded.
        control.addEventListener("input", () => move?.(name, Math.min(Math.max(control.valueAsNumber * factor, lower), upper)));
      }
      const value = h("span", { class: "number" });
      const words = h("span", { class: "range dim" });
      return { range, factor, control, value, words,
        element: h("div", { class: "viewed-joint" }, h("span", { text: name }), value, control, words) };
    });
    this.elements = this.rows.map(({ element }) => element);
  }

  /** @param {Record<string, number | null>} positions By joint [rad or m]. */
  show(positions) {
    for (const { range: { name, unit, lower, upper }, factor, control, value, words, element } of this.rows) {
      const at = positions[name];
      if (at === null || at === undefined) continue;
      const room = Math.min(at - lower, upper - at);
      const level = room < -ROUNDING ? "beyond" : room < NEAR * (upper - lower) ? "near" : "free";
      const shown = position(at, unit);
      if (element.classList.item(1) !== level) element.className = `viewed-joint ${level}`;
      setText(value, shown);
      if (document.activeElement !== control) control.value = /** @type {any} */ (String(at / factor));
      control.setAttribute("aria-valuetext", shown);
      setText(words,
        text(`viewer.${level}`, { lower: position(lower, unit), upper: position(upper, unit), room: position(Math.max(room, 0), unit) }));
    }
  }
}
