// All texts of the page that people read, in English; another language replaces this file.
// A name in braces is replaced by a value.

/** @type {Record<string, string>} */
const TEXTS = {
  "app.title": "Bioscara",
  "app.footer": "This page needs network and software to work. Its STOP is not the emergency stop.",

  "link.connecting": "connecting",
  "link.live": "live",
  "link.stale": "values are {age} old",
  "link.gone": "arm state unknown, last values {age} ago",
  "link.mismatch": "another version",
  "link.signed-out": "signed out",

  "error.no_lease": "take control first",
  "error.no_token": "Not signed in. Open the address that “bioscara web” or “bioscara serve --with web” printed.",

  "stop.button": "STOP",
  "stop.description": "Stops all motion. It is not an emergency stop.",

  "tab.watch": "View",
  "tab.jog": "Jog",
  "tab.run": "Run",
  "tab.teach": "Teach",
  "tab.files": "Files",
  "tab.plots": "Plots",
  "tab.health": "Health",
  "tab.settings": "Settings",
  "tab.bench": "Simulation",

  // Header: state, lease, STOP.

  // View: 3D, preview, targets.
  "view.toolbar": "View",
  "view.look": "Look from: {preset}",
  "view.look_iso": "Oblique",
  "view.look_front": "Front",
  "view.look_side": "Side",
  "view.look_top": "Top",
  "view.look_follow": "Follow",
  "view.camera": "Camera",
  "view.step_left": "Turn left",
  "view.step_right": "Turn right",
  "view.step_up": "Turn up",
  "view.step_down": "Turn down",
  "view.step_in": "Larger",
  "view.step_out": "Smaller",
  "view.step_pan-left": "Shift left",
  "view.step_pan-right": "Shift right",
  "view.step_pan-up": "Shift up",
  "view.step_pan-down": "Shift down",
  "view.layers": "Show",
  "view.layer_frames": "Frames",
  "view.layer_zones": "Zones",
  "view.layer_margins": "Margins",
  "view.layer_trace": "Trace of the tool, 30 s",
  "view.layer_labels": "Names",
  "view.picture": "Picture of the arm. Arrow keys turn it, with Shift they shift it, plus and minus change its size.",
  "view.picture_flat": "Picture of the arm from above and from the side.",
  "view.loading": "The model of the arm is loading.",
  "view.no_model": "The model of the arm cannot be loaded: {why}",
  "view.no_webgl": "This browser has no WebGL: the arm is shown from above and from the side.",
  "view.slow": "This computer draws slowly: fewer pictures, with less detail.",
  "view.flat_top": "From above",
  "view.flat_side": "From the side",
  "view.waiting": "No values of the arm yet.",
  "view.old": "NOT LIVE: as {age} ago",
  "view.unknown_joints": "POSITION UNKNOWN: {joints} not homed or not read",
  "view.pose_unknown": "Position of the tool unknown",
  "view.pose": "x {x}  y {y}  z {z}  yaw {yaw}",
  "view.pose_said": "Tool at x {x}, y {y}, z {z}, yaw {yaw}.",
  "view.joints_said": "Joints: {joints}.",
  "view.width_said": "Jaws at {width}.",
  "view.not_live_said": "These values are not live.",
  "view.clearance_unknown": "Clearance unknown",
  "view.clearance_none": "Clearance: nothing is near",
  "view.clearance_clear": "Clear: {distance}, {link} to {other}",
  "view.clearance_near": "Near: {distance}, {link} to {other}",
  "view.clearance_below": "Below the margin: {distance}, {link} to {other}",
  "view.target": "Target",
  "view.target_title": "Target of the tool",
  "view.target_x": "x",
  "view.target_y": "y",
  "view.target_z": "z",
  "view.target_yaw": "yaw",
  "view.less": "less {name}",
  "view.more": "more {name}",
  "view.step": "Step of plus and minus",
  "view.step_of": "step {step}",
  "view.to_tool": "At the tool",
  "view.kind": "Kind of motion",
  "view.kind_ptp": "Joints (PTP)",
  "view.kind_lin": "Line (LIN)",
  "view.speed": "Speed",
  "view.make_plan": "Plan",
  "view.planning": "Planning",
  "view.collision": "Collision: {link} and {other}.",
  "view.plan": "Plan",
  "view.plan_ptp": "Plan, joints",
  "view.plan_lin": "Plan, line",
  "view.plan_time": "Time in the plan",
  "view.plan_clock": "{time} of {duration} s",
  "view.play": "Play",
  "view.pause": "Pause",
  "view.execute": "Execute",
  "view.executing": "Executing",
  "view.executing_status": "The arm follows the plan.",
  "view.discard": "Discard",
  "view.executed": "The plan was executed.",
  "view.not_executed": "Not executed to its end: {why} Make another plan.",
  "view.refused": "Execution was refused. Make another plan.",
  "view.execute_no_lease": "Take control to execute it.",
  "view.execute_stale": "The position of the arm is not known now.",
  "view.dead_owner": "Void: the server has started again since. Make another plan.",
  "view.dead_workspace": "Void: tool, scene, load or speed limit have changed since. Make another plan.",
  "view.dead_limits": "Void: limits of the arm have changed since. Make another plan.",
  "view.dead_moved": "Void: {joint} is not where the plan begins. Make another plan.",

  // Jog and run.

  // Teach.

  // Files and recordings.

  // Plots.

  // Health.

  // Settings.

  // Simulation bench.

  // Start page.
};

/**
 * Return a text.
 *
 * @param {string} key Its key.
 * @param {Record<string, string | number>} [values] Values for the names in braces.
 * @returns {string} The text.
 */
export function text(key, values = {}) {
  const found = TEXTS[key];
  if (found === undefined) throw new Error(`there is no text ${key}`);
  return found.replace(/\{(\w+)\}/g, (_, name) => String(values[name]));
}
