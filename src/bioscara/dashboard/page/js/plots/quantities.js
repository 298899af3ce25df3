// The plotted quantities: the columns of a row, in the units that people read, and their limits.

/** @import { Description, History, StateSample } from "../../messages.d.ts" */

import { DEGREE, MM } from "../format.js";

/** Time for which the joints may be without a setpoint [s]; docs/loop.md. */
const SILENCE = 0.06;
/** Share of a period that the bus may take; docs/loop.md. */
const BUS_SHARE = 0.85;
/** Following error that is always allowed, as a share of the joint's range; control/faults/following_error.py. */
const FLOOR_SHARE = 0.005;

/**
 * One line.
 *
 * @typedef {Object} Line
 * @property {number} column Its column in a row.
 * @property {string} name Joint, or name of the time.
 * @property {number} joint Number of the joint; -1 for times.
 * @property {string} unit Unit that people read.
 * @property {number} factor SI value of that unit.
 * @property {string} si Unit in files.
 * @property {number[]} limits Limits, in the unit that people read.
 *
 * @typedef {Object} Quantity
 * @property {"position" | "velocity" | "error" | "load" | "timing"} id Its id, also of its texts.
 * @property {Line[]} lines Its lines.
 */

/**
 * Return the quantities of an arm that can be plotted.
 *
 * @param {Description} description The arm.
 * @returns {Quantity[]} The quantities; their columns are numbered through.
 */
export function quantitiesOf(description) {
  let column = 0;
  const { joints } = description.parameters;
  /**
   * @param {Quantity["id"]} id
   * @param {"" | "/s"} suffix
   * @param {(joint: typeof joints[number]) => number[]} limits
   * @returns {Quantity}
   */
  const perJoint = (id, suffix, limits) => ({
    id,
    lines: joints.map((joint, index) => jointLine(joint, index, column++, suffix, limits(joint))),
  });
  const period = 1 / description.rate;
  return [
    perJoint("position", "", (joint) => [joint.lower, joint.upper]),
    perJoint("velocity", "/s", (joint) => [-joint.max_velocity, joint.max_velocity]),
    perJoint("error", "", (joint) => [-1, 1].map((sign) => sign * FLOOR_SHARE * (joint.upper - joint.lower))),
    {
      id: "load",
      lines: joints.map(({ name }, joint) => ({ column: column++, name, joint, factor: 1, unit: "%", si: "%", limits: [100] })),
    },
    {
      id: "timing",
      lines: [
        { column: column++, name: "bus", joint: -1, factor: 1e-3, unit: "ms", si: "s", limits: [(BUS_SHARE * period) / 1e-3] },
        { column: column++, name: "late", joint: -1, factor: 1e-3, unit: "ms", si: "s", limits: [SILENCE / 1e-3] },
      ],
    },
  ];
}

/**
 * Return the line of a joint.
 *
 * @param {{name: string, unit: string}} joint The joint; its unit is that of its position in SI.
 * @param {number} index Its number.
 * @param {number} column Its column in a row.
 * @param {"" | "/s"} suffix Of the units: `/s` for velocities.
 * @param {number[]} limits Limits, in SI units.
 * @returns {Line} The line.
 */
export function jointLine({ name, unit }, index, column, suffix, limits) {
  const linear = unit === "m";
  const factor = linear ? MM : DEGREE;
  const scaled = limits.map((limit) => limit / factor);
  return { column, name, joint: index, factor, unit: (linear ? "mm" : "°") + suffix, si: unit + suffix, limits: scaled };
}

/**
 * Return the function that takes the columns from a sample.
 *
 * @param {Quantity[]} quantities The plotted quantities.
 * @returns {(sample: StateSample, column: number) => number | null} The value in the unit that people read.
 */
export function columnsOfSample(quantities) {
  /** @type {((sample: StateSample) => number | null)[]} */
  const read = [];
  for (const { id, lines } of quantities) {
    for (const { column, joint, factor, name } of lines) {
      read[column] = {
        position: (/** @type {StateSample} */ sample) => scaled(sample.positions[joint], factor),
        velocity: (/** @type {StateSample} */ sample) => scaled(sample.velocities[joint], factor),
        error: (/** @type {StateSample} */ sample) => error(sample, joint, factor),
        load: (/** @type {StateSample} */ sample) => sample.loads?.[joint] ?? null,
        timing: (/** @type {StateSample} */ sample) => scaled(name === "bus" ? sample.bus_time : sample.late, factor),
      }[id];
    }
  }
  return (sample, column) => read[column](sample);
}

/**
 * Return the function that takes the columns from an answer of `get_history`.
 *
 * @param {Quantity[]} quantities The plotted quantities.
 * @param {History} history The answer.
 * @returns {(column: number, row: number) => number | null} The value in the unit that people read.
 */
export function columnsOfHistory(quantities, history) {
  /** @type {{values: (number | null)[], factor: number}[]} */
  const columns = [];
  for (const { id, lines } of quantities) {
    for (const { column, joint, factor, name } of lines) {
      const values = {
        position: history.positions,
        velocity: history.velocities,
        error: history.errors,
        load: history.loads,
        timing: null,
      }[id]?.[joint] ?? (name === "bus" ? history.bus_time : name === "late" ? history.late : []);
      columns[column] = { values, factor };
    }
  }
  return (column, row) => scaled(columns[column].values[row], columns[column].factor);
}

/**
 * @param {number | null | undefined} value
 * @param {number} factor
 */
function scaled(value, factor) {
  return value === null || value === undefined ? null : value / factor;
}

/**
 * @param {StateSample} sample
 * @param {number} joint
 * @param {number} factor
 */
function error(sample, joint, factor) {
  const command = sample.commands[joint];
  const position = sample.positions[joint];
  // Without power a joint follows nothing.
  if (command === null || position === null || !sample.enabled) return null;
  return (command - position) / factor;
}
