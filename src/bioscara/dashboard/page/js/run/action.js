// Buttons that say why they do nothing, and fields for lengths and angles.

/** @import { App } from "../app.js" */

import { refusal } from "../control/allowed.js";
import { button, h } from "../dom.js";
import { DEGREE, MM } from "../format.js";

/** The state of the arm that an action requires. @typedef {{homed?: boolean, enabled?: boolean, idle?: boolean, extra?: () => string}} Needs */

/**
 * Return a button for a command. It can be pressed at any time: where the arm does not allow it, it says why.
 *
 * @param {App} app The page.
 * @param {string} label Its text.
 * @param {() => Promise<unknown>} work Sends the command.
 * @param {Needs & {attributes?: Object<string, any>}} [needs] Its conditions; by default all.
 * @returns {HTMLButtonElement} The button.
 */
export function action(app, label, work, { homed = true, enabled = true, idle = true, extra = () => "", attributes = {} } = {}) {
  const why = () => refusal(app, { homed, enabled, idle }) || extra();
  const made = button(label, () => {
    const reason = why();
    if (reason) app.say(`${label}: ${reason}`, "error", () => why() === reason);
    else app.attempt(work);
  }, attributes);
  let former = "";
  const update = () => {
    const reason = why();
    if (reason === former && made.hasAttribute("aria-disabled")) return;
    former = reason;
    made.setAttribute("aria-disabled", String(reason !== ""));
    made.title = reason;
  };
  app.arm.follow(["sample", "link", "lease"], update);
  return made;
}

/**
 * A field for a length or an angle; read in SI units.
 *
 * @typedef {Object} Quantity
 * @property {HTMLElement} element The field with its label.
 * @property {HTMLInputElement} input The field.
 * @property {() => number} value The value [m or rad, or as it is]; NaN where it is none.
 * @property {(value: number) => void} set Shows a value.
 */

/**
 * Return what reads a field, and fills it in: the value that it was given, as long as its text is that of this value.
 *
 * A field shows fewer digits than a value has; rounded, it may be beyond a limit at which the arm stands.
 *
 * @param {{value: string}} input The field.
 * @param {number} factor Its unit in SI units.
 */
export function exactly(input, factor) {
  let exact = NaN;
  let shown = "";
  return {
    value: () => (input.value.trim() === "" ? NaN : input.value === shown ? exact : Number(input.value) * factor),
    /** @param {number} given */
    set: (given) => {
      exact = given;
      input.value = shown = String(Number((given / factor).toFixed(2)));
    },
  };
}

/**
 * Return a field for a quantity.
 *
 * @param {string} label Its name.
 * @param {"mm" | "°" | "g" | "%" | "s"} unit The unit that people read.
 * @param {{value?: number, min?: number, max?: number, step?: number, id?: string}} [options] In that unit.
 * @returns {Quantity} The field.
 */
export function quantity(label, unit, { value, min, max, step = 0.1, id } = {}) {
  const factor = { "mm": MM, "°": DEGREE, "g": 1e-3, "%": 0.01, "s": 1 }[unit];
  const input = h("input", { type: "number", id, min, max, step: "any", value, inputmode: "decimal", "data-step": step });
  const element = h("label", { class: "field" }, h("span", { class: "field-name", text: label }), input,
    h("span", { class: "dim", text: unit }));
  return { element, input, ...exactly(input, factor) };
}

/**
 * Return a part of a panel.
 *
 * @param {string} title Its title.
 * @param {...(Node | string)} children Its children.
 */
export function card(title, ...children) {
  return h("section", { class: "card column", "aria-label": title }, h("h2", { text: title }), ...children);
}
