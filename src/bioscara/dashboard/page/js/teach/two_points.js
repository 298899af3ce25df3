// A frame from two points of it: its origin, and a point on its x axis. Knows no page.

/** @import { Pose } from "../../messages.d.ts" */

/** Least distance of the points [m], as of `Frame.from_points`: half a millimetre of error is then 1.4 degrees. */
export const APART = 0.02;

/**
 * A frame that two points give. All poses of the arm are upright, so that a third point would add nothing.
 *
 * @typedef {Object} Found
 * @property {Pose} pose Origin and direction of the frame in the base [m, rad].
 * @property {number} distance Of the points in plan view [m].
 * @property {number} rise How far the second point is above the first one, which does not count [m].
 * @property {boolean} apart Whether they are far enough from each other for a direction.
 */

/**
 * Return the frame of two points.
 *
 * @param {Pose} origin Pose of the tool at its origin.
 * @param {Pose} onX Pose of the tool on its x axis, at positive x.
 * @returns {Found} The frame.
 */
export function frameOf(origin, onX) {
  const [ahead, left] = [onX[0] - origin[0], onX[1] - origin[1]];
  const distance = Math.hypot(ahead, left);
  const [x, y, z] = origin;
  return { pose: [x, y, z, Math.atan2(left, ahead)], distance, rise: onX[2] - z, apart: distance >= APART };
}
