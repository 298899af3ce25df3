// Colours of the drawing, from the tokens of the page: they differ between light and dark.

/** Colours by their purpose; `var(--...)` of base.css and view.css. */
const TOKENS = {
  back: "--view-back",
  grid: "--view-grid",
  stale: "--view-stale",
  commanded: "--view-commanded",
  plan: "--view-plan",
  trace: "--view-trace",
  keepOut: "--view-keep-out",
  keepIn: "--view-keep-in",
  table: "--view-table",
  load: "--view-load",
  nearest: "--danger",
  near: "--warn",
  clear: "--good",
  target: "--view-target",
  x: "--view-x",
  y: "--view-y",
  z: "--view-z",
};

/** @typedef {Record<keyof typeof TOKENS, string>} Palette */

/**
 * Return the colours of now.
 *
 * @returns {Palette} CSS colours.
 */
export function palette() {
  const style = getComputedStyle(document.documentElement);
  const entries = Object.entries(TOKENS).map(([name, token]) => [name, style.getPropertyValue(token).trim()]);
  return /** @type {Palette} */ (Object.fromEntries(entries));
}

/**
 * Call a function when the colours change.
 *
 * @param {() => void} changed The function.
 */
export function onPaletteChange(changed) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", changed);
}
