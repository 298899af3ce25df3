// The fields of one step.

/** @import { App } from "../app.js" */
/** @import { Quantity } from "../run/action.js" */
/** @import { SequenceModel, Step } from "./sequence.js" */
/** @import { StepField } from "./step_kinds.js" */

import { button, h } from "../dom.js";
import { quantity } from "../run/action.js";
import { text } from "../texts.js";
import { STEP_KINDS } from "./step_kinds.js";
import { jointsOf, tidy } from "./step_words.js";

/** Id of the list with the names of all poses. */
export const NAMES = "pose-names";

/**
 * Return the fields of a step; each writes its value to the model when it is changed.
 *
 * @param {App} app The page.
 * @param {SequenceModel} model The sequence.
 * @param {number} index The step.
 * @returns {HTMLElement} The fields.
 */
export function stepFields(app, model, index) {
  const kind = STEP_KINDS[model.steps[index].kind];
  return h("div", { class: "step-fields" }, ...Object.entries(kind).flatMap(([name, field]) => partsOf(app, model, index, name, field)));
}

/**
 * Return the fields of one value, as its declaration says.
 *
 * @param {App} app
 * @param {SequenceModel} model
 * @param {number} index
 * @param {string} name
 * @param {StepField} field
 * @returns {HTMLElement[]}
 */
function partsOf(app, model, index, name, field) {
  const step = model.steps[index];
  switch (field.type) {
    case "pose":
      return [place(app, model, index, name)];
    case "positions":
      return jointFields(app, model, index);
    case "load":
      return loadFields(model, index);
    case "name":
      return name === "frame" ? frameField(app, model, index) : [nameField(model, index, name)];
    default:
      return [numberField(model, index, name, field, step[name])];
  }
}

/** Unit that people read, for that of a value. @type {Record<string, "mm" | "°" | "g" | "s" | "%">} */
const READ = { m: "mm", rad: "°", kg: "g", s: "s" };
/** Factor from a value to its unit on the page. */
const FACTORS = { "mm": 1e3, "°": 180 / Math.PI, "g": 1e3, "s": 1, "%": 100 };

/**
 * @param {SequenceModel} model
 * @param {number} index
 * @param {string} name
 * @param {StepField} field
 * @param {number | undefined} value
 */
function numberField(model, index, name, { unit = "", minimum, maximum, required, usual }, value) {
  const read = READ[unit] ?? "%";
  /** @param {number | undefined} limit */
  const scaled = (limit) => (limit === undefined ? undefined : Number((limit * FACTORS[read]).toFixed(3)));
  const made = quantity(text(`teach.${name}`), read, { min: scaled(minimum), max: scaled(maximum) });
  if (value ?? usual) made.set(value ?? usual ?? 0);
  else if (usual === 0) made.set(0);
  if (!required && usual === null) made.input.placeholder = text("teach.usual");
  made.input.addEventListener("change", () => {
    const now = made.value();
    const left = Number.isNaN(now) && !required;
    made.input.setAttribute("aria-invalid", String(Number.isNaN(now) && !left));
    if (left || !Number.isNaN(now)) model.edit(index, { [name]: left || tidy(now) === usual ? undefined : tidy(now) });
  });
  return made.element;
}

/**
 * Join a field to a value.
 *
 * @param {SequenceModel} model
 * @param {number} index
 * @param {Quantity} field
 * @param {number} value
 * @param {(value: number) => Object<string, any>} values
 */
function bound(model, index, field, value, values) {
  field.set(value);
  field.input.addEventListener("change", () => {
    const now = field.value();
    field.input.setAttribute("aria-invalid", String(Number.isNaN(now)));
    if (!Number.isNaN(now)) model.edit(index, values(tidy(now)));
  });
  return field.element;
}

/**
 * @param {SequenceModel} model
 * @param {number} index
 * @param {string} field
 */
function nameField(model, index, field) {
  const input = h("input", { type: "text", list: NAMES, value: model.steps[index][field] ?? "", maxlength: "64", spellcheck: "false",
    autocomplete: "off" });
  input.addEventListener("change", () => model.edit(index, { [field]: input.value.trim() }));
  return h("label", { class: "field" }, h("span", { class: "field-name", text: text("teach.pose") }), input);
}

/**
 * @param {App} app
 * @param {SequenceModel} model
 * @param {number} index
 */
function jointFields(app, model, index) {
  const { positions } = model.steps[index];
  const fields = app.arm.joints.map(({ name, unit }) =>
    bound(model, index, quantity(name, unit === "m" ? "mm" : "°"), positions[name] ?? 0,
      (value) => ({ positions: { ...model.steps[index].positions, [name]: value } }))
  );
  return [...fields, here(app, () => model.edit(index, { positions: jointsOf(app.arm) }, true))];
}

/**
 * @param {App} app
 * @param {SequenceModel} model
 * @param {number} index
 */
function frameField(app, model, index) {
  const step = model.steps[index];
  if (!byNumbers(step.pose) && !byNumbers(step.via)) return [];
  const frames = (app.arm.workspace?.table.frames ?? []).map(({ name }) => name);
  if (step.frame && !frames.includes(step.frame)) frames.push(step.frame);
  const frame = h("select", {}, h("option", { value: "", text: text("teach.base") }),
    ...frames.map((name) => h("option", { value: name, text: name })));
  frame.value = step.frame ?? "";
  frame.addEventListener("change", () => model.edit(index, inFrame(app, model.steps[index], frame.value), true));
  return [h("label", { class: "field" }, h("span", { class: "field-name", text: text("teach.frame") }), frame)];
}

/**
 * Return whether a place is given by numbers, and not by a name.
 *
 * @param {any} given
 */
function byNumbers(given) {
  return given !== undefined && typeof given !== "string";
}

/**
 * Return the fields of a place: of a name, or of numbers.
 *
 * @param {App} app
 * @param {SequenceModel} model
 * @param {number} index
 * @param {string} field
 */
function place(app, model, index, field) {
  const step = model.steps[index];
  const title = text(field === "pose" ? "teach.goal" : "teach.via");
  const given = h("select", { "aria-label": text("teach.given_by", { title }) },
    h("option", { value: "numbers", text: text("teach.by_numbers") }), h("option", { value: "name", text: text("teach.by_name") }));
  given.value = byNumbers(step[field]) ? "numbers" : "name";
  given.addEventListener("change", () => {
    const numbers = given.value === "numbers";
    const other = field === "pose" ? step.via : step.pose;
    model.edit(index, {
      [field]: numbers ? placeHere(app, step.frame) : (app.arm.workspace?.table.poses?.[0]?.name ?? "center"),
      frame: numbers || byNumbers(other) ? step.frame : undefined,
    }, true);
  });
  const parts = byNumbers(step[field])
    ? [...axes(model, index, field), here(app, () => model.edit(index, { [field]: placeHere(app, model.steps[index].frame) }, true))]
    : [nameField(model, index, field)];
  return h("fieldset", { class: "place" }, h("legend", { text: title }), given, ...parts);
}

/**
 * @param {SequenceModel} model
 * @param {number} index
 * @param {string} field
 */
function axes(model, index, field) {
  return ["x", "y", "z", "yaw"].map((axis) =>
    bound(model, index, quantity(axis === "yaw" ? text("teach.yaw") : axis.toUpperCase(), axis === "yaw" ? "°" : "mm"),
      model.steps[index][field][axis] ?? 0, (value) => ({ [field]: { ...model.steps[index][field], [axis]: value } }))
  );
}

/**
 * @param {App} app
 * @param {() => void} fill
 */
function here(app, fill) {
  return button(text("teach.fill"), () => {
    if (app.arm.fresh && app.arm.sample?.pose) fill();
    else app.say(text("refusal.not_homed"), "error", () => !app.arm.sample?.pose);
  });
}

/**
 * @param {SequenceModel} model
 * @param {number} index
 */
function loadFields(model, index) {
  const box = () => model.steps[index].load;
  const edit = (/** @type {Object<string, any>} */ values) => ({ load: { ...box(), ...values } });
  const name = h("input", { type: "text", value: box().name, maxlength: "64", spellcheck: "false" });
  name.addEventListener("change", () => model.edit(index, edit({ name: name.value.trim() })));
  const touches = h("input", { type: "text", value: (box().touches ?? []).join(", "), placeholder: "table" });
  touches.addEventListener("change", () => {
    const names = touches.value.split(",").map((each) => each.trim()).filter(Boolean);
    const { touches: _, ...rest } = box();
    model.edit(index, { load: names.length ? { ...rest, touches: names } : rest });
  });
  const corners = ["lower", "upper"].map((corner) =>
    h("fieldset", { class: "place" }, h("legend", { text: text(`teach.${corner}`) }), ...["X", "Y", "Z"].map((axis, at) =>
      bound(model, index, quantity(axis, "mm"), box()[corner][at], (value) =>
        edit({ [corner]: box()[corner].with(at, value) }))
    ))
  );
  return [
    h("label", { class: "field" }, h("span", { class: "field-name", text: text("teach.load") }), name),
    ...corners,
    bound(model, index, quantity(text("teach.mass"), "g", { min: 0 }), box().mass ?? 0, (mass) => edit({ mass })),
    h("label", { class: "field" }, h("span", { class: "field-name", text: text("teach.touches") }), touches),
  ];
}

/**
 * Return the pose of the tool now, in a frame.
 *
 * @param {App} app
 * @param {string | undefined} frame
 */
function placeHere({ arm }, frame) {
  const [x, y, z, yaw] = arm.sample?.pose ?? [0.4, 0, 0.25, 0];
  return into(arm.workspace?.table.frames?.find(({ name }) => name === frame)?.pose_frame_in_base, { x, y, z, yaw });
}

/**
 * Return the values of a step with its places given in another frame: they stay where they are.
 *
 * @param {App} app
 * @param {Step} step
 * @param {string} frame
 */
function inFrame({ arm }, step, frame) {
  const find = (/** @type {string | undefined} */ wanted) =>
    arm.workspace?.table.frames?.find(({ name }) => name === wanted)?.pose_frame_in_base;
  /** @type {Object<string, any>} */
  const values = { frame: frame || undefined };
  for (const field of ["pose", "via"]) if (byNumbers(step[field])) values[field] = into(find(frame), outOf(find(step.frame), step[field]));
  return values;
}

/** @typedef {{x: number, y: number, z: number, yaw?: number}} Place */

/**
 * @param {readonly number[] | undefined} frame
 * @param {Place} place
 * @returns {Place}
 */
function outOf(frame, { x, y, z, yaw = 0 }) {
  if (!frame) return { x, y, z, yaw };
  const [c, s] = [Math.cos(frame[3]), Math.sin(frame[3])];
  return { x: frame[0] + c * x - s * y, y: frame[1] + s * x + c * y, z: frame[2] + z, yaw: frame[3] + yaw };
}

/**
 * @param {readonly number[] | undefined} frame
 * @param {Place} place
 * @returns {Place}
 */
function into(frame, { x, y, z, yaw = 0 }) {
  if (!frame) return { x: tidy(x), y: tidy(y), z: tidy(z), yaw: turned(yaw) };
  const [c, s, dx, dy] = [Math.cos(frame[3]), Math.sin(frame[3]), x - frame[0], y - frame[1]];
  return { x: tidy(c * dx + s * dy), y: tidy(c * dy - s * dx), z: tidy(z - frame[2]), yaw: turned(yaw - frame[3]) };
}

/** @param {number} yaw */
function turned(yaw) {
  return tidy(Math.atan2(Math.sin(yaw), Math.cos(yaw)));
}
