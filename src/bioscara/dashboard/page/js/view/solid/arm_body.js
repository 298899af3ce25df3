// The arm in 3D, from its meshes: as it is, or as a ghost.

/** @import { Model } from "../kinematics.js" */

import { BufferAttribute, BufferGeometry, Group, Mesh, MeshLambertMaterial } from "../../../vendor/three.js";
import { placed } from "../kinematics.js";

/** How a ghost is drawn: where it is in the same place as the arm, behind it. */
const GHOSTLY = { transparent: true, opacity: 0.38, depthWrite: false, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4 };

/** The links of the arm, each with its meshes. */
export class ArmBody {
  /**
   * @param {Model} model The arm.
   * @param {Map<string, BufferGeometry>} meshes Its meshes.
   * @param {string | null} ghost Colour of a ghost; null for the colours of the arm.
   */
  constructor(model, meshes, ghost = null) {
    this.group = new Group();
    /** @type {Map<string, Group>} */
    this.links = new Map();
    /** @type {Map<string, MeshLambertMaterial>} */
    this.materials = new Map();
    this.ghost = ghost !== null;
    this.tint = ghost ?? "";
    for (const link of model.links) {
      const group = new Group();
      group.matrixAutoUpdate = false;
      for (const { mesh, color, origin } of link.visuals) {
        const geometry = meshes.get(mesh);
        if (!geometry) continue;
        const body = new Mesh(geometry, this.#material(ghost ?? rgb(color)));
        body.matrixAutoUpdate = false;
        body.matrix.fromArray(placed(origin));
        body.renderOrder = this.ghost ? 2 : 0;
        group.add(body);
      }
      this.links.set(link.name, group);
      this.group.add(group);
    }
  }

  /** @param {string} color */
  #material(color) {
    let material = this.materials.get(color);
    if (!material) {
      const see = this.ghost ? GHOSTLY : {};
      material = new MeshLambertMaterial({ color, flatShading: true, ...see });
      this.materials.set(color, material);
    }
    return material;
  }

  /**
   * Move the links.
   *
   * @param {Map<string, Float64Array>} placements Their placements.
   */
  place(placements) {
    for (const [name, group] of this.links) {
      const placement = placements.get(name);
      if (!placement) continue;
      group.matrix.fromArray(placement);
      group.matrixWorldNeedsUpdate = true;
    }
  }

  /**
   * Draw it in one colour, or in its own.
   *
   * @param {string | null} color The colour; null for its own.
   */
  paint(color) {
    if ((color ?? "") === this.tint) return;
    this.tint = color ?? "";
    for (const [own, material] of this.materials) material.color.set(color ?? own);
  }

  /**
   * Show or hide the gripper, for another mounted tool.
   *
   * @param {(name: string) => boolean} shows Whether a link is shown.
   */
  showLinks(shows) {
    for (const [name, group] of this.links) group.visible = shows(name);
  }
}

/**
 * Return triangles as a geometry.
 *
 * @param {Float32Array} corners x, y, z of three corners for each triangle [m].
 * @returns {BufferGeometry} The geometry.
 */
export function geometryOf(corners) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(corners, 3));
  geometry.computeVertexNormals();
  return geometry;
}

/** @param {[number, number, number]} color */
function rgb(color) {
  return `rgb(${color.map((share) => Math.round(255 * share)).join(",")})`;
}
