// Recordings of the arm: listed, downloaded, replayed in the view, plotted.

/** @import { App } from "../app.js" */

import { ActionError } from "../app.js";
import { button, h, setText } from "../dom.js";
import { duration } from "../format.js";
import { get, judged } from "../http.js";
import { card } from "../run/action.js";
import { text } from "../texts.js";
import { MotionPlots } from "./motion_plots.js";

/** Samples that are asked for. */
const SAMPLES = 4000;
/** Recordings that are listed at once. */
const LISTED = 100;

/**
 * @typedef {{name: string, size: number, begin: number | null, end: number | null, complete: boolean, writing: boolean}} Entry
 * @typedef {{begin: number, times: number[], joint_names: string[], positions: (number | null)[][], velocities: (number | null)[][], total: number}} Samples
 */

/** The card. */
export class RecordingsCard {
  /** @param {App} app The page. */
  constructor(app) {
    this.app = app;
    this.status = h("p", { class: "dim", role: "status" });
    this.list = h("ul", { class: "recordings" });
    this.title = h("h3");
    this.plots = new MotionPlots(app);
    this.element = card(text("files.recordings"), h("div", { class: "row" }, button(text("files.refresh"), () => this.refresh())),
      this.status, this.list, this.title, this.plots.element);
    this.title.hidden = true;
  }

  /** Ask for the list. */
  refresh() {
    return this.app.attempt(async () => {
      /** @type {Entry[]} */
      const entries = await get("api/recordings");
      const shown = entries.slice(0, LISTED);
      this.list.replaceChildren(...shown.map((entry) => this.#row(entry)));
      const more = entries.length > shown.length ? text("files.more", { count: entries.length - shown.length }) : "";
      setText(this.status, entries.length ? more : text("files.no_recordings"));
    });
  }

  /** @param {Entry} entry */
  #row(entry) {
    const { name, size, begin, end, complete, writing } = entry;
    const when = begin === null ? "" : new Date(1000 * begin).toLocaleString([], { dateStyle: "medium", timeStyle: "medium" });
    const facts = [when, begin !== null && end !== null ? duration(end - begin) : "", `${(size / 2 ** 20).toFixed(1)} MiB`,
      complete ? "" : text(writing ? "files.writing" : "files.incomplete")];
    const address = `api/recordings/${encodeURIComponent(name)}`;
    return h("li", {},
      h("span", { class: "grow" }, h("strong", { text: name }), " ", h("span", { class: "dim", text: facts.filter(Boolean).join(" · ") })),
      h("span", { class: "row" }, button(text("files.replay"), () => this.app.attempt(() => this.#replay(entry, address)), {
        "aria-label": text("files.replay_one", { name }),
      }),
        h("a", { href: address, download: name, class: "button", text: text("files.download"),
          "aria-label": text("files.download_one", { name }) })));
  }

  /**
   * @param {Entry} entry
   * @param {string} address
   */
  async #replay({ name }, address) {
    setText(this.status, text("files.reading", { name }));
    /** @type {Samples} */
    const samples = await judged(get(`${address}/samples?count=${SAMPLES}`));
    setText(this.status, text("files.samples", { shown: samples.times.length, total: samples.total }));
    this.title.hidden = false;
    setText(this.title, name);
    this.plots.show({ names: samples.joint_names, times: samples.times, positions: samples.positions, velocities: samples.velocities });
    const trajectory = known(samples);
    if (!trajectory) throw new ActionError(text("files.unknown_positions", { name }));
    this.app.showPreview({ title: text("files.replay_one", { name }), trajectory, plan: null, execute: null, time: 0, source: "files" });
  }
}

/**
 * Return the samples whose positions are known, as a trajectory that begins at 0; null if there are none.
 *
 * @param {Samples} samples
 * @returns {import("../../messages.d.ts").TrajectoryValue | null}
 */
function known({ times, joint_names, positions }) {
  const kept = times.map((_, index) => index).filter((index) => positions[index].every((position) => position !== null));
  if (kept.length < 2) return null;
  return {
    joint_names,
    times: kept.map((index) => times[index] - times[kept[0]]),
    positions: kept.map((index) => /** @type {number[]} */ (positions[index])),
    velocities: null,
    accelerations: null,
  };
}
