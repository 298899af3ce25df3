// A step in words.

/** @import { Step } from "./sequence.js" */

import { degrees, duration, millimetres, number } from "../format.js";
import { text } from "../texts.js";

/** Kinds of steps, in the order in which they are offered; their texts are `step.KIND`. */
export const KINDS = [
  "move_named", "move_to", "move_linear", "move_circular", "move_joints", "gripper_move", "gripper_open", "gripper_close", "grasp", "release", "wait",
];
/** Kinds that may be joined to the next one by a blend. */
export const PATHS = new Set(["move_linear", "move_circular"]);
/** Kinds that move the arm. */
export const MOTIONS = new Set(["move_named", "move_to", "move_linear", "move_circular", "move_joints"]);

/**
 * Return a step in words.
 *
 * @param {Step} step The step.
 * @returns {string} The words.
 */
export function summary(step) {
  const words = [text(`step.${step.kind}`), target(step)];
  if (step.speed !== undefined && step.speed !== 1) words.push(`${number(100 * step.speed, 1).replace(/\.0$/, "")} %`);
  if (step.blend) words.push(text("teach.blend_words", { blend: millimetres(step.blend) }));
  return words.filter(Boolean).join(" · ");
}

/** @param {Step} step */
function target(step) {
  if (step.kind === "move_joints") return text("teach.joint_positions");
  if (step.kind === "gripper_move") return millimetres(step.width);
  if (step.kind === "grasp") return step.load?.name ?? "";
  if (step.kind === "wait") return duration(step.seconds);
  if (step.name !== undefined) return step.name;
  if (!step.pose) return "";
  const { x, y, z, yaw = 0 } = step.pose;
  const place = `${[x, y, z].map((value) => millimetres(value).replace(" mm", "")).join(" ")} mm ${degrees(yaw)}`;
  return step.frame ? text("teach.in_frame", { place, frame: step.frame }) : place;
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
  const here = { x: tidy(pose[0]), y: tidy(pose[1]), z: tidy(pose[2]), yaw: tidy(pose[3]) };
  switch (kind) {
    case "move_joints": return { kind, joints: jointsOf(arm) };
    case "move_named": return { kind, name: arm.workspace?.table.poses?.[0]?.name ?? "center" };
    case "move_circular": return { kind, pose: here, via: { ...here } };
    case "move_to":
    case "move_linear": return { kind, pose: here };
    case "gripper_move": return { kind, width: 0.05 };
    case "grasp": return { kind, load: { name: "load", lower: [-0.03, -0.03, -0.02], upper: [0.03, 0.03, 0.02] } };
    case "wait": return { kind, seconds: 1 };
    default: return { kind };
  }
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
