// Panel: the parameters of the arm, changed in its overlay after a look at what changes.

/** @import { App, Panel, PanelView } from "../app.js" */
/** @import { Draft, Parameters } from "../settings/requests.js" */

import { RequestError } from "../connection.js";
import { button, h, setText, setValues } from "../dom.js";
import { saveFile } from "../http.js";
import { copyButton, pythonText } from "../python.js";
import { checkChanges, readParameters } from "../settings/requests.js";
import { inWords, ParameterTable, shown } from "../settings/table.js";
import { text } from "../texts.js";

/** @type {Panel} */
export const settingsPanel = { id: "settings", mount: (host, app) => new Settings(host, app) };

/** @implements {PanelView} */
class Settings {
  /**
   * @param {HTMLElement} host
   * @param {App} app
   */
  constructor(host, app) {
    this.app = app;
    this.visible = false;
    /** @type {Parameters | null} */
    this.given = null;
    /** @type {Draft | null} */
    this.draft = null;
    /** Overlays that this page has replaced, the last one last. @type {string[]} */
    this.former = [];
    /** @type {import("../settings/table.js").Edits} */
    this.edits = new Map();
    this.table = new ParameterTable(this.edits, () => this.#edited());
    this.search = h("input", { type: "search", placeholder: text("settings.search"), "aria-label": text("settings.search"),
      on: { input: () => this.#filter() } });
    this.own = h("input", { type: "checkbox", on: { change: () => this.#filter() } });
    this.restart = h("p", { class: "notice warn", hidden: true, text: text("settings.restart") });
    this.why = h("p", { class: "dim", role: "status" });
    this.problem = h("p", { class: "notice danger", role: "alert", hidden: true });
    this.check = button(text("settings.check"), () => this.#check());
    this.discard = button(text("settings.discard"), () => this.#discard());
    this.undo = button(text("settings.undo"), () => this.#undo());
    this.changes = h("section", { class: "card column", "aria-label": text("settings.changes"), hidden: true, tabindex: "-1" });
    host.append(
      h("div", { class: "column settings" }, this.restart, this.why,
        h("div", { class: "row" }, this.search, h("label", {}, this.own, text("settings.own")),
          button(text("settings.download"), () => this.#download()), copyButton(() => this.#code())),
        h("div", { class: "row" }, this.check, this.discard, this.undo), this.problem, this.changes, this.table.element),
    );
    app.arm.on("reset", () => {
      this.former = [];
      if (this.visible) this.#load();
    });
    app.arm.on("event", () => {
      if (this.visible && app.arm.events.at(-1)?.what === "parameters") this.#load();
    });
    app.arm.follow(["lease", "link"], () => this.#permit());
    this.#edited();
  }

  show() {
    this.visible = true;
    this.#load();
  }

  hide() {
    this.visible = false;
  }

  /** Why this page cannot save; empty if it can. @returns {string} */
  get hindrance() {
    const { arm } = this.app;
    if (arm.scope !== "admin") return text("settings.needs_admin", { scope: text(`settings.scope_${arm.scope}`) });
    return arm.commands ? "" : text("settings.needs_lease");
  }

  async #load() {
    try {
      const given = await readParameters();
      if (this.given && given.revision !== this.given.revision) this.#replaced();
      this.given = given;
    } catch (error) {
      this.#complain(error);
      return;
    }
    this.table.editable = this.app.arm.scope === "admin";
    this.table.fill(this.given.rows);
    this.restart.hidden = !this.given.restart;
    this.#filter();
    this.#edited(false);
  }

  /** The overlay is another one now: a draft for the former one cannot be saved. */
  #replaced() {
    if (!this.draft) return;
    this.#drop();
    this.#complain(new Error(text("settings.conflict")));
  }

  #permit() {
    const why = this.hindrance;
    setText(this.why, why);
    setValues(this.undo, { disabled: why !== "" || this.former.length === 0 });
    const saving = this.changes.querySelector("button.primary");
    if (saving instanceof HTMLButtonElement) setValues(saving, { disabled: why !== "" });
  }

  /** @param {boolean} [drop] Whether the draft is void. */
  #edited(drop = true) {
    if (drop) this.#drop();
    this.check.disabled = this.edits.size === 0;
    this.discard.disabled = this.edits.size === 0;
    setText(this.check, this.edits.size ? text("settings.check_count", { count: this.edits.size }) : text("settings.check"));
    this.#permit();
  }

  #drop() {
    this.draft = null;
    this.changes.hidden = true;
    this.problem.hidden = true;
  }

  #filter() {
    this.table.filter(this.search.value, this.own.checked);
  }

  async #check() {
    this.problem.hidden = true;
    try {
      this.draft = await checkChanges(Object.fromEntries(this.edits));
    } catch (error) {
      this.#drop();
      this.#complain(error);
      return;
    }
    this.#showDraft(this.draft);
  }

  /** @param {Draft} draft */
  #showDraft(draft) {
    const columns = ["name", "before", "after", "unit"];
    const rows = draft.diff.map(({ name, before, after, unit }) =>
      h("tr", {}, h("th", { scope: "row", text: name }), h("td", {}, h("del", { text: shown(before) }), ` ${inWords(before, unit)}`),
        h("td", {}, h("ins", { text: shown(after) }), ` ${inWords(after, unit)}`), h("td", { text: unit }))
    );
    const content = rows.length === 0
      ? h("p", { text: text("settings.no_change") })
      : h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": text("settings.changes") },
        h("table", {}, h("thead", {}, h("tr", {}, ...columns.map((name) => h("th", { scope: "col", text: text(`settings.col_${name}`) })))),
          h("tbody", {}, ...rows)));
    this.changes.replaceChildren(h("h2", { text: text("settings.changes") }), content,
      h("p", { class: "dim", text: text("settings.applies") }),
      h("div", { class: "row" }, button(text("settings.save"), () => this.#save(draft.overlay, draft.revision), { class: "primary" }),
        button(text("settings.back"), () => this.#drop())));
    this.changes.hidden = false;
    this.#permit();
    this.changes.focus();
  }

  /**
   * @param {string} overlay
   * @param {number} revision
   */
  async #save(overlay, revision) {
    const before = this.given?.overlay ?? "";
    this.problem.hidden = true;
    try {
      await this.app.request({ kind: "set_parameters", overlay, revision });
    } catch (error) {
      const conflict = error instanceof RequestError && error.failure.error === "ConflictError";
      this.#complain(conflict ? new Error(text("settings.conflict")) : error);
      if (conflict) await this.#load();
      return;
    }
    this.former.push(before);
    this.edits.clear();
    this.#drop();
    await this.#load();
    this.app.say(text("settings.saved"));
  }

  async #undo() {
    const before = this.former.pop();
    if (before === undefined || !this.given) return;
    const now = this.former.length;
    await this.#save(before, this.given.revision);
    // An undone change is not undone by the next press; that goes further back.
    if (this.former.length > now) this.former.pop();
    else this.former.push(before);
    this.#permit();
  }

  #discard() {
    this.edits.clear();
    this.#edited();
    this.table.fill(this.given?.rows ?? []);
    this.#filter();
  }

  #code() {
    const change = this.draft ? `\nrobot.set_overlay(${pythonText(this.draft.overlay)}, ${this.draft.revision})` : "";
    return `print(robot.overlay().overlay)${change}`;
  }

  #download() {
    const name = (this.app.connection.welcome?.owner ?? "arm").replace(/[^\w-]/g, "_");
    saveFile(`${name}-parameters.yaml`, new Blob([this.given?.overlay ?? ""], { type: "application/yaml" }));
  }

  /** @param {unknown} error */
  #complain(error) {
    setText(this.problem, error instanceof Error ? error.message : String(error));
    this.problem.hidden = false;
  }
}
