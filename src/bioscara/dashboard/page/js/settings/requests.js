// Requests for the parameters of the arm.

import { get, judged, post } from "../http.js";

/**
 * A parameter.
 *
 * @typedef {Object} ParameterRow
 * @property {string} name Its dotted name.
 * @property {unknown} value Its value with the overlay.
 * @property {unknown} default That of the existing arms.
 * @property {string} unit Its unit; empty without one.
 * @property {"default" | "overlay"} source Where its value is from.
 * @property {string} text Its meaning.
 * @property {string | null} fixed Why it cannot be changed; null if it can.
 *
 * @typedef {Object} Parameters
 * @property {number} revision Number of the overlay.
 * @property {boolean} restart Whether the overlay was changed since the owner began.
 * @property {string} overlay Text of the overlay.
 * @property {ParameterRow[]} rows The parameters.
 *
 * @typedef {Object} Draft
 * @property {string} overlay Text of the new overlay.
 * @property {number} revision Number of the overlay that it replaces.
 * @property {{name: string, before: unknown, after: unknown, unit: string}[]} diff Its changes.
 */

/**
 * Ask for the parameters.
 *
 * @returns {Promise<Parameters>} The parameters.
 * @throws {RequestError} They cannot be had.
 */
export function readParameters() {
  return get("api/parameters");
}

/**
 * Check changes; nothing is written.
 *
 * @param {Record<string, unknown>} changes Values by name; null removes one from the overlay.
 * @returns {Promise<Draft>} The new overlay.
 * @throws {RequestError} A value cannot be used.
 */
export function checkChanges(changes) {
  return judged(post("api/parameters/check", { changes }));
}
