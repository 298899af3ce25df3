// One fault in full: what happened, where, since when, the data behind it, the evidence, what to do.

/** @import { Arm } from "../arm.js" */
/** @import { FaultValue } from "../../messages.d.ts" */

import { h } from "../dom.js";
import { readable } from "../format.js";
import { clockTime } from "./clock.js";
import { text } from "../texts.js";

/** Attributes of an error that its text or its place has already. */
const TOLD = new Set(["args", "what", "remedy", "joint", "component"]);

/**
 * Return a fault's text in two parts: the event, and the remedy.
 *
 * @param {FaultValue} fault The fault.
 * @returns {{what: string, remedy: string}} The parts; the remedy is empty if the text has none.
 */
export function parts(fault) {
  const bare = readable(fault.text.startsWith(`${fault.fault}: `) ? fault.text.slice(fault.fault.length + 2) : fault.text);
  let end = bare.lastIndexOf("; ");
  // The only remedies of two clauses.
  if (bare.slice(end).startsWith("; it is a defect")) end = bare.lastIndexOf("; ", end - 1);
  return end < 0 ? { what: bare, remedy: "" } : { what: bare.slice(0, end), remedy: bare.slice(end + 2) };
}

/**
 * Return when a fault was detected, by the clock on the wall.
 *
 * @param {Arm} arm The arm.
 * @param {FaultValue} fault The fault.
 * @returns {string} The time; a dash if it was before this page knows of.
 */
export function since(arm, fault) {
  const event = arm.events.find(
    (each) => each.fault && each.fault.time === fault.time && each.fault.fault === fault.fault && each.fault.source === fault.source,
  );
  return event ? clockTime(event.wall) : "–";
}

/**
 * Return a link to the flight record of a fault.
 *
 * @param {FaultValue} fault The fault.
 * @returns {HTMLElement | null} The link; null if none is written.
 */
export function evidenceLink(fault) {
  if (!fault.evidence) return null;
  const name = fault.evidence;
  return h("a", { href: `api/flight-records/${encodeURIComponent(name)}`, download: name, text: text("health.evidence", { name }) });
}

/**
 * Return the description of a fault.
 *
 * @param {Arm} arm The arm.
 * @param {FaultValue} fault The fault.
 * @param {number} index Its place, 0 for the first cause.
 * @returns {HTMLElement} The description.
 */
export function faultDetails(arm, fault, index) {
  const { what, remedy } = parts(fault);
  /** @type {[string, Node | string][]} */
  const rows = [
    [text("health.what"), what],
    [text("health.remedy"), remedy || "–"],
    [text("health.since"), since(arm, fault)],
    [text("health.cause"), `${fault.cause.error} (${fault.cause.code}): ${fault.cause.text}`],
  ];
  const data = Object.entries(fault.cause.data ?? {}).filter(([name, value]) => !TOLD.has(name) && value !== null && value !== "");
  if (data.length > 0) rows.push([text("health.data"), data.map(([name, value]) => `${name} ${shown(value)}`).join(", ")]);
  rows.push([text("health.evidence_title"), evidenceLink(fault) ?? text("health.no_evidence")]);
  const list = h("dl", { class: "facts" });
  for (const [name, value] of rows) list.append(h("dt", { text: name }), h("dd", {}, value));
  const heading = h("h3", {}, h("span", { class: "badge danger", text: `⚠ ${fault.fault}` }), ` ${fault.source} `);
  if (index === 0) heading.append(h("span", { class: "dim", text: text("health.first_cause") }));
  return h("article", { class: "fault" }, heading, list);
}

/** @param {unknown} value */
function shown(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(5))) : typeof value === "string" ? value : JSON.stringify(value);
}
