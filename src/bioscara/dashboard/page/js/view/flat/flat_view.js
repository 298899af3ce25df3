// The view without WebGL: the arm from above and from the side, as lines.

/** @import { Pose, Prism } from "../../../messages.d.ts" */
/** @import { Kinematics } from "../kinematics.js" */
/** @import { Picture } from "../picture.js" */

import { h } from "../../dom.js";
import { text } from "../../texts.js";
import { grown, outline, shapeOf } from "../shapes.js";
import { bodyOutline } from "./body_outline.js";
import { Projection, attributes, svg } from "./projection.js";

/** Widths of the drawn arm, of its tool and a frame's origin [mm]. */
const ARM = 60;
const TOOL = 14;
const ORIGIN = 5;

/** Draws a picture from above and from the side. */
export class FlatView {
  /**
   * @param {Kinematics} kinematics The arm.
   * @param {(pose: Pose) => void} drag Called with the pose to which the target is dragged.
   */
  constructor(kinematics, drag) {
    this.kinematics = kinematics;
    /** @type {Pose | null} */
    this.target = null;
    const moved = (/** @type {"top" | "side"} */ kind) => (/** @type {number} */ a, /** @type {number} */ b) => {
      if (!this.target) return;
      const [x, y, z, yaw] = this.target;
      drag(kind === "top" ? [a, b, z, yaw] : [x, y, b, yaw]);
    };
    this.views = /** @type {const} */ (["top", "side"]).map((kind) => ({
      kind,
      projection: new Projection(kind, moved(kind)),
    }));
    this.host = h("div", { class: "view-canvas view-flat" },
      ...this.views.map(({ kind, projection }) =>
        h("figure", {}, projection.element, h("figcaption", { text: text(`view.flat_${kind}`) }))
      ));
    /** @type {Picture["workspace"]} */
    this.workspace = null;
    this.shown = "";
  }

  /** Its colours are those of its style sheet. */
  repaint() {}

  /** It is simple already. */
  reduce() {}

  /** It has no camera. */
  look() {}

  /** It has no camera. */
  step() {}

  /** @param {Picture} picture The picture. */
  draw(picture) {
    this.target = picture.target;
    this.host.classList.toggle("stale", !picture.fresh);
    const marked = [...picture.collision, ...(picture.clearance?.level === "below" ? [picture.clearance.other] : [])];
    const shown = [...picture.layers, "", ...marked].join("\n");
    if (picture.workspace !== this.workspace || shown !== this.shown) {
      this.workspace = picture.workspace;
      this.shown = shown;
      for (const { projection } of this.views) this.#surroundings(projection, picture, marked);
    }
    for (const { projection } of this.views) {
      this.#bodies(projection, picture);
      this.#arm(projection, picture);
    }
  }

  /**
   * @param {Projection} projection
   * @param {Picture} picture
   * @param {string[]} marked
   */
  #surroundings(projection, { workspace, layers }, marked) {
    const { surroundings } = projection;
    surroundings.replaceChildren();
    const { scene } = workspace ?? {};
    const side = projection.kind === "side";
    if (side && typeof scene?.table_height === "number") {
      surroundings.append(svg("path", { class: "table", d: `M-1000,${-1000 * scene.table_height} H1000` }));
    }
    for (const value of layers.has("zones") ? scene?.zones ?? [] : []) {
      const shape = shapeOf(value);
      const keepIn = value.zone.keep_in === true;
      const kind = `zone ${keepIn ? "keep-in" : ""} ${marked.includes(value.zone.name) ? "marked" : ""}`;
      surroundings.append(svg("polygon", { class: kind, points: projected(projection, shape) }));
      if (layers.has("margins")) {
        const margin = (keepIn ? -1 : 1) * (scene?.margin ?? 0);
        surroundings.append(
          svg("polygon", { class: keepIn ? "margin keep-in" : "margin", points: projected(projection, grown(shape, margin)) }),
        );
      }
      if (layers.has("labels")) {
        const [u, v] = projection.of(shape.x, shape.y, shape.high);
        surroundings.append(svg("text", { x: u, y: v }, value.zone.name));
      }
    }
    for (const { name, pose_frame_in_base: [x, y, z] } of layers.has("frames") ? workspace?.table.frames ?? [] : []) {
      const [u, v] = projection.of(x, y, z);
      surroundings.append(svg("circle", { class: "frame", cx: u, cy: v, r: ORIGIN }), svg("text", { x: u, y: v }, name));
    }
  }

  /**
   * @param {Projection} projection
   * @param {Picture} picture
   */
  #bodies(projection, picture) {
    const { bodies } = projection;
    const shapes = picture.layers.has("bodies") ? picture.bodies.filter(([, kind]) => kind !== "jaw") : [];
    const poses = new Map(picture.bodyPoses.map((pose) => [pose[0], pose]));
    while (bodies.children.length > shapes.length) bodies.lastChild?.remove();
    while (bodies.children.length < shapes.length) bodies.append(svg("polygon", {}));
    shapes.forEach((shape, index) => {
      const pose = poses.get(shape[0]);
      if (!pose) return;
      const color = (this.kinematics.model.body_colors[shape[1]] ?? [0.5, 0.5, 0.5]).map((share) => Math.round(255 * share));
      attributes(bodies.children[index], { points: bodyOutline(projection, shape, pose), stroke: `rgb(${color})`, "stroke-width": 8 });
    });
  }

  /**
   * @param {Projection} projection
   * @param {Picture} picture
   */
  #arm(projection, picture) {
    const { trace, path, layers, target } = picture;
    this.#body(projection.live, projection, picture.live, picture);
    this.#body(projection.commanded, projection, picture.commandedElsewhere ? picture.commandedRoom : null, picture);
    this.#body(projection.planned, projection, picture.curve ? picture.plannedRoom : null, picture);
    attributes(projection.trace, { points: layers.has("trace") ? projection.line(trace.points, trace.count) : "" });
    attributes(projection.path, { points: path ? projection.line(path, path.length / 3) : "" });
    const [from, to] = [picture.clearance?.link_point, picture.clearance?.other_point];
    attributes(projection.pair, { points: from && to ? projection.line([...from, ...to], 2) : "" });
    projection.showTarget(target);
  }

  /**
   * @param {SVGGElement} group
   * @param {Projection} projection
   * @param {Map<string, Float64Array> | null} room
   * @param {Picture} picture
   */
  #body(group, projection, room, picture) {
    group.style.display = room ? "" : "none";
    if (!room) return;
    const [limb, tool] = group.children;
    // The axes of the joints, at the height of the arm; the column goes up from the base.
    const ends = this.#axes(room);
    attributes(limb, { points: ends.map((end) => projection.of(...end).join(",")).join(" "), "stroke-width": ARM });
    const pose = this.kinematics.toolPose(room, picture.tool);
    const [x, y, z, yaw] = pose;
    const wrist = ends[ends.length - 1];
    const down = projection.of(wrist[0], wrist[1], z);
    const tip = [x + 0.03 * Math.cos(yaw), y + 0.03 * Math.sin(yaw), z];
    const places = [projection.of(...wrist), down, projection.of(x, y, z), projection.of(tip[0], tip[1], tip[2])];
    attributes(tool, { points: places.map((place) => place.join(",")).join(" "), "stroke-width": TOOL });
  }

  /**
   * @param {Map<string, Float64Array>} room
   * @returns {[number, number, number][]}
   */
  #axes(room) {
    const { model, names } = this.kinematics;
    const moving = model.joints.filter((joint) => names.includes(joint.name));
    const height = room.get(this.kinematics.wrist)?.[14] ?? 0;
    /** @type {[number, number, number][]} */
    const ends = [[0, 0, 0]];
    for (const { child } of moving) {
      const placement = room.get(child);
      if (placement) ends.push([placement[12], placement[13], height]);
    }
    return ends;
  }
}

/**
 * @param {Projection} projection
 * @param {Prism} shape
 */
function projected(projection, shape) {
  const around = outline(shape);
  if (projection.kind === "top") return around.map(([x, y]) => projection.of(x, y, 0).join(",")).join(" ");
  const xs = around.map(([x]) => x);
  const [low, high] = [Math.min(...xs), Math.max(...xs)];
  const corners = [[low, shape.low], [high, shape.low], [high, shape.high], [low, shape.high]];
  return corners.map(([x, z]) => projection.of(x, 0, z).join(",")).join(" ");
}
