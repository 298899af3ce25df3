// A trajectory between its points, as the arm follows it: quintics, cubics or straight lines.

/** @import { Pose, TrajectoryValue } from "../../messages.d.ts" */
/** @import { Kinematics } from "./kinematics.js" */

/** Largest number of points of a drawn path. */
export const PATH_POINTS = 3000;

/** The curve of a trajectory; before its first point and after its last one it rests. */
export class TrajectoryCurve {
  /** @param {TrajectoryValue} value The trajectory. */
  constructor(value) {
    this.value = value;
    /** Time at which it begins: 0, or before that of a measured one [s]. */
    this.begin = Math.min(value.times[0] ?? 0, 0);
    /** Time at which it ends [s]. */
    this.duration = value.times[value.times.length - 1] ?? 0;
    /** Positions at the time that was asked for last. @type {Record<string, number | null>} */
    this.positions = {};
  }

  /**
   * Return the positions at a time; the same object with each call.
   *
   * @param {number} time Time since the begin [s].
   * @returns {Record<string, number | null>} By joint [rad or m].
   */
  at(time) {
    const { joint_names: names, times, positions } = this.value;
    const last = times.length - 1;
    const index = this.#segment(time);
    names.forEach((name, joint) => {
      if (time <= times[0]) this.positions[name] = positions[0][joint];
      else if (time >= times[last]) this.positions[name] = positions[last][joint];
      else this.positions[name] = this.#between(index, joint, time);
    });
    return this.positions;
  }

  /** @param {number} time */
  #segment(time) {
    const { times } = this.value;
    let low = 0;
    let high = times.length - 2;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /**
   * @param {number} index
   * @param {number} joint
   * @param {number} time
   */
  #between(index, joint, time) {
    const { times, positions, velocities, accelerations } = this.value;
    const T = times[index + 1] - times[index];
    const t = time - times[index];
    const p0 = positions[index][joint];
    const d = positions[index + 1][joint] - p0;
    if (!velocities) return p0 + (d * t) / T;
    const v0 = velocities[index][joint];
    const v1 = velocities[index + 1][joint];
    if (!accelerations) {
      return p0 + t * (v0 + t * ((3 * d / T - 2 * v0 - v1) / T + t * ((v0 + v1 - 2 * d / T) / T ** 2)));
    }
    const a0 = accelerations[index][joint];
    const a1 = accelerations[index + 1][joint];
    const c3 = (20 * d - (8 * v1 + 12 * v0) * T - (3 * a0 - a1) * T ** 2) / (2 * T ** 3);
    const c4 = (-30 * d + (14 * v1 + 16 * v0) * T + (3 * a0 - 2 * a1) * T ** 2) / (2 * T ** 4);
    const c5 = (12 * d - 6 * (v1 + v0) * T + (a1 - a0) * T ** 2) / (2 * T ** 5);
    return p0 + t * (v0 + t * (a0 / 2 + t * (c3 + t * (c4 + t * c5))));
  }

  /**
   * Return the path of the tool.
   *
   * @param {Kinematics} kinematics The arm.
   * @param {Pose} tool Pose of the tool in the flange.
   * @returns {Float32Array} x, y, z of each point [m].
   */
  path(kinematics, tool) {
    const room = kinematics.room();
    const count = Math.min(PATH_POINTS, Math.max(2, 2 * this.value.times.length, Math.ceil(25 * (this.duration - this.begin))));
    const points = new Float32Array(3 * count);
    for (let point = 0; point < count; point += 1) {
      kinematics.place(this.at(this.begin + ((this.duration - this.begin) * point) / (count - 1)), room);
      points.set(kinematics.toolPose(room, tool).slice(0, 3), 3 * point);
    }
    return points;
  }
}
