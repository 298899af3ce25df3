// Statistics of the control loop, the bus and the owner, with their limits.

/** @import { App } from "../app.js" */
/** @import { Statistics } from "../../messages.d.ts" */

import { h, setText } from "../dom.js";
import { duration, number } from "../format.js";
import { text } from "../texts.js";

/** Time for which the joints may be without a setpoint [s]; docs/loop.md. */
const SILENCE = 0.06;
/** Share of a period that the exchanges may take; docs/loop.md. */
const BUS_LIMIT = 0.85;
/** Share of a period that the bus should leave. */
const BUS_ADVISED = 0.8;
/** Share of cycles that may be late within a second; docs/loop.md. */
const OVERRUN_LIMIT = 0.05;

/**
 * Build the tables.
 *
 * @param {App} app The page.
 * @returns {{element: HTMLElement, report: (statistics: Statistics) => void, sample: () => void}} The tables, and
 *   what brings them up to date.
 */
export function loopTable(app) {
  const body = h("tbody");
  const columns = ["quantity", "now", "p50", "p99", "max", "limit"];
  const table = h("table", {}, h("caption", { class: "hidden-text", text: text("health.loop") }),
    h("thead", {}, h("tr", {}, ...columns.map((name) => h("th", { scope: "col", text: text(`health.col_${name}`) })))), body);
  /** @type {Record<string, HTMLElement[]>} */
  const rows = {};
  for (const name of ["late", "bus_time", "read", "update", "write"]) {
    rows[name] = columns.slice(1).map(() => h("td", { class: "number", text: "–" }));
    body.append(h("tr", {}, h("th", { scope: "row", text: text(`health.time_${name}`) }), ...rows[name]));
  }
  const facts = h("dl", { class: "facts" });
  /** @type {Record<string, HTMLElement>} */
  const values = {};
  for (const name of ["period", "rate", "bus_share", "overruns", "cycles", "clients", "memory", "uptime", "software"]) {
    values[name] = h("dd", { text: "–" });
    facts.append(h("dt", { text: text(`health.fact_${name}`) }), values[name]);
  }

  /**
   * @param {string} name
   * @param {number} column
   * @param {number | null} value Time [s].
   * @param {number} [limit] Above which it is marked [s].
   * @param {number} [digits] Digits after the point.
   */
  function fill(name, column, value, limit = Infinity, digits = 2) {
    const cell = rows[name][column];
    setText(cell, value === null || Number.isNaN(value) ? "–" : `${number(1e3 * value, digits)} ms`);
    cell.classList.toggle("warn", value !== null && value > limit);
  }

  return {
    element: h("div", { class: "column" },
      h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": text("health.loop") }, table), facts),
    sample() {
      const { sample, description } = app.arm;
      if (!sample) return;
      const period = 1 / (description?.rate ?? NaN);
      fill("late", 0, sample.late, SILENCE);
      fill("bus_time", 0, sample.bus_time, period * BUS_LIMIT);
    },
    report(statistics) {
      const { description } = app.arm;
      const period = 1 / (description?.rate ?? NaN);
      for (const name of /** @type {const} */ (["late", "read", "update", "write"])) {
        const limit = name === "late" ? SILENCE : period;
        statistics[name].forEach((value, place) => fill(name, 1 + place, value, limit));
        fill(name, 4, limit, Infinity, 0);
      }
      fill("bus_time", 4, period * BUS_LIMIT, Infinity, 1);
      setText(values.rate, text("health.rate", { rate: statistics.rate }));
      const share = description?.bus_share ?? NaN;
      setText(values.period, text("health.period", { period: duration(period), rate: description?.rate ?? "–" }));
      setText(values.bus_share, text("health.bus_share", { share: percent(share), limit: percent(BUS_LIMIT) }));
      values.bus_share.classList.toggle("warn", share > BUS_ADVISED);
      const late = statistics.overruns / Math.max(statistics.cycles, 1);
      setText(values.overruns,
        text("health.overruns", { count: statistics.overruns, share: percent(late, 2), limit: percent(OVERRUN_LIMIT) }));
      values.overruns.classList.toggle("warn", late > OVERRUN_LIMIT);
      setText(values.cycles, String(statistics.cycles));
      setText(values.clients, String(statistics.clients));
      setText(values.memory, `${number(statistics.memory / 1e6, 1)} MB`);
      setText(values.uptime, duration(statistics.uptime));
      setText(values.software, description?.software ?? "–");
    },
  };
}

/**
 * @param {number} share
 * @param {number} [digits]
 */
function percent(share, digits = 0) {
  return `${number(100 * share, digits)} %`;
}
