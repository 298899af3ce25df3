// The bodies around a simulated arm in 3D.

/** @import { BodyPose, BodyShape } from "../../../messages.d.ts" */
/** @import { Model } from "../kinematics.js" */

import { Group, Mesh, MeshLambertMaterial } from "../../../vendor/three.js";
import { edges, solid } from "../shapes.js";
import { geometryOf } from "./arm_body.js";
import { clear, lines } from "./surroundings.js";

/** Kind of the bodies that the meshes of the arm show already. */
const JAW = "jaw";
/** Brightness of the edges, as a share of that of the faces. */
const EDGE = 0.45;

/** The bodies, each in a group of its own. */
export class Bodies {
  /** @param {Model} model The arm, with the colours of the kinds. */
  constructor(model) {
    this.group = new Group();
    this.colors = model.body_colors;
    /** @type {Map<string, Group>} */
    this.byName = new Map();
  }

  /**
   * Draw other bodies.
   *
   * @param {BodyShape[]} shapes Name, kind, whether it moves, and boxes of each.
   */
  set(shapes) {
    clear(this.group);
    this.byName.clear();
    for (const [name, kind, , boxes] of shapes) {
      if (kind === JAW) continue;
      const color = this.colors[kind] ?? [0.5, 0.5, 0.5];
      const parts = boxes.map(([x, y, z, a, b, c]) => ({ x, y, half_x: a, half_y: b, low: z - c, high: z + c }));
      const material = new MeshLambertMaterial({ color: rgb(color, 1), flatShading: true });
      const group = new Group();
      // One of each for all boxes: there may be hundreds of bodies.
      group.add(new Mesh(geometryOf(joined(parts.map(solid))), material), lines(joined(parts.map(edges)), rgb(color, EDGE)));
      this.byName.set(name, group);
      this.group.add(group);
    }
  }

  /**
   * Move them.
   *
   * @param {BodyPose[]} poses Where they are.
   */
  place(poses) {
    for (const [name, x, y, z, qw, qx, qy, qz] of poses) {
      const group = this.byName.get(name);
      group?.position.set(x, y, z);
      group?.quaternion.set(qx, qy, qz, qw);
    }
  }
}

/**
 * @param {number[]} color
 * @param {number} brightness
 */
function rgb(color, brightness) {
  return `rgb(${color.map((share) => Math.round(255 * brightness * share)).join(",")})`;
}

/** @param {Float32Array[]} arrays */
function joined(arrays) {
  return new Float32Array(arrays.flatMap((each) => [...each]));
}
