// The strip below the header while the bench is not confirmed that the last owner knew.

/** @import { App } from "../app.js" */

import { at, h, setText } from "../dom.js";
import { action } from "../run/action.js";
import { text } from "../texts.js";

/**
 * Build the strip.
 *
 * @param {App} app The page.
 */
export function buildUnconfirmedStrip(app) {
  const { arm } = app;
  const host = at("unconfirmed");
  const what = h("span");
  const confirm = action(app, text("health.confirm"),
    async () => app.ended((await app.start({ kind: "confirm_scene", revision: arm.workspace?.revision ?? null })).goal), { homed: false,
    enabled: false, attributes: { class: "primary" } });
  const strip = h("div", { class: "strip" },
    h("div", { class: "strip-text" }, h("strong", { text: `⚠ ${text("health.unconfirmed")}` }), " ", what),
    h("div", { class: "strip-step" }, confirm));

  function update() {
    const found = arm.workspace?.unconfirmed ?? [];
    host.dataset.kind = found.length ? "warning" : "";
    setText(what, text("health.unconfirmed_what", { what: found.join(", ") }));
    if (found.length === 0) strip.remove();
    else if (!strip.isConnected) host.append(strip);
  }
  arm.follow(["workspace", "reset"], update);
}
