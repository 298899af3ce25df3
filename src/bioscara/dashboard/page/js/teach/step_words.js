// A step in words.

/** @import { Step } from "./sequence.js" */
/** @import { StepField } from "./step_kinds.js" */

import { degrees, duration, millimetres, number } from "../format.js";
import { text } from "../texts.js";
import { STEP_KINDS } from "./step_kinds.js";

/** Kinds of steps, in the order in which they are offered; their texts are `step.KIND`. */
export const KINDS = Object.keys(STEP_KINDS);
/** Values with which a new step begins, where its declaration has none. @type {Record<string, number>} */
const BEGIN = { width: 0.05, seconds: 1 };

/**
 * Return a step in words.
 *
 * @param {Step} step The step.
 * @returns {string} The words.
 */
export function summary(step) {
  const words = [text(`step.${step.kind}`), target(step)];
  const share = step.velocity_scaling ?? 1;
  if (share !== 1) words.push(`${number(100 * share, 1).replace(/\.0$/, "")} %`);
  if (step.blend) words.push(text("teach.blend_words", { blend: millimetres(step.blend) }));
  return words.filter(Boolean).join(" · ");
}

/** @param {Step} step */
function target(step) {
  const words = Object.entries(STEP_KINDS[step.kind]).map(([name, field]) => {
    const value = step[name];
    // Where the arm goes, not how it gets there.
    if (value === undefined || name === "frame" || name === "via" || field.type === "share") return "";
    return shown(field, value, step.frame);
  });
  return words.filter(Boolean).join(" ");
}

/**
 * @param {StepField} field
 * @param {any} value
 * @param {string | undefined} frame
 */
function shown({ type, unit }, value, frame) {
  if (type === "positions") return text("teach.joint_positions");
  if (type === "load") return value.name;
  if (typeof value === "string") return value;
  if (type === "number") return unit === "rad" ? degrees(value) : unit === "s" ? duration(value) : millimetres(value);
  const { x, y, z, yaw = 0 } = value;
  const place = `${[x, y, z].map((each) => millimetres(each).replace(" mm", "")).join(" ")} mm ${degrees(yaw)}`;
  return frame ? text("teach.in_frame", { place, frame }) : place;
}

/**
 * Return a new step of a kind, with values that a person changes.
 *
 * @param {string} kind The kind.
 * @param {import("../arm.js").Arm} arm The arm, for where it is.
 * @returns {Step} The step.
 */
export function newStep(kind, arm) {
  const pose = arm.sample?.pose ?? [0.4, 0, 0.25, 0];
  /** @param {string} name @param {StepField} field */
  const begin = (name, { type, minimum = 0 }) => {
    if (type === "pose") return { x: tidy(pose[0]), y: tidy(pose[1]), z: tidy(pose[2]), yaw: tidy(pose[3]) };
    if (type === "positions") return jointsOf(arm);
    if (type === "name") return arm.workspace?.table.poses?.[0]?.name ?? "center";
    if (type === "load") return { name: "load", lower: [-0.03, -0.03, -0.02], upper: [0.03, 0.03, 0.02] };
    return BEGIN[name] ?? Math.max(minimum, 0);
  };
  const fields = Object.entries(STEP_KINDS[kind]).filter(([, { required }]) => required);
  return { kind, ...Object.fromEntries(fields.map(([name, field]) => [name, begin(name, field)])) };
}

/**
 * Return the positions of the joints by their names.
 *
 * @param {import("../arm.js").Arm} arm The arm.
 * @returns {Record<string, number>} The positions [rad or m].
 */
export function jointsOf({ sample, joints }) {
  return Object.fromEntries(joints.map(({ name }, index) => [name, tidy(sample?.positions[index] ?? 0)]));
}

/** @param {number} value */
export function tidy(value) {
  return Number(value.toFixed(6));
}
