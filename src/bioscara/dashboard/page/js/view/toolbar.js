// Buttons of the view: position of the camera, layers, target.

/** @import { Layer } from "./picture.js" */

import { button, h } from "../dom.js";
import { text } from "../texts.js";

const PRESETS = /** @type {const} */ (["iso", "front", "side", "top", "follow"]);
/** Steps of the camera with their signs, in rows. */
const STEPS = /** @type {const} */ ({
  turn: { left: "←", right: "→", up: "↑", down: "↓" },
  shift: { "pan-left": "←", "pan-right": "→", "pan-up": "↑", "pan-down": "↓" },
  size: { in: "+", out: "−" },
});
/** @type {Layer[]} */
const LAYERS = ["frames", "zones", "margins", "bodies", "trace", "labels"];

/**
 * Actions of the buttons.
 *
 * @typedef {Object} ViewCommands
 * @property {(preset: typeof PRESETS[number]) => void} look Moves the camera.
 * @property {(step: any) => void} step Moves it by a step.
 * @property {(layer: Layer, shown: boolean) => void} layer Shows a layer or hides it.
 * @property {(shown: boolean) => void} target Shows the target or hides it.
 */

/**
 * Build the buttons.
 *
 * @param {ViewCommands} commands Their actions.
 * @param {Set<Layer>} layers Those shown at first.
 * @param {boolean} solid Whether there is a camera, which the flat view has not.
 * @returns {{element: HTMLElement, target: HTMLButtonElement}} The buttons, and that of the target.
 */
export function buildToolbar(commands, layers, solid) {
  const target = button(text("view.target"), () => commands.target(target.getAttribute("aria-pressed") !== "true"), {
    "aria-pressed": "false",
    class: "view-target-toggle",
  });
  const element = h(
    "div",
    { class: "view-toolbar", role: "toolbar", "aria-label": text("view.toolbar") },
    ...(solid
      ? PRESETS.map((preset) =>
        button(text(`view.look_${preset}`), () => commands.look(preset), {
          "aria-label": text("view.look", { preset: text(`view.look_${preset}`) }),
        })
      )
      : []),
    ...(solid
      ? [menu("view.camera", "view-camera", Object.entries(STEPS).map(([row, steps]) =>
        h(
          "div",
          { class: "view-camera-row" },
          h("span", { class: "dim", text: text(`view.camera_${row}`), "aria-hidden": "true" }),
          ...Object.entries(steps).map(([step, sign]) =>
            button(sign, () => commands.step(step), {
              "aria-label": text(`view.step_${step}`),
              title: text(`view.step_${step}`),
            })
          ),
        )
      ))]
      : []),
    menu("view.layers", "view-layers", LAYERS.map((layer) => {
      const input = h("input", { type: "checkbox", checked: layers.has(layer) });
      input.addEventListener("change", () => commands.layer(layer, input.checked));
      return h("label", {}, input, text(`view.layer_${layer}`));
    })),
    target,
  );
  return { element, target };
}

/**
 * @param {string} key
 * @param {string} kind
 * @param {HTMLElement[]} items
 */
function menu(key, kind, items) {
  const opened = h("div", { class: `view-menu card ${kind}` }, ...items);
  const element = h("details", { class: "view-details" }, h("summary", { text: text(key) }), opened);
  element.addEventListener("focusout", (event) => {
    if (event.relatedTarget instanceof Node && !element.contains(event.relatedTarget)) element.open = false;
  });
  return element;
}
