// All texts of the page that people read, in English; another language replaces this file.
// A name in braces is replaced by a value.

/** @type {Record<string, string>} */
const TEXTS = {
  "app.title": "Bioscara",
  "app.footer": "This page needs network and software to work. Its STOP is not the emergency stop.",

  "link.connecting": "connecting",
  "link.live": "live",
  "link.trip": "round trip {trip} ms",
  "link.stale": "values are {age} old",
  "link.gone": "arm state unknown, last values at {last}, {age} ago",
  "link.mismatch": "another version",
  "link.signed-out": "signed out",

  "error.no_lease": "take control first",
  "error.no_token": "Not signed in. Open the address that “bioscara web” or “bioscara serve --with web” printed.",

  "stop.button": "STOP",
  "stop.description": "Stops all motion. It is not an emergency stop. Key: Escape.",
  "stop.interrupt": "STOP was pressed",
  "stop.sent": "Sent.",
  "stop.received": "Received after {took} ms.",
  "stop.decelerating": "Decelerating.",
  "stop.resting": "At rest. Nothing continues by itself.",
  "stop.unconfirmed": "NOT CONFIRMED, use the emergency stop",
  "stop.take": "Take control",
  "stop.close": "Close",

  "python.copy": "Python",
  "python.title": "Copy as Python",
  "python.copied": "Copied",
  "python.refused": "Not allowed",

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
  "header.simulated": "SIMULATED",
  "header.real": "REAL ARM",
  "header.unknown": "unknown arm",
  "header.reload": "Reload",
  "header.close": "Close this message",
  "state.signed-out": "signed out",
  "state.mismatch": "another version",
  "state.connecting": "connecting",
  "state.gone": "arm state unknown",
  "state.stale": "old values",
  "state.fault": "fault",
  "state.recovering": "recovering",
  "state.lease-elsewhere": "another client commands",
  "state.no-lease": "nobody commands",
  "state.commanding": "you command",
  "allowed.signed-out": "Open the address with the token again.",
  "allowed.mismatch": "Page and server have different versions: reload the page. STOP works.",
  "allowed.connecting": "No values yet. STOP works.",
  "allowed.gone": "The server does not answer, and nothing can be commanded. STOP is sent by every way there is.",
  "allowed.stale": "The values are old: motion is off. STOP works.",
  "allowed.fault": "Motion is off until the fault is dealt with. STOP works.",
  "allowed.recovering": "The arm recovers. STOP works.",
  "allowed.lease-elsewhere": "You can look, plan, pause and STOP.",
  "allowed.no-lease": "You can look, plan, pause and STOP. Take control to move the arm.",
  "allowed.commanding": "You can move the arm.",
  "condition.paused": "paused",
  "condition.busy": "moving: {what}",
  "condition.disabled": "disabled",
  "condition.not_homed": "not homed",
  "condition.ready": "ready",
  "lease.take": "Take control",
  "lease.take_over": "Take over",
  "lease.give": "Give back",
  "lease.given": "control was given back",
  "lease.gone": "this page does not command the arm any more",
  "lease.unknown": "Who commands is unknown",
  "lease.mine": "You command the arm",
  "lease.other": "{client} commands the arm",
  "lease.none": "Nobody commands the arm",
  "lease.since": "since {time}",
  "lease.view": "Signed in to look: no commands",
  "lease.lost": "You do not command the arm any more: {why}.",
  "lease.ended": "the owner ended it",
  "lease.broken": "the connection was broken",
  "lease.seen": "Close",
  "lease.over_title": "Take control from {client}?",
  "lease.over_means": "All that {client} has begun is stopped, and the arm comes to rest. Everybody sees who took control and why.",
  "lease.reason": "Reason",
  "lease.over_do": "Take control",
  "lease.cancel": "Cancel",
  "lease.report": "took control from {client}: {reason}",

  // View: 3D, preview, targets.

  // Jog and run.
  "refusal.stale": "the values are old, and motion is off",
  "refusal.view": "this page is signed in to look",
  "refusal.no_lease": "take control first",
  "refusal.lease_elsewhere": "{client} commands the arm",
  "refusal.fault": "a fault has to be dealt with first",
  "refusal.paused": "motion is paused: resume it first",
  "refusal.busy": "the arm is busy with {what}",
  "refusal.disabled": "the joints are disabled: enable them in Run",
  "refusal.not_homed": "a joint is not homed: home it in Run",
  "jog.pad": "Jog: hold a button or a key",
  "jog.keys": "Keys work while the pad has the focus. Release to stop.",
  "jog.caution": "This page has no enabling device. Stand where you see the arm, and outside of its reach.",
  "jog.mode": "What moves",
  "jog.joints": "Joints",
  "jog.tool": "Tool",
  "jog.frame": "Frame",
  "jog.frame.base": "in the base",
  "jog.frame.tool": "in the tool",
  "jog.size": "Hold, or size of a step",
  "jog.hold": "Hold",
  "jog.units": "mm or °",
  "jog.speed": "Speed",
  "jog.speed_value": "{speed} mm/s",
  "jog.moving": "now {speed} mm/s",
  "jog.plus": "{name} plus",
  "jog.minus": "{name} minus",
  "jog.axis.j1": "J1",
  "jog.axis.j2": "J2",
  "jog.axis.j3": "J3",
  "jog.axis.j4": "J4",
  "jog.axis.x": "X",
  "jog.axis.y": "Y",
  "jog.axis.z": "Z",
  "jog.axis.yaw": "Yaw",
  "jog.held": "Moves while you hold.",
  "jog.ended": "No motion: {why}.",
  "jog.stepping": "One step.",
  "jog.stepped": "The step is done.",
  "jog.end.blur": "the page lost the focus",
  "jog.end.hidden": "the page was hidden",
  "jog.end.menu": "a menu was opened",
  "jog.end.closed": "the connection is broken",
  "jog.end.lease": "this page does not command the arm",
  "jog.end.stale": "the values are old",
  "jog.end.backlog": "the network is too slow",
  "jog.end.fault": "a fault has stopped the arm",
  "jog.end.paused": "motion was paused",
  "jog.end.screen": "the screen went off",
  "jog.end.mode": "another mode or speed was chosen",
  "jog.end.second": "two at once: release all, then press one",
  "jog.end.left": "the pointer left the button",
  "jog.end.modifier": "keys with Shift, Ctrl, Alt or Meta do not move the arm",
  "jog.end.focus": "the focus has moved",
  "jog.gamepad.none": "The gamepad is gone",
  "jog.gamepad.centre": "Gamepad: release its sticks and buttons once.",
  "jog.gamepad.frozen": "Gamepad: it sends nothing any more; release its sticks and buttons.",
  "jog.gamepad.released": "Gamepad: hold a shoulder button, then use the sticks.",
  "jog.gamepad.held": "Gamepad: moves while you hold.",

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
