// A trajectory from a file: read and checked by the server, stretched to fit, previewed, followed.

/** @import { App } from "../app.js" */
/** @import { TrajectoryValue } from "../../messages.d.ts" */

import { ActionError } from "../app.js";
import { pauseButtons } from "../control/pause_buttons.js";
import { button, h, setText } from "../dom.js";
import { duration, number, velocity } from "../format.js";
import { judged, post } from "../http.js";
import { copyButton, pythonText } from "../python.js";
import { action, card } from "../run/action.js";
import { text } from "../texts.js";
import { dropZone } from "./drop_zone.js";
import { Follower } from "./follow.js";
import { MotionPlots, rowsOf } from "./motion_plots.js";

/** Largest file [byte], as of the server: a larger one is not sent. */
const SIZE_MAX = 8 * 2 ** 20;

/**
 * The server's answer for a file.
 *
 * @typedef {Object} Checked
 * @property {TrajectoryValue} trajectory The trajectory.
 * @property {number} points Number of its points.
 * @property {number} duration [s].
 * @property {number} stretched Factor by which it was stretched in time.
 * @property {string[]} notes Notes of the reader.
 * @property {{joint: string, velocity: number, velocity_limit: number, acceleration: number, acceleration_limit: number}[]} peaks Its extremes.
 * @property {string | null} problem Why the arm cannot follow it as it is.
 * @property {TrajectoryValue | null} planned The motion that the arm makes of it.
 */

/** The card. */
export class TrajectoryCard {
  /** @param {App} app The page. */
  constructor(app) {
    this.app = app;
    /** @type {File | null} */
    this.file = null;
    /** @type {Checked | null} */
    this.checked = null;
    this.follower = new Follower(app, () => this.#update());
    this.status = h("p", { role: "status" });
    this.problem = h("p", { class: "badge-line danger", role: "status", hidden: true });
    this.notes = h("ul", { class: "plan-notes dim" });
    this.peaks = h("tbody");
    this.fit = button(text("files.fit"), () => this.#read(true));
    this.plots = new MotionPlots(app);
    this.element = card(text("files.trajectory"), dropZone(text("files.drop"), ".yaml,.yml,.csv", (file) => this.take(file)), this.status,
      this.problem, this.#found(), this.#running());
    this.#update();
  }

  #found() {
    const heads = ["joint", "speed", "speed_limit", "acceleration", "acceleration_limit"];
    const table = h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": text("files.peaks") },
      h("table", { class: "peaks" }, h("caption", { text: text("files.peaks") }),
        h("thead", {}, h("tr", {}, ...heads.map((name) => h("th", { scope: "col", text: text(`files.${name}`) })))), this.peaks));
    this.follow = action(this.app, text("files.execute"), () => this.#follow(), { enabled: false, extra: () => this.#why(),
      attributes: { class: "primary" } });
    const buttons = h("div", { class: "row" }, button(text("files.preview"), () => this.#preview()), this.fit, this.follow,
      copyButton(() => this.#code()));
    this.found = h("div", { class: "column" }, buttons, this.notes, table, this.plots.element);
    return this.found;
  }

  #running() {
    this.bar = h("progress", { max: 1, "aria-label": text("files.progress") });
    this.words = h("span", { role: "status" });
    const { app } = this;
    const cancel = button(text("files.cancel"), () => app.attempt(() => this.follower.cancel()));
    this.controls = h("div", { class: "row" }, this.bar, pauseButtons(app, "follow-pause"), cancel);
    return h("div", { class: "column follow" }, this.controls, this.words);
  }

  /**
   * Read a file.
   *
   * @param {File} file The file.
   */
  take(file) {
    this.app.attempt(async () => {
      if (file.size > SIZE_MAX) {
        throw new ActionError(text("files.too_large", { name: file.name, size: (file.size / 2 ** 20).toFixed(1) }));
      }
      this.file = file;
      await this.#read(false);
    });
  }

  /** @param {boolean} fit */
  async #read(fit) {
    const { file } = this;
    if (!file) return;
    setText(this.status, text("files.reading", { name: file.name }));
    this.#set(null);
    try {
      /** @type {Checked} */
      const checked = await judged(post(`api/trajectories?name=${encodeURIComponent(file.name)}&fit=${Number(fit)}`, file));
      // Another file may have been chosen before the answer.
      if (this.file === file) this.#set(checked);
    } catch (error) {
      if (this.file !== file) return;
      setText(this.status, text("files.refused", { name: file.name }));
      setText(this.problem, error instanceof Error ? error.message : String(error));
      this.problem.hidden = false;
    }
  }

  /** @param {Checked | null} checked */
  #set(checked) {
    this.checked = checked;
    this.#update();
    this.problem.hidden = !checked?.problem;
    this.plots.show(checked ? rowsOf(checked.planned ?? checked.trajectory) : null);
    if (!checked) return;
    const { points, stretched, problem, notes, peaks } = checked;
    const words = [text("files.read", { name: this.file?.name ?? "", points, time: duration(checked.duration) })];
    if (stretched > 1) words.push(text("files.stretched", { factor: number(stretched, 3) }));
    const takes = checked.planned?.times.at(-1);
    if (takes !== undefined) words.push(text("files.takes", { time: duration(takes) }));
    setText(this.status, words.join(" "));
    setText(this.problem, problem ?? "");
    this.notes.replaceChildren(...notes.map((note) => h("li", { text: note })));
    this.peaks.replaceChildren(...peaks.map((peak) => this.#peak(peak)));
  }

  /** @param {Checked["peaks"][number]} peak */
  #peak(peak) {
    const unit = this.app.arm.joints.find(({ name }) => name === peak.joint)?.unit ?? "rad";
    const cell = (/** @type {number} */ value, /** @type {number} */ limit, /** @type {string} */ per) => {
      const over = value > limit * (1 + 1e-9);
      return h("td", { class: `number${over ? " danger" : ""}`,
        text: `${velocity(value, unit)}${per}${over ? ` ${text("files.over")}` : ""}` });
    };
    return h("tr", {}, h("th", { scope: "row", text: peak.joint }), cell(peak.velocity, peak.velocity_limit, ""),
      cell(peak.velocity_limit, Infinity, ""), cell(peak.acceleration, peak.acceleration_limit, "²"),
      cell(peak.acceleration_limit, Infinity, "²"));
  }

  #update() {
    const { checked, follower } = this;
    if (!this.found || !this.bar || !this.words || !this.controls) return;
    this.found.hidden = checked === null;
    this.fit.hidden = !checked?.problem;
    const runs = follower.phase !== "idle";
    this.controls.hidden = !runs;
    if (Number.isNaN(follower.progress)) this.bar.removeAttribute("value");
    else this.bar.value = follower.progress;
    const share = Number.isNaN(follower.progress) ? "" : ` ${Math.round(100 * follower.progress)} %`;
    setText(this.words, runs ? text(`files.${follower.phase}`) + share : follower.words);
  }

  #why() {
    if (this.follower.phase !== "idle") return text("files.runs_already");
    return this.checked?.problem ? text("files.over_limits") : "";
  }

  #preview() {
    const { checked } = this;
    if (!checked) return;
    this.app.showPreview({
      title: this.file?.name ?? text("files.trajectory"),
      trajectory: checked.planned ?? checked.trajectory,
      plan: null,
      time: 0,
      source: "files",
      notes: checked.notes,
      execute: checked.problem ? null : () => this.follower.follow(checked.trajectory),
    });
  }

  async #follow() {
    if (this.checked) await this.follower.follow(this.checked.trajectory);
  }

  #code() {
    const name = pythonText(this.file?.name ?? "trajectory.yaml");
    const fit = (this.checked?.stretched ?? 1) > 1;
    const lines = [`from bioscara.planning import ${fit ? "fit, read" : "read"}`, "", `trajectory, notes = read(${name})`];
    if (fit) lines.push("trajectory, factor = fit(trajectory, robot.parameters.joints)");
    return [...lines, "robot.follow(trajectory, approach=True)"].join("\n");
  }
}
