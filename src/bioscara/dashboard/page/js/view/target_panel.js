// Fields of the target: all that dragging does, by numbers and buttons; and the plan to it.

/** @import { Pose } from "../../messages.d.ts" */
/** @import { Target } from "./target.js" */

import { button, h, setText } from "../dom.js";
import { DEGREE, MM } from "../format.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";

/** Steps that can be chosen, in mm or degrees. */
const STEPS = [0.1, 1, 10, 50];

/** Fields by their place in the pose, and the unit that people read. */
const AXES = [
  { name: "x", unit: MM, sign: "mm" },
  { name: "y", unit: MM, sign: "mm" },
  { name: "z", unit: MM, sign: "mm" },
  { name: "yaw", unit: DEGREE, sign: "°" },
];

/** The fields. */
export class TargetPanel {
  /** @param {Target} target The target. */
  constructor(target) {
    this.target = target;
    this.step = 10;
    /** @type {HTMLInputElement[]} */
    this.inputs = [];
    this.refusal = h("p", { class: "target-refusal card", role: "alert", hidden: true });
    this.planButton = button(text("view.make_plan"), () => target.plan(), { class: "primary" });
    this.element = h(
      "section",
      { class: "view-target card column", "aria-label": text("view.target_title"), hidden: true },
      ...AXES.map((_, axis) => this.#row(axis)),
      h("div", { class: "row" }, this.#steps(), button(text("view.to_tool"), () => target.toTool())),
      this.#kinds(),
      this.#speed(),
      h("div", { class: "row" }, this.planButton, copyButton(() => target.python)),
    );
    target.listeners.push(() => this.#update());
    this.#update();
  }

  /** @param {number} axis */
  #row(axis) {
    const { name, sign } = AXES[axis];
    const label = text(`view.target_${name}`);
    const input = h("input", { type: "number", step: "any", "aria-label": `${label} [${sign}]` });
    input.addEventListener("change", () => this.#set(axis, input.valueAsNumber));
    this.inputs.push(input);
    const press = (/** @type {number} */ direction) => () => this.#nudge(axis, direction);
    return h(
      "div",
      { class: "target-row" },
      h("span", { text: label, "aria-hidden": "true" }),
      button("−", press(-1), { "aria-label": text("view.less", { name: label }) }),
      input,
      button("+", press(1), { "aria-label": text("view.more", { name: label }) }),
      h("span", { class: "dim", text: sign, "aria-hidden": "true" }),
    );
  }

  #steps() {
    const select = h("select", { "aria-label": text("view.step") },
      ...STEPS.map((step) => h("option", { value: step, text: text("view.step_of", { step }), selected: step === this.step })));
    select.addEventListener("change", () => {
      this.step = Number(select.value);
    });
    return select;
  }

  #kinds() {
    const kinds = /** @type {const} */ (["ptp", "lin"]).map((kind) => {
      const input = h("input", { type: "radio", name: "target-kind", value: kind, checked: kind === this.target.kind });
      input.addEventListener("change", () => this.target.choose({ kind }));
      return h("label", {}, input, text(`view.kind_${kind}`));
    });
    return h("fieldset", { class: "target-kinds" }, h("legend", { class: "hidden-text", text: text("view.kind") }), ...kinds);
  }

  #speed() {
    const shown = h("span", { class: "number" });
    const input = h("input", { type: "range", min: 1, max: 100, value: 100 * this.target.speed, "aria-label": text("view.speed") });
    const show = () => {
      setText(shown, `${input.value} %`);
      input.setAttribute("aria-valuetext", `${input.value} %`);
    };
    input.addEventListener("input", show);
    input.addEventListener("change", () => this.target.choose({ speed: input.valueAsNumber / 100 }));
    show();
    return h("div", { class: "target-speed" }, h("span", { text: text("view.speed"), "aria-hidden": "true" }), input, shown);
  }

  /**
   * @param {number} axis
   * @param {number} value
   */
  #set(axis, value) {
    const { pose } = this.target;
    if (!pose) return;
    if (Number.isFinite(value)) {
      this.target.set(/** @type {Pose} */ (pose.map((each, index) => (index === axis ? value * AXES[axis].unit : each))));
    }
    this.#update();
  }

  /**
   * @param {number} axis
   * @param {number} direction
   */
  #nudge(axis, direction) {
    const { pose } = this.target;
    if (pose) this.#set(axis, pose[axis] / AXES[axis].unit + direction * this.step);
  }

  #update() {
    const { pose, refusal, planning } = this.target;
    this.element.hidden = pose === null;
    this.refusal.hidden = pose === null || refusal === null;
    if (!pose) return;
    this.inputs.forEach((input, axis) => {
      const shown = (pose[axis] / AXES[axis].unit).toFixed(1).replace(/^-(?=0\.0$)/, "");
      if (input.value !== shown) input.value = shown;
    });
    this.planButton.disabled = planning;
    setText(this.planButton, text(planning ? "view.planning" : "view.make_plan"));
    const [link, other] = refusal?.names ?? [];
    const collision = link && other ? `${text("view.collision", { link, other })} ` : "";
    setText(this.refusal, refusal ? collision + refusal.text : "");
  }
}
