// The content of the view, as values: drawn in 3D, or flat where there is no WebGL.

/** @import { BodyPose, BodyShape, Pose, WorkspaceState } from "../../messages.d.ts" */
/** @import { App, Preview } from "../app.js" */
/** @import { Clearance } from "./clearance.js" */
/** @import { Kinematics } from "./kinematics.js" */

import { GRIPPER } from "./kinematics.js";
import { Trace } from "./trace.js";
import { TrajectoryCurve } from "./trajectory_curve.js";

/** Difference from which a joint counts as moved [rad or m], above the noise of its encoder; and as elsewhere than commanded. */
const MOVED = 3e-5;
const ELSEWHERE = { rad: 0.01, m: 1e-3 };
/** The bodies of an arm without a world. @type {BodyShape[]} */
const NOTHING = [];

/**
 * Layers that can be shown or hidden.
 *
 * @typedef {"frames" | "zones" | "margins" | "bodies" | "trace" | "labels"} Layer
 */

/** The values of the drawing. */
export class Picture {
  /**
   * @param {App} app The page.
   * @param {Kinematics} kinematics The arm.
   */
  constructor(app, kinematics) {
    this.app = app;
    this.kinematics = kinematics;
    /** Placements of the links as they are. */
    this.live = kinematics.room();
    /** As commanded, and as planned. */
    this.commandedRoom = kinematics.room();
    this.plannedRoom = kinematics.room();
    /** Whether the positions are those of now; else the arm is drawn grey. */
    this.fresh = false;
    /** Joints whose position is unknown. @type {string[]} */
    this.unknown = [];
    this.trace = new Trace();
    /** @type {Float32Array | null} */
    this.path = null;
    /** @type {TrajectoryCurve | null} */
    this.curve = null;
    /** @type {Preview | null} */
    this.preview = null;
    /** Pose of the target of the tool; null without one. @type {Pose | null} */
    this.target = null;
    /** @type {Clearance | null} */
    this.clearance = null;
    /** Names of the bodies that a refused plan would touch. @type {string[]} */
    this.collision = [];
    /** @type {Set<Layer>} */
    this.layers = new Set(["frames", "zones", "bodies", "trace", "labels"]);
    /** @type {Record<string, number | null>} */
    this.positions = {};
    /** @type {Record<string, number | null>} */
    this.commands = {};
  }

  /** @returns {WorkspaceState | null} */
  get workspace() {
    return this.app.arm.workspace;
  }

  /** The bodies around a simulated arm. @returns {BodyShape[]} */
  get bodies() {
    return this.app.arm.bodies?.bodies ?? NOTHING;
  }

  /** @returns {BodyPose[]} */
  get bodyPoses() {
    return this.app.arm.bodyPoses;
  }

  /** Pose of the tool in the flange. @returns {Pose} */
  get tool() {
    return this.workspace?.tool.pose_tool_in_flange ?? [0, 0, 0, 0];
  }

  /**
   * Take the newest sample.
   *
   * @returns {boolean} Whether the drawing has changed.
   */
  take() {
    const { sample, fresh, world } = this.app.arm;
    if (!sample) return false;
    const known = fresh && sample.pose !== null;
    let changed = known !== this.fresh;
    this.fresh = known;
    this.unknown = sample.names.filter((_, joint) => sample.positions[joint] === null || sample.qualities[joint] > 1);
    sample.names.forEach((name, joint) => {
      changed = keep(this.positions, name, sample.positions[joint]) || changed;
      changed = keep(this.commands, name, sample.commands[joint]) || changed;
    });
    // A simulated world knows where the jaws are, and not only where they are commanded to be.
    changed = keep(this.positions, GRIPPER, world?.width ?? sample.width) || changed;
    this.commands[GRIPPER] = this.positions[GRIPPER] ?? null;
    if (known && sample.pose) changed = this.trace.add(sample.time, sample.pose) || changed;
    return changed;
  }

  /** Take the trajectory that the page previews, if it is another one. */
  takePreview() {
    const { preview } = this.app;
    if (preview?.trajectory !== this.preview?.trajectory) {
      this.curve = preview ? new TrajectoryCurve(preview.trajectory) : null;
      this.path = this.curve ? this.curve.path(this.kinematics, this.tool) : null;
    }
    this.preview = preview;
  }

  /** Compute the placements, just before they are drawn. */
  place() {
    this.kinematics.place(this.positions, this.live);
    if (this.commandedElsewhere) this.kinematics.place(this.commands, this.commandedRoom);
    if (!this.curve || !this.preview) return;
    const positions = this.curve.at(this.preview.time);
    positions[GRIPPER] = this.positions[GRIPPER] ?? null;
    // A trajectory of some joints leaves the others where they are.
    for (const name of this.kinematics.names) positions[name] ??= this.positions[name] ?? null;
    this.kinematics.place(positions, this.plannedRoom);
  }

  /** Whether a joint is commanded to be elsewhere than it is. */
  get commandedElsewhere() {
    if (!this.fresh) return false;
    return this.app.arm.joints.some(({ name, unit }) => {
      const [command, position] = [this.commands[name], this.positions[name]];
      const allowed = unit === "m" ? ELSEWHERE.m : ELSEWHERE.rad;
      return typeof command === "number" && typeof position === "number" && Math.abs(command - position) > allowed;
    });
  }
}

/**
 * @param {Record<string, number | null>} values
 * @param {string} name
 * @param {number | null} value
 */
function keep(values, name, value) {
  const former = values[name];
  // An unknown position leaves the joint drawn where it was last, in grey.
  if (value === null || value === undefined) return false;
  if (typeof former === "number" && Math.abs(former - value) < MOVED) return false;
  values[name] = value;
  return true;
}
