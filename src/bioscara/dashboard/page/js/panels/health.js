// Panel: the state of health. Faults with the recovery, joints, loop and bus, controllers, events, log.

/** @import { App, Panel, PanelView } from "../app.js" */
/** @import { Recovery } from "../health/recovery.js" */

import { h, setText } from "../dom.js";
import { readable } from "../format.js";
import { controllerTables } from "../health/controllers.js";
import { eventLog } from "../health/event_log.js";
import { faultDetails } from "../health/fault_details.js";
import { stepButton } from "../health/fault_strip.js";
import { jointTable } from "../health/joint_table.js";
import { logView } from "../health/log_view.js";
import { loopTable } from "../health/loop_table.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";

/** Time between two reports of joints and statistics [ms]. */
const PERIOD = 2000;

/**
 * Return the panel.
 *
 * @param {Recovery} recovery The recovery from faults.
 * @returns {Panel} The panel.
 */
export function healthPanel(recovery) {
  return { id: "health", mount: (host, app) => mount(host, app, recovery) };
}

/**
 * @param {HTMLElement} host
 * @param {App} app
 * @param {Recovery} recovery
 * @returns {PanelView}
 */
function mount(host, app, recovery) {
  const { arm } = app;
  const faults = faultSection(app, recovery);
  const joints = jointTable(app);
  const loop = loopTable(app);
  const controllers = controllerTables();
  const events = eventLog(app);
  const log = logView(app);
  const logDetails = details("health.log", log.element);
  const controllerDetails = details("health.controllers_title", controllers.element);
  host.append(
    h("div", { class: "health" }, faults.element, card("health.joints", joints.element, "wide"), card("health.loop", loop.element),
      card("health.events", events.element), controllerDetails, logDetails),
  );
  let visible = false;
  let timer = 0;

  async function refresh() {
    clearTimeout(timer);
    if (!visible) return;
    if (arm.connection.open && !document.hidden) {
      // Each on its own: a replayed recording answers only some of them.
      await Promise.allSettled([
        app.ask({ kind: "get_joints" }).then(joints.report),
        app.ask({ kind: "get_statistics" }).then(loop.report),
        controllerDetails.open ? app.ask({ kind: "list_controllers" }).then(controllers.report) : null,
        logDetails.open ? log.refresh() : null,
      ]);
    }
    clearTimeout(timer);
    if (visible) timer = window.setTimeout(refresh, PERIOD);
  }
  for (const each of [logDetails, controllerDetails]) each.addEventListener("toggle", refresh);
  arm.on("sample", () => {
    if (!visible) return;
    joints.sample();
    loop.sample();
  });
  return {
    show() {
      visible = true;
      events.show();
      faults.show();
      joints.sample();
      refresh();
    },
    hide() {
      visible = false;
      events.hide();
      clearTimeout(timer);
    },
  };
}

/**
 * Build the list of faults and warnings.
 *
 * @param {App} app The page.
 * @param {Recovery} recovery The recovery from faults.
 */
function faultSection(app, recovery) {
  const { arm } = app;
  const state = h("p", { role: "status" });
  const list = h("div", { class: "column" });
  const warnings = h("ul", { class: "warnings" });
  const noWarnings = h("p", { class: "dim", text: text("health.no_warnings") });
  const step = stepButton(recovery);
  const python = copyButton(() => {
    const next = recovery.step;
    return next && next.kind !== "stopping" ? `robot.${next.kind}()` : "for fault in robot.faults:\n    print(fault)";
  });
  let shown = "";

  function draw() {
    step.update();
    const given = arm.faultList;
    const now = JSON.stringify([given, arm.sample?.fault, arm.events.length > 0]);
    if (now === shown) return;
    shown = now;
    setText(state, given ? text(`health.state_${arm.sample?.fault ?? given.state}`) : text("health.loading"));
    list.replaceChildren(...(given?.faults ?? []).map((fault, index) => faultDetails(arm, fault, index)));
    warnings.replaceChildren(...[...(given?.warnings ?? [])].reverse().map((each) => h("li", { text: readable(each) })));
    noWarnings.hidden = (given?.warnings ?? []).length > 0;
  }
  for (const topic of /** @type {const} */ (["sample", "faults", "lease", "link"])) arm.on(topic, draw);
  const element = h("section", { class: "card column faults wide" },
    h("div", { class: "row" }, h("h2", { text: text("health.faults") }), python), state, list, step.element,
    h("h3", { text: text("health.warnings") }), noWarnings, warnings);
  return { element, show: draw };
}

/**
 * @param {string} title
 * @param {HTMLElement} content
 * @param {string} [kind]
 */
function card(title, content, kind = "") {
  return h("section", { class: `card column ${kind}` }, h("h2", { text: text(title) }), content);
}

/**
 * @param {string} title
 * @param {HTMLElement} content
 */
function details(title, content) {
  return h("details", { class: "card wide" }, h("summary", {}, h("h2", { text: text(title) })), content);
}
