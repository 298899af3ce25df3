// A place to drop a file on, or to choose one.

import { button, h } from "../dom.js";
import { text } from "../texts.js";

/**
 * Return the place.
 *
 * @param {string} label What to drop.
 * @param {string} accept Ends of the names that are offered.
 * @param {(file: File) => void} take Called with the file.
 * @returns {HTMLElement} The place.
 */
export function dropZone(label, accept, take) {
  const input = fileInput(label, accept, take);
  const zone = h("div", { class: "drop" }, input, h("span", { text: label }), button(text("files.choose"), () => input.click()));
  for (const event of ["dragenter", "dragover"]) {
    zone.addEventListener(event, (dragged) => {
      dragged.preventDefault();
      zone.classList.add("over");
    });
  }
  zone.addEventListener("dragleave", () => zone.classList.remove("over"));
  zone.addEventListener("drop", (dropped) => {
    dropped.preventDefault();
    zone.classList.remove("over");
    const file = dropped.dataTransfer?.files[0];
    if (file) take(file);
  });
  return zone;
}

/**
 * Return the hidden field by which a button lets a person choose a file.
 *
 * @param {string} label What to choose.
 * @param {string} accept Ends of the names that are offered.
 * @param {(file: File) => unknown} take Called with the file.
 */
export function fileInput(label, accept, take) {
  const input = h("input", { type: "file", accept, class: "hidden-text", tabindex: "-1", "aria-label": label });
  input.addEventListener("change", () => {
    const file = input.files?.[0];
    // The same file can be chosen again, once it was changed.
    input.value = "";
    if (file) take(file);
  });
  return input;
}
