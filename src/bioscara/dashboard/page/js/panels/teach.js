// Panel: poses, tools and frames that have names, and sequences of steps.

/** @import { App, PanelView } from "../app.js" */

import { h } from "../dom.js";
import { frameCard } from "../teach/frame_card.js";
import { poseCard } from "../teach/pose_card.js";
import { SequenceModel } from "../teach/sequence.js";
import { sequenceCard } from "../teach/sequence_card.js";
import { Table } from "../teach/table.js";

/** @type {import("../app.js").Panel} */
export const teachPanel = { id: "teach", mount };

/**
 * @param {HTMLElement} host
 * @param {App} app
 * @returns {PanelView}
 */
function mount(host, app) {
  const table = new Table(app);
  const model = new SequenceModel();
  const poses = poseCard(app, table, (former, name) => model.renamePose(former, name), (name) => model.add({ kind: "move_named", name }));
  host.append(h("div", { class: "teach" }, h("div", { class: "column" }, poses, frameCard(app, table)), sequenceCard(app, model, table)));
  return {};
}
