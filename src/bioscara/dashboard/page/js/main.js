// Begin of the page: sign in, connect, build its parts.

import { Arm } from "./arm.js";
import { App } from "./app.js";
import { Connection } from "./connection.js";
import { buildJog } from "./control/jog_pad.js";
import { keepLease } from "./control/lease_keeping.js";
import { watchLeaving } from "./control/leaving.js";
import { buildStop } from "./control/stop_button.js";
import { at, h, printable } from "./dom.js";
import { watchGateway } from "./gateway.js";
import { buildHeader, buildMessages } from "./header.js";
import { buildFaultStrip } from "./health/fault_strip.js";
import { buildUnconfirmedStrip } from "./health/unconfirmed_strip.js";
import { Recovery } from "./health/recovery.js";
import { benchPanel } from "./panels/bench.js";
import { filesPanel } from "./panels/files.js";
import { healthPanel } from "./panels/health.js";
import { plotsPanel } from "./panels/plots.js";
import { runPanel } from "./panels/run.js";
import { settingsPanel } from "./panels/settings.js";
import { signIn } from "./session.js";
import { teachPanel } from "./panels/teach.js";
import { showState } from "./states.js";
import { buildTabs } from "./tabs.js";
import { text } from "./texts.js";
import { buildView } from "./view/view.js";

/** Return a random name. */
function randomName() {
  return crypto.getRandomValues(new Uint8Array(16)).reduce((name, byte) => name + byte.toString(16).padStart(2, "0"), "");
}

async function begin() {
  const connection = new Connection("dashboard", randomName());
  const arm = new Arm(connection, "view");
  const app = new App(connection, arm);
  // First: it works also where the rest fails.
  buildStop(app);
  arm.scope = await signIn();
  buildHeader(app);
  buildMessages(app);
  buildView(app);
  buildJog(app);
  const recovery = new Recovery(app);
  buildFaultStrip(app, recovery);
  buildUnconfirmedStrip(app);
  buildTabs(app, [
    runPanel,
    teachPanel,
    filesPanel,
    plotsPanel,
    healthPanel(recovery),
    settingsPanel,
    benchPanel,
  ]);
  showState(arm);
  keepLease(arm);
  watchLeaving(app);
  watchGateway(arm);
  connection.connect();
  // For tests and for the curious.
  Object.assign(window, { bioscara: app });
}

begin().catch((error) => {
  document.documentElement.dataset.state = "signed-out";
  at("identity").append(h("h1", { text: text("app.title") }));
  at("messages").textContent = printable(error.message);
});
