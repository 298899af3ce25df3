// The panel with which the arm is enabled, homed and sent somewhere.

/** @import { Panel } from "../app.js" */

import { h } from "../dom.js";
import { goalsCard } from "../run/goals.js";
import { goToCard, namedCard } from "../run/go_to.js";
import { gripperCard } from "../run/gripper.js";
import { powerCard } from "../run/power.js";
import { speedCard } from "../run/speed.js";

/** @type {Panel} */
export const runPanel = {
  id: "run",
  mount(host, app) {
    const goals = goalsCard(app);
    host.append(
      h("div", { class: "cards" }, goals.element, powerCard(app), goToCard(app), namedCard(app), speedCard(app), gripperCard(app)),
    );
    return { show: goals.show, hide: goals.hide };
  },
};
