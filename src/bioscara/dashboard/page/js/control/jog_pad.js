// The jog pad: joints and tool, by hold or in steps, with pointer, touch, keyboard and gamepad.

/** @import { App } from "../app.js" */
/** @import { Axis, Mode } from "./jog_motion.js" */

import { at, button, h, setText } from "../dom.js";
import { degrees, millimetres, MM, number } from "../format.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";
import { refusal } from "./allowed.js";
import { AxisChoice } from "./axis_choice.js";
import { GamepadReader } from "./gamepad.js";
import { BEAT, EXPIRY, Hold } from "./hold.js";
import { keepScreenOn, watchHold } from "./hold_triggers.js";
import { watchKeys, watchPointers } from "./jog_input.js";
import { AXES, FASTEST, jogCode, stepShare, stepTask, toolSpeed, USUAL, velocityOf } from "./jog_motion.js";

/** Sizes of a step [mm or degrees]; 0 is hold to run. */
const SIZES = [0, 0.1, 1, 10];

/** The pad's settings: mode, frame, size of a step, speed. */
class Settings {
  constructor() {
    /** @type {Mode} */
    this.mode = "joints";
    /** Name of the frame of the tool's velocity; also `base` and `tool`. */
    this.frame = "base";
    /** Size of a step [mm or degrees]; 0 for hold to run. */
    this.size = 0;
    /** Speed of the tool [m/s]. */
    this.speed = USUAL;
    /** Axis and direction of the latest press, which is copied as Python. */
    this.axis = 0;
    this.sign = 1;
    /** Share of the speed limits of the latest step. */
    this.share = 1;
  }
}

/**
 * Build the pad.
 *
 * @param {App} app The page.
 */
export function buildJog(app) {
  const { arm } = app;
  const settings = new Settings();
  const status = h("p", { class: "jog-status", role: "status" });
  const rows = h("div", { class: "jog-rows" });
  const pad = h("div", { class: "jog-pad", role: "group", tabindex: "0", "aria-label": text("jog.pad"), "aria-describedby": "jog-keys" },
    rows);
  const hold = new Hold(portOf(app, () => changed()));
  const reader = new GamepadReader();
  const moving = h("span", { class: "jog-speed number" });
  let stepping = false;
  /** Why a hold or a step was not begun, as long as that is so. */
  let refused = "";
  /** Why the arm does not fully follow the latest hold; empty if it does. */
  let limitation = "";
  const actions = {
    /** @param {string} source @param {number} axis @param {number} sign */
    press(source, axis, sign) {
      Object.assign(settings, { axis, sign });
      if (!hold.active) values.choose(axis);
      if (settings.size > 0) {
        step(axis, sign);
        return;
      }
      hold.press(source, () => {
        const share = [0, 0, 0, 0];
        share[axis] = sign;
        return velocityOf(settings.mode, share, settings.speed, arm, frameAngle(app, settings.frame));
      });
      if (hold.active) keepScreenOn(hold);
    },
  };
  watchHold(app, hold);
  watchPointers(pad, hold, actions, () => settings.size > 0);
  watchKeys(pad, hold, actions, () => AXES[settings.mode], (why) => say(why));
  watchGamepad(app, hold, reader, settings);
  setInterval(() => hold.tick(), BEAT);
  const axisChoice = new AxisChoice((axis) => {
    hold.end(text("jog.end.mode"));
    values.choose(axis);
  });
  const values = buildRows();
  at("jog").append(
    h("div", { class: "card column jog-card" }, modeRow(app, settings, rebuild), axisChoice.element, pad, status,
      sizeRow(app, settings, rebuild), speedRow(app, settings, moving),
      h("p", { id: "jog-keys", class: "dim small", text: text("jog.keys") }), h("p", { class: "dim small", text: text("jog.caution") })),
  );
  /** @type {import("../../messages.d.ts").StateSample | null} */
  let former = null;

  /** Make the buttons of the mode; returns what shows the values, and what shows one row on a narrow page. */
  function buildRows() {
    const axes = AXES[settings.mode];
    const made = axes.map((axis, index) => rowOf(axis, index, settings));
    rows.replaceChildren(...made.map(({ row }) => row));
    axisChoice.fill(axes);
    /** @param {number} chosen */
    const choose = (chosen) => {
      const former = made.find(({ row }) => row.contains(document.activeElement));
      made.forEach(({ row }, index) => row.classList.toggle("chosen", index === chosen));
      axisChoice.select(chosen);
      // A key of another axis: the focus would leave the pad with the row that is hidden.
      if (former && !visible(former.row)) pad.focus({ preventScroll: true });
    };
    choose(axisChoice.chosen);
    return { shown: made.map(({ value }) => value), choose };
  }

  /** As another mode, frame or size was chosen. */
  function rebuild() {
    hold.end(text("jog.end.mode"));
    Object.assign(values, buildRows());
    refresh();
  }

  function refresh() {
    const { sample } = arm;
    if (!visible(pad)) return;
    values.shown.forEach((value, index) => {
      const words = jointValue(app, settings.mode, index);
      setText(value, words);
      axisChoice.show(index, words);
    });
    for (const element of [pad, axisChoice.element]) element.classList.toggle("old", !arm.fresh);
    if (hold.state === "running") {
      limitation = sample?.limitation?.text ?? "";
      showHold();
    }
    if (refused && refusal(app) !== refused) {
      refused = hold.why = "";
      showHold();
    }
    const speed = hold.active ? toolSpeed(former, sample) : NaN;
    setText(moving, Number.isNaN(speed) ? "" : text("jog.moving", { speed: number(speed / MM, 0) }));
    former = sample;
  }

  function changed() {
    refused = !hold.active && hold.why === refusal(app) ? hold.why : "";
    const { dataset } = document.documentElement;
    if (hold.active) dataset.pressed = "true";
    else delete dataset.pressed;
    if (hold.state === "waiting" || hold.state === "starting") limitation = "";
    showHold();
    refresh();
  }

  function showHold() {
    const words = [limitation];
    if (!hold.active && hold.why) words.unshift(text("jog.ended", { why: hold.why }));
    const shown = words.filter(Boolean).join(" ");
    setText(status, shown || (hold.active ? text("jog.held") : ""));
    status.classList.toggle("warn", shown !== "");
  }

  /** @param {string} why */
  function say(why) {
    setText(status, text("jog.ended", { why }));
    status.classList.add("warn");
  }

  /** @param {number} axis @param {number} sign */
  async function step(axis, sign) {
    const why = stepping ? text("jog.one_step") : refusal(app);
    if (why) {
      say(why);
      refused = stepping ? "" : why;
      return;
    }
    refused = "";
    stepping = true;
    setText(status, text("jog.stepping"));
    status.classList.remove("warn");
    try {
      const failure = await stepOnce(app, settings, axis, sign);
      if (failure) say(failure);
      else setText(status, text("jog.stepped"));
    } catch (error) {
      say(error instanceof Error ? error.message : String(error));
    }
    stepping = false;
  }
  arm.on("sample", refresh);
  arm.on("description", refresh);
  arm.on("link", refresh);
}

/**
 * Move by one step, at the speed that is chosen.
 *
 * @param {App} app The page.
 * @param {Settings} settings Mode, size and speed.
 * @param {number} axis Of the mode.
 * @param {number} sign Direction.
 * @returns {Promise<string>} Why it failed; empty if it did not.
 */
async function stepOnce(app, settings, axis, sign) {
  const { mode, speed } = settings;
  const size = sign * settings.size;
  /** @param {number} share */
  const task = (share) => stepTask(mode, axis, size, share, app.arm, frameAngle(app, settings.frame));
  const fastest = task(1);
  if (!fastest) return text("refusal.not_homed");
  const { interruptions } = app;
  const plan = await app.ask({ kind: "make_plan", motion: fastest });
  settings.share = stepShare(mode, axis, size, speed, app.arm, plan.trajectory.times.at(-1) ?? 0);
  // The person may have pressed STOP, or lost the lease, while it was planned.
  const why = interruptions === app.interruptions ? refusal(app) : text("jog.end.interrupted");
  const motion = why ? null : task(settings.share);
  if (!motion) return why;
  const goal = await app.start(motion);
  const ended = await app.ended(goal.goal);
  return ended.failure?.text ?? "";
}

/**
 * @param {App} app
 * @param {() => void} changed
 * @returns {import("./hold.js").HoldPort}
 */
function portOf(app, changed) {
  const { arm, connection } = app;
  return {
    now: () => performance.now(),
    refusal: () => refusal(app, { jog: true }),
    doubt: () => {
      if (!arm.commands) return text("jog.end.lease");
      return arm.fresh ? "" : text("jog.end.stale");
    },
    backlog: () => (connection.backlog > 0 ? text("jog.end.backlog") : ""),
    start: async (velocity) => {
      const goal = await app.start({ kind: "jog", expiry: EXPIRY, ...velocity });
      return goal.goal;
    },
    beat: (goal, velocity) => app.request({ kind: "set_jog_velocity", goal, ...velocity }),
    // Without the lease the owner has ended it already.
    end: (goal) => {
      app.request({ kind: "end_jog", goal }).catch(() => {});
    },
    over: (goal) => app.ended(goal),
    changed,
  };
}

/**
 * @param {Axis} axis
 * @param {number} index
 * @param {Settings} settings
 */
function rowOf(axis, index, settings) {
  const name = text(`jog.axis.${axis.id}`);
  const value = h("span", { class: "number jog-value" });
  /** @param {number} sign @param {string} key */
  const make = (sign, key) =>
    h("button", {
      type: "button",
      class: "jog-button",
      "data-axis": index,
      "data-sign": sign,
      "aria-keyshortcuts": key,
    }, h("span", { class: "hidden-text", text: text(sign > 0 ? "jog.plus" : "jog.minus", { name }) }),
      h("span", { class: "jog-sign", "aria-hidden": "true", text: sign > 0 ? "+" : "−" }),
      h("kbd", { "aria-hidden": "true", text: keyName(key) }));
  const row = h("div", { class: "jog-row", "data-mode": settings.mode }, h("span", { class: "jog-name", text: name }), make(-1, axis.minus),
    value, make(1, axis.plus));
  return { row, value };
}

/** @param {string} key */
function keyName(key) {
  const marks =
    /** @type {Record<string, string>} */ ({ ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", PageUp: "PgUp",
      PageDown: "PgDn" });
  return marks[key] ?? key.toUpperCase();
}

/**
 * @param {App} app
 * @param {Mode} mode
 * @param {number} index
 */
function jointValue({ arm }, mode, index) {
  const { sample } = arm;
  const value = mode === "joints" ? sample?.positions[index] : sample?.pose?.[index];
  return AXES[mode][index].angular ? degrees(value ?? null, 2) : millimetres(value ?? null, 2);
}

/**
 * Build the choice of mode and frame.
 *
 * @param {App} app
 * @param {Settings} settings
 * @param {() => void} changed
 */
function modeRow(app, settings, changed) {
  const frame = h("select", { "aria-label": text("jog.frame"), hidden: true, on: { change: () => {
    settings.frame = frame.value;
    changed();
  } } });
  const offer = () => {
    const frames = app.arm.workspace?.table.frames ?? [];
    const names = ["base", "tool", ...frames.map(({ name }) => name)];
    const offered = Array.from(frame.options, ({ value }) => value);
    if (names.join("\n") === offered.join("\n")) return;
    frame.replaceChildren(...names.map((name, at) => h("option", { value: name, text: at < 2 ? text(`jog.frame.${name}`) : name })));
    frame.value = names.includes(settings.frame) ? settings.frame : "base";
    settings.frame = frame.value;
  };
  app.arm.follow(["workspace"], offer);
  const modes = choice(text("jog.mode"), [["joints", text("jog.joints")], ["tool", text("jog.tool")]], "joints", (chosen) => {
    settings.mode = chosen === "tool" ? "tool" : "joints";
    frame.hidden = settings.mode === "joints";
    changed();
  });
  return h("div", { class: "row jog-head" }, h("h2", { text: text("tab.jog") }), modes, frame);
}

/**
 * Build the choice between hold and the sizes of a step.
 *
 * @param {App} app
 * @param {Settings} settings
 * @param {() => void} changed
 */
function sizeRow(app, settings, changed) {
  const sizes = choice(text("jog.size"), SIZES.map((size) => [String(size), size ? String(size) : text("jog.hold")]), "0", (chosen) => {
    settings.size = Number(chosen);
    changed();
  });
  const python = copyButton(() =>
    jogCode(settings.mode, settings.axis, settings.sign * (settings.size || 1), settings.size === 0, settings.speed, settings.share,
      app.arm, frameAngle(app, settings.frame))
  );
  return h("div", { class: "row" }, sizes, h("span", { class: "dim small", text: text("jog.units") }), python);
}

/**
 * Build a choice of one of several words.
 *
 * @param {string} label Its name.
 * @param {string[][]} options Value and word of each.
 * @param {string} chosen The value at first.
 * @param {(value: string) => void} choose Called with the value that is chosen.
 */
function choice(label, options, chosen, choose) {
  const made = options.map(([value, word]) =>
    button(word, () => {
      for (const each of made) each.setAttribute("aria-pressed", String(each.dataset.value === value));
      choose(value);
    }, { "data-value": value, "aria-pressed": String(value === chosen) })
  );
  return h("div", { class: "choice", role: "group", "aria-label": label }, ...made);
}

/**
 * @param {App} app
 * @param {Settings} settings
 * @param {HTMLElement} moving
 */
function speedRow(app, settings, moving) {
  const shown = h("output", { class: "number", for: "jog-speed" });
  const slider = h("input", {
    type: "range",
    id: "jog-speed",
    min: 1,
    max: FASTEST / MM,
    value: USUAL / MM,
    step: 1,
    on: { input: () => {
      app.interrupt(text("jog.end.mode"));
      update();
    } },
  });
  const update = () => {
    settings.speed = Number(slider.value) * MM;
    const words = text("jog.speed_value", { speed: slider.value });
    slider.setAttribute("aria-valuetext", words);
    setText(shown, words);
  };
  update();
  return h("div", { class: "row jog-speed-row" }, h("label", { for: "jog-speed", text: text("jog.speed") }), slider, shown, moving);
}

/**
 * Return the direction of a frame in the base.
 *
 * @param {App} app The page.
 * @param {string} name `base`, `tool`, or the name of a frame.
 * @returns {number} Direction of its x axis [rad].
 */
function frameAngle({ arm }, name) {
  if (name === "base") return 0;
  if (name === "tool") return arm.sample?.pose?.[3] ?? 0;
  return arm.workspace?.table.frames?.find((frame) => frame.name === name)?.pose_frame_in_base[3] ?? 0;
}

/**
 * Look at the gamepads while there are any.
 *
 * @param {App} app
 * @param {Hold} hold
 * @param {GamepadReader} reader
 * @param {Settings} settings
 */
function watchGamepad(app, hold, reader, settings) {
  const words = h("p", { class: "small", role: "status", hidden: true });
  at("jog").append(words);
  /** @type {ReturnType<typeof setInterval> | undefined} */
  let timer;
  const look = () => {
    const pads = navigator.getGamepads();
    reader.look(document.hidden ? [] : pads, performance.now());
    const { state } = reader;
    words.hidden = state === "none";
    setText(words, text(`jog.gamepad.${state || "held"}`));
    if (reader.held) {
      hold.press("gamepad", () => velocityOf(settings.mode, reader.share, settings.speed, app.arm, frameAngle(app, settings.frame)));
    } else if (hold.down.has("gamepad")) {
      if (hold.active && state !== "released") hold.end(text(`jog.gamepad.${state || "released"}`));
      hold.release("gamepad");
    }
    if (!pads.some(Boolean)) {
      clearInterval(timer);
      timer = undefined;
    }
  };
  const begin = () => {
    reader.reset();
    timer ??= setInterval(look, BEAT);
  };
  window.addEventListener("gamepadconnected", begin);
  window.addEventListener("gamepaddisconnected", () => {
    reader.reset();
    look();
  });
}

/** @param {HTMLElement} element */
function visible(element) {
  return element.offsetParent !== null;
}
