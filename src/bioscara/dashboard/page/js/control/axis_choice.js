// Which axis a narrow page shows for the jog, where there is no room for all rows: radio buttons with the values.

/** @import { Axis } from "./jog_motion.js" */

import { h, setText } from "../dom.js";
import { text } from "../texts.js";

/** Radio buttons, one for each axis of the mode; a wide page hides them, as it shows all rows. */
export class AxisChoice {
  /** @param {(axis: number) => void} choose Called with the index of the axis that is chosen. */
  constructor(choose) {
    this.choose = choose;
    this.chosen = 0;
    /** @type {{radio: HTMLInputElement, value: HTMLElement}[]} */
    this.options = [];
    this.element = h("div", { class: "axis-choice", role: "radiogroup", "aria-label": text("jog.axis") });
  }

  /**
   * Offer the axes of another mode.
   *
   * @param {Axis[]} axes The axes.
   */
  fill(axes) {
    this.options = axes.map(({ id }, index) => {
      const value = h("span", { class: "number axis-value", id: `axis-${id}-value` });
      const radio = h("input", {
        type: "radio",
        name: "jog-axis",
        id: `axis-${id}`,
        value: id,
        "aria-describedby": value.id,
        on: { change: () => this.choose(index) },
      });
      return { radio, value };
    });
    this.element.replaceChildren(
      ...this.options.map(({ radio, value }, index) =>
        h("div", { class: "axis-option" }, radio, h("label", { for: radio.id, text: text(`jog.axis.${axes[index].id}`) }), value)
      ),
    );
    this.select(this.chosen);
  }

  /**
   * Mark an axis as the chosen one.
   *
   * @param {number} axis Its index.
   */
  select(axis) {
    this.chosen = axis;
    this.options[axis].radio.checked = true;
  }

  /**
   * Show the value of an axis.
   *
   * @param {number} axis Its index.
   * @param {string} words The value.
   */
  show(axis, words) {
    setText(this.options[axis].value, words);
  }
}
