// The sequence: its steps, files, dry run, preview, and carrying it out.

/** @import { App } from "../app.js" */
/** @import { DryRun } from "./sequence_run.js" */
/** @import { SequenceModel } from "./sequence.js" */
/** @import { Table } from "./table.js" */

import { ActionError } from "../app.js";
import { pauseButtons } from "../control/pause_buttons.js";
import { button, h, setText, setValues } from "../dom.js";
import { fileInput } from "../files/drop_zone.js";
import { duration, readable } from "../format.js";
import { judged, post, saveFile } from "../http.js";
import { programButton } from "../python.js";
import { action, card } from "../run/action.js";
import { text } from "../texts.js";
import { NAMES } from "./step_fields.js";
import { SequenceRun } from "./sequence_run.js";
import { stepList } from "./step_list.js";
import { KINDS, newStep } from "./step_words.js";

/** Largest file that is sent [byte]: the server reads no larger one. */
const FILE_MAX = 2 ** 20;

/**
 * Build the sequence.
 *
 * @param {App} app The page.
 * @param {SequenceModel} model The sequence.
 * @param {Table} table The table.
 * @returns {HTMLElement} The part.
 */
export function sequenceCard(app, model, table) {
  const title = h("input", { type: "text", id: "sequence-title", maxlength: "100", value: model.title });
  title.addEventListener("change", () => model.entitle(title.value.trim()));
  const names = h("datalist", { id: NAMES });
  const state = h("p", { class: "run-state", role: "status" });
  const notes = h("ul", { class: "plan-notes dim" });
  const undo = button(text("teach.undo"), () => model.undo());
  const editor = h("fieldset", { class: "editor column" }, h("legend", { class: "hidden-text", text: text("teach.sequence") }),
    h("label", { class: "field" }, h("span", { class: "field-name", text: text("teach.title") }), title), files(app, model),
    stepList(app, model), addStep(app, model, undo));
  const run = new SequenceRun(app, model, update);
  const runButtons = buttons(app, model, run, say);

  function offer() {
    names.replaceChildren(...["center", ...table.poses.map(({ name }) => name)].map((name) => h("option", { value: name })));
    model.tool = model.steps.length ? model.tool : (app.arm.workspace?.tool.name ?? "fingers");
  }

  function update() {
    editor.disabled = run.running;
    undo.disabled = model.past.length === 0;
    if (run.words) setText(state, run.words);
    runButtons.update();
  }

  /**
   * @param {DryRun} planned
   * @param {string} words
   */
  function say(planned, words) {
    setText(state, words);
    const lines = planned.verdicts.flatMap(({ failure, notes: all }) => (failure ? [failure.text] : all)).map(readable);
    notes.replaceChildren(...lines.map((line) => h("li", { text: line })));
  }
  app.arm.on("workspace", offer);
  for (const topic of /** @type {const} */ (["steps", "edit"])) {
    model.on(topic, () => {
      run.words = "";
      setText(state, "");
      notes.replaceChildren();
      if (title.value !== model.title) title.value = model.title;
      update();
    });
  }
  offer();
  update();
  return card(text("teach.sequence"), names, editor, runButtons.element, state, notes);
}

/**
 * @param {App} app
 * @param {SequenceModel} model
 * @param {HTMLElement} undo
 */
function addStep(app, model, undo) {
  const kind = h("select", { id: "step-kind" }, ...KINDS.map((each) => h("option", { value: each, text: text(`step.${each}`) })));
  return h("div", { class: "row" }, h("label", { for: "step-kind", text: text("teach.new_step") }), kind,
    button(text("teach.add"), () => model.add(newStep(kind.value, app.arm))), undo);
}

/**
 * @param {App} app
 * @param {SequenceModel} model
 */
function files(app, model) {
  const input = fileInput(text("teach.load_file"), ".yaml,.yml", (file) => app.attempt(() => load(file)));

  /** @param {File} file */
  async function load(file) {
    if (file.size > FILE_MAX) throw new ActionError(text("teach.too_large", { name: file.name, size: (file.size / 2 ** 20).toFixed(1) }));
    model.load(await judged(post(`api/sequences/read?name=${encodeURIComponent(file.name)}`, await file.text())));
    app.say(text("teach.loaded", { name: file.name, count: model.steps.length }));
  }
  const name = () => (model.title || "sequence").replace(/[^\p{L}\p{N}_-]+/gu, "_");
  const save = (/** @type {() => Promise<string>} */ content, /** @type {string} */ end) =>
    app.attempt(async () => saveFile(name() + end, new Blob([await content()], { type: "text/plain" })));
  return h("div", { class: "row" }, input, button(text("teach.load_file"), () => input.click()),
    button(text("teach.save_yaml"), () => save(() => model.yaml(), ".yaml")),
    button(text("teach.save_python"), () => save(() => model.python(), ".py")), programButton(() => model.python()));
}

/**
 * @param {App} app
 * @param {SequenceModel} model
 * @param {SequenceRun} run
 * @param {(planned: DryRun, words: string) => void} say
 */
function buttons(app, model, run, say) {
  const none = () => (run.running ? text("teach.runs_already") : model.steps.length ? "" : text("teach.no_steps"));
  const chosen = () => none() || (model.chosen < 0 ? text("teach.choose_step") : "");
  const dry = (/** @type {boolean} */ show) =>
    app.attempt(async () => {
      const why = none();
      if (why) throw new ActionError(why);
      const planned = await run.plan();
      const refused = planned.verdicts.find(({ failure }) => failure);
      say(planned, refused
        ? text("teach.dry_refused", { label: refused.label.split(" ")[0] })
        : text("teach.dry_ok", { time: duration(planned.duration) }));
      if (show) preview(app, model, planned);
    });
  const stop = h("div", { class: "row" }, pauseButtons(app, "run-pause"),
    button(text("teach.cancel_run"), () => app.attempt(() => run.cancel())));
  const start = h("div", { class: "row" }, button(text("teach.dry_run"), () => dry(false)), button(text("teach.preview"), () => dry(true)),
    action(app, text("teach.run_all"), () => run.start(), { extra: none, attributes: { class: "primary" } }),
    action(app, text("teach.run_step"), () => run.start(model.chosen, model.chosen + 1), { extra: chosen }),
    action(app, text("teach.run_from"), () => run.start(model.chosen), { extra: chosen }), programButton(() => model.python()));
  const update = () => {
    setValues(start, { hidden: run.running });
    setValues(stop, { hidden: !run.running });
  };
  return { element: h("div", { class: "column" }, start, stop, h("p", { class: "dim small", text: text("teach.run_means") })), update };
}

/**
 * @param {App} app
 * @param {SequenceModel} model
 * @param {DryRun} planned
 */
function preview(app, model, { trajectory, verdicts }) {
  if (!trajectory) return;
  app.showPreview({
    title: model.title || text("teach.sequence"),
    trajectory,
    plan: null,
    execute: null,
    time: 0,
    source: "teach",
    notes: verdicts.flatMap(({ failure, notes }) => (failure ? [failure.text] : notes)).map(readable),
  });
}
