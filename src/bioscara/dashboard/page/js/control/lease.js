// The client that commands the arm: the strip in the header, taking and giving back, and a banner where it was lost.

/** @import { App } from "../app.js" */

import { openDialog } from "../dialog.js";
import { at, button, h, setText } from "../dom.js";
import { clockTime } from "../health/clock.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";

/** Longest reason that is sent, with the names around it [characters]. */
const REASON = 200;

/**
 * Build the strip of the lease.
 *
 * @param {App} app The page.
 */
export function buildLease(app) {
  const { arm } = app;
  const who = h("span", { class: "lease-who", role: "status" });
  const since = h("span", { class: "dim lease-since" });
  const take = button(text("lease.take"), () => app.attempt(() => arm.acquire()), { class: "primary", id: "lease-take" });
  const over = button(text("lease.take_over"), () => askReason(app), { id: "lease-over" });
  const give = button(text("lease.give"), () => {
    app.interrupt(text("lease.given"));
    app.attempt(() => arm.release());
  }, { id: "lease-give" });
  const python = copyButton(() => (arm.epoch === null ? "robot.acquire_lease()" : "robot.release_lease()"));
  at("lease").append(h("div", { class: "row" }, h("div", { class: "column lease-words" }, who, since), take, over, give, python));
  let commanded = false;
  buildBanner(app);

  function update() {
    // The event that this page has it comes before the answer with its epoch.
    if (arm.acquiring) return;
    const { client } = arm.lease ?? {};
    // Of an arm that does not answer the lease is unknown.
    const open = app.connection.open && arm.link !== "gone";
    const mine = arm.commands;
    const view = arm.scope === "view";
    const other = client && !mine;
    setText(who, !open ? text("lease.unknown") : mine ? text("lease.mine") : other ? text("lease.other", { client }) : text("lease.none"));
    const time = sinceWhen(app);
    setText(since, open && client && time ? text("lease.since", { time }) : view ? text("lease.view") : "");
    const focused = document.activeElement === take || document.activeElement === over || document.activeElement === give;
    take.hidden = !open || mine || view || Boolean(other);
    over.hidden = !open || !other || arm.scope !== "admin";
    give.hidden = !mine;
    python.hidden = view;
    // The button that was pressed is replaced by another one, which takes its focus.
    if (focused && mine !== commanded) (mine ? give : take).focus();
    commanded = mine;
  }
  arm.follow(["lease", "link", "event", "reset"], update);
}

/**
 * Return since when the client that commands the arm does, by the clock of the arm's computer.
 *
 * @param {App} app The page.
 * @returns {string} The time of day; empty if it is not known.
 */
function sinceWhen({ arm }) {
  const taken = arm.events.findLast((event) => event.what === "lease" && event.lease?.epoch === arm.lease?.epoch);
  return taken ? clockTime(taken.wall) : "";
}

/**
 * Show that this page has lost the lease, and by what, until it is taken again or the person has seen it.
 *
 * @param {App} app The page.
 */
function buildBanner(app) {
  const { arm } = app;
  const words = h("span");
  const close = button(text("lease.seen"), () => {
    banner.hidden = true;
  });
  const banner = h("div", { id: "lease-lost", class: "banner warn row", role: "alert", hidden: true }, words, close);
  at("header").after(banner);
  let had = false;
  /** Newest event while this page had the lease. */
  let seen = 0;

  function update() {
    const has = arm.epoch !== null;
    if (has) seen = arm.lastEvent;
    if (has || arm.loss === "given") banner.hidden = true;
    else if (had) {
      banner.hidden = false;
      app.interrupt(text("lease.gone"));
    }
    had = has;
    if (banner.hidden) return;
    // The event that says why may come after the loss is known.
    const cause = arm.events.find((event) => event.lease !== null && event.number > seen);
    const why = arm.loss === "ended" ? cause?.text : undefined;
    setText(words, text("lease.lost", { why: why ?? text(arm.loss === "broken" ? "lease.broken" : "lease.ended") }));
  }
  for (const topic of /** @type {const} */ (["lease", "event"])) arm.on(topic, update);
}

/**
 * Ask for the reason of a takeover, and take the lease over.
 *
 * @param {App} app The page.
 */
function askReason(app) {
  const { arm } = app;
  const client = arm.lease?.client ?? "";
  openDialog(app, text("lease.over_title", { client }), (close) => {
    const reason = h("input", { type: "text", id: "lease-reason", maxlength: REASON, required: true, autocomplete: "off" });
    const go = h("button", { type: "submit", class: "primary", text: text("lease.over_do") });
    const form = h("form", { class: "column", on: { submit: takeOver } }, h("p", { text: text("lease.over_means", { client }) }),
      h("label", { for: "lease-reason", text: text("lease.reason") }), reason,
      h("div", { class: "row" }, go, button(text("lease.cancel"), close)));

    /** @param {SubmitEvent} event */
    function takeOver(event) {
      event.preventDefault();
      const given = reason.value.trim();
      if (!given) return;
      close();
      app.attempt(async () => {
        await arm.acquire(true);
        await app.ask({ kind: "report", text: text("lease.report", { client, reason: given }).slice(0, 500) });
      });
    }
    return [form];
  });
}
