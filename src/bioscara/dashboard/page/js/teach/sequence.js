// The sequence that is edited: its steps, which one is chosen, undo, verdicts of planning, progress.

import { judged, post } from "../http.js";

/** A step as the file has it: `kind` and the values of that kind, in SI units. @typedef {{kind: string, [field: string]: any}} Step */
/** @typedef {{title?: string, tool?: string, steps: Step[]}} SequenceValues */
/** What planning or carrying out says of a step. @typedef {{state: "ok" | "refused" | "running" | "done" | "failed", text: string}} Mark */
/** @typedef {{title: string, steps: Step[]}} Snapshot */

/** Changes that can be undone. */
const KEPT = 50;

/**
 * The sequence. `on` calls a function after each change: `steps` when steps were added, removed, moved or loaded,
 * `edit` when a value changed, `marks` when verdicts or progress changed.
 */
export class SequenceModel {
  constructor() {
    this.title = "";
    this.tool = "fingers";
    /** @type {Step[]} */
    this.steps = [];
    this.chosen = -1;
    /** By index. @type {Map<number, Mark>} */
    this.marks = new Map();
    /** @type {Snapshot[]} */
    this.past = [];
    /** @type {Map<string, (() => void)[]>} */
    this.listeners = new Map();
  }

  /**
   * @param {"steps" | "edit" | "marks"} topic
   * @param {() => void} listener
   */
  on(topic, listener) {
    this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
  }

  /** @param {"steps" | "edit" | "marks"} topic */
  #tell(topic) {
    for (const listener of this.listeners.get(topic) ?? []) listener();
  }

  #remember() {
    this.past.push({ title: this.title, steps: structuredClone(this.steps) });
    if (this.past.length > KEPT) this.past.shift();
    this.marks.clear();
  }

  /** @returns {SequenceValues} The values that the server takes. */
  values() {
    return { ...(this.title ? { title: this.title } : {}), tool: this.tool, steps: this.steps };
  }

  /** @returns {Promise<string>} The sequence as the text of a file. */
  async yaml() {
    return (await judged(post("api/sequences/write", this.values()))).text;
  }

  /**
   * Return the sequence, or some steps of it, as a Python program.
   *
   * @param {number} [first] Index of the first step.
   * @param {number} [last] Index of the step to end before; all without it.
   * @returns {Promise<string>} The program.
   */
  async python(first = 0, last = this.steps.length) {
    return (await judged(post(`api/sequences/script?first=${first}&last=${last}`, this.values()))).text;
  }

  /**
   * Replace the sequence by another one.
   *
   * @param {SequenceValues} values Of a file.
   */
  load(values) {
    this.#remember();
    this.title = values.title ?? "";
    this.tool = values.tool ?? "fingers";
    this.steps = values.steps;
    this.chosen = -1;
    this.#tell("steps");
  }

  /**
   * Add a step after the chosen one, or at the end, and choose it.
   *
   * @param {Step} step The step.
   */
  add(step) {
    this.#remember();
    const at = this.chosen < 0 ? this.steps.length : this.chosen + 1;
    this.steps.splice(at, 0, step);
    this.chosen = at;
    this.#tell("steps");
  }

  /** @param {number} index */
  remove(index) {
    this.#remember();
    this.steps.splice(index, 1);
    this.chosen = Math.min(this.chosen, this.steps.length - 1);
    this.#tell("steps");
  }

  /** @param {number} index */
  duplicate(index) {
    this.chosen = index;
    this.add(structuredClone(this.steps[index]));
  }

  /**
   * Move a step to another place.
   *
   * @param {number} from Its index.
   * @param {number} to Its index afterwards.
   */
  move(from, to) {
    if (from === to || to < 0 || to >= this.steps.length) return;
    this.#remember();
    const [step] = this.steps.splice(from, 1);
    this.steps.splice(to, 0, step);
    this.chosen = to;
    this.#tell("steps");
  }

  /**
   * Choose a step; -1 for none.
   *
   * @param {number} index Its index.
   */
  choose(index) {
    this.chosen = index === this.chosen ? -1 : index;
    this.#tell("steps");
  }

  /**
   * Change values of a step; those that are undefined are removed.
   *
   * @param {number} index The step.
   * @param {Object<string, any>} values The values.
   * @param {boolean} [rebuild] Whether its fields are others now.
   */
  edit(index, values, rebuild = false) {
    this.#remember();
    const step = { ...this.steps[index], ...values };
    for (const [field, value] of Object.entries(step)) if (value === undefined) delete step[field];
    this.steps[index] = step;
    this.#tell(rebuild ? "steps" : "edit");
  }

  /** @param {string} title */
  entitle(title) {
    this.#remember();
    this.title = title;
    this.#tell("edit");
  }

  /** Undo the latest change. */
  undo() {
    const before = this.past.pop();
    if (!before) return;
    Object.assign(this, before);
    this.chosen = Math.min(this.chosen, this.steps.length - 1);
    this.marks.clear();
    this.#tell("steps");
  }

  /**
   * Use the new name of a pose.
   *
   * @param {string} former Its former name.
   * @param {string} name Its name.
   */
  renamePose(former, name) {
    for (const step of this.steps) {
      for (const field of ["name", "pose", "via"]) if (step[field] === former) step[field] = name;
    }
    this.#tell("steps");
  }

  /**
   * Mark steps.
   *
   * @param {number} first Index of the first one.
   * @param {number} number Number of the steps.
   * @param {Mark} mark What to say of them.
   */
  mark(first, number, mark) {
    for (let index = first; index < first + number; index += 1) this.marks.set(index, mark);
    this.#tell("marks");
  }

  /** Forget the messages about the steps. */
  unmark() {
    this.marks.clear();
    this.#tell("marks");
  }
}
