// Zones, table, frames, tool and load in 3D.

/** @import { Pose, Prism, WorkspaceState } from "../../../messages.d.ts" */
/** @import { Palette } from "../palette.js" */
/** @import { Layer } from "../picture.js" */
/** @import { Label } from "./labels.js" */

import { BufferAttribute, BufferGeometry, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh,
  MeshLambertMaterial } from "../../../vendor/three.js";
import { upright } from "../kinematics.js";
import { edges, grown, outline, shapeOf, solid } from "../shapes.js";
import { geometryOf } from "./arm_body.js";

/** Length of the axes of a frame, size of the drawn table, and thickness of its top [m]. */
const AXES = 0.06;
const TABLE = 0.75;
const THICK = 0.004;
/** Number of the wrist's frame, in bodies of mounted tools. */
const WRIST = 4;

/** The surroundings of the arm, and the load of its wrist. */
export class Surroundings {
  constructor() {
    /** In the base. */
    this.fixed = new Group();
    /** In the frame of the tool, and of the wrist. */
    this.atTool = new Group();
    this.atWrist = new Group();
    this.zones = new Group();
    this.margins = new Group();
    this.frames = new Group();
    this.toolAxes = new Group();
    this.atTool.matrixAutoUpdate = false;
    this.atWrist.matrixAutoUpdate = false;
    /** @type {Label[]} */
    this.labels = [];
    /** @type {Map<string, {solid: MeshLambertMaterial | null, line: LineBasicMaterial, color: string}>} */
    this.byName = new Map();
  }

  /**
   * Draw a workspace.
   *
   * @param {WorkspaceState} workspace The workspace.
   * @param {Palette} colors Colours.
   * @param {Set<string>} seen Names of zones that bodies show: their edges are drawn alone.
   */
  set(workspace, colors, seen) {
    for (const group of [this.zones, this.margins, this.frames, this.toolAxes, this.fixed, this.atTool, this.atWrist]) clear(group);
    this.byName.clear();
    this.labels = [];
    this.fixed.add(this.zones, this.margins, this.frames);
    this.atTool.add(this.toolAxes);
    this.toolAxes.add(axes([0, 0, 0, 0], colors));
    this.#addZones(workspace, colors, seen);
    this.#addFrames(workspace, colors);
    const { load, scene } = workspace;
    if (load) this.#addLoad(load, colors);
    for (const [, frame, shapes] of scene.mounted ?? []) {
      if (frame === WRIST) { for (const shape of shapes) this.atWrist.add(body(shape, colors.load, 0.9)); }
    }
  }

  /**
   * @param {WorkspaceState} workspace
   * @param {Palette} colors
   * @param {Set<string>} seen
   */
  #addZones({ scene }, colors, seen) {
    const margin = scene.margin ?? 0;
    for (const value of scene.zones ?? []) {
      const { name, keep_in: keepIn } = value.zone;
      const shape = shapeOf(value);
      const color = keepIn ? colors.keepIn : colors.keepOut;
      const line = lines(edges(shape), color);
      const filled = keepIn || seen.has(name) ? null : body(shape, color, 0.28);
      this.zones.add(line);
      if (filled) this.zones.add(filled);
      this.margins.add(lines(edges(grown(shape, keepIn ? -margin : margin)), color, 0.5));
      this.byName.set(name, {
        solid: filled ? /** @type {MeshLambertMaterial} */ (filled.material) : null,
        line: /** @type {LineBasicMaterial} */ (line.material),
        color,
      });
      this.labels.push({ text: name, at: [shape.x, shape.y, shape.high], layer: "zones" });
    }
    if (typeof scene.table_height !== "number") return;
    const top = scene.table_height;
    const shape = { x: 0, y: 0, half_x: TABLE, half_y: TABLE, low: top - THICK, high: top };
    const table = body(shape, colors.table, 1);
    // The base may stand in the table's top.
    table.position.z = -1e-3;
    this.fixed.add(table);
    this.margins.add(lines(border(grown(shape, margin)), colors.table, 0.6));
    const material = /** @type {MeshLambertMaterial} */ (table.material);
    this.byName.set("table", { solid: material, line: new LineBasicMaterial(), color: colors.table });
  }

  /**
   * @param {WorkspaceState} workspace
   * @param {Palette} colors
   */
  #addFrames({ table }, colors) {
    this.frames.add(axes([0, 0, 0, 0], colors));
    for (const { name, pose_frame_in_base: pose } of table.frames ?? []) {
      this.frames.add(axes(pose, colors));
      this.labels.push({ text: name, at: [pose[0], pose[1], pose[2]], layer: "frames" });
    }
  }

  /**
   * @param {import("../../../messages.d.ts").Load} load
   * @param {Palette} colors
   */
  #addLoad({ name, shape }, colors) {
    this.atTool.add(body(shape, colors.load, 0.85), lines(edges(shape), colors.load));
    this.labels.push({ text: name, at: [0, 0, 0], layer: "labels", tool: true });
  }

  /**
   * Show layers and mark names.
   *
   * @param {Set<Layer>} layers The layers that are shown.
   * @param {string[]} marked Names that are marked.
   * @param {Palette} colors Colours.
   */
  show(layers, marked, colors) {
    this.zones.visible = layers.has("zones");
    this.margins.visible = layers.has("margins");
    this.frames.visible = layers.has("frames");
    this.toolAxes.visible = layers.has("frames");
    for (const [name, { solid: filled, line, color }] of this.byName) {
      const shown = marked.includes(name) ? colors.nearest : color;
      filled?.color.set(shown);
      line.color.set(shown);
    }
  }
}

/**
 * Empty a group.
 *
 * @param {Group} group The group.
 */
export function clear(group) {
  group.traverse((each) => {
    if (each instanceof Mesh || each instanceof LineSegments) {
      each.geometry.dispose();
      each.material.dispose();
    }
  });
  group.clear();
}

/**
 * @param {Prism} shape
 * @param {string} color
 * @param {number} opacity
 */
function body(shape, color, opacity) {
  const transparent = opacity < 1;
  const material = new MeshLambertMaterial({
    color,
    opacity,
    transparent,
    depthWrite: !transparent,
    flatShading: true,
    side: DoubleSide,
  });
  const made = new Mesh(geometryOf(solid(shape)), material);
  made.renderOrder = transparent ? 1 : 0;
  return made;
}

/**
 * Return edges as lines.
 *
 * @param {Float32Array} ends Both ends of each edge, x, y, z [m].
 * @param {string} color Their colour.
 * @param {number} [opacity] Below 1 for faint ones.
 */
export function lines(ends, color, opacity = 1) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(ends, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color, opacity, transparent: opacity < 1 }));
}

/** @param {Prism} shape */
function border(shape) {
  const around = outline(shape);
  return new Float32Array(
    around.flatMap(([x, y], index) => [x, y, shape.high, ...around[(index + 1) % around.length], shape.high]),
  );
}

/**
 * @param {Pose} pose
 * @param {Palette} colors
 */
function axes(pose, colors) {
  const group = new Group();
  group.add(
    lines(new Float32Array([0, 0, 0, AXES, 0, 0]), colors.x),
    lines(new Float32Array([0, 0, 0, 0, AXES, 0]), colors.y),
    lines(new Float32Array([0, 0, 0, 0, 0, AXES]), colors.z),
  );
  group.matrixAutoUpdate = false;
  group.matrix.fromArray(upright(pose));
  for (const each of group.children) {
    each.renderOrder = 3;
    // Seen through the arm, which stands around most of them.
    /** @type {LineSegments<BufferGeometry, LineBasicMaterial>} */ (each).material.depthTest = false;
  }
  return group;
}
