// Enabling, disabling and homing.

/** @import { App } from "../app.js" */

import { button, h, setText, setValues } from "../dom.js";
import { position } from "../format.js";
import { copyButton, pythonText } from "../python.js";
import { text } from "../texts.js";
import { action, card } from "./action.js";

/** Time within which the second press of a confirmation has to come [ms]. */
const CONFIRM = 6000;

/**
 * Build enabling and homing.
 *
 * @param {App} app The page.
 * @returns {HTMLElement} The part.
 */
export function powerCard(app) {
  const { arm } = app;
  const state = h("span", { class: "badge", role: "status" });
  const enable = action(app, text("run.enable"), () => app.start({ kind: "enable" }), { homed: false, enabled: false,
    attributes: { class: "primary" } });
  const disable = confirmed(app, text("run.disable"), text("run.disable_means"), () => app.start({ kind: "disable" }));
  const update = () => {
    const enabled = arm.fresh ? arm.sample?.enabled : null;
    setText(state, text(enabled === null ? "run.unknown" : enabled ? "run.enabled" : "run.disabled"));
    setValues(state, { className: enabled ? "badge good" : "badge" });
    setValues(enable, { hidden: enabled === true });
    setValues(disable, { hidden: enabled === false });
  };
  arm.follow(["sample", "link"], update);
  return card(text("run.power"),
    h("div", { class: "row" }, state, enable, disable, copyButton(() => (arm.sample?.enabled ? "robot.disable()" : "robot.enable()"))),
    homing(app));
}

/** @param {App} app */
function homing(app) {
  const { arm } = app;
  const body = h("tbody");
  /** @type {{name: string, state: HTMLElement, value: HTMLElement}[]} */
  let rows = [];
  const home = action(app, text("run.home_all"), () => app.start({ kind: "home" }), { homed: false, enabled: false,
    attributes: { class: "primary" } });

  /** @param {string} name */
  function rowOf(name) {
    const state = h("span", { class: "badge" });
    const value = h("td", { class: "number" });
    const again = action(app, text("run.home"), () => app.start({ kind: "home", joints: [name] }), { homed: false, enabled: false,
      attributes: { "aria-label": text("run.home_one", { name }) } });
    body.append(
      h("tr", {}, h("th", { scope: "row", text: name.toUpperCase() }), h("td", {}, state), value,
        h("td", {}, again, " ", copyButton(() => `robot.home([${pythonText(name)}])`))),
    );
    return { name, state, value };
  }

  function build() {
    if (rows.length || !arm.joints.length) return;
    rows = arm.joints.map(({ name }) => rowOf(name));
    update();
  }

  function update() {
    if (body.offsetParent === null) return;
    const { sample } = arm;
    rows.forEach(({ state, value }, index) => {
      const at = arm.fresh && sample ? sample.positions[index] : undefined;
      const word = at === undefined ? "run.unknown" : at === null ? "run.not_homed" : "run.homed";
      setText(state, text(word));
      setValues(state, { className: `badge ${at === undefined ? "" : at === null ? "action" : "good"}` });
      setText(value, position(at ?? null, arm.joints[index].unit));
    });
  }
  arm.on("description", build);
  arm.on("sample", update);
  arm.on("link", update);
  build();
  return h("div", { class: "column" },
    h("div", { class: "row" }, home, copyButton(() => "robot.home()"), h("span", { class: "dim small", text: text("run.home_means") })),
    h("table", { class: "joints" }, h("caption", { class: "hidden-text", text: text("run.homing") }), body));
}

/**
 * Return a button that acts at its second press, after it has shown its consequences.
 *
 * @param {App} app The page.
 * @param {string} label Its text.
 * @param {string} means Its consequences.
 * @param {() => Promise<unknown>} work Sends the command.
 * @returns {HTMLElement} The button, with its question.
 */
export function confirmed(app, label, means, work) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  const question = h("p", { class: "confirm-text", text: means });
  const cancel = button(text("run.keep"), () => ask(false));
  const sure = action(app, text("run.sure", { what: label }), () => {
    ask(false);
    return work();
  }, { homed: false, enabled: false, idle: false, attributes: { class: "primary" } });
  const box = h("div", { class: "confirm column", role: "group", hidden: true }, question, h("div", { class: "row" }, sure, cancel));
  const first = action(app, label, async () => ask(true), { homed: false, enabled: false, idle: false });
  const whole = h("div", { class: "column" }, first, box);

  /** @param {boolean} open */
  function ask(open) {
    clearTimeout(timer);
    const inside = box.contains(document.activeElement);
    box.hidden = !open;
    first.hidden = open;
    if (open) {
      sure.focus();
      timer = setTimeout(() => ask(false), CONFIRM);
    } else if (inside) first.focus();
  }
  return whole;
}
