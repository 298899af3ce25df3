// Named poses: search, save the present one, overwrite with the difference shown, rename, delete, go.

/** @import { App } from "../app.js" */
/** @import { NamedPose } from "../../messages.d.ts" */
/** @import { Table } from "./table.js" */

import { ActionError } from "../app.js";
import { openDialog } from "../dialog.js";
import { button, h, setText } from "../dom.js";
import { DEGREE, degrees, millimetres, position } from "../format.js";
import { copyButton, pythonText } from "../python.js";
import { action, card } from "../run/action.js";
import { text } from "../texts.js";
import { PoseList } from "./pose_list.js";
import { undoLine } from "./undo_line.js";

/** Pause in typing after which the search is carried out [ms]. */
const TYPING = 120;
/** Differences that are not shown: of the last digit that people read [m, rad]. */
const SAME = { m: 5e-6, rad: 0.005 * DEGREE };

/**
 * Build the poses.
 *
 * @param {App} app The page.
 * @param {Table} table The table.
 * @param {(former: string, name: string) => void} renamed Called when a pose has another name.
 * @param {(name: string) => void} use Called to use a pose in a step.
 * @returns {HTMLElement} The part.
 */
export function poseCard(app, table, renamed, use) {
  const { arm } = app;
  const search = h("input", { type: "search", id: "pose-search", placeholder: text("teach.search"), autocomplete: "off" });
  const count = h("span", { class: "dim", role: "status" });
  const list = new PoseList(text("teach.poses"), () => update());
  const undo = undoLine(app);
  const buttons = h("div", { class: "row pose-actions" });
  const name = h("input", { type: "text", id: "pose-name", maxlength: "64", autocomplete: "off", spellcheck: "false" });
  const chosen = () => table.pose(list.chosen);
  let timer = 0;

  function filter() {
    const wanted = search.value.trim().toLowerCase();
    const found = wanted
      ? table.poses.filter((pose) => pose.name.toLowerCase().includes(wanted) || pose.tool?.toLowerCase() === wanted)
      : table.poses;
    list.set(found, arm.workspace?.tool.name ?? "");
    setText(count, text("teach.count", { found: found.length, all: table.poses.length }));
    update();
  }

  function update() {
    buttons.hidden = !chosen();
    setText(title, list.chosen);
  }
  search.addEventListener("input", () => {
    clearTimeout(timer);
    timer = window.setTimeout(filter, TYPING);
  });

  const save = action(app, text("teach.save_here"), async () => {
    const wanted = name.value.trim();
    const here = present(app, wanted);
    const former = table.pose(wanted);
    if (former) confirmOverwrite(app, former, here, () => saved(here));
    else await saved(here);
  }, { enabled: false, extra: () => (name.value.trim() ? "" : text("teach.no_name")) });

  /** @param {NamedPose} pose */
  async function saved(pose) {
    await table.savePose(pose);
    search.value = "";
    filter();
    list.select(pose.name, true);
    undo.say(text("teach.saved", { name: pose.name }));
  }
  const rename = button(text("teach.rename"), () => {
    const pose = chosen();
    if (pose) askName(app, table, pose, renamed, undo);
  });
  const remove = button(text("teach.delete"), () =>
    app.attempt(async () => {
      const pose = chosen();
      if (!pose) return;
      await table.deletePose(pose.name);
      undo.say(text("teach.deleted", { name: pose.name }), () => table.savePose(pose));
    }));
  const title = h("strong", { class: "pose-title" });
  buttons.append(title, action(app, text("teach.go"), () => app.start({ kind: "move_named", name: list.chosen })),
    button(text("teach.overwrite"), () => {
      name.value = list.chosen;
      save.click();
    }), rename, remove, button(text("teach.use"), () => use(list.chosen)), copyButton(() => code(chosen())));
  arm.follow(["workspace", "reset"], filter);
  return card(text("teach.poses"),
    h("div", { class: "row" }, h("label", { class: "grow" }, h("span", { text: text("teach.name") }), name), save,
      copyButton(() => saveCode(name.value.trim()))),
    h("div", { class: "row" }, h("label", { class: "hidden-text", for: "pose-search", text: text("teach.search") }), search, count),
    list.element, buttons, undo.element);
}

/**
 * Return where the arm is as a pose of the table.
 *
 * @param {App} app The page.
 * @param {string} name Its name.
 * @returns {NamedPose} The pose.
 */
function present({ arm }, name) {
  const { sample, workspace } = arm;
  if (!sample?.pose || !arm.fresh) throw new ActionError(text("refusal.not_homed"));
  const [j1, j2, j3, j4] = sample.positions.map(rounded);
  const [x, y, z, yaw] = sample.pose.map(rounded);
  return { name, joints: [j1, j2, j3, j4], pose_tool_in_base: [x, y, z, yaw], tool: workspace?.tool.name ?? "fingers" };
}

/** @param {number} value */
function rounded(value) {
  return Number(value.toFixed(7));
}

/**
 * @param {App} app
 * @param {NamedPose} former
 * @param {NamedPose} now
 * @param {() => Promise<void>} overwrite
 */
function confirmOverwrite(app, former, now, overwrite) {
  openDialog(app, text("teach.overwrite_title", { name: former.name }), (close) => [
    differences(app, former, now),
    h("div", { class: "row" }, button(text("teach.overwrite"), () => {
      close();
      app.attempt(overwrite);
    }, { class: "primary" }), button(text("teach.keep"), close)),
  ]);
}

/**
 * Return a table of the values of two poses, in which those that differ are marked.
 *
 * @param {App} app
 * @param {NamedPose} former
 * @param {NamedPose} now
 */
function differences({ arm }, former, now) {
  const rows = [];
  for (const [index, joint] of arm.joints.entries()) {
    const unit = joint.unit === "m" ? "m" : "rad";
    rows.push(row(joint.name, former.joints?.[index], now.joints?.[index], SAME[unit], (value) => position(value, joint.unit)));
  }
  for (const [index, axis] of ["x", "y", "z", "yaw"].entries()) {
    const linear = axis !== "yaw";
    const show = (/** @type {number} */ value) => (linear ? millimetres(value, 2) : degrees(value, 2));
    rows.push(row(axis, former.pose_tool_in_base?.[index], now.pose_tool_in_base?.[index], linear ? SAME.m : SAME.rad, show));
  }
  const tools = [former.tool ?? "", now.tool ?? ""];
  rows.push(line(text("teach.tool"), tools[0], tools[1], tools[0] === tools[1] ? "" : "≠"));
  const head = h("tr", {},
    ...["teach.value", "teach.before", "teach.after", "teach.change"].map((key) => h("th", { scope: "col", text: text(key) })));
  return h("table", { class: "diff" }, h("thead", {}, head), h("tbody", {}, ...rows));
}

/**
 * @param {string} name
 * @param {number | undefined} before
 * @param {number | undefined} after
 * @param {number} same
 * @param {(value: number) => string} show
 */
function row(name, before, after, same, show) {
  const words = (/** @type {number | undefined} */ value) => (value === undefined ? "–" : show(value));
  const by = before === undefined || after === undefined ? NaN : after - before;
  const change = Number.isNaN(by) ? (before === after ? "" : "≠") : Math.abs(by) > same ? `${by > 0 ? "+" : ""}${show(by)}` : "";
  return line(name, words(before), words(after), change);
}

/**
 * @param {string} name
 * @param {string} before
 * @param {string} after
 * @param {string} change
 */
function line(name, before, after, change) {
  return h("tr", { class: change ? "changed" : null }, h("th", { scope: "row", text: name }),
    ...[before, after, change].map((words) => h("td", { class: "number", text: words })));
}

/**
 * @param {App} app
 * @param {Table} table
 * @param {NamedPose} pose
 * @param {(former: string, name: string) => void} renamed
 * @param {ReturnType<typeof undoLine>} undo
 */
function askName(app, table, pose, renamed, undo) {
  const name = h("input", { type: "text", value: pose.name, maxlength: "64", id: "rename-to", spellcheck: "false" });
  const close = openDialog(app, text("teach.rename_title", { name: pose.name }), (shut) => [
    h("form", { class: "column", on: { submit } }, h("label", { for: "rename-to", text: text("teach.name") }), name,
      h("div", { class: "row" }, h("button", { type: "submit", class: "primary", text: text("teach.rename") }),
        button(text("teach.cancel"), shut))),
  ]);
  name.select();

  /** @param {Event} event */
  function submit(event) {
    event.preventDefault();
    const wanted = name.value.trim();
    close();
    if (!wanted || wanted === pose.name) return;
    app.attempt(async () => {
      if (table.pose(wanted)) throw new ActionError(text("teach.name_taken", { name: wanted }));
      await table.savePose({ ...pose, name: wanted }, pose.name);
      renamed(pose.name, wanted);
      undo.say(text("teach.renamed", { former: pose.name, name: wanted }), async () => {
        await table.savePose(pose, wanted);
        renamed(wanted, pose.name);
      });
    });
  }
}

/** @param {NamedPose | undefined} pose */
function code(pose) {
  return pose ? `robot.move_named(${pythonText(pose.name)})` : "robot.table.all_poses()";
}

/** @param {string} name */
function saveCode(name) {
  const pose = `NamedPose(${pythonText(name || "name")}, Joints(*robot.state.positions), robot.pose, robot.tool.name)`;
  return `robot.table = robot.table.with_pose(${pose}, overwrite=True)`;
}
