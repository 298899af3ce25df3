// Where the links are: forward kinematics of the model that the gateway sends, without any drawing.
// A placement is an array of 16 numbers, column by column, as WebGL has it; lengths in m.

/** @import { Pose } from "../../messages.d.ts" */

/**
 * The arm as the gateway describes it.
 *
 * @typedef {Object} Model
 * @property {string} base Link whose frame is the frame of the scene and of poses.
 * @property {string} tool Link whose frame is the pose of the gripper's tool.
 * @property {{name: string, visuals: {mesh: string, color: [number, number, number], origin: Place}[]}[]} links
 * @property {ModelJoint[]} joints Parents before children.
 * @property {Record<string, number[]>} body_colors Red, green and blue, 0 to 1, of the kinds of bodies around it.
 *
 * @typedef {[number, number, number, number, number, number]} Place x, y, z [m], roll, pitch, yaw [rad].
 *
 * @typedef {Object} ModelJoint
 * @property {string} name Its name.
 * @property {"revolute" | "prismatic" | "fixed"} type Its kind.
 * @property {string} parent Link that carries it.
 * @property {string} child Link that it carries.
 * @property {Place} origin Pose in the parent at position zero.
 * @property {[number, number, number]} axis Axis of rotation, or direction of translation.
 * @property {number} lower Lowest position [rad or m].
 * @property {number} upper Highest position [rad or m].
 * @property {{joint: string, multiplier: number, offset: number} | null} mimic The joint that it follows.
 */

/** The name of the joint that the width of the jaws moves. */
export const GRIPPER = "gripper";
const IDENTITY = identity();

/** The links of one arm. */
export class Kinematics {
  /**
   * @param {Model} model The arm.
   * @param {string[]} names Names of the joints of the arm, from the base to the wrist.
   */
  constructor(model, names) {
    this.model = model;
    this.names = names;
    this.origins = model.joints.map((joint) => placed(joint.origin));
    const last = model.joints.find((joint) => joint.name === names[names.length - 1]);
    /** Link that carries the tool. */
    this.wrist = last?.child ?? model.tool;
    this.fixed = new Float64Array(16);
    this.moved = new Float64Array(16);
  }

  /**
   * Return room for the placements of all links, to be filled by `place`.
   *
   * @returns {Map<string, Float64Array>} Placements by link, in the base.
   */
  room() {
    /** @type {Map<string, Float64Array>} */
    const room = new Map();
    for (const { name } of this.model.links) room.set(name, identity());
    return room;
  }

  /**
   * Compute where the links are.
   *
   * @param {Record<string, number | null>} positions By joint [rad or m]; a joint without one stands at zero, or at
   *   its limit next to zero. That of the gripper is the width of its jaws.
   * @param {Map<string, Float64Array>} room Filled with the placements.
   */
  place(positions, room) {
    this.model.joints.forEach((joint, index) => {
      const parent = room.get(joint.parent);
      const child = room.get(joint.child);
      if (!parent || !child) return;
      if (joint.type === "fixed") {
        multiply(parent, this.origins[index], child);
        return;
      }
      multiply(parent, this.origins[index], this.fixed);
      move(joint, this.#position(joint, positions), this.moved);
      multiply(this.fixed, this.moved, child);
    });
  }

  /**
   * @param {ModelJoint} joint
   * @param {Record<string, number | null>} positions
   */
  #position({ name, mimic, lower, upper }, positions) {
    const source = positions[mimic ? mimic.joint : name];
    if (source === undefined || source === null) return Math.min(Math.max(0, lower), upper);
    return mimic ? mimic.multiplier * source + mimic.offset : source;
  }

  /**
   * Return the pose of the tool.
   *
   * @param {Map<string, Float64Array>} room Placements of the links.
   * @param {Pose} tool Pose of the tool in the flange.
   * @returns {Pose} In the base; its yaw is within half a turn.
   */
  toolPose(room, tool) {
    const flange = room.get(this.wrist) ?? identity();
    return compose([flange[12], flange[13], flange[14], Math.atan2(flange[1], flange[0])], tool);
  }
}

/**
 * Return a pose given in a frame, in the parent of the frame.
 *
 * @param {Pose} frame The frame in its parent.
 * @param {Pose} pose The pose in the frame.
 * @returns {Pose} The pose in the parent.
 */
export function compose([x, y, z, yaw], [dx, dy, dz, turn]) {
  const c = Math.cos(yaw);
  const s = Math.sin(yaw);
  return [x + c * dx - s * dy, y + s * dx + c * dy, z + dz, yaw + turn];
}

/** Return the placement that moves nothing. */
export function identity() {
  return Float64Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
}

/**
 * Return the placement of an upright frame.
 *
 * @param {Pose} pose Its pose.
 * @returns {Float64Array} Its placement.
 */
export function upright([x, y, z, yaw]) {
  return placed([x, y, z, 0, 0, yaw]);
}

/**
 * Return a placement as a matrix.
 *
 * @param {Place} place Position, and rotations about the fixed x, y and z axes, in this order.
 * @returns {Float64Array} The matrix.
 */
export function placed([x, y, z, roll, pitch, yaw]) {
  const [cr, sr, cp, sp, cy, sy] = [roll, pitch, yaw].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
  return new Float64Array([
    ...[cy * cp, sy * cp, -sp, 0],
    ...[cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr, 0],
    ...[cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr, 0],
    ...[x, y, z, 1],
  ]);
}

/**
 * @param {Float64Array} a
 * @param {Float64Array} b
 * @param {Float64Array} into
 */
function multiply(a, b, into) {
  for (let column = 0; column < 16; column += 4) {
    for (let row = 0; row < 4; row += 1) {
      into[column + row] = a[row] * b[column] + a[4 + row] * b[column + 1] + a[8 + row] * b[column + 2] + a[12 + row] * b[column + 3];
    }
  }
}

/**
 * @param {ModelJoint} joint
 * @param {number} position
 * @param {Float64Array} into
 */
function move({ type, axis: [x, y, z] }, position, into) {
  into.set(IDENTITY);
  if (type === "prismatic") {
    into[12] = x * position;
    into[13] = y * position;
    into[14] = z * position;
    return;
  }
  const c = Math.cos(position);
  const s = Math.sin(position);
  const t = 1 - c;
  into[0] = t * x * x + c;
  into[1] = t * x * y + s * z;
  into[2] = t * x * z - s * y;
  into[4] = t * x * y - s * z;
  into[5] = t * y * y + c;
  into[6] = t * y * z + s * x;
  into[8] = t * x * z + s * y;
  into[9] = t * y * z - s * x;
  into[10] = t * z * z + c;
}
