// The view of the arm: picture, buttons, clearance, target and the strip of a plan.

/** @import { Pose } from "../../messages.d.ts" */
/** @import { App } from "../app.js" */
/** @import { Layer } from "./picture.js" */

import { at, h, setText, setValues } from "../dom.js";
import { degrees, duration, millimetres, position } from "../format.js";
import { text } from "../texts.js";
import { ClearanceReadout } from "./clearance.js";
import { FlatView } from "./flat/flat_view.js";
import { Kinematics } from "./kinematics.js";
import { fetchMeshes, fetchModel } from "./model_source.js";
import { onPaletteChange } from "./palette.js";
import { Picture } from "./picture.js";
import { PlanStrip } from "./plan_strip.js";
import { Scheduler } from "./scheduler.js";
import { Target } from "./target.js";
import { TargetPanel } from "./target_panel.js";
import { buildToolbar } from "./toolbar.js";

/** Time between two checks of the age of values that are not live, and between two texts for screen readers [ms]. */
const AGE = 250;
const SAID = 1000;

/** Keys of the picture. @type {Record<string, Parameters<import("./solid/solid_view.js").SolidView["step"]>[0]>} */
const KEYS = {
  ArrowLeft: "left",
  ArrowRight: "right",
  ArrowUp: "up",
  ArrowDown: "down",
  "+": "in",
  "=": "in",
  "-": "out",
};
const SHIFTED = { ArrowLeft: "pan-left", ArrowRight: "pan-right", ArrowUp: "pan-up", ArrowDown: "pan-down" };

/**
 * Build the view.
 *
 * @param {App} app The page.
 * @param {{target?: boolean, trace?: boolean}} [parts] Whether it has the target of the tool, and shows its trace at first.
 */
export function buildView(app, { target = true, trace = true } = {}) {
  const strip = new PlanStrip(app);
  const loading = h("p", { class: "view-canvas view-loading dim", role: "status", text: text("view.loading") });
  const host = h("div", { class: "view-body" }, loading);
  at("view").append(host, strip.element);
  const begin = async () => {
    if (!app.arm.description) return false;
    const kinematics = new Kinematics(await fetchModel(), app.arm.joints.map((joint) => joint.name));
    const backend = await makeBackend(kinematics);
    loading.remove();
    const view = new View(app, kinematics, backend, host, strip.element, trace);
    view.toolbar.target.hidden = !target;
    strip.uncoverPicture();
    return true;
  };
  let begun = false;
  const attempt = () => {
    // A phone shows the view on request: what draws it is not loaded before.
    if (begun || !app.arm.description || host.offsetParent === null) return;
    begun = true;
    begin().catch((error) => {
      setText(loading, text("view.no_model", { why: error.message }));
      // Another connection may bring it.
      begun = false;
    });
  };
  app.arm.on("description", attempt);
  new ResizeObserver(attempt).observe(host);
}

/**
 * The place of the picture, and its callbacks.
 *
 * @typedef {import("./solid/solid_view.js").SolidView | FlatView} Drawing
 *
 * @typedef {Object} Backend
 * @property {Drawing} drawing Draws pictures.
 * @property {{changed: () => void, drag: (pose: Pose) => void, busy: (turning: boolean) => void}} calls Set by the view.
 */

/**
 * Make the drawing: solid, or flat where there is no WebGL.
 *
 * @param {Kinematics} kinematics The arm.
 * @returns {Promise<Backend>} The drawing.
 */
async function makeBackend(kinematics) {
  /** @type {Backend["calls"]} */
  const calls = { changed: () => {}, drag: () => {}, busy: () => {} };
  const through = {
    changed: () => calls.changed(),
    drag: (/** @type {Pose} */ pose) => calls.drag(pose),
    busy: (/** @type {boolean} */ is) => calls.busy(is),
  };
  if (hasWebGl()) {
    const [meshes, { SolidView }] = await Promise.all([fetchMeshes(kinematics.model), import("./solid/solid_view.js")]);
    try {
      return { drawing: new SolidView(kinematics, meshes, through), calls };
    } catch {
      // WebGL is there in name only, as with a driver on the browser's list: the flat view needs none.
    }
  }
  return { drawing: new FlatView(kinematics, through.drag), calls };
}

function hasWebGl() {
  const context = document.createElement("canvas").getContext("webgl2");
  // Browsers keep few contexts at once.
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return context !== null;
}

/** The parts of the view, together. */
class View {
  /**
   * @param {App} app The page.
   * @param {Kinematics} kinematics The arm.
   * @param {Backend} backend Where it is drawn.
   * @param {HTMLElement} host Element of the view.
   * @param {HTMLElement} strip Element of the plan, before which a refusal stands.
   * @param {boolean} trace Whether the trace of the tool is shown at first.
   */
  constructor(app, kinematics, { drawing, calls }, host, strip, trace) {
    this.app = app;
    this.drawing = drawing;
    this.solid = !(drawing instanceof FlatView);
    this.picture = new Picture(app, kinematics);
    if (!trace) this.picture.layers.delete("trace");
    this.target = new Target(app);
    this.scheduler = new Scheduler(drawing.host, () => this.#draw());
    this.clearance = new ClearanceReadout(app, () => this.scheduler.seen, (found) => {
      this.picture.clearance = found;
      this.scheduler.request();
    });
    this.said = -Infinity;
    this.toolbar = buildToolbar({
      look: (preset) => {
        this.drawing.look(preset);
        this.scheduler.request();
      },
      step: (step) => {
        this.drawing.step(step);
        this.scheduler.request();
      },
      layer: (layer, shown) => this.#layer(layer, shown),
      target: (shown) => this.target.show(shown),
    }, this.picture.layers, this.solid);
    this.panel = new TargetPanel(this.target);
    this.pose = h("span", { class: "number view-pose" });
    this.held = h("span", { class: "view-held", hidden: true });
    this.note = h("span", { class: "dim view-note", text: this.solid ? "" : text("view.no_webgl") });
    this.banner = h("p", { class: "view-banner", role: "status", hidden: true });
    this.alternative = h("p", { id: "view-said", class: "hidden-text" });
    this.#build(host);
    strip.before(this.panel.refusal);
    calls.changed = () => this.scheduler.request();
    calls.drag = (pose) => this.target.set(pose);
    calls.busy = (turning) => {
      this.scheduler.turning = turning;
    };
    this.scheduler.becameSlow = () => this.#reduce();
    this.#listen();
    // For tests and for the curious.
    Object.assign(app, { view: this });
  }

  /** @param {HTMLElement} host */
  #build(host) {
    // A picture that keys turn: the screen reader passes them on.
    const { host: canvas } = this.drawing;
    canvas.setAttribute("role", this.solid ? "application" : "img");
    canvas.setAttribute("aria-describedby", "view-said");
    canvas.setAttribute("aria-label", text(this.solid ? "view.picture" : "view.picture_flat"));
    if (this.solid) canvas.tabIndex = 0;
    canvas.addEventListener("keydown", (event) => this.#key(event));
    host.append(
      this.toolbar.element,
      h("div", { class: "view-middle" }, h("div", { class: "view-picture" }, canvas, this.banner), this.panel.element),
      h("div", { class: "view-status row" }, this.pose, this.clearance.element, this.held, this.note),
      this.alternative,
    );
  }

  #listen() {
    const { arm } = this.app;
    arm.on("sample", () => this.#sample());
    arm.on("link", () => this.#sample());
    arm.on("description", () => this.scheduler.request());
    for (const topic of /** @type {const} */ (["world", "bodies"])) {
      arm.on(topic, () => {
        this.picture.take();
        this.#held();
        this.scheduler.request();
      });
    }
    arm.on("workspace", () => {
      this.picture.preview = null;
      this.#preview();
    });
    arm.on("reset", () => {
      this.picture.trace.clear();
      this.scheduler.request();
    });
    this.app.previewListeners.push(() => this.#preview());
    this.target.listeners.push(() => this.#targeted());
    setInterval(() => {
      if (!arm.fresh) this.#sample();
    }, AGE);
    onPaletteChange(() => {
      this.drawing.repaint();
      this.scheduler.request();
    });
    this.#preview();
    this.#sample();
  }

  #draw() {
    this.picture.place();
    this.drawing.draw(this.picture);
  }

  #reduce() {
    this.drawing.reduce();
    setText(this.note, text("view.slow"));
    this.scheduler.request();
  }

  #sample() {
    if (this.picture.take()) this.scheduler.request();
    if (!this.scheduler.seen) return;
    this.#banner();
    this.#pose();
    this.#say();
  }

  #preview() {
    this.picture.takePreview();
    this.scheduler.request();
  }

  #targeted() {
    this.toolbar.target.setAttribute("aria-pressed", String(this.target.shown));
    this.picture.target = this.target.pose;
    this.picture.collision = this.target.refusal?.names ?? [];
    this.scheduler.request();
  }

  /**
   * @param {Layer} layer
   * @param {boolean} shown
   */
  #layer(layer, shown) {
    if (shown) this.picture.layers.add(layer);
    else this.picture.layers.delete(layer);
    this.scheduler.request();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const step = event.shiftKey ? { ...KEYS, ...SHIFTED }[event.key] : KEYS[event.key];
    if (!step || !this.solid) return;
    event.preventDefault();
    /** @type {import("./solid/solid_view.js").SolidView} */ (this.drawing).step(/** @type {any} */ (step));
    this.scheduler.request();
  }

  /** Say over the picture that it is not that of now. */
  #banner() {
    const { arm } = this.app;
    let message = "";
    if (!arm.sample) message = text("view.waiting");
    else if (!arm.fresh) message = text("view.old", { age: duration(arm.age / 1000) });
    else if (this.picture.unknown.length) message = text("view.unknown_joints", { joints: this.picture.unknown.join(", ") });
    setText(this.banner, message);
    setValues(this.banner, { hidden: message === "" });
  }

  /** The sentence on the body in the jaws, which only a simulated world knows. @returns {string} */
  get heldWords() {
    const { world, bodies } = this.app.arm;
    if (!world || !bodies) return "";
    return world.held === null ? text("view.holds_nothing") : text("view.holds", { name: world.held });
  }

  #held() {
    setText(this.held, this.heldWords);
    setValues(this.held, { hidden: this.heldWords === "" });
  }

  #pose() {
    const { sample } = this.app.arm;
    this.pose.classList.toggle("dim", !this.picture.fresh);
    if (!sample?.pose) {
      setText(this.pose, text("view.pose_unknown"));
      return;
    }
    setText(this.pose, text("view.pose", words(sample.pose)));
  }

  /** The same as text, for screen readers; not announced, as it changes all the time. */
  #say() {
    if (performance.now() - this.said < SAID) return;
    this.said = performance.now();
    const { sample, joints, fresh } = this.app.arm;
    if (!sample) {
      setText(this.alternative, text("view.waiting"));
      return;
    }
    const each = sample.names.map((name, joint) => {
      const unit = joints.find((known) => known.name === name)?.unit ?? "rad";
      return `${name} ${position(sample.positions[joint], unit)}`;
    });
    const parts = [
      fresh ? "" : text("view.not_live_said"),
      sample.pose ? text("view.pose_said", words(sample.pose)) : text("view.pose_unknown"),
      text("view.joints_said", { joints: each.join(", ") }),
      this.heldWords,
      typeof sample.width === "number" ? text("view.width_said", { width: millimetres(sample.width) }) : "",
    ];
    setText(this.alternative, parts.filter(Boolean).join(" "));
  }
}

/** @param {Pose} pose */
function words([x, y, z, yaw]) {
  return { x: millimetres(x), y: millimetres(y), z: millimetres(z), yaw: degrees(Math.atan2(Math.sin(yaw), Math.cos(yaw))) };
}
