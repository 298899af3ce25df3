// The header: name, state and rights, the client that commands, the connection; and messages below it.

/** @import { App } from "./app.js" */

import { buildLease } from "./control/lease.js";
import { pausedBy } from "./control/pause_buttons.js";
import { at, button, h, printable, setText, setValues } from "./dom.js";
import { duration } from "./format.js";
import { clockTime } from "./health/clock.js";
import { pageState } from "./states.js";
import { text } from "./texts.js";

/** Time for which a message stays [ms]. */
const MESSAGE = 8000;
/** Time between two checks of the age of values that are old [ms]. */
const LOOK = 500;

/** Mark and colour of each state of the page; words are in the texts. */
export const STATES = {
  "signed-out": ["⊘", "action"],
  "mismatch": ["≠", "warn"],
  "connecting": ["↻", ""],
  "gone": ["✖", "danger"],
  "stale": ["◷", "warn"],
  "fault": ["▲", "danger"],
  "recovering": ["↻", "action"],
  "lease-elsewhere": ["◐", ""],
  "no-lease": ["○", ""],
  "commanding": ["●", "good"],
};

/**
 * Build the header.
 *
 * @param {App} app The page.
 */
export function buildHeader(app) {
  buildIdentity(app);
  buildLease(app);
  buildLink(app);
  at("footer").append(text("app.footer"));
}

/** @param {App} app */
function buildIdentity(app) {
  const { arm, connection } = app;
  const name = h("h1");
  const kind = h("span", { class: "badge kind" });
  const mark = h("span", { "aria-hidden": "true" });
  const word = h("span");
  const state = h("span", { class: "badge state" }, mark, word);
  const condition = h("span", { class: "badge condition" });
  const allowed = h("p", { class: "dim allowed" });
  const reload = button(text("header.reload"), () => location.reload(), { hidden: true });
  const live = h("div", { class: "row", role: "status" }, state, condition);
  const others = h("a", { href: "arms.html", class: "arms-link", text: text("arms.link") });
  at("identity").append(h("div", { class: "row" }, name, kind, live, reload, others), allowed);

  function update() {
    const owner = connection.welcome?.owner;
    setText(name, owner ?? text("app.title"));
    const { description } = arm;
    const simulated = description?.simulated;
    const which = description ? (simulated ? "simulated" : "real") : "unknown";
    setValues(kind.dataset, { kind: which });
    setText(kind, text(`header.${which}`));
    setValues(kind, { title: description?.arm ?? "" });
    const title = `${printable(owner ?? "")} – ${simulated ? `${text("header.simulated")} – ` : ""}${text("app.title")}`;
    setValues(document, { title });
    const now = pageState(arm);
    const [sign, colour] = STATES[now];
    setText(mark, sign);
    setText(word, text(`state.${now}`));
    setValues(state, { className: `badge state ${colour}` });
    setText(allowed, text(`allowed.${now}`) + (now === "mismatch" ? ` ${arm.mismatch}` : now === "signed-out" ? ` ${arm.reason}` : ""));
    setValues(reload, { hidden: !["mismatch", "signed-out", "gone"].includes(now) });
    const [what, tone] = conditionOf(app);
    setText(condition, what);
    setValues(condition, { hidden: what === "", className: `badge condition ${tone}` });
  }
  arm.follow(["sample", "link", "lease", "description", "reset"], update);
}

/**
 * Return the arm's activity, and its colour.
 *
 * @param {App} app The page.
 * @returns {[string, string]} Both; empty where it is not known.
 */
function conditionOf({ arm }) {
  const { sample } = arm;
  if (!sample || !arm.fresh) return ["", ""];
  if (sample.paused) return [text("condition.paused", { names: pausedBy(sample) }), "action"];
  if (sample.moving.length) return [text("condition.busy", { what: sample.moving.join(", ") }), "good"];
  if (!sample.enabled) return [text("condition.disabled"), ""];
  if (sample.positions.some((position) => position === null)) return [text("condition.not_homed"), "action"];
  return [text("condition.ready"), "good"];
}

/** @param {App} app */
function buildLink(app) {
  const { arm, connection } = app;
  const word = h("span", { role: "status" });
  const trip = h("span", { class: "dim trip" });
  at("link").append(h("div", { class: "column" }, word, trip));

  function update() {
    const state = arm.link;
    const age = arm.sample ? duration(Math.round(arm.age / 100) / 10) : "";
    const last = arm.sample ? clockTime((Date.now() - arm.age) / 1000) : "";
    setText(word, text(`link.${state}`, { age, last }) + (state !== "live" && arm.reason ? `: ${arm.reason}` : ""));
    setText(trip,
      Number.isNaN(connection.roundTrip) || state === "gone" ? "" : text("link.trip", { trip: Math.ceil(connection.roundTrip) }));
  }
  for (const topic of /** @type {const} */ (["link", "description", "reset", "lease"])) arm.on(topic, update);
  // Passing time is no event.
  setInterval(() => {
    if (arm.link === "stale" || arm.link === "gone") update();
  }, LOOK);
  update();
}

/**
 * Show messages to the person below the header.
 *
 * @param {App} app The page.
 */
export function buildMessages(app) {
  const host = at("messages");
  /** @type {Map<HTMLElement, () => boolean>} */
  const shown = new Map();
  app.messageListeners.push((message, kind, holds) => {
    const line = h("p", { class: `message ${kind}`, text: message });
    const close = button("×", () => line.remove(), { "aria-label": text("header.close") });
    line.append(" ", close);
    host.prepend(line);
    shown.set(line, holds);
    while (host.children.length > 3) host.lastChild?.remove();
    if (kind === "info") setTimeout(() => line.remove(), MESSAGE);
  });
  for (const topic of /** @type {const} */ (["sample", "link", "lease"])) {
    app.arm.on(topic, () => {
      for (const [line, holds] of shown) {
        if (!holds()) line.remove();
        if (!line.isConnected) shown.delete(line);
      }
    });
  }
}
