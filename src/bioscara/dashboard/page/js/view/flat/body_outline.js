// A body around a simulated arm in a flat picture: the outline of the box around its parts.

/** @import { BodyPose, BodyShape } from "../../../messages.d.ts" */
/** @import { Projection } from "./projection.js" */

/**
 * Return the corners of a body's outline, as the points of a polygon.
 *
 * @param {Projection} projection The picture.
 * @param {BodyShape} shape The body.
 * @param {BodyPose} pose Where it is.
 * @returns {string} The points.
 */
export function bodyOutline(projection, [, , , boxes], pose) {
  const ends = [-1, 1].map((sign) => [0, 1, 2].map((axis) => sign * Math.max(...boxes.map((box) => sign * box[axis] + box[axis + 3]))));
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) =>
    projection.of(...placed(pose, [0, 1, 2].map((axis) => ends[(corner >> axis) & 1][axis])))
  );
  return hull(corners).map((place) => place.join(",")).join(" ");
}

/**
 * @param {BodyPose} pose
 * @param {number[]} point
 * @returns {[number, number, number]}
 */
function placed([, x, y, z, w, a, b, c], [px, py, pz]) {
  // Twice the vector part of the quaternion, times the point.
  const [u, v, t] = [2 * (b * pz - c * py), 2 * (c * px - a * pz), 2 * (a * py - b * px)];
  return [x + px + w * u + b * t - c * v, y + py + w * v + c * u - a * t, z + pz + w * t + a * v - b * u];
}

/**
 * Return the corners of the convex hull, in order.
 *
 * @param {[number, number][]} points
 */
function hull(points) {
  const sorted = [...points].sort(([x, y], [u, v]) => x - u || y - v);
  const half = (/** @type {[number, number][]} */ order) => {
    /** @type {[number, number][]} */
    const kept = [];
    for (const point of order) {
      while (kept.length > 1 && !turnsLeft(kept[kept.length - 2], kept[kept.length - 1], point)) kept.pop();
      kept.push(point);
    }
    return kept.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/**
 * @param {[number, number]} a
 * @param {[number, number]} b
 * @param {[number, number]} c
 */
function turnsLeft([x, y], [u, v], [s, t]) {
  return (u - x) * (t - y) > (v - y) * (s - x);
}
