// The fields of one step.

/** @import { App } from "../app.js" */
/** @import { Quantity } from "../run/action.js" */
/** @import { SequenceModel, Step } from "./sequence.js" */

import { button, h } from "../dom.js";
import { quantity } from "../run/action.js";
import { text } from "../texts.js";
import { jointsOf, MOTIONS, PATHS, tidy } from "./step_words.js";

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
  const step = model.steps[index];
  const parts = [];
  if (step.kind === "move_named") parts.push(nameField(model, index, "name", text("teach.pose")));
  if (step.kind === "move_joints") parts.push(...jointFields(app, model, index));
  if (["move_to", "move_linear", "move_circular"].includes(step.kind)) parts.push(...targetFields(app, model, index));
  if (step.kind === "gripper_move") parts.push(bound(model, index, quantity(text("teach.width"), "mm", { min: 0 }), step.width, (width) => ({ width })));
  if (step.kind === "grasp") parts.push(...loadFields(model, index));
  if (step.kind === "release") parts.push(optional(model, index, quantity(text("teach.opening"), "mm", { min: 0 }), "opening"));
  if (step.kind === "wait") parts.push(secondsField(model, index));
  if (MOTIONS.has(step.kind)) {
    parts.push(bound(model, index, quantity(text("teach.speed"), "%", { min: 0.1, max: 100, step: 1 }), step.speed ?? 1,
      (speed) => ({ speed: speed === 1 ? undefined : tidy(speed) })));
  }
  if (PATHS.has(step.kind)) {
    parts.push(bound(model, index, quantity(text("teach.blend"), "mm", { min: 0, step: 1 }), step.blend ?? 0,
      (blend) => ({ blend: blend ? tidy(blend) : undefined })));
  }
  return h("div", { class: "step-fields" }, ...parts);
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
 * @param {Quantity} field
 * @param {string} name
 */
function optional(model, index, field, name) {
  const value = model.steps[index][name];
  if (value !== undefined) field.set(value);
  field.input.placeholder = text("teach.usual");
  field.input.addEventListener("change", () => {
    const now = field.value();
    model.edit(index, { [name]: Number.isNaN(now) ? undefined : tidy(now) });
  });
  return field.element;
}

/**
 * @param {SequenceModel} model
 * @param {number} index
 * @param {string} field
 * @param {string} label
 */
function nameField(model, index, field, label) {
  const input = h("input", { type: "text", list: NAMES, value: model.steps[index][field] ?? "", maxlength: "64", spellcheck: "false", autocomplete: "off" });
  input.addEventListener("change", () => model.edit(index, { [field]: input.value.trim() }));
  return h("label", { class: "field" }, h("span", { class: "field-name", text: label }), input);
}

/**
 * @param {SequenceModel} model
 * @param {number} index
 */
function secondsField(model, index) {
  const input = h("input", { type: "number", min: 0, max: 3600, step: "any", value: model.steps[index].seconds, inputmode: "decimal" });
  input.addEventListener("change", () => { if (input.value.trim()) model.edit(index, { seconds: Number(input.value) }); });
  return h("label", { class: "field" }, h("span", { class: "field-name", text: text("teach.seconds") }), input, h("span", { class: "dim", text: "s" }));
}

/**
 * @param {App} app
 * @param {SequenceModel} model
 * @param {number} index
 */
function jointFields(app, model, index) {
  const { joints } = model.steps[index];
  const fields = app.arm.joints.map(({ name, unit }) => bound(model, index, quantity(name, unit === "m" ? "mm" : "°"), joints[name] ?? 0,
    (value) => ({ joints: { ...model.steps[index].joints, [name]: value } })));
  return [...fields, here(app, () => model.edit(index, { joints: jointsOf(app.arm) }, true))];
}

/**
 * @param {App} app
 * @param {SequenceModel} model
 * @param {number} index
 */
function targetFields(app, model, index) {
  const step = model.steps[index];
  const frames = (app.arm.workspace?.table.frames ?? []).map(({ name }) => name);
  if (step.frame && !frames.includes(step.frame)) frames.push(step.frame);
  const frame = h("select", {}, h("option", { value: "", text: text("teach.base") }), ...frames.map((name) => h("option", { value: name, text: name })));
  frame.value = step.frame ?? "";
  frame.addEventListener("change", () => model.edit(index, inFrame(app, model.steps[index], frame.value), true));
  /** @type {HTMLElement[]} */
  const parts = [place(app, model, index, "pose", "name", text("teach.goal"))];
  if (step.kind === "move_circular") parts.unshift(place(app, model, index, "via", "via_name", text("teach.via")));
  if (step.pose || step.via) parts.push(h("label", { class: "field" }, h("span", { class: "field-name", text: text("teach.frame") }), frame));
  return parts;
}

/**
 * Return the fields of a place: of a name, or of numbers.
 *
 * @param {App} app
 * @param {SequenceModel} model
 * @param {number} index
 * @param {string} field
 * @param {string} nameOf
 * @param {string} title
 */
function place(app, model, index, field, nameOf, title) {
  const step = model.steps[index];
  const given = h("select", { "aria-label": text("teach.given_by", { title }) },
    h("option", { value: "numbers", text: text("teach.by_numbers") }), h("option", { value: "name", text: text("teach.by_name") }));
  given.value = step[field] ? "numbers" : "name";
  given.addEventListener("change", () => {
    const numbers = given.value === "numbers";
    const other = field === "pose" ? step.via : step.pose;
    model.edit(index, {
      [field]: numbers ? placeHere(app, step.frame) : undefined,
      [nameOf]: numbers ? undefined : (app.arm.workspace?.table.poses?.[0]?.name ?? "center"),
      frame: numbers || other ? step.frame : undefined,
    }, true);
  });
  const parts = step[field]
    ? [...axes(model, index, field), here(app, () => model.edit(index, { [field]: placeHere(app, model.steps[index].frame) }, true))]
    : [nameField(model, index, nameOf, text("teach.pose"))];
  return h("fieldset", { class: "place" }, h("legend", { text: title }), given, ...parts);
}

/**
 * @param {SequenceModel} model
 * @param {number} index
 * @param {string} field
 */
function axes(model, index, field) {
  return ["x", "y", "z", "yaw"].map((axis) => bound(model, index, quantity(axis === "yaw" ? text("teach.yaw") : axis.toUpperCase(), axis === "yaw" ? "°" : "mm"),
    model.steps[index][field][axis] ?? 0, (value) => ({ [field]: { ...model.steps[index][field], [axis]: value } })));
}

/**
 * @param {App} app
 * @param {() => void} fill
 */
function here(app, fill) {
  return button(text("teach.fill"), () => {
    if (app.arm.fresh && app.arm.sample?.pose) fill();
    else app.say(text("refusal.not_homed"), "error");
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
  const corners = ["lower", "upper"].map((corner) => h("fieldset", { class: "place" }, h("legend", { text: text(`teach.${corner}`) }),
    ...["X", "Y", "Z"].map((axis, at) => bound(model, index, quantity(axis, "mm"), box()[corner][at], (value) => edit({ [corner]: box()[corner].with(at, value) })))));
  return [
    h("label", { class: "field" }, h("span", { class: "field-name", text: text("teach.load") }), name), ...corners,
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
  const find = (/** @type {string | undefined} */ wanted) => arm.workspace?.table.frames?.find(({ name }) => name === wanted)?.pose_frame_in_base;
  /** @type {Object<string, any>} */
  const values = { frame: frame || undefined };
  for (const field of ["pose", "via"]) if (step[field]) values[field] = into(find(frame), outOf(find(step.frame), step[field]));
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
