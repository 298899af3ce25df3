// What "bioscara view" shows, in place of the connection to an owner: it answers for the arm and reports where it is.

/** @import { Pose, TrajectoryValue, WorkspaceState } from "../../messages.d.ts" */
/** @import { Model } from "./kinematics.js" */

import { GRIPPER, Kinematics } from "./kinematics.js";

/**
 * The answer of the server.
 *
 * @typedef {Object} Viewed
 * @property {string} title Its title.
 * @property {import("../../messages.d.ts").Description["parameters"]} parameters Parameters of the arm.
 * @property {WorkspaceState} workspace Tool, scene and load.
 * @property {number[]} positions Where the arm is shown at first [rad or m].
 * @property {string[]} notes Notes for the person.
 * @property {TrajectoryValue | null} motion The motion to play.
 * @property {[number, string][]} phases Begin of each part of the motion [s], and its name.
 * @property {boolean} live Whether the arm moves now.
 */

/** Stands in for a `Connection` that only looks. */
export class ViewedSource {
  /**
   * @param {Viewed} viewed The content.
   * @param {Model} model The arm.
   */
  constructor(viewed, model) {
    this.open = true;
    this.roundTrip = 0;
    this.names = viewed.parameters.joints.map(({ name }) => name);
    this.kinematics = new Kinematics(model, this.names);
    this.room = this.kinematics.room();
    /** @type {Pose} */
    this.tool = viewed.workspace.tool.pose_tool_in_flange;
    /** @type {Record<string, unknown>} */
    this.answers = { get_description: { parameters: viewed.parameters }, get_workspace: viewed.workspace };
    /** By joint, with that of the gripper [rad or m]. @type {Record<string, number | null>} */
    this.positions = Object.fromEntries(this.names.map((name, index) => [name, viewed.positions[index]]));
    this.time = 0;
    /** @type {Map<string, (message: any) => void>} */
    this.handlers = new Map();
  }

  /**
   * @param {string} kind Kind of messages.
   * @param {(message: any) => void} handler Called with each.
   */
  on(kind, handler) {
    this.handlers.set(kind, handler);
  }

  /** @param {{kind: string}} command @returns {Promise<any>} */
  request({ kind }) {
    const answer = this.answers[kind];
    return answer ? Promise.resolve(answer) : Promise.reject(new Error(kind));
  }

  post() {}

  renew() {}

  /** Begin, as an owner does when it greets. */
  begin() {
    this.handlers.get("welcome")?.({ instance: "viewed", last_event: 0, resumed: false });
  }

  /**
   * Show the arm at positions.
   *
   * @param {Record<string, number | null>} positions By joint [rad or m]; others stay.
   * @param {number} time Time [s].
   */
  show(positions, time) {
    Object.assign(this.positions, positions);
    this.time = time;
    this.report();
  }

  /** Report the positions again, as an owner does in each cycle. */
  report() {
    const positions = this.names.map((name) => this.positions[name]);
    this.kinematics.place(this.positions, this.room);
    this.handlers.get("state")?.({
      cycle: 0,
      time: this.time,
      names: this.names,
      positions,
      commands: positions,
      qualities: positions.map(() => 0),
      width: this.positions[GRIPPER] ?? null,
      pose: this.kinematics.toolPose(this.room, this.tool),
      stale: false,
      fault: "",
    });
  }
}
