// One experiment: the simulated fault, the expected reaction of the software, and the observed one.

/** @import { App } from "../app.js" */
/** @import { Event } from "../../messages.d.ts" */
/** @import { Experiment } from "./experiments.js" */

import { button, h, setText, setValues } from "../dom.js";
import { DEGREE, duration, MM, number } from "../format.js";
import { copyButton, pythonNumber, pythonText } from "../python.js";
import { text } from "../texts.js";

/** Events of the software that are shown for one experiment. */
const SHOWN = 8;
/** Events that say nothing about the reaction. */
const ASIDE = new Set(["client", "gateway", "lease", "workspace", "parameters", "simulation"]);
/** Distance of a new obstacle from the joint, as a share of its range. */
const AHEAD = 0.05;

/** An experiment's part of the panel. */
export class ExperimentCard {
  /**
   * @param {App} app The page.
   * @param {Experiment} experiment The experiment.
   * @param {(experiment: Experiment, joint: string, value: number, on: boolean) => Promise<boolean>} run Begins or
   *   ends it.
   */
  constructor(app, experiment, run) {
    this.app = app;
    this.experiment = experiment;
    this.run = run;
    /** Number of the newest event before it was begun; null unless it was. @type {number | null} */
    this.since = null;
    this.begun = NaN;
    /** Number of events that are shown. */
    this.count = 0;
    const { fault, joint, value } = experiment;
    this.joint = h("select", { "aria-label": text("bench.joint"), hidden: !joint, on: { change: () => this.suggest() } },
      ...app.arm.joints.map(({ name }) => h("option", { value: name, text: name })));
    this.value = h("input", { type: "number", step: "any", class: "bench-value", hidden: value === null });
    this.unit = h("span", { class: "dim" });
    this.on = button(text(experiment.switch.off ? "bench.begin" : "bench.do"), () => this.#begin());
    this.off = button(text("bench.end"), () => this.run(experiment, this.joint.value, 0, false), {
      hidden: experiment.switch.off === null,
    });
    this.did = h("ol", { class: "bench-events", "aria-live": "polite" });
    this.didTitle = h("h3", { text: text("bench.did"), hidden: true });
    const label = value === null ? null : h("label", {}, text(`bench.value_${value}`), this.value, this.unit);
    this.element = h("section", { class: "card column bench-card", "aria-label": text(`bench.${fault}`) },
      h("h2", { text: text(`bench.${fault}`) }),
      h("p", {}, h("strong", { text: text("bench.expected") }), ` ${text(`bench.expect_${fault}`)}`),
      h("div", { class: "row" }, this.joint, label, this.on, this.off, copyButton(() => this.#python())), this.didTitle, this.did);
    this.suggest();
  }

  /** Let it be pressed or not. @param {boolean} allowed Whether this page may. */
  permit(allowed) {
    for (const each of [this.on, this.off]) setValues(each, { disabled: !allowed });
  }

  /** Show the reaction of the software since the begin. */
  show() {
    const { since } = this;
    if (since === null) return;
    const events = this.app.arm.events.filter((event) => event.number > since && telling(event)).slice(0, SHOWN);
    this.didTitle.hidden = false;
    if (events.length === 0) {
      this.did.replaceChildren(h("li", { class: "dim", text: text("bench.nothing_yet") }));
      this.count = 0;
      return;
    }
    if (events.length === this.count) return;
    this.count = events.length;
    this.did.replaceChildren(
      ...events.map((event) =>
        h("li", {}, h("span", { class: "dim", text: text("bench.after", { time: duration(Math.max(event.time - this.begun, 0)) }) }),
          ` ${event.text}`)
      ),
    );
  }

  /** Forget the events, as of another owner. */
  reset() {
    this.since = null;
    this.did.replaceChildren();
    this.didTitle.hidden = true;
  }

  async #begin() {
    const { arm } = this.app;
    const since = arm.lastEvent;
    const begun = arm.sample?.time ?? NaN;
    if (!this.value.hidden && !Number.isFinite(this.value.valueAsNumber)) {
      this.app.say(text("bench.no_number"), "error");
      return;
    }
    this.count = -1;
    if (await this.run(this.experiment, this.joint.value, this.#given(), true)) {
      this.since = since;
      this.begun = begun;
      this.show();
    }
  }

  /** The value that begins it, in SI units. */
  #given() {
    const { value, switch: { on } } = this.experiment;
    return value === null ? on : this.value.valueAsNumber * this.#factor();
  }

  #factor() {
    switch (this.experiment.value) {
      case "place":
        return this.#linear() ? MM : DEGREE;
      case "rate":
      case "share":
        return 0.01;
    }
    return 1;
  }

  #linear() {
    return this.app.arm.joints.find(({ name }) => name === this.joint.value)?.unit === "m";
  }

  /** Suggest a value for the joint that is chosen. */
  suggest() {
    const { value, initial } = this.experiment;
    if (value === null) return;
    const linear = this.#linear();
    setText(this.unit, { place: linear ? "mm" : "°", force: linear ? "N" : "N m", rate: "%", share: "%", time: "s" }[value]);
    if (value !== "place") {
      this.value.value = String(initial);
      return;
    }
    const index = this.app.arm.joints.findIndex(({ name }) => name === this.joint.value);
    const joint = this.app.arm.joints[index];
    const at = this.app.arm.sample?.positions[index] ?? (joint.lower + joint.upper) / 2;
    const ahead = at + AHEAD * (joint.upper - joint.lower);
    this.value.value = number(Math.min(ahead, joint.upper) / this.#factor(), 1);
  }

  #python() {
    const { fault, joint } = this.experiment;
    const value = this.#given();
    const words = [pythonText(fault), joint ? pythonText(this.joint.value) : '""', pythonNumber(Number.isFinite(value) ? value : 0)];
    return `robot.simulate_fault(${words.join(", ")})`;
  }
}

/** @param {Event} event */
function telling(event) {
  return !ASIDE.has(event.what);
}
