// Upright shapes as outlines and solids: a rectangle, offset outwards by a radius, between two heights.

/** @import { BoxZone, CylinderZone, Prism } from "../../messages.d.ts" */

/** Points of a round corner. */
const CORNER = 9;

/**
 * Return a zone as a shape in the base.
 *
 * @param {BoxZone | CylinderZone} value The zone.
 * @returns {Required<Prism>} The shape.
 */
export function shapeOf(value) {
  if (value.kind === "cylinder") {
    const { x, y, radius, low, high } = value.zone;
    return { x, y, half_x: 0, half_y: 0, low, high, radius, yaw: 0 };
  }
  const { lower, upper, yaw = 0 } = value.zone;
  return {
    x: (lower[0] + upper[0]) / 2,
    y: (lower[1] + upper[1]) / 2,
    half_x: (upper[0] - lower[0]) / 2,
    half_y: (upper[1] - lower[1]) / 2,
    low: lower[2],
    high: upper[2],
    radius: 0,
    yaw,
  };
}

/**
 * Return a shape that is larger on all sides.
 *
 * @param {Prism} shape The shape.
 * @param {number} margin How much larger [m]; negative for smaller.
 * @returns {Prism} The larger shape.
 */
export function grown(shape, margin) {
  const { radius = 0 } = shape;
  const grows = margin >= 0 || radius + margin > 0;
  return {
    ...shape,
    half_x: grows ? shape.half_x : Math.max(shape.half_x + margin, 0),
    half_y: grows ? shape.half_y : Math.max(shape.half_y + margin, 0),
    radius: grows ? radius + margin : 0,
    low: shape.low - margin,
    high: shape.high + margin,
  };
}

/**
 * Return the outline of a shape in plan view, counterclockwise.
 *
 * @param {Prism} shape The shape.
 * @returns {[number, number][]} Its corners x, y [m], in the frame of the shape.
 */
export function outline({ x, y, half_x: a, half_y: b, radius = 0, yaw = 0 }) {
  const c = Math.cos(yaw);
  const s = Math.sin(yaw);
  const steps = radius > 0 ? CORNER : 1;
  /** @type {[number, number][]} */
  const corners = [];
  [[a, b], [-a, b], [-a, -b], [a, -b]].forEach(([dx, dy], quarter) => {
    for (let step = 0; step < steps; step += 1) {
      const angle = (Math.PI / 2) * (quarter + (steps > 1 ? step / (steps - 1) : 0));
      const px = dx + radius * Math.cos(angle);
      const py = dy + radius * Math.sin(angle);
      corners.push([x + c * px - s * py, y + s * px + c * py]);
    }
  });
  return corners;
}

/**
 * Return the surface of a shape.
 *
 * @param {Prism} shape The shape.
 * @returns {Float32Array} Three corners for each triangle, x, y, z [m], counterclockwise from outside.
 */
export function solid(shape) {
  const around = outline(shape);
  const { low, high } = shape;
  /** @type {number[]} */
  const corners = [];
  around.forEach(([x, y], index) => {
    const [u, v] = around[(index + 1) % around.length];
    corners.push(x, y, low, u, v, low, u, v, high, x, y, low, u, v, high, x, y, high);
    if (index === 0 || index === around.length - 1) return;
    const [ox, oy] = around[0];
    corners.push(ox, oy, low, u, v, low, x, y, low, ox, oy, high, x, y, high, u, v, high);
  });
  return new Float32Array(corners);
}

/**
 * Return the edges of a shape: both borders, and posts at its sides.
 *
 * @param {Prism} shape The shape.
 * @returns {Float32Array} Both ends of each edge, x, y, z [m].
 */
export function edges(shape) {
  const around = outline(shape);
  const { low, high } = shape;
  const post = Math.max(1, around.length / 4);
  /** @type {number[]} */
  const ends = [];
  around.forEach(([x, y], index) => {
    const [u, v] = around[(index + 1) % around.length];
    ends.push(x, y, low, u, v, low, x, y, high, u, v, high);
    if (index % post === 0) ends.push(x, y, low, x, y, high);
  });
  return new Float32Array(ends);
}
