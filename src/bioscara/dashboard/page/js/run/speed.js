// Speed override, and the reduced speed with its guarded release.

/** @import { App } from "../app.js" */

import { h, setText } from "../dom.js";
import { copyButton, pythonNumber } from "../python.js";
import { text } from "../texts.js";
import { action, card } from "./action.js";
import { confirmed } from "./power.js";

/** Time between two values that are sent while the slider moves [ms]. */
const THROTTLE = 150;

/**
 * Build the speed.
 *
 * @param {App} app The page.
 * @returns {HTMLElement} The part.
 */
export function speedCard(app) {
  const { arm } = app;
  const shown = h("output", { class: "number", for: "override" });
  const slider = h("input", { type: "range", id: "override", min: 0, max: 100, step: 1, on: { input: change, change } });
  let sent = 0;
  let touched = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;

  function change() {
    touched = performance.now();
    setText(shown, `${slider.value} %`);
    clearTimeout(timer);
    const wait = THROTTLE - (performance.now() - sent);
    // The last value is sent in any case.
    timer = setTimeout(() => {
      sent = performance.now();
      app.attempt(() => app.request({ kind: "set_speed_override", share: Number(slider.value) / 100 }));
    }, Math.max(wait, 0));
  }

  const update = () => {
    const { sample } = arm;
    // What another client sets is shown, but not under the hand of this person.
    if (!sample || performance.now() - touched < 1000) return;
    const share = String(Math.round(100 * sample.speed_override));
    if (slider.value !== share) slider.value = share;
    setText(shown, `${share} %`);
  };
  arm.follow(["sample"], update);
  return card(text("run.speed"),
    h("div", { class: "row" }, h("label", { for: "override", text: text("run.override") }), slider, shown,
      copyButton(() => `robot.speed_override = ${pythonNumber(Number(slider.value) / 100, 2)}`)), reduced(app));
}

/** @param {App} app */
function reduced(app) {
  const { arm } = app;
  const state = h("span", { class: "badge", role: "status" });
  /** @param {boolean} wanted */
  const set = (wanted) => app.start({ kind: "set_reduced_speed", reduced: wanted, revision: arm.workspace?.revision ?? null });
  const release = confirmed(app, text("run.release"), text("run.release_means"), () => set(false));
  const reduce = action(app, text("run.reduce"), () => set(true), { homed: false, enabled: false });
  const update = () => {
    const known = arm.workspace !== null;
    const is = arm.workspace?.reduced_speed;
    setText(state, text(!known ? "run.unknown" : is ? "run.reduced" : "run.full"));
    state.className = `badge ${known ? (is ? "good" : "warn") : ""}`;
    release.hidden = is === false;
    reduce.hidden = is !== false;
  };
  arm.follow(["workspace"], update);
  return h("div", { class: "row" }, state, release, reduce,
    copyButton(() => `robot.reduced_speed = ${arm.workspace?.reduced_speed === false ? "True" : "False"}`));
}
