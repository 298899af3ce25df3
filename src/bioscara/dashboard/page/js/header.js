// The header: which arm, its state, who commands, the connection, STOP; and messages below it.

/** @import { App } from "./app.js" */

import { at, button, h, printable, setText } from "./dom.js";
import { duration } from "./format.js";
import { text } from "./texts.js";

/** Time for which a message stays [ms]. */
const MESSAGE = 8000;

/**
 * Build the header.
 *
 * @param {App} app The page.
 */
export function buildHeader(app) {
  const { arm, connection } = app;
  const name = h("h1");
  const kind = h("span", { class: "badge" });
  at("identity").append(h("div", { class: "row" }, name, kind));
  const link = at("link");
  link.setAttribute("role", "status");

  function update() {
    const welcome = connection.welcome;
    setText(name, welcome?.owner ?? text("app.title"));
    document.title = `${printable(welcome?.owner ?? "")} – ${text("app.title")}`;
    const state = arm.link;
    const age = duration(arm.age / 1000);
    setText(link, text(`link.${state}`, { age }) + (arm.reason ? `: ${arm.reason}` : ""));
  }
  for (const topic of /** @type {const} */ (["link", "description", "reset"])) arm.on(topic, update);
  update();
  at("footer").append(text("app.footer"));
}

/**
 * Show messages to the person below the header.
 *
 * @param {App} app The page.
 */
export function buildMessages(app) {
  const host = at("messages");
  app.messageListeners.push((message, kind) => {
    const line = h("p", { class: `message ${kind}`, text: message });
    const close = button("×", () => line.remove(), { "aria-label": "close" });
    line.append(" ", close);
    host.prepend(line);
    while (host.children.length > 3) host.lastChild?.remove();
    if (kind === "info") setTimeout(() => line.remove(), MESSAGE);
  });
}
