// Elements of the page. Texts go in as text, never as markup: names come from people and files.

/** Whether the page is as narrow as on a phone, as in layout.css. */
export const PHONE = matchMedia("(max-width: 767px)");

/**
 * Make an element.
 *
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag Its name.
 * @param {Object<string, any>} [attributes] `class`, `text` and `on` (listeners by event) are special; null and
 *   false leave an attribute out.
 * @param {...(Node | string | null)} children Its children.
 * @returns {HTMLElementTagNameMap[K]} The element.
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name === "text") element.textContent = printable(value);
    else if (name === "class") element.className = value;
    else if (name === "on") {
      for (const [event, listener] of Object.entries(value)) element.addEventListener(event, listener);
    } else element.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) {
    if (child !== null) element.append(typeof child === "string" ? printable(child) : child);
  }
  return element;
}

/**
 * Make a button.
 *
 * @param {string} label Its text.
 * @param {() => unknown} press Called when it is pressed.
 * @param {Object<string, any>} [attributes] Further attributes.
 * @returns {HTMLButtonElement} The button.
 */
export function button(label, press, attributes = {}) {
  return h("button", { type: "button", text: label, on: { click: press }, ...attributes });
}

/**
 * Return the element of the document with an id.
 *
 * @param {string} id Its id.
 * @returns {HTMLElement} The element.
 */
export function at(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element ${id}`);
  return found;
}

/**
 * Set a text if it differs: the screen reader and the layout are left alone otherwise.
 *
 * @param {Node} element The element.
 * @param {string} text The text.
 */
export function setText(element, text) {
  const shown = printable(text);
  if (element.textContent !== shown) element.textContent = shown;
}

/**
 * Set those properties that differ: the browser computes styles anew for each that is set, also to its value of before.
 *
 * @template {object} T
 * @param {T} target An element, or its `dataset`.
 * @param {Partial<T>} values The properties.
 */
export function setValues(target, values) {
  for (const name of /** @type {(keyof T)[]} */ (Object.keys(values))) {
    if (target[name] !== values[name]) target[name] = /** @type {any} */ (values[name]);
  }
}

/**
 * Return a text in which characters that do not print are shown as their codes.
 *
 * @param {unknown} text The text.
 * @returns {string} The text to show.
 */
export function printable(text) {
  return String(text).replace(
    /[\p{C}\p{Zl}\p{Zp}]/gu,
    (character) => (character === "\n" ? "\n" : `\\u{${(character.codePointAt(0) ?? 0).toString(16)}}`),
  );
}
