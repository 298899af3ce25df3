// Panel: the simulation bench, where a person sees the reaction of the software to each fault.

/** @import { App, Panel, PanelView } from "../app.js" */
/** @import { Experiment } from "../bench/experiments.js" */
/** @import { SimulationState } from "../../messages.d.ts" */

import { ExperimentCard } from "../bench/card.js";
import { EXPERIMENTS } from "../bench/experiments.js";
import { WorldCards } from "../bench/world_cards.js";
import { RequestError } from "../connection.js";
import { button, h, setText, setValues } from "../dom.js";
import { DEGREE, MM } from "../format.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";

/** Factors of the speed of time. */
const SPEEDS = [0.1, 0.5, 1, 2, 5, 10, 20];
/** Angle and distance of the test motion, and its share of the speed. */
const ANGLE = 20 * DEGREE;
const DISTANCE = 30 * MM;
const SHARE = 0.5;

/** @type {Panel} */
export const benchPanel = {
  id: "bench",
  available: (app) => app.arm.description?.simulated ?? false,
  mount: (host, app) => new Bench(host, app),
};

/** @implements {PanelView} */
class Bench {
  /**
   * @param {HTMLElement} host
   * @param {App} app
   */
  constructor(host, app) {
    this.app = app;
    this.visible = false;
    /** The faults that the owner simulates now; null if that is not known. @type {SimulationState | null} */
    this.state = null;
    /** @type {ExperimentCard[]} */
    this.cards = [];
    this.grid = h("div", { class: "bench-grid" });
    this.world = new WorldCards(app);
    this.why = h("p", { class: "dim", role: "status" });
    this.on = h("p", { role: "status" });
    host.append(
      h("div", { class: "column" },
        h("p", { class: "notice warn" }, h("strong", { text: text("bench.banner_title") }), ` ${text("bench.banner")}`), this.why,
        this.#controls(), this.on, this.world.element, this.grid),
    );
    for (const topic of /** @type {const} */ (["lease", "link"])) app.arm.on(topic, () => this.#permit());
    app.arm.on("description", () => this.#build());
    app.arm.on("reset", () => {
      for (const card of this.cards) card.reset();
      if (this.visible) this.#look();
    });
    app.arm.on("event", () => {
      if (!this.visible) return;
      for (const card of this.cards) card.show();
      // Another page may have begun something.
      if (app.arm.events.at(-1)?.what === "simulation") this.#look();
    });
  }

  show() {
    this.visible = true;
    this.#build();
    for (const card of this.cards) {
      card.show();
      // Where the joints are now, unless it was used.
      if (card.since === null) card.suggest();
    }
    this.#permit();
    this.#look();
  }

  hide() {
    this.visible = false;
  }

  /** Why this page cannot let anything fail; empty if it can, which needs no lease. @returns {string} */
  get hindrance() {
    if (this.app.arm.scope === "view") return text("health.view_only");
    return this.state?.available === false ? text("bench.elsewhere") : "";
  }

  #controls() {
    this.allOff = button(text("bench.all_off"), () => this.#allOff());
    this.joint = h("select", { "aria-label": text("bench.motion_joint") });
    this.motion = button(text("bench.motion"), () => this.#move());
    this.speed = h("select", { "aria-label": text("bench.speed"), on: { change: () => this.#setSpeed() } },
      ...SPEEDS.map((factor) => h("option", { value: factor, text: `× ${factor}`, selected: factor === 1 })));
    return h("div", { class: "row" }, this.allOff, this.joint, this.motion, h("label", {}, text("bench.speed"), this.speed),
      copyButton(() => this.#python()));
  }

  #build() {
    const { joints } = this.app.arm;
    if (this.cards.length > 0 || joints.length === 0) return;
    this.joint?.replaceChildren(...joints.map(({ name }) => h("option", { value: name, text: name })));
    this.cards = EXPERIMENTS.map((experiment) => new ExperimentCard(this.app, experiment, (...words) => this.#run(...words)));
    this.grid.replaceChildren(...this.cards.map((card) => card.element));
    this.#permit();
  }

  #permit() {
    const why = this.hindrance;
    const commands = this.app.arm.commands;
    setText(this.why, why || (commands ? "" : text("bench.take_control")));
    for (const card of this.cards) card.permit(why === "");
    this.world.permit(why === "");
    if (this.allOff) setValues(this.allOff, { disabled: why !== "" });
    for (const each of [this.motion, this.speed]) if (each) setValues(each, { disabled: why !== "" || !commands });
  }

  /**
   * Begin or end an experiment.
   *
   * @param {Experiment} experiment
   * @param {string} joint
   * @param {number} value
   * @param {boolean} on
   */
  async #run(experiment, joint, value, on) {
    const { fault, switch: { off } } = experiment;
    const which = experiment.joint ? joint : "";
    if (!on && !off) return false;
    const done = await this.app.attempt(() => this.#simulate(on ? fault : off?.fault ?? fault, which, on ? value : off?.value ?? 0));
    if (!done) return false;
    await this.#look();
    return true;
  }

  /**
   * @param {import("../bench/experiments.js").Fault} fault
   * @param {string} joint
   * @param {number} value
   */
  async #simulate(fault, joint, value) {
    await this.app.ask({ kind: "simulate_fault", fault, joint, value });
  }

  /** End everything that any page has begun. */
  async #allOff() {
    if (await this.app.attempt(() => this.#simulate("clear", "", 0))) this.app.say(text("bench.all_is_off"));
    await this.#look();
  }

  /** Show the simulated faults, as the owner reports them. */
  async #look() {
    try {
      this.state = await this.app.ask({ kind: "get_simulation" });
    } catch {
      // A recording that is replayed, or no connection.
      this.state = null;
    }
    const names = (this.state?.faults ?? []).map(({ fault, joint }) => (joint ? `${nameOf(fault)} (${joint})` : nameOf(fault)));
    setText(this.on,
      names.length ? text("bench.on_now", { names: names.join(", ") }) : text(this.state ? "bench.nothing_on" : "bench.unknown"));
    this.#showSpeed(this.state?.real_time_factor ?? NaN);
    this.#permit();
  }

  /** @param {number} factor */
  #showSpeed(factor) {
    const { speed } = this;
    if (!speed || Number.isNaN(factor)) return;
    // Another client may have chosen one that is not in the list.
    if (![...speed.options].some((option) => Number(option.value) === factor))
      speed.append(h("option", { value: factor, text: `× ${factor}` }));
    speed.value = String(factor);
  }

  async #setSpeed() {
    const factor = Number(this.speed?.value);
    await this.app.attempt(() => this.app.request({ kind: "set_real_time_factor", real_time_factor: factor }));
    await this.#look();
  }

  /** Move a joint there and back, as most faults show only in motion. */
  async #move() {
    const { arm } = this.app;
    const index = arm.joints.findIndex(({ name }) => name === this.joint?.value);
    const begin = arm.sample?.positions ?? [];
    if (begin.some((position) => position === null)) {
      this.app.say(text("bench.not_homed"), "error", () => !arm.sample?.pose);
      return;
    }
    await this.app.attempt(async () => {
      for (const goal of [this.#goal(index, begin), begin]) {
        const started = await this.app.start({ kind: "move_joints", positions: goal, velocity_scaling: SHARE,
          acceleration_scaling: SHARE });
        const end = await this.app.ended(started.goal);
        if (end.failure) throw new RequestError(end.failure);
      }
    });
  }

  /**
   * Return where the test motion goes: away from the nearer limit.
   *
   * @param {number} index
   * @param {number[]} begin
   */
  #goal(index, begin) {
    const { lower, upper, unit } = this.app.arm.joints[index];
    const step = unit === "m" ? DISTANCE : ANGLE;
    const there = begin[index] + step <= upper ? begin[index] + step : Math.max(begin[index] - step, lower);
    return begin.map((position, joint) => (joint === index ? there : position));
  }

  #python() {
    const index = Math.max(this.app.arm.joints.findIndex(({ name }) => name === this.joint?.value), 0);
    const step = this.app.arm.joints[index]?.unit === "m" ? DISTANCE : ANGLE;
    return [
      "begin = list(robot.state.positions)",
      "goal = list(begin)",
      `goal[${index}] += ${step.toFixed(4)}`,
      `robot.move_joints(goal, velocity_scaling=${SHARE})`,
      `robot.move_joints(begin, velocity_scaling=${SHARE})`,
    ].join("\n");
  }
}

/**
 * Return the name of a fault that people read.
 *
 * @param {string} fault
 */
function nameOf(fault) {
  return EXPERIMENTS.some((each) => each.fault === fault) ? text(`bench.${fault}`) : fault;
}
