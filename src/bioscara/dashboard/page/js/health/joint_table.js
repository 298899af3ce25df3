// The joints as they describe themselves: a column for each, a row for each property.

/** @import { App } from "../app.js" */
/** @import { JointList, JointValue } from "../../messages.d.ts" */

import { h, setText, setValues } from "../dom.js";
import { duration } from "../format.js";
import { text } from "../texts.js";

/** Bits of a joint's flags, by the keys of their texts. */
const FLAGS = ["stall", "busy", "not_homed", "not_enabled", "fault", "armed", "", "refused"];
const NOT_HOMED = 0x04;
const NOT_ENABLED = 0x08;
const QUALITIES = ["fresh", "stale", "assumed", "unknown"];
const UNKNOWN = "–";

/**
 * A cell: its text and its colour.
 *
 * @typedef {[string, string?]} Cell
 */

/** @type {Record<string, (joint: JointValue) => Cell>} */
const REPORTED = {
  halted: ({ halted, name }) => (halted ? [halted.replace(`${name}: `, ""), "danger"] : [text("health.takes_commands")]),
  hot: ({ hot }) => (hot === null ? [UNKNOWN] : hot ? [text("health.too_hot"), "danger"] : [text("health.not_hot")]),
  mode: ({ mode }) => [mode],
  firmware: ({ firmware, protocol }) => [text(firmware ? "health.firmware_of" : "health.original", { firmware, protocol })],
  boot: ({ boot_id }) => [boot_id === null ? UNKNOWN : `0x${boot_id.toString(16).padStart(4, "0")}`],
  reset: ({ reset_cause }) => [
    reset_cause === "pin" ? text("health.pin") : reset_cause || UNKNOWN,
    ["power on", ""].includes(reset_cause) ? "" : "warn",
  ],
  latched: ({ counters }) => (counters ? [latched(counters), counters.fault === "NONE" ? "" : "danger"] : [UNKNOWN]),
  broken: ({ counters }) => [counters ? String(counters.broken) : UNKNOWN],
  refused: ({ counters }) => [counters ? refused(counters) : UNKNOWN],
  bus_errors: ({ counters }) => [counters?.bus_errors === null || !counters ? UNKNOWN : String(counters.bus_errors)],
  retries: ({ retries }) => [String(retries)],
  address: ({ address }) => [`0x${address.toString(16)}`],
};

/** Properties that each sample has. @type {Record<string, (flags: number, quality: number, age: number) => Cell>} */
const SAMPLED = {
  homed: (flags, quality) => (quality === 3 ? [UNKNOWN] : flags & NOT_HOMED ? [text("health.no"), "warn"] : [text("health.yes")]),
  motor: (flags, quality) => (quality === 3 ? [UNKNOWN] : [text(flags & NOT_ENABLED ? "health.off" : "health.on")]),
  flags: (flags) => [flagNames(flags)],
  quality: (_, quality, age) => [
    age > 0.1
      ? text("health.quality_age", { quality: text(`health.quality_${QUALITIES[quality]}`), age: duration(age) })
      : text(`health.quality_${QUALITIES[quality] ?? "unknown"}`),
    quality === 0 ? "" : "warn",
  ],
};

/**
 * Build the table.
 *
 * @param {App} app The page.
 * @returns {{element: HTMLElement, sample: () => void, report: (list: JointList) => void}} The table, and what
 *   brings it up to date with a sample or a report.
 */
export function jointTable(app) {
  const names = [...Object.keys(SAMPLED), ...Object.keys(REPORTED)];
  const head = h("tr", {}, h("th", { scope: "col", text: text("health.joint") }));
  const body = h("tbody");
  const counted = h("p", { class: "dim" });
  const table = h("table", { class: "joint-reports" }, h("caption", { class: "hidden-text", text: text("health.joints") }),
    h("thead", {}, head), body);
  /** @type {Map<string, HTMLElement[]>} */
  const cells = new Map();

  /** @param {readonly string[]} joints */
  function build(joints) {
    head.replaceChildren(h("th", { scope: "col", text: text("health.joint") }),
      ...joints.map((name) => h("th", { scope: "col", text: name })));
    body.replaceChildren(...names.map((name) => {
      const row = joints.map(() => h("td", { text: UNKNOWN }));
      cells.set(name, row);
      return h("tr", {}, h("th", { scope: "row", text: text(`health.row_${name}`) }), ...row);
    }));
  }

  /**
   * @param {string} name
   * @param {number} joint
   * @param {Cell} cell
   */
  function fill(name, joint, [shown, colour]) {
    const cell = cells.get(name)?.[joint];
    if (!cell) return;
    setText(cell, shown);
    setValues(cell, { className: colour ?? "" });
  }

  return {
    element: h("div", { class: "column" },
      h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": text("health.joints") }, table), counted),
    sample() {
      const sample = app.arm.sample;
      if (!sample) return;
      if (head.children.length !== sample.names.length + 1) build(sample.names);
      for (let joint = 0; joint < sample.names.length; joint += 1) {
        const age = sample.time - (sample.stamps[joint] ?? NaN);
        for (const [name, cell] of Object.entries(SAMPLED)) fill(name, joint, cell(sample.flags[joint], sample.qualities[joint], age));
      }
    },
    report(list) {
      list.joints.forEach((joint, index) => {
        for (const [name, cell] of Object.entries(REPORTED)) fill(name, index, cell(joint));
      });
      const age = list.counted === null ? NaN : (app.arm.sample?.time ?? NaN) - list.counted;
      setText(counted, Number.isNaN(age)
        ? text("health.never_counted")
        : text("health.counted", { age: age < 1 ? text("health.just_now") : text("health.ago", { age: duration(age) }) }));
    },
  };
}

/** @param {number} flags */
function flagNames(flags) {
  const found = FLAGS.filter((name, bit) => name && flags & (1 << bit)).map((name) => text(`health.flag_${name}`));
  return found.join(", ") || text("health.none");
}

/** @param {import("../../messages.d.ts").JointCounters} counters */
function latched({ fault, data }) {
  return fault === "NONE" ? text("health.none") : `${fault} (${Number((data ?? NaN).toPrecision(4))})`;
}

/** @param {import("../../messages.d.ts").JointCounters} counters */
function refused({ refused: count, refusal }) {
  return refusal === "NONE" ? String(count) : text("health.refused_last", { count, refusal });
}
