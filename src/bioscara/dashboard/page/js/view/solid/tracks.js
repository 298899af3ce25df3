// Lines in 3D that change often: trace of the tool, path of a plan, the nearest pair.

/** @import { Palette } from "../palette.js" */
/** @import { Picture } from "../picture.js" */

import { BufferAttribute, BufferGeometry, DynamicDrawUsage, Group, Line, LineBasicMaterial, Mesh, MeshBasicMaterial,
  SphereGeometry } from "../../../vendor/three.js";
import { TRACE_POINTS } from "../trace.js";
import { PATH_POINTS } from "../trajectory_curve.js";

/** Radius of the balls that mark the nearest pair [m]. */
const BALL = 0.006;

/** The lines. */
export class Tracks {
  constructor() {
    this.group = new Group();
    this.trace = line(TRACE_POINTS);
    this.path = line(PATH_POINTS);
    this.pair = line(2);
    const ball = new SphereGeometry(BALL, 12, 8);
    this.pairMaterial = new MeshBasicMaterial({ depthTest: false, transparent: true });
    this.balls = [new Mesh(ball, this.pairMaterial), new Mesh(ball, this.pairMaterial)];
    for (const each of [this.pair, ...this.balls]) each.renderOrder = 5;
    this.pair.material.depthTest = false;
    this.group.add(this.trace, this.path, this.pair, ...this.balls);
    /** @type {Palette | null} */
    this.colors = null;
    /** @type {Float32Array | null} */
    this.drawnPath = null;
  }

  /** @param {Palette} colors Colours. */
  paint(colors) {
    this.trace.material.color.set(colors.trace);
    this.path.material.color.set(colors.plan);
    this.colors = colors;
  }

  /** @param {Picture} picture The picture. */
  draw({ trace, path, clearance, layers }) {
    this.trace.visible = layers.has("trace") && trace.count > 1;
    if (this.trace.visible) fill(this.trace, trace.points, trace.count);
    this.path.visible = path !== null;
    if (path && path !== this.drawnPath) fill(this.path, path, path.length / 3);
    this.drawnPath = path;
    const [from, to] = [clearance?.link_point, clearance?.other_point];
    const paired = Boolean(from && to);
    for (const each of [this.pair, ...this.balls]) each.visible = paired;
    if (!from || !to || !clearance || !this.colors) return;
    const color = { below: this.colors.nearest, near: this.colors.near, clear: this.colors.clear }[clearance.level];
    this.pair.material.color.set(color);
    this.pairMaterial.color.set(color);
    fill(this.pair, [...from, ...to], 2);
    this.balls[0].position.set(...from);
    this.balls[1].position.set(...to);
  }
}

/** @param {number} points */
function line(points) {
  const geometry = new BufferGeometry();
  const positions = new BufferAttribute(new Float32Array(3 * points), 3);
  positions.setUsage(DynamicDrawUsage);
  geometry.setAttribute("position", positions);
  const made = new Line(geometry, new LineBasicMaterial());
  // Its bounds would have to be computed for each change.
  made.frustumCulled = false;
  made.visible = false;
  return made;
}

/**
 * @param {Line<BufferGeometry>} drawn
 * @param {ArrayLike<number>} points
 * @param {number} count
 */
function fill(drawn, points, count) {
  const attribute = /** @type {BufferAttribute} */ (drawn.geometry.getAttribute("position"));
  for (let value = 0; value < 3 * count; value += 1) attribute.array[value] = points[value];
  attribute.needsUpdate = true;
  drawn.geometry.setDrawRange(0, count);
}
