// The WebSocket to the owner of the arm: greeting, numbered requests with answers, messages.

/** @import { AnyCommand, FailureValue, FromOwner, Welcome } from "../messages.d.ts" */

import { readable } from "./format.js";

export const VERSION = 1;
/** Time after which a request without an answer counts as lost [ms]. */
const LOST = 20000;
/** Shortest and longest wait before connecting again [ms]. */
const FIRST_WAIT = 500;
const LONGEST_WAIT = 5000;
/** Number of round trips of which the least counts. */
const TRIPS = 8;

/** A request was refused, or failed; carries the owner's failure. */
export class RequestError extends Error {
  /**
   * @param {FailureValue} failure The owner's failure.
   * @param {string} [message] Its text for people.
   */
  constructor(failure, message = readable(failure.text)) {
    super(message);
    this.failure = failure;
  }
}

/** A request was sent, and the connection ended before its answer. */
export class ConnectionError extends Error {}

/**
 * The connection; it reconnects automatically, and never sends a command twice.
 *
 * Handlers: `welcome`, `closed(reason, again)` and one for each kind of message.
 */
export class Connection {
  /**
   * @param {string} client Name of this page, for messages to people.
   * @param {string} session Random name of this page's session with the owner.
   */
  constructor(client, session) {
    this.client = client;
    this.session = session;
    /** @type {WebSocket | null} */
    this.socket = null;
    /** @type {Welcome | null} */
    this.welcome = null;
    /** Least of the latest round trips [ms]; NaN before the first. */
    this.roundTrip = NaN;
    /** When the newest message of the owner came [ms]. */
    this.heard = -Infinity;
    /** @type {Map<string, ((message: any) => void)[]>} */
    this.handlers = new Map();
    /** @type {Map<number, {resolve: (result: any) => void, reject: (error: Error) => void, sent: number}>} */
    this.waiting = new Map();
    /** @type {number[]} */
    this.trips = [];
    this.number = 0;
    this.attempt = 0;
    this.greeted = false;
    this.ended = false;
    /** Connects again after a while. @type {ReturnType<typeof setTimeout> | undefined} */
    this.again = undefined;
    setInterval(() => this.#giveUp(), 1000);
  }

  /** Whether requests can be sent. */
  get open() {
    return this.greeted && this.socket?.readyState === WebSocket.OPEN;
  }

  /** Bytes that the browser has not sent yet. */
  get backlog() {
    return this.socket?.bufferedAmount ?? 0;
  }

  /**
   * Call a function for each message of a kind.
   *
   * @param {string} kind The kind.
   * @param {(message: any) => void} handler The function.
   */
  on(kind, handler) {
    this.handlers.set(kind, [...(this.handlers.get(kind) ?? []), handler]);
  }

  /** Connect, and again whenever the connection breaks. */
  connect() {
    const scheme = location.protocol === "https:" ? "wss://" : "ws://";
    const socket = new WebSocket(`${scheme}${location.host}/ws`);
    this.socket = socket;
    socket.onopen = () => {
      const { client, session } = this;
      socket.send(JSON.stringify({ kind: "hello", version: VERSION, client, session }));
    };
    socket.onmessage = (message) => this.#receive(JSON.parse(message.data));
    socket.onclose = (closed) => {
      if (this.socket === socket) this.#close(closed.reason, closed.code);
    };
  }

  /** End the connection and connect again, as after sleep of the computer. */
  renew() {
    const former = this.socket;
    this.#close("the connection is renewed", 1000, 0);
    former?.close();
  }

  /** End the connection until it is resumed, if ever. */
  end() {
    this.ended = true;
    clearTimeout(this.again);
    this.socket?.close();
  }

  /** Connect again after an end, as of a page to which its person came back. */
  resume() {
    this.ended = false;
    this.renew();
  }

  /**
   * Send a request.
   *
   * @param {AnyCommand} command The request.
   * @param {number | null} [epoch] Epoch of the lease, for commands that need one.
   * @returns {Promise<any>} The result.
   * @throws {RequestError} The owner refuses it.
   * @throws {ConnectionError} There is no connection, or it ended before the answer.
   */
  request(command, epoch = null) {
    if (!this.open) return Promise.reject(new ConnectionError("not connected"));
    this.number += 1;
    const id = this.number;
    this.socket?.send(JSON.stringify({ kind: "request", id, command, epoch }));
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject, sent: performance.now() });
    });
  }

  /**
   * Send a message that has no answer.
   *
   * @param {object} message The message.
   */
  post(message) {
    if (this.open) this.socket?.send(JSON.stringify(message));
  }

  /** @param {FromOwner} message */
  #receive(message) {
    this.heard = performance.now();
    if (message.kind === "welcome") {
      this.attempt = 0;
      this.greeted = true;
      this.welcome = message;
    } else if (message.kind === "response" || message.kind === "refusal") {
      const waits = message.id === null ? undefined : this.waiting.get(message.id);
      if (waits && message.id !== null) {
        this.waiting.delete(message.id);
        if (message.kind === "response") {
          const { kind } = message.result;
          // Answered at once, so that these measure the network alone.
          if (kind === "lease_state") this.#measure(performance.now() - waits.sent);
          waits.resolve(message.result);
        } else {
          waits.reject(new RequestError(message.failure));
        }
        return;
      }
    }
    this.#emit(message.kind, message);
  }

  /**
   * @param {string} kind
   * @param {any} message
   */
  #emit(kind, message) {
    for (const handler of this.handlers.get(kind) ?? []) handler(message);
  }

  /** @param {number} trip */
  #measure(trip) {
    this.trips = [...this.trips.slice(1 - TRIPS), trip];
    this.roundTrip = Math.min(...this.trips);
  }

  /**
   * @param {string} reason
   * @param {number} code
   * @param {number} [wait]
   */
  #close(reason, code, wait = Math.min(FIRST_WAIT * 2 ** this.attempt, LONGEST_WAIT)) {
    this.socket = null;
    this.greeted = false;
    for (const waits of this.waiting.values()) {
      waits.reject(new ConnectionError("the connection ended before the answer"));
    }
    this.waiting.clear();
    this.trips = [];
    this.roundTrip = NaN;
    const signedOut = code === 1008 && reason.includes("sign");
    this.#emit("closed", { reason, signedOut });
    clearTimeout(this.again);
    if (this.ended || signedOut) return;
    this.attempt += 1;
    this.again = setTimeout(() => this.connect(), wait);
  }

  #giveUp() {
    const now = performance.now();
    for (const [id, waits] of this.waiting) {
      if (now - waits.sent > LOST) {
        this.waiting.delete(id);
        waits.reject(new ConnectionError(`no answer for ${LOST / 1000} s`));
      }
    }
  }
}
