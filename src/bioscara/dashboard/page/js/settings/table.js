// The parameters as a table that can be searched and edited.

/** @import { ParameterRow } from "./requests.js" */

import { button, h, setText } from "../dom.js";
import { degrees, millimetres } from "../format.js";
import { text } from "../texts.js";

/** Edits of a person: values by name; null removes the value from the overlay. @typedef {Map<string, unknown>} Edits */

/** A table of parameters with fields to edit them. */
export class ParameterTable {
  /**
   * @param {Edits} edits Where the edits are kept.
   * @param {() => void} changed Called after each edit.
   */
  constructor(edits, changed) {
    this.edits = edits;
    this.changed = changed;
    /** @type {ParameterRow[]} */
    this.rows = [];
    this.editable = false;
    this.body = h("tbody");
    this.empty = h("p", { class: "dim", hidden: true, text: text("settings.none_found") });
    const columns = ["name", "value", "unit", "source", "text"];
    this.element = h("div", {},
      h("div", { class: "scroll settings-table", tabindex: "0", role: "region", "aria-label": text("settings.table") },
        h("table", {}, h("thead", {}, h("tr", {}, ...columns.map((name) => h("th", { scope: "col", text: text(`settings.col_${name}`) })))),
          this.body)), this.empty);
  }

  /**
   * Show other rows.
   *
   * @param {ParameterRow[]} rows The rows.
   */
  fill(rows) {
    this.rows = rows;
    this.body.replaceChildren(...rows.map((row) => this.#row(row)));
  }

  /**
   * Show some of the rows.
   *
   * @param {string} wanted Words that must all be in a row, in any case.
   * @param {boolean} own Whether only values of the overlay and edited ones are shown.
   */
  filter(wanted, own) {
    const words = wanted.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    this.rows.forEach((row, index) => {
      const all = `${row.name} ${row.text} ${row.unit}`.toLowerCase();
      const shown = words.every((word) => all.includes(word)) && (!own || row.source === "overlay" || this.edits.has(row.name));
      this.body.rows[index].hidden = !shown;
      count += Number(shown);
    });
    this.empty.hidden = count > 0;
  }

  /** @param {ParameterRow} row */
  #row(row) {
    const field = h("input", {
      type: "text",
      value: shown(this.edits.has(row.name) ? this.edits.get(row.name) ?? row.default : row.value),
      "aria-label": `${row.name}${row.unit ? ` [${row.unit}]` : ""}`,
      autocomplete: "off",
      spellcheck: "false",
      disabled: !this.editable || row.fixed !== null,
      on: { input: () => this.#edit(row, field, line) },
    });
    const human = h("span", { class: "dim" });
    const reset = button(text("settings.reset"), () => this.#reset(row, field, line), {
      class: "small",
      "aria-label": text("settings.reset_of", { name: row.name }),
      title: text("settings.reset_to", { value: shown(row.default) }),
    });
    const source = h("span", { class: `badge ${row.source === "overlay" ? "action" : ""}`, text: text(`settings.source_${row.source}`) });
    const line = h("tr", {}, h("th", { scope: "row" }, ...breakable(row.name)),
      h("td", {}, h("div", { class: "row" }, field, reset), human), h("td", { text: row.unit }), h("td", {}, source),
      h("td", { class: "dim", text: row.fixed === null ? row.text : text("settings.fixed", { text: row.text, reason: row.fixed }) }));
    this.#mark(row, field, line);
    return line;
  }

  /**
   * @param {ParameterRow} row
   * @param {HTMLInputElement} field
   * @param {HTMLTableRowElement} line
   */
  #edit(row, field, line) {
    const value = read(field.value);
    if (same(value, row.value)) this.edits.delete(row.name);
    else this.edits.set(row.name, value);
    this.#mark(row, field, line);
    this.changed();
  }

  /**
   * @param {ParameterRow} row
   * @param {HTMLInputElement} field
   * @param {HTMLTableRowElement} line
   */
  #reset(row, field, line) {
    field.value = shown(row.default);
    if (row.source === "overlay") this.edits.set(row.name, null);
    else this.edits.delete(row.name);
    this.#mark(row, field, line);
    this.changed();
  }

  /**
   * @param {ParameterRow} row
   * @param {HTMLInputElement} field
   * @param {HTMLTableRowElement} line
   */
  #mark(row, field, line) {
    const edited = this.edits.has(row.name);
    line.classList.toggle("edited", edited);
    const value = read(field.value);
    setText(/** @type {HTMLElement} */ (line.cells[1].lastChild), inWords(value, row.unit));
    const reset = /** @type {HTMLButtonElement} */ (line.querySelector("button"));
    reset.hidden = !this.editable || row.fixed !== null || same(value, row.default);
  }
}

/**
 * Return a dotted name that can be broken between its words.
 *
 * @param {string} name
 */
function breakable(name) {
  return name.split(/(?<=[._])/).flatMap((part) => [part, h("wbr")]);
}

/**
 * Return a value as people type it.
 *
 * @param {unknown} value The value.
 * @returns {string} The text.
 */
export function shown(value) {
  return typeof value === "string" ? value : JSON.stringify(value ?? null);
}

/**
 * Return the value that a person typed: JSON where it is that, else a text.
 *
 * @param {string} typed The text.
 * @returns {unknown} The value.
 */
function read(typed) {
  const trimmed = typed.trim();
  try {
    return JSON.parse(trimmed);
  } catch {
    return trimmed;
  }
}

/**
 * @param {unknown} value
 * @param {unknown} other
 */
function same(value, other) {
  return JSON.stringify(value) === JSON.stringify(other);
}

/**
 * Return a value in the unit that people read, where that is another one.
 *
 * @param {unknown} value
 * @param {string} unit
 */
export function inWords(value, unit) {
  if (typeof value !== "number") return "";
  const [base, ...rest] = unit.split("/");
  const suffix = rest.length ? `/${rest.join("/")}` : "";
  if (base === "rad") return `= ${degrees(value, 2)}${suffix}`;
  if (base === "m") return `= ${millimetres(value, 2)}${suffix}`;
  return "";
}
