// The arm as this page knows it: the newest sample with its age, lease, faults, workspace, goals, events.

/** @import { Connection } from "./connection.js" */
/** @import { BodyList, BodyPose, Description, Event, FaultList, GoalValue, LeaseValue, StateSample, WorkspaceState,
 *    WorldSample } from "../messages.d.ts" */

import { text } from "./texts.js";

/** Least time between two samples [s]. */
const PERIOD = 0.04;
/** The same of a hidden page, which looks at the lease with each of them [s]. */
const HIDDEN_PERIOD = 0.5;
/** Samples that the owner may send before the page confirms them. */
const AHEAD = 2;
/** Events and goals that are kept. */
const KEPT = 500;
/** Age from which a sample counts as stale, and from which the arm counts as gone [ms]. */
export const STALE = 300;
export const GONE = 1000;
/** Difference of two clocks that shows that the computer slept [ms]. */
const SLEPT = 1000;
/** Faults of a supervisor that stop the arm. */
const FAULTY = new Set(["stopping", "latched", "acknowledged"]);

/** The page has another version than its gateway, and may only look and stop. */
export class MismatchError extends Error {}

/** @typedef {"sample" | "link" | "lease" | "faults" | "workspace" | "description" | "goals" | "event" | "reset" | "world" | "bodies"} Topic */

/**
 * The arm as this page knows it. `on` calls a function after each change of a topic:
 *
 * - `sample`: at most once for each frame of the screen;
 * - `world`: the same of the bodies around a simulated arm; `bodies`: there are others;
 * - `link`: the connection, or the age of the sample, has another state;
 * - `reset`: another run of the owner; values of the former one are void.
 */
export class Arm {
  /**
   * @param {Connection} connection The connection.
   * @param {"view" | "operate" | "admin"} scope The rights of this page.
   */
  constructor(connection, scope) {
    this.connection = connection;
    this.scope = scope;
    /** @type {StateSample | null} */
    this.sample = null;
    /** @type {Description | null} */
    this.description = null;
    /** @type {WorkspaceState | null} */
    this.workspace = null;
    /** @type {FaultList | null} */
    this.faultList = null;
    /** The bodies around a simulated arm; null without a world. @type {BodyList | null} */
    this.bodies = null;
    /** Where they are; null before the first sample. @type {WorldSample | null} */
    this.world = null;
    /** Version of the bodies that were asked for. */
    this.askedBodies = NaN;
    /** @type {LeaseValue | null} */
    this.lease = null;
    /** Epoch of the lease of this page; null without one. @type {number | null} */
    this.epoch = null;
    /** How this page lost the lease: given back, by a break of the connection, or ended by the owner. @type {"" | "given" | "broken" | "ended"} */
    this.loss = "";
    /** Whether it has been asked for. */
    this.acquiring = false;
    /** Newest last. @type {Event[]} */
    this.events = [];
    /** By number, oldest first. @type {Map<number, GoalValue>} */
    this.goals = new Map();
    /** Why there is no connection. */
    this.reason = "";
    this.signedOut = false;
    this.mismatch = "";
    /** @type {Map<Topic, (() => void)[]>} */
    this.listeners = new Map();
    this.arrival = -Infinity;
    this.lastEvent = 0;
    this.instance = "";
    this.clocks = Date.now() - performance.now();
    this.former = "";
    this.drawing = false;
    connection.on("welcome", (welcome) => this.#greet(welcome));
    connection.on("closed", (closed) => this.#lose(closed));
    connection.on("state", (sample) => this.#take(sample));
    connection.on("world", (sample) => this.#takeWorld(sample));
    connection.on("event", (event) => this.#hear(event));
    setInterval(() => this.#watch(), 100);
    document.addEventListener("visibilitychange", () => this.#visible());
  }

  /** Age of the newest sample [ms]: since it arrived, and half of the least round trip. */
  get age() {
    const half = this.connection.roundTrip / 2;
    return performance.now() - this.arrival + (Number.isNaN(half) ? 0 : half);
  }

  /** Whether the owner reports, also where it cannot read the joints, as after a loss of the bus. */
  get told() {
    return this.connection.open && this.sample !== null && this.age <= STALE;
  }

  /** Whether there is a sample that is not stale. */
  get fresh() {
    return this.told && this.sample?.stale === false;
  }

  /** Whether this page commands the arm. */
  get commands() {
    return this.epoch !== null && this.connection.open;
  }

  /** Whether a fault has to be dealt with. */
  get faulty() {
    return FAULTY.has(this.sample?.fault ?? "");
  }

  /** Names of the joints, and whether each is linear. */
  get joints() {
    return this.description?.parameters.joints ?? [];
  }

  /**
   * State of the connection, for the table of states.
   *
   * @returns {"connecting" | "live" | "stale" | "gone" | "mismatch" | "signed-out"} The state.
   */
  get link() {
    if (this.signedOut) return "signed-out";
    if (this.mismatch) return "mismatch";
    if (this.sample === null) return "connecting";
    if (!this.connection.open || this.age > GONE) return "gone";
    return this.fresh ? "live" : "stale";
  }

  /**
   * Call a function after each change of a topic.
   *
   * @param {Topic} topic The topic.
   * @param {() => void} listener The function.
   * @returns {() => void} Lets it not be called any more.
   */
  on(topic, listener) {
    this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
    return () => {
      this.listeners.set(topic, (this.listeners.get(topic) ?? []).filter((each) => each !== listener));
    };
  }

  /**
   * Call a function now, and after each change of some topics.
   *
   * @param {Topic[]} topics The topics.
   * @param {() => void} listener The function.
   */
  follow(topics, listener) {
    for (const topic of topics) this.on(topic, listener);
    listener();
  }

  /** @param {Topic} topic */
  #tell(topic) {
    for (const listener of this.listeners.get(topic) ?? []) listener();
  }

  /** @param {import("../messages.d.ts").Welcome} welcome */
  #greet(welcome) {
    this.reason = "";
    if (welcome.instance !== this.instance) {
      this.instance = welcome.instance;
      this.lastEvent = Math.max(welcome.last_event - KEPT, 0);
      this.events = [];
      this.goals.clear();
      this.bodies = null;
      this.world = null;
      this.askedBodies = NaN;
      this.#tell("bodies");
      this.#part("broken");
      this.#tell("reset");
    } else if (!welcome.resumed) {
      this.#part("broken");
    }
    // A connection that broke gives no right to command: a person asks again.
    this.drop();
    this.#subscribe();
    this.#ask("get_description", (result) => {
      this.description = result;
    }, "description");
    this.#ask("list_goals", (result) => {
      for (const goal of result.goals) this.goals.set(goal.goal, goal);
    }, "goals");
    this.refreshWorkspace();
    this.refreshFaults();
    this.refreshLease();
    this.#tell("lease");
  }

  #subscribe() {
    const { lastEvent } = this;
    const period = document.hidden ? HIDDEN_PERIOD : PERIOD;
    this.connection
      .request({ kind: "subscribe", states: true, period, world: true, world_period: period, unconfirmed: AHEAD, events_after: lastEvent })
      .catch(() => {});
  }

  /**
   * @param {string} kind
   * @param {(result: any) => void} keep
   * @param {Topic} topic
   */
  #ask(kind, keep, topic) {
    this.connection.request(/** @type {any} */ ({ kind })).then(
      (result) => {
        keep(result);
        this.#tell(topic);
      },
      () => {},
    );
  }

  /** Ask for the workspace again. */
  refreshWorkspace() {
    this.#ask("get_workspace", (result) => {
      this.workspace = result;
    }, "workspace");
  }

  /** Ask for the faults again. */
  refreshFaults() {
    this.#ask("get_faults", (result) => {
      this.faultList = result;
    }, "faults");
  }

  /** Ask for the lease again; its answer also measures the round trip. */
  refreshLease() {
    this.#ask("get_lease", (result) => this.#setLease(result.lease), "lease");
  }

  /** @param {LeaseValue} lease */
  #setLease(lease) {
    this.lease = lease;
    if (lease.epoch !== this.epoch || lease.client === null) this.#part("ended");
  }

  /** @param {"given" | "broken" | "ended"} loss */
  #part(loss) {
    if (this.epoch === null) return;
    this.epoch = null;
    this.loss = loss;
  }

  /**
   * Take the lease.
   *
   * @param {boolean} [force] Whether to take it from another client.
   */
  async acquire(force = false) {
    if (this.mismatch) throw new MismatchError(text("refusal.mismatch"));
    this.acquiring = true;
    try {
      const result = await this.connection.request({ kind: "acquire_lease", time_to_live: 2, force });
      this.epoch = result.lease.epoch;
      this.lease = result.lease;
      this.loss = "";
    } finally {
      this.acquiring = false;
      this.#tell("lease");
    }
  }

  /** Give the lease back. */
  async release() {
    const { epoch } = this;
    this.#part("given");
    this.#tell("lease");
    if (epoch !== null) await this.connection.request({ kind: "release_lease" }, epoch);
  }

  /** Give up the lease without the owner, as after a break of the connection. */
  drop() {
    const { epoch } = this;
    this.#part("broken");
    if (epoch !== null) this.connection.request({ kind: "release_lease" }, epoch).catch(() => {});
  }

  /**
   * Let this page only look and stop until it is loaded again.
   *
   * @param {"mismatch" | "signed-out"} state Its state.
   * @param {string} reason Why.
   */
  suspend(state, reason) {
    if (state === "mismatch") this.mismatch = reason;
    else this.signedOut = true;
    this.reason = reason;
    this.drop();
    this.#tell("lease");
    this.#tell("link");
  }

  /** @param {StateSample} sample */
  #take(sample) {
    this.connection.post({ kind: "received", cycle: sample.cycle });
    this.sample = sample;
    this.arrival = performance.now();
    if (this.drawing) return;
    // Drawn once for each frame of the screen, the newest one.
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      this.#tell("sample");
    });
  }

  /** @param {WorldSample} sample */
  #takeWorld(sample) {
    this.world = sample;
    if (sample.version === this.bodies?.version) {
      this.#tell("world");
    } else if (sample.version !== this.askedBodies) {
      this.askedBodies = sample.version;
      this.#ask("get_bodies", (result) => {
        this.bodies = result;
      }, "bodies");
    }
  }

  /** Where all bodies are; those that the newest sample does not name are where their list says. @returns {BodyPose[]} */
  get bodyPoses() {
    const { bodies, world } = this;
    if (!bodies) return [];
    return world?.version === bodies.version ? [...bodies.poses, ...world.poses] : bodies.poses;
  }

  /** @param {Event} event */
  #hear(event) {
    this.lastEvent = event.number;
    this.events.push(event);
    if (this.events.length > KEPT) this.events.shift();
    if (event.goal) {
      this.goals.delete(event.goal.goal);
      this.goals.set(event.goal.goal, event.goal);
      if (this.goals.size > KEPT) this.goals.delete(this.goals.keys().next().value ?? 0);
      this.#tell("goals");
    }
    if (event.lease) {
      this.#setLease(event.lease);
      this.#tell("lease");
    }
    if (event.what === "workspace") this.refreshWorkspace();
    if (["fault", "faults_cleared", "warning", "goal_ended"].includes(event.what)) this.refreshFaults();
    this.#tell("event");
  }

  /** @param {{reason: string, signedOut: boolean}} closed */
  #lose(closed) {
    this.reason = closed.reason || "the connection is broken";
    this.signedOut = this.signedOut || closed.signedOut;
    this.#tell("lease");
    this.#tell("link");
  }

  #visible() {
    if (!this.connection.open) return;
    // Messages that were sent while the page was hidden are old: it gets a new sample first.
    this.#subscribe();
  }

  #watch() {
    const clocks = Date.now() - performance.now();
    if (Math.abs(clocks - this.clocks) > SLEPT) {
      // The computer slept, or its clock was set: a connection may have died unseen.
      this.clocks = clocks;
      this.drop();
      this.connection.renew();
    }
    if (this.link !== this.former) {
      this.former = this.link;
      this.#tell("link");
    }
  }
}
