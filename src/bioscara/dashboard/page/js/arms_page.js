// Begin of the start page: all arms that are served on the computer of the gateway, with STOP for each and for all.

/** @import { ServedArm } from "./arms/arm_card.js" */

import { ArmCard } from "./arms/arm_card.js";
import { pressed, stop } from "./arms/stopper.js";
import { at, h, printable, setText } from "./dom.js";
import { duration } from "./format.js";
import { signIn } from "./session.js";
import { text } from "./texts.js";

/** Time between two looks [ms]. */
const PERIOD = 1000;
/** Time in which the gateway has to answer; it gives each owner 1 s [ms]. */
const PATIENCE = 3000;
/** Age from which the states are unknown [ms]. */
const OLD = 4000;

/** The list of the arms. */
class ArmsPage {
  constructor() {
    /** @type {Map<string, ArmCard>} */
    this.cards = new Map();
    this.press = 0;
    this.arrival = -Infinity;
    this.asking = false;
    setText(at("title"), text("arms.title"));
    setText(at("none"), text("arms.none"));
    at("footer").append(text("app.footer"));
    const button = h("button", { type: "button", id: "stop-button", text: text("arms.stop_all"), "aria-describedby": "stop-description" });
    pressed(button, () => this.stopAll());
    at("stop").append(button, h("span", { id: "stop-description", class: "hidden-text", text: text("arms.stop_description") }));
    window.addEventListener("keydown", (event) => {
      if (event.key === "Escape" && !event.repeat) this.stopAll();
    }, { capture: true });
  }

  /** Look again and again while the page is visible. */
  watch() {
    const look = () => {
      if (!document.hidden) this.look();
    };
    setInterval(look, PERIOD);
    setInterval(() => this.#showAge(), PERIOD / 4);
    document.addEventListener("visibilitychange", look);
    look();
  }

  /** Ask how the arms are. */
  async look() {
    if (this.asking) return;
    this.asking = true;
    try {
      const answer = await fetch("api/arms", { signal: AbortSignal.timeout(PATIENCE) });
      if (answer.status === 401) this.#say(text("error.no_token"));
      if (!answer.ok) return;
      this.#show(await answer.json());
      this.arrival = performance.now();
      document.documentElement.dataset.state = "live";
      this.#say("");
    } catch {
      // The age of the states shows it.
    } finally {
      this.asking = false;
      this.#showAge();
    }
  }

  /** Stop all arms of the computer. */
  stopAll() {
    this.press += 1;
    const { press } = this;
    for (const card of this.cards.values()) {
      card.press += 1;
      card.told(null, true);
    }
    const superseded = () => press !== this.press;
    stop("api/arms/stop", (found) => {
      for (const card of this.cards.values()) card.told(found?.find(({ name }) => name === card.name) ?? null);
      if (!found) this.#say(text("arms.all_unconfirmed"));
    }, superseded);
  }

  /** @param {ServedArm[]} arms */
  #show(arms) {
    for (const [name, card] of this.cards) {
      if (arms.some((arm) => arm.name === name)) continue;
      card.element.remove();
      this.cards.delete(name);
    }
    for (const arm of arms) {
      let card = this.cards.get(arm.name);
      if (!card) {
        card = new ArmCard(arm.name);
        this.cards.set(arm.name, card);
        at("arms").append(card.element);
      }
      card.show(arm);
    }
    at("none").hidden = arms.length > 0;
  }

  #showAge() {
    const age = performance.now() - this.arrival;
    if (age < OLD) {
      setText(at("age"), text("arms.age", { age: duration(age / 1000) }));
      return;
    }
    document.documentElement.dataset.state = Number.isFinite(age) ? "gone" : "connecting";
    setText(at("age"), Number.isFinite(age) ? text("arms.old", { age: duration(age / 1000) }) : text("state.connecting"));
    for (const card of this.cards.values()) card.show(null);
  }

  /** @param {string} message */
  #say(message) {
    setText(at("messages"), message);
  }
}

const page = new ArmsPage();
signIn().then(() => page.watch(), (error) => {
  document.documentElement.dataset.state = "signed-out";
  at("messages").textContent = printable(error.message);
});
