// The gripper: width, opening and closing, and its load.

/** @import { App } from "../app.js" */
/** @import { Load } from "../../messages.d.ts" */

import { h, setText, setValues } from "../dom.js";
import { millimetres } from "../format.js";
import { copyButton, pythonNumber, pythonText } from "../python.js";
import { text } from "../texts.js";
import { action, card, quantity } from "./action.js";

/** The jaws may move while the arm homes: the owner decides. */
const NEEDS = { homed: false, enabled: false, idle: false };

/**
 * Build the gripper.
 *
 * @param {App} app The page.
 * @returns {HTMLElement} The part.
 */
export function gripperCard(app) {
  const { arm } = app;
  const state = h("span", { class: "badge", role: "status" });
  const width = quantity(text("run.width"), "mm", { value: 50, min: 0, id: "gripper-width" });
  const enable = action(app, text("run.enable"), () => app.start({ kind: "enable_gripper" }), NEEDS);
  const disable = action(app, text("run.release_servo"), () => app.start({ kind: "disable_gripper" }), NEEDS);
  const update = () => {
    const at = arm.sample?.width ?? null;
    const driven = at !== null;
    setText(state, !arm.fresh ? text("run.unknown") : driven ? millimetres(at) : text("run.not_driven"));
    setValues(enable, { hidden: driven });
    setValues(disable, { hidden: !driven });
  };
  arm.follow(["sample", "link"], update);
  const missing = () => (Number.isNaN(width.value()) ? text("run.fields") : "");
  const move = action(app, text("run.move"), () => app.start({ kind: "move_gripper", width: width.value() }), { ...NEEDS, extra: missing });
  return card(text("run.gripper"),
    h("div", { class: "row" }, state, enable, disable,
      copyButton(() => (arm.sample?.width == null ? "robot.gripper.enable()" : "robot.gripper.disable()"))),
    h("div", { class: "row" }, action(app, text("run.open"), () => app.start({ kind: "open_gripper" }), NEEDS),
      copyButton(() => "robot.gripper.open()"), action(app, text("run.close"), () => app.start({ kind: "close_gripper" }), NEEDS),
      copyButton(() => "robot.gripper.close()")),
    h("div", { class: "row" }, width.element, move, copyButton(() => `robot.gripper.move(${pythonNumber(width.value() || 0, 4)})`)),
    carrying(app));
}

/** First values of the fields: a microplate of ANSI SLAS 1 and 2, held across its short side [mm, g]. */
const PLATE = { name: "plate", length: 127.8, width: 85.5, below: 10, above: 4.4, mass: 50 };

/** @param {App} app */
function carrying(app) {
  const { arm } = app;
  const name = h("input", { type: "text", id: "load-name", value: PLATE.name, maxlength: 40, autocomplete: "off", spellcheck: "false" });
  const [length, across, below, above, mass] = [
    quantity(text("run.load_length"), "mm", { value: PLATE.length, min: 0 }),
    quantity(text("run.load_width"), "mm", { value: PLATE.width, min: 0 }),
    quantity(text("run.load_below"), "mm", { value: PLATE.below, min: 0 }),
    quantity(text("run.load_above"), "mm", { value: PLATE.above, min: 0 }),
    quantity(text("run.load_mass"), "g", { value: PLATE.mass, min: 0 }),
  ];
  const table = h("input", { type: "checkbox", id: "load-table", checked: true });
  const carried = h("span", { class: "badge", role: "status" });
  const fields = [length, across, below, above, mass];
  const missing = () => (fields.some((field) => Number.isNaN(field.value())) || !name.value ? text("run.fields") : "");
  /** @returns {Load} */
  const load = () => ({
    name: name.value,
    mass: mass.value(),
    touches: touched() ? ["table"] : [],
    shape: { x: 0, y: 0, half_x: length.value() / 2, half_y: across.value() / 2, low: -below.value(), high: above.value() },
  });
  // A table that is not in the scene cannot be touched.
  const touched = () => table.checked && arm.workspace?.scene.table_height != null;
  const code = () => {
    const [x, y] = [length.value() / 2 || 0, across.value() / 2 || 0];
    const lower = [-x, -y, -(below.value() || 0)].map((value) => pythonNumber(value)).join(", ");
    const upper = [x, y, above.value() || 0].map((value) => pythonNumber(value)).join(", ");
    const touches = touched() ? ', touches=("table",)' : "";
    const kilograms = pythonNumber(mass.value() || 0);
    return `robot.gripper.grasp(Load(${pythonText(name.value)}, Prism.between((${lower}), (${upper})), mass=${kilograms}${touches}))`;
  };
  const update = () => {
    const has = arm.workspace?.load;
    setText(carried, !arm.workspace ? text("run.unknown") : has ? text("run.carries", { name: has.name }) : text("run.empty"));
  };
  arm.follow(["workspace"], update);
  const grasp = action(app, text("run.grasp"), () => app.start({ kind: "grasp", load: load() }), { ...NEEDS, extra: missing });
  const release = action(app, text("run.let_go"), () => app.start({ kind: "release" }), NEEDS);
  return h("details", { class: "column" }, h("summary", { text: text("run.load") }),
    h("div", { class: "fields" }, h("label", { class: "field" }, h("span", { class: "field-name", text: text("run.load_name") }), name),
      ...fields.map(({ element }) => element)), h("label", {}, table, text("run.load_table")),
    h("div", { class: "row" }, carried, grasp, copyButton(code), release, copyButton(() => "robot.gripper.release()")));
}
