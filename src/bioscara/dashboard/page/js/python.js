// The Python code of a control: the call with the same effect.

import { h, setText } from "./dom.js";
import { text } from "./texts.js";

/** Names that a fragment may use, from `bioscara`. */
const NAMES = [
  "Box",
  "Cylinder",
  "Frame",
  "Joints",
  "JointVelocity",
  "Load",
  "Motion",
  "NamedPose",
  "Pose",
  "Prism",
  "Robot",
  "Scene",
  "Tool",
  "ToolVelocity",
  "Trajectory",
  "Waypoint",
  "load_table",
  "read_scene",
  "save_table",
];
/** Time for which "copied" is shown [ms]. */
const SHOWN = 1500;

/**
 * Return a button that copies Python code.
 *
 * @param {() => string} code Returns the code as of now: statements that use `robot`, in SI units.
 * @returns {HTMLButtonElement} The button; its property `python` is `code`, with the imports.
 */
export function copyButton(code) {
  return programButton(async () => withImports(code()));
}

/**
 * Return a button that copies a Python program.
 *
 * @param {() => Promise<string>} program Returns the program as of now.
 * @returns {HTMLButtonElement} The button; its property `python` is `program`.
 */
export function programButton(program) {
  const label = h("span", { text: text("python.copy") });
  const made = h("button", {
    type: "button",
    class: "copy-python",
    title: text("python.title"),
    "aria-label": text("python.title"),
    on: { click: copy, pointerenter: tell, focus: tell },
  }, label);

  async function tell() {
    made.title = `${text("python.title")}:\n${await program().catch(String)}`;
  }

  async function copy() {
    let done = "python.copied";
    try {
      await navigator.clipboard.writeText(await program());
    } catch {
      // No permission, no secure address, or no program: the tooltip has the code, or the reason.
      done = "python.refused";
      void tell();
    }
    setText(label, text(done));
    made.setAttribute("aria-label", text(done));
    setTimeout(() => {
      setText(label, text("python.copy"));
      made.setAttribute("aria-label", text("python.title"));
    }, SHOWN);
  }
  return Object.assign(made, { python: program });
}

/**
 * Return code with the import that it needs.
 *
 * @param {string} code Statements.
 * @returns {string} The same below its import.
 */
export function withImports(code) {
  // Names in strings are none of the code.
  const bare = code.replace(/"(?:[^"\\\n]|\\.)*"/g, '""');
  const used = NAMES.filter((name) => new RegExp(`\\b${name}\\b`).test(bare));
  return used.length ? `from bioscara import ${used.join(", ")}\n\n${code}` : code;
}

/**
 * Return a number as Python code.
 *
 * @param {number} value The number.
 * @param {number} [digits] Digits after the point.
 * @returns {string} The code.
 */
export function pythonNumber(value, digits = 5) {
  const shown = value.toFixed(digits).replace(/^-(?=[0.]*$)/, "");
  return shown.includes(".") ? shown.replace(/0+$/, "").replace(/\.$/, ".0") : shown;
}

/**
 * Return a text as a literal of Python.
 *
 * @param {string} value The text.
 * @returns {string} The literal.
 */
export function pythonText(value) {
  // A string of JSON is one of Python, too.
  return JSON.stringify(value);
}

/**
 * Return a pose as Python code.
 *
 * @param {readonly number[]} pose x, y, z [m] and yaw [rad].
 * @returns {string} The code.
 */
export function pythonPose(pose) {
  return `Pose(${pose.map((value) => pythonNumber(value)).join(", ")})`;
}
