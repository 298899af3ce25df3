// Requests to the gateway without the WebSocket. A refusal is an error with the sentence of the server.

/** @import { FailureValue } from "../messages.d.ts" */

import { ConnectionError, RequestError } from "./connection.js";

/**
 * Ask the gateway.
 *
 * @param {string} path Path of the request, as `api/recordings`.
 * @returns {Promise<any>} The answer, from JSON.
 * @throws {RequestError} It is refused.
 * @throws {ConnectionError} The gateway does not answer.
 */
export function get(path) {
  return answered(fetch(path));
}

/**
 * Send something to the gateway.
 *
 * @param {string} path Path of the request.
 * @param {Blob | string | object} body The content: a file or a text as it is, anything else as JSON.
 * @returns {Promise<any>} The answer, from JSON; errors as of `get`.
 */
export function post(path, body) {
  const plain = typeof body === "string" || body instanceof Blob;
  return answered(fetch(path, {
    method: "POST",
    headers: { "Content-Type": plain ? "application/octet-stream" : "application/json" },
    body: plain ? body : JSON.stringify(body),
  }));
}

/**
 * Ask a question about content, as a file or values that a person has given.
 *
 * @param {Promise<{result: any, failure: FailureValue | null}>} answer The answer of `get` or `post`.
 * @returns {Promise<any>} The parsed content.
 * @throws {RequestError} It cannot be used, or the request is refused; other errors as of `get`.
 */
export async function judged(answer) {
  const { result, failure } = await answer;
  // The units of a file are those that the person wrote.
  if (failure) throw new RequestError(failure, failure.text);
  return result;
}

/**
 * Give a person a file.
 *
 * @param {string} name Its name.
 * @param {Blob} content Its content.
 */
export function saveFile(name, content) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  // Not at once: the browser may not have begun to read.
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** @param {Promise<globalThis.Response>} request */
async function answered(request) {
  let answer;
  try {
    answer = await request;
  } catch {
    throw new ConnectionError("the gateway does not answer");
  }
  if (answer.ok) return answer.json();
  let failure;
  try {
    failure = /** @type {FailureValue} */ (await answer.json());
  } catch {
    throw new ConnectionError(`the gateway answers ${answer.status}`);
  }
  throw new RequestError(failure);
}
