// Tools and work frames: which tool is mounted, frames taught at the tool.

/** @import { App } from "../app.js" */
/** @import { Table } from "./table.js" */

import { ActionError } from "../app.js";
import { button, h, setText } from "../dom.js";
import { degrees } from "../format.js";
import { copyButton, pythonText } from "../python.js";
import { action, card } from "../run/action.js";
import { text } from "../texts.js";
import { placeOf, pointFrame } from "./point_frame.js";
import { undoLine } from "./undo_line.js";

/**
 * Build tools and frames.
 *
 * @param {App} app The page.
 * @param {Table} table The table.
 * @returns {HTMLElement} The part.
 */
export function frameCard(app, table) {
  const { arm } = app;
  const tools = h("select", { id: "tool" });
  const mounted = h("span", { class: "dim", role: "status" });
  const mount = action(app, text("teach.mount"),
    () => app.start({ kind: "set_tool", name: tools.value, revision: arm.workspace?.revision ?? null }), { enabled: false, homed: false });
  const name = h("input", { type: "text", id: "frame-name", maxlength: "64", autocomplete: "off", spellcheck: "false" });
  const frames = h("ul", { class: "frames" });
  const none = h("p", { class: "dim", text: text("teach.no_frames") });
  const undo = undoLine(app);
  const save = action(app, text("teach.frame_here"), async () => {
    const pose = arm.sample?.pose;
    if (!pose) throw new ActionError(text("refusal.not_homed"));
    await keep(pose);
  }, { enabled: false, extra: () => (name.value.trim() ? "" : text("teach.no_name")) });

  /** @param {import("../../messages.d.ts").Pose} pose */
  async function keep(pose) {
    const wanted = name.value.trim();
    const former = table.frames.find((frame) => frame.name === wanted);
    await table.saveFrame({ name: wanted, pose_frame_in_base: pose });
    undo.say(text("teach.saved", { name: wanted }), former ? () => table.saveFrame(former) : () => table.deleteFrame(wanted));
  }

  function draw() {
    const { workspace } = arm;
    if (!workspace) return;
    const chosen = tools.value;
    tools.replaceChildren(...table.tools.map((tool) => h("option", { value: tool.name, text: tool.name })));
    tools.value = table.tools.some((tool) => tool.name === chosen) ? chosen : workspace.tool.name;
    setText(mounted, text("teach.mounted", { name: workspace.tool.name }));
    none.hidden = table.frames.length > 0;
    frames.replaceChildren(...table.frames.map((frame) => {
      const place = `${placeOf(frame.pose_frame_in_base)} ${degrees(frame.pose_frame_in_base[3])}`;
      const remove = button(text("teach.delete"), () =>
        app.attempt(async () => {
          await table.deleteFrame(frame.name);
          undo.say(text("teach.deleted", { name: frame.name }), () => table.saveFrame(frame));
        }), { "aria-label": text("teach.delete_one", { name: frame.name }) });
      return h("li", { class: "row" }, h("strong", { text: frame.name }), h("span", { class: "number", text: place }), remove,
        copyButton(() => `robot.frame(${pythonText(frame.name)})`));
    }));
  }
  arm.follow(["workspace", "reset"], draw);
  return card(text("teach.tools_frames"),
    h("div", { class: "row" }, h("label", { for: "tool", text: text("teach.tool") }), tools, mount,
      copyButton(() => `robot.tool = ${pythonText(tools.value)}`), mounted),
    h("p", { class: "dim small", text: text("teach.mount_means") }), h("h3", { text: text("teach.frames") }), none, frames,
    h("div", { class: "row" }, h("label", { class: "grow" }, h("span", { text: text("teach.name") }), name), save,
      copyButton(() => `robot.table = robot.table.with_frame(Frame(${pythonText(name.value.trim() || "name")}, robot.pose))`)),
    pointFrame(app, () => name.value.trim(), keep), undo.element);
}
