// The steps as a list: choose, edit, move by buttons or by dragging, with what planning and running say of each.

/** @import { App } from "../app.js" */
/** @import { SequenceModel } from "./sequence.js" */

import { button, h, setText } from "../dom.js";
import { programButton } from "../python.js";
import { text } from "../texts.js";
import { stepFields } from "./step_fields.js";
import { summary } from "./step_words.js";

const TONES = { ok: "good", done: "good", running: "action", refused: "danger", failed: "danger" };

/**
 * Build the list.
 *
 * @param {App} app The page.
 * @param {SequenceModel} model The sequence.
 * @returns {HTMLElement} The list.
 */
export function stepList(app, model) {
  const list = h("ol", { class: "steps", "aria-label": text("teach.steps") });
  const empty = h("p", { class: "dim", text: text("teach.no_steps") });
  let dragged = -1;

  function build() {
    const focused = focusOf(list);
    empty.hidden = model.steps.length > 0;
    list.replaceChildren(...model.steps.map((_, index) => item(index)));
    refocus(list, focused, model.chosen);
  }

  /** @param {number} index */
  function item(index) {
    const is = index === model.chosen;
    const words = h("span", { class: "step-words", text: summary(model.steps[index]) });
    const choose = h("button", { type: "button", class: "step-choose", "aria-expanded": String(is), "data-do": "choose",
      on: { click: () => model.choose(index) } }, h("span", { class: "step-number", text: `${index + 1}` }), words);
    const label = (/** @type {string} */ key) => text("teach.of_step", { what: text(key), number: index + 1 });
    const small = (/** @type {string} */ sign, /** @type {string} */ key, /** @type {() => void} */ press, off = false) =>
      button(sign, press, { class: "small", title: text(key), "aria-label": label(key), "data-do": key, disabled: off });
    const handle = h("span", { class: "handle", draggable: "true", "aria-hidden": "true", title: text("teach.drag"), text: "⠿" });
    const row = h("div", { class: "step-row" }, handle, choose, h("span", { class: "step-mark" }),
      h("span", { class: "row step-buttons" }, small("↑", "teach.up", () => model.move(index, index - 1), index === 0),
        small("↓", "teach.down", () => model.move(index, index + 1), index === model.steps.length - 1),
        small("❐", "teach.duplicate", () => model.duplicate(index)), small("✕", "teach.remove", () => model.remove(index)),
        programButton(() => model.python(index, index + 1))));
    const made = h("li", { "data-index": String(index), class: is ? "chosen" : null }, row, is ? stepFields(app, model, index) : null);
    handle.addEventListener("dragstart", (event) => {
      dragged = index;
      event.dataTransfer?.setData("text/plain", String(index));
      event.dataTransfer?.setDragImage(row, 8, 8);
    });
    made.addEventListener("dragover", (event) => {
      if (dragged >= 0) {
        event.preventDefault();
        made.classList.add("over");
      }
    });
    made.addEventListener("dragleave", () => made.classList.remove("over"));
    made.addEventListener("drop", (event) => {
      event.preventDefault();
      if (dragged >= 0) model.move(dragged, index);
      dragged = -1;
    });
    handle.addEventListener("dragend", () => {
      dragged = -1;
      for (const each of list.children) each.classList.remove("over");
    });
    mark(made, index);
    return made;
  }

  /**
   * @param {HTMLElement} made
   * @param {number} index
   */
  function mark(made, index) {
    const place = made.querySelector(".step-mark");
    const found = model.marks.get(index);
    if (!place) return;
    place.className = `step-mark${found ? ` badge ${TONES[found.state]}` : ""}`;
    setText(place, found ? [text(`teach.mark_${found.state}`), found.text].filter(Boolean).join(" ") : "");
  }

  function marks() {
    for (const made of list.children) mark(/** @type {HTMLElement} */ (made), Number(/** @type {HTMLElement} */ (made).dataset.index));
  }
  model.on("steps", build);
  model.on("marks", marks);
  model.on("edit", () => {
    for (const [index, made] of Array.from(list.children).entries()) {
      const words = made.querySelector(".step-words");
      if (words) setText(words, summary(model.steps[index]));
    }
    marks();
  });
  build();
  return h("div", { class: "column" }, empty, list);
}

/**
 * Return which control of the list has the focus.
 *
 * @param {HTMLElement} list
 */
function focusOf(list) {
  const { activeElement } = document;
  if (!(activeElement instanceof HTMLElement) || !list.contains(activeElement)) return null;
  return activeElement.dataset.do ?? "choose";
}

/**
 * Give the focus back to the same control of the chosen step, as its element is another one now.
 *
 * @param {HTMLElement} list
 * @param {string | null} focused
 * @param {number} chosen
 */
function refocus(list, focused, chosen) {
  if (!focused) return;
  const at = list.querySelector(`[data-index="${Math.max(chosen, 0)}"]`);
  const found = [focused, "choose"].map((what) => at?.querySelector(`[data-do="${what}"]:not(:disabled)`)).find(Boolean);
  if (found instanceof HTMLElement) found.focus();
}
