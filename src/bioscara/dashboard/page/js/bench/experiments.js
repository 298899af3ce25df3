// The faults that can be simulated: how each is begun and ended. The expected reaction of the software is in the texts.

/**
 * @typedef {import("../../messages.d.ts").SimulateFault["fault"]} Fault
 * @typedef {Object} Experiment
 * @property {Fault} fault Name of the simulated fault, also of its texts.
 * @property {boolean} joint Whether it concerns one joint.
 * @property {"place" | "force" | "rate" | "share" | "time" | null} value Which number it needs.
 * @property {number} [initial] That number at first, in the unit that people read.
 * @property {{on: number, off: {fault: Fault, value: number} | null}} switch Value that begins it, unless a person
 *   gives one; and what ends it, null if it has a fixed duration.
 */

/** @type {Experiment[]} */
export const EXPERIMENTS = [
  { fault: "obstacle", joint: true, value: "place", switch: { on: 0, off: { fault: "clear_obstacles", value: 0 } } },
  { fault: "push", joint: true, value: "force", initial: 5, switch: { on: 0, off: { fault: "push", value: 0 } } },
  { fault: "supply", joint: false, value: null, switch: { on: 0, off: { fault: "supply", value: 1 } } },
  { fault: "power", joint: true, value: null, switch: { on: 0, off: { fault: "power", value: 1 } } },
  { fault: "reset", joint: true, value: null, switch: { on: 1, off: null } },
  { fault: "hang", joint: true, value: null, switch: { on: 1, off: { fault: "hang", value: 0 } } },
  { fault: "freeze_encoder", joint: true, value: null, switch: { on: 1, off: { fault: "freeze_encoder", value: 0 } } },
  { fault: "overheat", joint: true, value: null, switch: { on: 1, off: { fault: "overheat", value: 0 } } },
  { fault: "brown_out", joint: false, value: "time", initial: 0.2, switch: { on: 0, off: null } },
  { fault: "bus_flips", joint: false, value: "rate", initial: 0.01, switch: { on: 0, off: { fault: "bus_flips", value: 0 } } },
  { fault: "bus_loss", joint: false, value: "share", initial: 5, switch: { on: 0, off: { fault: "bus_loss", value: 0 } } },
  { fault: "bus_stuck", joint: false, value: null, switch: { on: 1, off: { fault: "bus_stuck", value: 0 } } },
];
