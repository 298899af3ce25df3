// The strip below the header, on every tab: the first cause of the present faults, and the next step.

/** @import { App } from "../app.js" */
/** @import { Recovery } from "./recovery.js" */

import { at, button, h, setText, setValues } from "../dom.js";
import { parts, since } from "./fault_details.js";
import { unhomed } from "./recovery.js";
import { text } from "../texts.js";

/**
 * Build the strip.
 *
 * @param {App} app The page.
 * @param {Recovery} recovery The recovery from faults.
 */
export function buildFaultStrip(app, recovery) {
  const { arm } = app;
  const host = at("faults");
  const title = h("strong");
  const what = h("span");
  const more = button("", () => document.getElementById("tab-health")?.click(), { class: "link" });
  const close = button("×", () => {
    recovery.dismiss();
    update();
  }, { "aria-label": text("health.close") });
  const step = stepButton(recovery);
  const strip = h("div", { class: "strip" }, h("div", { class: "strip-text" }, title, " ", what, " ", more),
    h("div", { class: "strip-step" }, step.element, close));

  function update() {
    const next = recovery.step;
    const cleared = next?.kind === "enable" || next?.kind === "home";
    setValues(host.dataset, { kind: next ? (cleared ? "action" : "danger") : "" });
    if (!next) {
      if (strip.isConnected) strip.remove();
      return;
    }
    if (cleared) showRecovered(next.kind === "enable");
    else showFault();
    close.hidden = !cleared;
    step.update();
    if (!strip.isConnected) host.append(strip);
  }

  function showFault() {
    const faults = arm.faultList?.faults ?? [];
    const [first] = faults;
    if (!first) {
      setText(title, `⚠ ${text("health.fault")}`);
      setText(what, text("health.loading"));
      more.hidden = true;
      return;
    }
    const { what: happened, remedy } = parts(first);
    setText(title, `⚠ ${first.fault} ${first.source}`);
    setText(what, text(remedy ? "health.strip" : "health.strip_short", { happened, remedy, time: since(arm, first) }));
    more.hidden = false;
    setText(more, faults.length > 1 ? text("health.more", { count: faults.length - 1 }) : text("health.details"));
  }

  /** @param {boolean} off Whether the motors are off. */
  function showRecovered(off) {
    setText(title, `✓ ${text("health.cleared")}`);
    const joints = unhomed(app);
    setText(what, [off ? text("health.motors_off") : "", joints ? text("health.not_homed", { joints }) : ""].join(" ").trim());
    more.hidden = true;
  }

  arm.follow(["sample", "faults", "lease", "link", "event"], update);
}

/**
 * Make the button of the next step, with its effect and the reason why it cannot be pressed.
 *
 * It is one element for all steps, so that the focus stays where it is.
 *
 * @param {Recovery} recovery The recovery from faults.
 * @returns {{element: HTMLElement, update: () => void}} The element, and what brings it up to date.
 */
export function stepButton(recovery) {
  const press = button("", () => {
    recovery.take().then(update);
    update();
  }, { class: "primary step" });
  const number = h("span", { class: "badge action" });
  const note = h("span", { class: "note" });
  const element = h("div", { class: "next-step", role: "group", "aria-label": text("health.next") }, number, press, note);

  function update() {
    const step = recovery.step;
    setValues(element, { hidden: step === null });
    if (step === null) return;
    setText(number, text("health.step", { number: step.number, count: step.count }));
    const { kind, busy } = step;
    press.hidden = kind === "stopping";
    setText(press, text(`health.${busy && kind !== "stopping" ? "busy" : "do"}_${kind}`));
    const hindrance = busy ? "" : recovery.hindrance;
    press.setAttribute("aria-disabled", String(busy || recovery.settling || hindrance !== ""));
    setText(note, hindrance || text(`health.about_${kind}`));
  }
  update();
  return { element, update };
}
