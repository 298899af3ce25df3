// The view in 3D.

/** @import { Pose } from "../../../messages.d.ts" */
/** @import { Kinematics } from "../kinematics.js" */
/** @import { Picture } from "../picture.js" */
/** @import { Preset } from "./stage.js" */

import { upright } from "../kinematics.js";
import { palette } from "../palette.js";
import { ArmBody, geometryOf } from "./arm_body.js";
import { Bodies } from "./bodies.js";
import { Handle } from "./handle.js";
import { Labels } from "./labels.js";
import { Stage } from "./stage.js";
import { Surroundings } from "./surroundings.js";
import { Tracks } from "./tracks.js";

/** Angle and distance of one press of a button or key [rad, pixel], and factor of the zoom. */
const TURN = Math.PI / 12;
const PAN = 40;
const ZOOM = 1.2;

/** Links of the gripper, which another mounted tool replaces. */
const GRIPPER_LINKS = new Set(["grp_base_link", "left_jaw_link", "right_jaw_link"]);

/** Draws a picture in 3D. */
export class SolidView {
  /**
   * @param {Kinematics} kinematics The arm.
   * @param {Map<string, Float32Array>} meshes Its meshes.
   * @param {{changed: () => void, drag: (pose: Pose) => void, busy: (turning: boolean) => void}} calls Called when
   *   the camera has moved, when the target is dragged, and when a person begins or ends to drag.
   * @throws {Error} The browser has no WebGL.
   */
  constructor(kinematics, meshes, calls) {
    this.stage = new Stage(calls.changed);
    this.host = this.stage.host;
    this.kinematics = kinematics;
    const geometries = new Map([...meshes].map(([name, corners]) => [name, geometryOf(corners)]));
    this.colors = palette();
    this.body = new ArmBody(kinematics.model, geometries);
    this.commanded = new ArmBody(kinematics.model, geometries, this.colors.commanded);
    this.planned = new ArmBody(kinematics.model, geometries, this.colors.plan);
    this.surroundings = new Surroundings();
    this.bodies = new Bodies(kinematics.model);
    this.tracks = new Tracks();
    this.labels = new Labels();
    this.handle = new Handle(this.stage, calls.drag, calls.busy);
    this.stage.controls.addEventListener("start", () => calls.busy(true));
    this.stage.controls.addEventListener("end", () => calls.busy(false));
    const { fixed, atTool, atWrist } = this.surroundings;
    this.stage.scene.add(
      this.body.group,
      this.commanded.group,
      this.planned.group,
      this.bodies.group,
      fixed,
      atTool,
      atWrist,
      this.tracks.group,
      this.handle.group,
    );
    this.host.append(this.labels.host);
    /** @type {Picture["workspace"]} */
    this.workspace = null;
    /** @type {Picture["bodies"]} */
    this.shapes = [];
    this.repaint();
  }

  /** Take the colours of the page again. */
  repaint() {
    this.colors = palette();
    this.stage.paint(this.colors);
    this.tracks.paint(this.colors);
    this.commanded.paint(this.colors.commanded);
    this.planned.paint(this.colors.plan);
    this.workspace = null;
  }

  /** Draw with less effort. */
  reduce() {
    this.stage.reduce();
    this.stage.paint(this.colors);
  }

  /** @param {Picture} picture The picture. */
  draw(picture) {
    const { live, workspace, clearance, collision } = picture;
    if (picture.bodies !== this.shapes) {
      this.shapes = picture.bodies;
      this.bodies.set(this.shapes);
      this.workspace = null;
    }
    this.bodies.group.visible = picture.layers.has("bodies");
    this.bodies.place(picture.bodyPoses);
    if (workspace && workspace !== this.workspace) {
      this.workspace = workspace;
      this.surroundings.set(workspace, this.colors, new Set(this.shapes.map(([name]) => name)));
      const other = workspace.scene.mounted !== null && workspace.scene.mounted !== undefined;
      for (const body of [this.body, this.commanded, this.planned]) body.showLinks((name) => !other || !GRIPPER_LINKS.has(name));
    }
    this.body.place(live);
    this.body.paint(picture.fresh ? null : this.colors.stale);
    this.#ghost(this.commanded, picture.commandedElsewhere, picture.commandedRoom);
    this.#ghost(this.planned, picture.curve !== null, picture.plannedRoom);
    const tool = this.kinematics.toolPose(live, picture.tool);
    set(this.surroundings.atTool, upright(tool));
    const wrist = live.get(this.kinematics.wrist);
    if (wrist) set(this.surroundings.atWrist, wrist);
    const close = clearance?.level === "below" ? [clearance.link, clearance.other] : [];
    this.surroundings.show(picture.layers, [...collision, ...close], this.colors);
    this.tracks.draw(picture);
    this.stage.follow(tool[0], tool[1], tool[2]);
    this.handle.draw(picture.target, this.colors);
    this.stage.render();
    this.labels.draw(this.surroundings.labels, picture.layers, this.stage.camera, [tool[0], tool[1], tool[2]]);
  }

  /**
   * @param {ArmBody} body
   * @param {boolean} visible
   * @param {Map<string, Float64Array>} room
   */
  #ghost(body, visible, room) {
    body.group.visible = visible;
    if (visible) body.place(room);
  }

  /** @param {Preset} preset Where the camera looks from. */
  look(preset) {
    this.stage.look(preset);
  }

  /**
   * Move the camera by a step.
   *
   * @param {"left" | "right" | "up" | "down" | "pan-left" | "pan-right" | "pan-up" | "pan-down" | "in" | "out"} step
   *   The step.
   */
  step(step) {
    const steps = {
      left: () => this.stage.turn(-TURN, 0),
      right: () => this.stage.turn(TURN, 0),
      up: () => this.stage.turn(0, TURN),
      down: () => this.stage.turn(0, -TURN),
      "pan-left": () => this.stage.pan(PAN, 0),
      "pan-right": () => this.stage.pan(-PAN, 0),
      "pan-up": () => this.stage.pan(0, PAN),
      "pan-down": () => this.stage.pan(0, -PAN),
      in: () => this.stage.zoom(ZOOM),
      out: () => this.stage.zoom(1 / ZOOM),
    };
    steps[step]();
  }
}

/**
 * @param {import("../../../vendor/three.js").Group} group
 * @param {Float64Array} placement
 */
function set(group, placement) {
  group.matrix.fromArray(placement);
  group.matrixWorldNeedsUpdate = true;
}
