// All texts of the page that people read, in English; another language replaces this file.
// A name in braces is replaced by a value.

/** @type {Record<string, string>} */
const TEXTS = {
  "app.title": "Bioscara",
  "app.footer": "This page needs network and software to work. Its STOP is not the emergency stop.",

  "link.connecting": "connecting",
  "link.live": "live",
  "link.stale": "values are {age} old",
  "link.gone": "arm state unknown, last values {age} ago",
  "link.mismatch": "another version",
  "link.signed-out": "signed out",

  "error.no_lease": "take control first",
  "error.no_token": "Not signed in. Open the address that “bioscara web” or “bioscara serve --with web” printed.",

  "stop.button": "STOP",
  "stop.description": "Stops all motion. It is not an emergency stop.",

  "tab.watch": "View",
  "tab.jog": "Jog",
  "tab.run": "Run",
  "tab.teach": "Teach",
  "tab.files": "Files",
  "tab.plots": "Plots",
  "tab.health": "Health",
  "tab.settings": "Settings",
  "tab.bench": "Simulation",

  // Header: state, lease, STOP.

  // View: 3D, preview, targets.

  // Jog and run.

  // Teach.

  // Files and recordings.

  // Plots.

  // Health.

  // Settings.

  // Simulation bench.

  // Start page.
};

/**
 * Return a text.
 *
 * @param {string} key Its key.
 * @param {Record<string, string | number>} [values] Values for the names in braces.
 * @returns {string} The text.
 */
export function text(key, values = {}) {
  const found = TEXTS[key];
  if (found === undefined) throw new Error(`there is no text ${key}`);
  return found.replace(/\{(\w+)\}/g, (_, name) => String(values[name]));
}
