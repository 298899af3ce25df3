// The strip of a previewed trajectory: time, play, notes, execute, discard. It serves the previews of all parts.

/** @import { App, Preview } from "../app.js" */
/** @import { GoalValue } from "../../messages.d.ts" */

import { button, h, PHONE, setText, setValues } from "../dom.js";
import { readable } from "../format.js";
import { text } from "../texts.js";
import { PlanGuard } from "./plan_guard.js";

/** Step of the slider [s], and speeds of the player, as shares of that of the motion. */
const STEP = 0.01;
const RATES = [0.1, 0.25, 0.5, 1, 2, 5, 10];

/** The strip. */
export class PlanStrip {
  /** @param {App} app The page. */
  constructor(app) {
    this.app = app;
    /** @type {Preview | null} */
    this.preview = null;
    /** @type {PlanGuard | null} */
    this.guard = null;
    /** @type {"idle" | "executing" | "spent"} */
    this.phase = "idle";
    this.outcome = "";
    this.playing = false;
    this.title = h("strong", { class: "plan-title" });
    this.play = button(text("view.play"), () => (this.playing ? this.#pause() : this.#begin()), { class: "plan-play" });
    this.rate = h("select", { "aria-label": text("view.rate") },
      ...RATES.map((rate) => h("option", { value: rate, text: text("view.rate_of", { rate }), selected: rate === 1 })));
    this.slider = h("input", { type: "range", min: 0, step: STEP, "aria-label": text("view.plan_time") });
    this.slider.addEventListener("input", () => {
      this.#pause();
      this.app.seekPreview(this.slider.valueAsNumber);
    });
    this.time = h("span", { class: "number plan-clock" });
    this.execute = button(text("view.execute"), () => this.#execute(), { class: "primary plan-execute",
      "aria-describedby": "plan-status" });
    this.discard = button(text("view.discard"), () => this.app.showPreview(null));
    this.status = h("p", { id: "plan-status", class: "plan-status", role: "status" });
    this.notes = h("ul", { class: "plan-notes dim" });
    this.element = h(
      "section",
      { class: "view-plan card", "aria-label": text("view.plan"), hidden: true },
      h("div", { class: "plan-row" }, this.title, this.play, this.rate, this.slider, this.time, this.execute, this.discard),
      this.status,
      this.notes,
    );
    app.previewListeners.push(() => this.#take());
    app.interrupts.push(() => this.#pause());
    this.#take();
    app.arm.follow(["sample", "link", "lease", "workspace", "description", "reset"], () => this.#update());
  }

  #take() {
    const { preview } = this.app;
    if (preview !== this.preview) {
      this.preview = preview;
      this.#pause();
      this.phase = "idle";
      this.outcome = "";
      this.guard = preview ? new PlanGuard(this.app, preview) : null;
      this.element.hidden = preview === null;
      if (preview) {
        setText(this.title, preview.title);
        this.slider.min = String(this.#begins);
        this.slider.max = String(this.#duration);
        this.notes.replaceChildren(...(preview.notes ?? []).map((note) => h("li", { text: readable(note) })));
        this.execute.hidden = preview.execute === null;
        this.discard.hidden = preview.source === "viewer";
        this.uncoverPicture();
      }
    }
    this.#update();
  }

  /** On a phone the strip lies over the picture, until the page is scrolled down. */
  uncoverPicture() {
    if (!this.preview || !PHONE.matches) return;
    // Once the tab is open.
    requestAnimationFrame(() => this.element.parentElement?.scrollIntoView({ block: "end" }));
  }

  get #begins() {
    return Math.min(this.preview?.trajectory.times[0] ?? 0, 0);
  }

  get #duration() {
    const times = this.preview?.trajectory.times ?? [];
    return times[times.length - 1] ?? 0;
  }

  #update() {
    const { preview } = this;
    if (!preview) return;
    const part = preview.phases?.findLast(([begin]) => begin <= preview.time)?.[1] ?? "";
    const shown = text("view.plan_clock", { time: preview.time.toFixed(2), duration: this.#duration.toFixed(2) }) + (part && `, ${part}`);
    if (this.time.textContent !== shown) {
      setText(this.time, shown);
      this.slider.value = String(preview.time);
      this.slider.setAttribute("aria-valuetext", shown);
    }
    const reason = this.#reason();
    this.element.classList.toggle("dead", Boolean(this.guard?.reason) && this.phase === "idle");
    setText(this.status, reason);
    for (const each of [this.play, this.slider]) setValues(each, { disabled: this.phase === "executing" });
    setValues(this.execute, { disabled: reason !== "" || this.phase !== "idle" });
    setText(this.execute, text(this.phase === "executing" ? "view.executing" : "view.execute"));
  }

  /** Why it cannot be executed; empty if it can. */
  #reason() {
    if (this.phase === "executing") return text("view.executing_status");
    if (this.phase === "spent") return this.outcome;
    const dead = this.guard?.check();
    if (dead) return dead;
    if (!this.preview?.execute) return "";
    if (!this.app.arm.fresh) return text("view.execute_stale");
    return this.app.arm.commands ? "" : text("view.execute_no_lease");
  }

  async #execute() {
    const { preview } = this;
    if (!preview?.execute || this.#reason() !== "" || this.phase !== "idle") return;
    this.#pause();
    this.phase = "executing";
    this.#follow(preview, 0);
    this.#update();
    /** @type {GoalValue | null} */
    let goal = null;
    const begun = await this.app.attempt(async () => {
      const answer = /** @type {GoalValue | undefined} */ (await preview.execute?.());
      const follow = (/** @type {number} */ share) => this.#follow(preview, share);
      goal = answer && typeof answer.goal === "number" ? await this.app.ended(answer.goal, follow) : null;
    });
    // Another one may be shown by now.
    if (this.app.preview === preview) this.#finish(begun, goal);
  }

  /**
   * Show the plan where the arm is in it.
   *
   * @param {Preview} preview The plan that it follows.
   * @param {number} share Share of its time.
   */
  #follow(preview, share) {
    if (this.app.preview !== preview || Number.isNaN(share)) return;
    this.app.seekPreview(this.#begins + share * (this.#duration - this.#begins));
  }

  /**
   * @param {boolean} begun
   * @param {GoalValue | null} goal
   */
  #finish(begun, goal) {
    if (begun && (goal === null || goal.status === "succeeded")) {
      this.app.showPreview(null);
      this.app.say(text("view.executed"));
      return;
    }
    this.phase = "spent";
    this.outcome = goal ? text("view.not_executed", { why: goal.failure?.text ?? goal.status }) : text("view.refused");
    this.#update();
  }

  #begin() {
    if (!this.preview) return;
    if (this.preview.time >= this.#duration) this.app.seekPreview(this.#begins);
    this.playing = true;
    setText(this.play, text("view.pause"));
    let last = performance.now();
    const step = () => {
      if (!this.playing || !this.preview) return;
      const now = performance.now();
      const time = Math.min(this.preview.time + (Number(this.rate.value) * (now - last)) / 1000, this.#duration);
      last = now;
      this.app.seekPreview(time);
      if (time >= this.#duration) this.#pause();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  #pause() {
    this.playing = false;
    setText(this.play, text("view.play"));
  }
}
