// The motion of a jog: axes, velocities, steps, and their Python code. Knows no page.

/** @import { Description, StateSample, WorkspaceState } from "../../messages.d.ts" */
/** @import { Velocity } from "./hold.js" */

import { DEGREE, MM } from "../format.js";
import { pythonNumber } from "../python.js";

/** Highest and usual speed of the tool [m/s]: ISO 10218-1 has the first as the manual reduced speed. */
export const FASTEST = 0.25;
export const USUAL = 0.025;
/** Least radius that a rotation counts with [m]: a hand that turns on the spot is quick at its ends. */
const LEAST_RADIUS = 0.1;
/** Least share of the speed limits that a motion may use. */
const LEAST_SCALING = 0.001;
/** Highest speed of a smooth motion from rest to rest, over its mean speed. */
const PEAK = 1.9;

/** @typedef {"joints" | "tool"} Mode */
/** @typedef {{id: string, angular: boolean, plus: string, minus: string}} Axis */

/** Axes with the keys of both directions, by mode. @type {Record<Mode, Axis[]>} */
export const AXES = {
  joints: [
    { id: "j1", angular: true, plus: "ArrowLeft", minus: "ArrowRight" },
    { id: "j2", angular: false, plus: "ArrowUp", minus: "ArrowDown" },
    { id: "j3", angular: true, plus: "a", minus: "d" },
    { id: "j4", angular: true, plus: "q", minus: "e" },
  ],
  tool: [
    { id: "x", angular: false, plus: "ArrowUp", minus: "ArrowDown" },
    { id: "y", angular: false, plus: "ArrowLeft", minus: "ArrowRight" },
    { id: "z", angular: false, plus: "PageUp", minus: "PageDown" },
    { id: "yaw", angular: true, plus: "q", minus: "e" },
  ],
};

/**
 * The arm, as far as a jog needs it.
 *
 * @typedef {Object} Known
 * @property {StateSample | null} sample
 * @property {Description | null} description
 * @property {WorkspaceState | null} workspace
 */

/**
 * Return the velocities of the axes for a direction.
 *
 * @param {Mode} mode Whether joints or the tool are moved.
 * @param {readonly number[]} share Share of the speed of each axis, -1 to 1.
 * @param {number} speed Highest speed of the tool [m/s], also of axes together, at every pose.
 * @param {Known} known The arm.
 * @param {number} frame Direction of the frame's x axis in the base [rad], for the tool.
 * @returns {Velocity} The velocity.
 */
export function velocityOf(mode, share, speed, known, frame) {
  if (mode === "joints") {
    // The speeds that the joints give the tool add up.
    const each = speed / Math.max(1, share.reduce((sum, part) => sum + Math.abs(part), 0));
    const joints = share.map((part, index) => part * jointSpeed(known, index, each));
    return { joints: [joints[0], joints[1], joints[2], joints[3]] };
  }
  const each = speed / Math.max(1, Math.hypot(share[0], share[1], share[2]));
  const [x, y] = turned(share[0] * each, share[1] * each, frame);
  return { tool: [x, y, share[2] * each, share[3] * yawSpeed(known, speed)] };
}

/**
 * Return the speed of a joint at which the tool is at most as fast as given.
 *
 * @param {Known} known The arm.
 * @param {number} index Of the joint.
 * @param {number} speed Speed of the tool [m/s].
 * @returns {number} [rad/s or m/s]
 */
export function jointSpeed({ description, workspace }, index, speed) {
  if (!description) return 0;
  const { geometry, joints } = description.parameters;
  const pose = workspace?.tool.pose_tool_in_flange;
  const hand = pose ? Math.hypot(pose[0], pose[1]) : Math.hypot(geometry.tool_x, geometry.tool_y);
  const radii = [geometry.upper_arm + geometry.forearm + hand, 1, geometry.forearm + hand, hand];
  const joint = joints[index];
  const wanted = joint.unit === "m" ? speed : speed / Math.max(radii[index], LEAST_RADIUS);
  return Math.min(wanted, joint.max_velocity);
}

/**
 * @param {Known} known
 * @param {number} speed
 */
function yawSpeed(known, speed) {
  return Math.min(speed / LEAST_RADIUS, known.description?.parameters.joints[3].max_velocity ?? 0);
}

/**
 * Return a finite goal for a step of an axis; null while the positions are unknown.
 *
 * @param {Mode} mode Whether a joint or the tool is moved.
 * @param {number} index Of the axis.
 * @param {number} size Signed size, in mm or degrees.
 * @param {number} share Share of the speed limits.
 * @param {Known} known The arm.
 * @param {number} frame Direction of the frame's x axis in the base [rad], for the tool.
 * @returns {import("../../messages.d.ts").MoveRelative | import("../../messages.d.ts").MoveJoints | null} The task.
 */
export function stepTask(mode, index, size, share, known, frame) {
  const step = size * unitOf(mode, index);
  if (mode === "tool") {
    const along = [0, 0, 0, 0];
    along[index] = step;
    const [x, y] = turned(along[0], along[1], frame);
    return { kind: "move_relative", x, y, z: along[2], yaw: along[3], velocity_scaling: share };
  }
  const { sample, description } = known;
  if (!sample || !description) return null;
  // From the commanded position: many small steps add up exactly.
  const goal = sample.names.map((_, each) => sample.commands[each] ?? sample.positions[each]);
  if (goal.some((position) => position === null)) return null;
  goal[index] += step;
  return { kind: "move_joints", positions: goal, velocity_scaling: share };
}

/**
 * Return the share of the speed limits with which a step keeps to a speed.
 *
 * @param {Mode} mode Whether a joint or the tool is moved.
 * @param {number} index Of the axis.
 * @param {number} size Signed size, in mm or degrees.
 * @param {number} speed Speed of the tool [m/s].
 * @param {Known} known The arm.
 * @param {number} fastest Duration of the step with all of the limits [s].
 * @returns {number} The share.
 */
export function stepShare(mode, index, size, speed, known, fastest) {
  const angular = AXES[mode][index].angular;
  const pace = mode === "joints" ? jointSpeed(known, index, speed) : angular ? yawSpeed(known, speed) : speed;
  const duration = (PEAK * Math.abs(size) * unitOf(mode, index)) / pace;
  return Math.min(Math.max(fastest / duration, LEAST_SCALING), 1);
}

/**
 * Return the Python code of a step, or of a hold of one second.
 *
 * @param {Mode} mode Whether a joint or the tool is moved.
 * @param {number} index Of the axis.
 * @param {number} size Signed size, in mm or degrees; 1 or -1 for a hold.
 * @param {boolean} held Whether it is held.
 * @param {number} speed Speed of the tool [m/s].
 * @param {number} share Share of the speed limits, of a step.
 * @param {Known} known The arm.
 * @param {number} frame Direction of the frame's x axis in the base [rad], for the tool.
 * @returns {string} The code.
 */
export function jogCode(mode, index, size, held, speed, share, known, frame) {
  if (held) {
    const along = [0, 0, 0, 0];
    along[index] = Math.sign(size);
    const velocity = velocityOf(mode, along, speed, known, frame);
    const names = mode === "joints" ? ["j1", "j2", "j3", "j4"] : ["x", "y", "z", "yaw"];
    const values = "joints" in velocity ? velocity.joints : velocity.tool;
    const words = names.map((name, each) => [name, values[each]]).filter(([, value]) => value !== 0);
    const given = words.map(([name, value]) => `${name}=${pythonNumber(Number(value))}`).join(", ");
    const kind = mode === "joints" ? "JointVelocity" : "ToolVelocity";
    return `import time\n\nend = time.monotonic() + 1.0\nrobot.jog(lambda: ${kind}(${given}) if time.monotonic() < end else None)`;
  }
  const task = stepTask(mode, index, size, share, known, frame);
  if (task?.kind === "move_joints") {
    const positions = task.positions.map((value) => pythonNumber(value)).join(", ");
    return `robot.move_joints([${positions}], velocity_scaling=${pythonNumber(task.velocity_scaling ?? 1, 3)})`;
  }
  if (task?.kind === "move_relative") {
    const moved = /** @type {const} */ (["x", "y", "z", "yaw"]).filter((name) => task[name]);
    const given = moved.map((name) => `${name}=${pythonNumber(task[name] ?? 0)}`);
    return `robot.move_relative(${[...given, `velocity_scaling=${pythonNumber(task.velocity_scaling ?? 1, 3)}`].join(", ")})`;
  }
  return "robot.home()";
}

/**
 * Return the speed of the tool between two samples.
 *
 * @param {StateSample | null} before The former sample.
 * @param {StateSample | null} now The newest one.
 * @returns {number} [m/s]; NaN while it is unknown.
 */
export function toolSpeed(before, now) {
  if (!before?.pose || !now?.pose || now.time <= before.time) return NaN;
  const [a, b] = [before.pose, now.pose];
  return Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) / (now.time - before.time);
}

/**
 * @param {Mode} mode
 * @param {number} index
 */
function unitOf(mode, index) {
  return AXES[mode][index].angular ? DEGREE : MM;
}

/**
 * @param {number} x
 * @param {number} y
 * @param {number} angle
 */
function turned(x, y, angle) {
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return [cos * x - sin * y, sin * x + cos * y];
}
