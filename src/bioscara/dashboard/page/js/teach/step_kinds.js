// Generated from src/bioscara/robot/tasks by `make generate`: the kinds of steps and their fields.

/**
 * A field of a step: type, unit, range, whether it has to be given, and its default.
 *
 * @typedef {Object} StepField
 * @property {"pose" | "positions" | "load" | "name" | "share" | "number"} type
 * @property {string} [unit]
 * @property {number} [minimum]
 * @property {number} [maximum]
 * @property {boolean} [required]
 * @property {number | null} [usual]
 */

/** The fields of each kind, by name. @type {Record<string, Record<string, StepField>>} */
export const STEP_KINDS = {
  move_joints: {
    positions: { type: "positions", required: true },
    velocity_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    acceleration_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
  },
  move_to: {
    pose: { type: "pose", required: true },
    frame: { type: "name" },
    velocity_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    acceleration_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
  },
  move_linear: {
    pose: { type: "pose", required: true },
    frame: { type: "name" },
    velocity_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    acceleration_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    blend: { type: "number", unit: "m", minimum: 0, maximum: 1.0, usual: 0 },
  },
  move_relative: {
    x: { type: "number", unit: "m", minimum: -10.0, maximum: 10.0, usual: 0.0 },
    y: { type: "number", unit: "m", minimum: -10.0, maximum: 10.0, usual: 0.0 },
    z: { type: "number", unit: "m", minimum: -10.0, maximum: 10.0, usual: 0.0 },
    yaw: { type: "number", unit: "rad", minimum: -6.283185307179586, maximum: 6.283185307179586, usual: 0.0 },
    velocity_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    acceleration_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
  },
  move_circular: {
    via: { type: "pose", required: true },
    pose: { type: "pose", required: true },
    frame: { type: "name" },
    velocity_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    acceleration_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    blend: { type: "number", unit: "m", minimum: 0, maximum: 1.0, usual: 0 },
  },
  move_named: {
    name: { type: "name", required: true },
    velocity_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    acceleration_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
  },
  unfold: {
    velocity_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
    acceleration_scaling: { type: "share", minimum: 0.001, maximum: 1.0, usual: 1.0 },
  },
  move_gripper: {
    width: { type: "number", unit: "m", minimum: 0.0, maximum: 1.0, required: true },
  },
  open_gripper: {
  },
  close_gripper: {
  },
  grasp: {
    load: { type: "load", required: true },
    width: { type: "number", unit: "m", minimum: 0.0, maximum: 1.0, usual: null },
    squeeze: { type: "number", unit: "m", minimum: 0.0, maximum: 1.0, usual: 0.003 },
  },
  release: {
    opening: { type: "number", unit: "m", minimum: 0.0, maximum: 1.0, usual: 0.01 },
  },
  wait: {
    seconds: { type: "number", unit: "s", minimum: 0.0, maximum: 3600.0, required: true },
  },
};
