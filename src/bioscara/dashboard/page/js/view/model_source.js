// The model of the arm and its meshes, from the gateway.

/** @import { Model } from "./kinematics.js" */

const HEADER = 84;
const FACET = 50;

/**
 * Fetch the model.
 *
 * @returns {Promise<Model>} The model.
 */
export async function fetchModel() {
  return (await required("api/model")).json();
}

/**
 * Fetch all meshes of a model.
 *
 * @param {Model} model The model.
 * @returns {Promise<Map<string, Float32Array>>} Corners of the triangles, x, y, z [m], by the names of the meshes.
 */
export async function fetchMeshes(model) {
  const names = [...new Set(model.links.flatMap((link) => link.visuals.map((visual) => visual.mesh)))];
  const meshes = await Promise.all(
    names.map(async (name) => triangles(await (await required(`api/meshes/${name}`)).arrayBuffer())),
  );
  return new Map(names.map((name, index) => [name, meshes[index]]));
}

/**
 * Read a binary STL file.
 *
 * @param {ArrayBuffer} file The file.
 * @returns {Float32Array} Three corners for each triangle, x, y, z.
 */
export function triangles(file) {
  const view = new DataView(file);
  const count = file.byteLength < HEADER ? 0 : view.getUint32(HEADER - 4, true);
  if (file.byteLength !== HEADER + FACET * count) throw new Error("a mesh is no binary STL file");
  const corners = new Float32Array(9 * count);
  for (let facet = 0; facet < count; facet += 1) {
    // The facet begins with its normal, which follows from the corners.
    const begin = HEADER + FACET * facet + 12;
    for (let value = 0; value < 9; value += 1) corners[9 * facet + value] = view.getFloat32(begin + 4 * value, true);
  }
  return corners;
}

/** @param {string} path */
async function required(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(`${path}: ${answer.status} ${answer.statusText}`);
  return answer;
}
