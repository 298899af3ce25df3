// One arm of the list: its name, its state, the link to its page, STOP.

/** @import { StateSample } from "../../messages.d.ts" */
/** @import { Stopped } from "./stopper.js" */

import { pausedBy } from "../control/pause_buttons.js";
import { h, setText } from "../dom.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";
import { pressed, stop } from "./stopper.js";

/**
 * An arm as `GET /api/arms` lists it.
 *
 * @typedef {{name: string, arm: string, simulated: boolean | null, state: StateSample | null, text: string,
 *   page: string | null, here: boolean}} ServedArm
 */

/**
 * Return how an arm is, with the colour of the state.
 *
 * @param {ServedArm | null} arm The arm; null if it is not known any more.
 * @returns {[string, string]} In words, and the class of the badge.
 */
export function conditionOf(arm) {
  const state = arm?.state;
  if (!state) return [text("arms.unknown"), "danger"];
  if (state.fault !== "clear") return [text("arms.fault", { state: state.fault }), "danger"];
  if (state.stale) return [text("arms.stale"), "warn"];
  if (state.paused) return [text("arms.paused", { names: pausedBy(state) }), "warn"];
  if (state.moving.length) return [text("arms.moving", { what: state.moving.join(", ") }), "good"];
  return [text(state.enabled ? "arms.enabled" : "arms.disabled"), ""];
}

/** The card of an arm. */
export class ArmCard {
  /** @param {string} name Name of its owner. */
  constructor(name) {
    this.name = name;
    this.press = 0;
    /** Whether it was seen at rest since the last stop. */
    this.rested = false;
    this.kind = h("span", { class: "badge kind" });
    this.condition = h("span", { class: "badge", role: "status" });
    this.facts = h("p", { class: "facts dim" });
    this.link = h("a", { class: "open" });
    this.result = h("p", { class: "result", role: "alert" });
    this.button = h("button", { type: "button", class: "stop-arm", text: text("stop.button"), "aria-label": text("arms.stop", { name }) });
    pressed(this.button, () => this.stop());
    const python = copyButton(() => `with Robot.connect("arm:${name}") as robot:\n    robot.stop()`);
    const title = h("h2", { text: name });
    this.element = h("li", { class: "card" }, h("div", { class: "row" }, title, this.kind, this.condition), this.facts, this.result,
      h("div", { class: "actions" }, this.link, h("div", { class: "row" }, python, this.button)));
  }

  /**
   * Show how the arm is.
   *
   * @param {ServedArm | null} arm The arm; null if that is not known now.
   */
  show(arm) {
    const [words, colour] = conditionOf(arm);
    this.element.dataset.known = String(Boolean(arm?.state));
    setText(this.condition, words);
    this.condition.className = `badge ${colour}`;
    if (!arm) return;
    if (!arm.state?.moving.length) this.rested = Boolean(arm.state);
    else if (this.rested && this.result.dataset.stopped === "true") setText(this.result, "");
    const kind = arm.simulated === null ? "unknown" : arm.simulated ? "simulated" : "real";
    this.element.dataset.kind = kind;
    setText(this.kind, text(`header.${kind}`));
    this.kind.className = `badge kind ${kind === "simulated" ? "warn" : ""}`;
    setText(this.facts, [arm.arm, arm.text].filter(Boolean).join(": "));
    this.#offer(arm);
  }

  /** @param {ServedArm} arm */
  #offer({ name, page, here }) {
    const address = here ? "./" : page;
    setText(this.link, address ? text("arms.open", { name }) : text("arms.no_page", { name }));
    if (address) this.link.href = address;
    else this.link.removeAttribute("href");
  }

  /** Stop this arm. */
  stop() {
    this.press += 1;
    const { press } = this;
    this.told(null, true);
    stop(`api/arms/${encodeURIComponent(this.name)}/stop`, (found) => this.told(found?.[0] ?? null), () => press !== this.press);
  }

  /**
   * Show what became of a stop.
   *
   * @param {Stopped | null} found The confirmation of its owner; null if there was no answer.
   * @param {boolean} [sent] Whether it was only sent now.
   */
  told(found, sent = false) {
    this.rested = false;
    this.result.dataset.stopped = String(sent || Boolean(found?.stopped));
    setText(this.result, sent ? text("arms.sent") : found?.text ?? text("arms.unconfirmed", { name: this.name }));
  }
}
