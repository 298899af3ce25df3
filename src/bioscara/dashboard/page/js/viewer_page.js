// Begin of the page of "bioscara view": a motion to play, an arm that moves now, or a slider for each joint.

/** @import { Connection } from "./connection.js" */
/** @import { Viewed } from "./view/viewed_source.js" */

import { App } from "./app.js";
import { Arm } from "./arm.js";
import { at, h, printable, setText } from "./dom.js";
import { MotionPlots, rowsOf } from "./files/motion_plots.js";
import { get } from "./http.js";
import { signIn } from "./session.js";
import { text } from "./texts.js";
import { JointRanges } from "./view/joint_ranges.js";
import { GRIPPER } from "./view/kinematics.js";
import { fetchModel } from "./view/model_source.js";
import { TrajectoryCurve } from "./view/trajectory_curve.js";
import { buildView } from "./view/view.js";
import { ViewedSource } from "./view/viewed_source.js";

/** Time between two reports of a motion at rest, and between two requests for an arm that moves, or at none [ms]. */
const REPORT = 100;
const LOOK = 40;
const RETRY = 1000;

async function begin() {
  await signIn();
  /** @type {[Viewed, import("./view/kinematics.js").Model]} */
  const [viewed, model] = await Promise.all([get("api/viewed"), fetchModel()]);
  const { title, motion, live, parameters } = viewed;
  document.title = `${title} · ${document.title}`;
  setText(at("title"), title);
  at("footer").append(text("viewer.footer"));
  const source = new ViewedSource(viewed, model);
  const connection = /** @type {Connection} */ (/** @type {unknown} */ (source));
  const app = new App(connection, new Arm(connection, "view"));
  app.clearancePath = ({ positions }) => `api/clearance?${positions.map((each) => `joints=${each}`).join("&")}`;
  buildView(app, { target: false, trace: live });
  const sliders = !motion && !live;
  const ranges = parameters.joints.map(({ name, unit, lower, upper }) => ({ name, unit, lower, upper }));
  const jaws = model.joints.find(({ name }) => name === GRIPPER);
  if (sliders && jaws) {
    ranges.push({ name: GRIPPER, unit: "m", lower: jaws.lower, upper: jaws.upper });
    source.positions[GRIPPER] = (jaws.lower + jaws.upper) / 2;
  }
  const joints = new JointRanges(ranges, sliders ? (name, value) => source.show({ [name]: value }, performance.now() / 1000) : null);
  at("joints").append(h("h2", { id: "joints-title", text: text("viewer.joints") }), ...joints.elements);
  app.arm.on("sample", () => joints.show(source.positions));
  source.begin();
  if (motion) play(app, source, viewed);
  if (live) look(source);
  else setInterval(() => source.report(), REPORT);
  document.documentElement.dataset.state = "live";
  // For tests and for the curious.
  Object.assign(window, { bioscara: app });
}

/**
 * @param {App} app
 * @param {ViewedSource} source
 * @param {Viewed} viewed
 */
function play(app, source, { motion, notes, phases }) {
  if (!motion) return;
  const curve = new TrajectoryCurve(motion);
  app.previewListeners.push(() => source.show(curve.at(app.preview?.time ?? curve.begin), app.preview?.time ?? 0));
  app.showPreview({ title: "", trajectory: motion, plan: null, execute: null, time: curve.begin, notes, phases, source: "viewer" });
  const plots = new MotionPlots(app);
  at("plots").append(plots.element);
  app.arm.on("description", () => plots.show(rowsOf(motion)));
}

/** @param {ViewedSource} source */
async function look(source) {
  let wait = LOOK;
  try {
    const { time, positions, problem } = document.hidden ? { time: 0, positions: [], problem: "" } : await get("api/viewed/now");
    setText(at("messages"), problem && text("viewer.waits", { problem }));
    if (positions.length) source.show(Object.fromEntries(source.names.map((name, index) => [name, positions[index]])), time);
    if (problem) wait = RETRY;
  } catch (error) {
    setText(at("messages"), error instanceof Error ? error.message : String(error));
    wait = RETRY;
  }
  setTimeout(() => look(source), wait);
}

begin().catch((error) => {
  document.documentElement.dataset.state = "signed-out";
  setText(at("title"), text("app.title"));
  at("messages").textContent = printable(error.message);
});
