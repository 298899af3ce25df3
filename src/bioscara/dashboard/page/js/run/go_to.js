// Going to a pose that is typed in, or to one that has a name; with the plan shown before.

/** @import { App } from "../app.js" */
/** @import { MoveJoints, MoveLinear, MoveNamed, MoveTo, Pose, Unfold } from "../../messages.d.ts" */

import { button, h, setText } from "../dom.js";
import { duration, readable } from "../format.js";
import { copyButton, pythonNumber, pythonPose, pythonText } from "../python.js";
import { text } from "../texts.js";
import { action, card, quantity } from "./action.js";

/** Pose that every arm has. */
const BUILT_IN = "center";

/** @typedef {MoveTo | MoveLinear | MoveNamed | MoveJoints | Unfold} Planned */

/**
 * Build going to a pose.
 *
 * @param {App} app The page.
 * @returns {HTMLElement} The part.
 */
export function goToCard(app) {
  const { arm } = app;
  const fields = [
    quantity("X", "mm", { id: "go-x" }),
    quantity("Y", "mm", { id: "go-y" }),
    quantity("Z", "mm", { id: "go-z" }),
    quantity(text("jog.axis.yaw"), "°", { id: "go-yaw" }),
  ];
  const kind = h("select", { id: "go-kind" }, h("option", { value: "move_to", text: text("run.ptp") }),
    h("option", { value: "move_linear", text: text("run.lin") }));
  const share = quantity(text("run.share"), "%", { value: 100, min: 0.1, max: 100, id: "go-share" });
  const here = button(text("run.here"), fill);
  let filled = false;

  function fill() {
    const pose = arm.sample?.pose;
    if (!arm.fresh) app.say(text("refusal.stale"), "error", () => !arm.fresh);
    else if (!pose) app.say(text("refusal.not_homed"), "error", () => !arm.sample?.pose);
    else fields.forEach((field, index) => field.set(pose[index]));
  }
  // Once, so that no field is empty; and only fields in which no text was begun.
  const first = () => {
    if (filled || !arm.sample?.pose || !arm.fresh) return;
    filled = true;
    if (fields.every(({ input }) => input.value === "")) fill();
  };
  arm.on("sample", first);
  const missing = () => (fields.some((field) => Number.isNaN(field.value())) || Number.isNaN(share.value()) ? text("run.fields") : "");
  /** @returns {(MoveTo | MoveLinear) & {pose: Pose}} */
  const motion = () => ({
    kind: kind.value === "move_linear" ? "move_linear" : "move_to",
    pose: [fields[0].value(), fields[1].value(), fields[2].value(), fields[3].value()],
    velocity_scaling: share.value(),
  });
  const code = () => {
    const { kind: method, pose, velocity_scaling } = motion();
    return `robot.${method}(${pythonPose(pose.map((value) => value || 0))}${scalingOf(velocity_scaling)})`;
  };
  return card(text("run.go_to"), h("div", { class: "fields" }, ...fields.map(({ element }) => element)),
    h("div", { class: "row" }, h("label", { for: "go-kind", text: text("run.motion") }), kind, share.element, here),
    buttons(app, motion, missing, code, text("run.pose")));
}

/**
 * Build going to a pose that has a name.
 *
 * @param {App} app The page.
 * @returns {HTMLElement} The part.
 */
export function namedCard(app) {
  const { arm } = app;
  const names = h("select", { id: "named-pose", class: "wide" });
  const offer = () => {
    const taught = arm.workspace?.table.poses ?? [];
    const chosen = names.value;
    names.replaceChildren(h("option", { value: BUILT_IN, text: BUILT_IN }),
      ...taught.map(({ name, tool }) =>
        h("option", { value: name, text: tool && tool !== arm.workspace?.tool.name ? `${name} (${tool})` : name })
      ));
    if (taught.some(({ name }) => name === chosen)) names.value = chosen;
  };
  arm.follow(["workspace"], offer);
  /** @returns {MoveNamed} */
  const motion = () => ({ kind: "move_named", name: names.value });
  const unfold = action(app, text("run.unfold"), () => app.start({ kind: "unfold" }));
  return card(text("run.named"), h("div", { class: "row" }, h("label", { for: "named-pose", text: text("run.pose") }), names),
    buttons(app, motion, () => "", () => `robot.move_named(${pythonText(names.value)})`, text("run.named_pose")),
    h("div", { class: "row" }, unfold, copyButton(() => "robot.unfold()"),
      h("span", { class: "dim small", text: text("run.unfold_means") })));
}

/**
 * Build the buttons of a motion: preview, execute the preview, go at once.
 *
 * @param {App} app The page.
 * @param {() => Planned} motion Returns the motion.
 * @param {() => string} missing Returns why it cannot be used yet.
 * @param {() => string} code Returns its Python code.
 * @param {string} title Title of its preview.
 */
function buttons(app, motion, missing, code, title) {
  const result = h("p", { class: "dim small", role: "status" });
  /** @type {import("../app.js").Preview | null} */
  let own = null;
  const plan = button(text("run.preview"), () => {
    const reason = () => missing() || (app.arm.fresh ? "" : text("refusal.stale"));
    const why = reason();
    if (why) app.say(`${text("run.preview")}: ${why}`, "error", () => reason() === why);
    else app.attempt(preview);
  });
  const execute = action(app, text("run.execute"), async () => {
    if (own?.execute) await own.execute();
  });
  const go = action(app, text("run.go"), () => app.start(motion()), { extra: missing });
  execute.hidden = true;
  app.previewListeners.push(() => {
    execute.hidden = own === null || app.preview !== own;
    if (execute.hidden) setText(result, "");
  });

  async function preview() {
    const made = await app.ask({ kind: "make_plan", motion: motion() });
    const last = made.trajectory.times.at(-1) ?? 0;
    own = {
      // At its end: where it begins, it is hidden by the arm.
      title,
      trajectory: made.trajectory,
      plan: made.plan,
      time: last,
      execute: () => app.start({ kind: "execute", plan: made.plan }),
    };
    app.showPreview(own);
    setText(result, [text("run.planned", { time: duration(last) }), ...made.notes.map(readable)].join(" "));
  }
  return h("div", { class: "column" }, h("div", { class: "row" }, plan, execute, go, copyButton(code)), result);
}

/** @param {number | undefined} share */
function scalingOf(share) {
  return share === undefined || Number.isNaN(share) || share === 1 ? "" : `, velocity_scaling=${pythonNumber(share, 3)}`;
}
