// Panel: trajectories from files, and recordings.

/** @import { App, PanelView } from "../app.js" */

import { h } from "../dom.js";
import { RecordingsCard } from "../files/recordings_card.js";
import { TrajectoryCard } from "../files/trajectory_card.js";

/** @type {import("../app.js").Panel} */
export const filesPanel = { id: "files", mount };

/**
 * @param {HTMLElement} host
 * @param {App} app
 * @returns {PanelView}
 */
function mount(host, app) {
  const recordings = new RecordingsCard(app);
  host.append(h("div", { class: "column" }, new TrajectoryCard(app).element, recordings.element));
  return { show: () => {
    recordings.refresh();
  } };
}
