// Panel: plots of the last minutes.

/** @import { App, Panel, PanelView } from "../app.js" */
/** @import { View } from "../plots/chart.js" */

import { button, h, setText } from "../dom.js";
import { number } from "../format.js";
import { saveFile } from "../http.js";
import { Chart } from "../plots/chart.js";
import { csv, png } from "../plots/export.js";
import { LONGEST, Recorder } from "../plots/recorder.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";

/** Lengths that can be chosen [s]. */
const LENGTHS = [10, 60, 300, 600];
const SHORTEST = 1;
/** Least time between two drawings [ms], and between two updates of the values in view. */
const PERIOD = 100;
const SUMMARY_PERIOD = 1000;
/** Time without any load after which a joint has none [s]. */
const NO_LOAD = 1;
/** Factor of one press of a zoom button, and share of one press of a move button. */
const ZOOM = 2;
const MOVE = 0.5;

/** @type {Panel} */
export const plotsPanel = { id: "plots", mount: (host, app) => new Plots(host, app) };

/** @implements {PanelView} */
class Plots {
  /**
   * @param {HTMLElement} host
   * @param {App} app
   */
  constructor(host, app) {
    this.app = app;
    this.visible = false;
    this.length = LENGTHS[1];
    /** The values in view while the time stands; null while it runs. @type {View | null} */
    this.held = null;
    /** @type {Map<string, {chart: Chart, element: HTMLElement, wanted: boolean}>} */
    this.charts = new Map();
    /** @type {Set<string>} */
    this.hidden = new Set();
    /** Which plots there are. */
    this.built = "";
    this.drawn = -Infinity;
    this.summarised = -Infinity;
    this.noted = -Infinity;
    this.limits = true;
    this.recorder = new Recorder(app, () => this.#build());
    this.joints = h("div", { class: "row", role: "group", "aria-label": text("plots.joints") });
    this.quantities = h("div", { class: "row", role: "group", "aria-label": text("plots.quantities") });
    this.stack = h("div", { class: "column plots" });
    this.status = h("p", { class: "dim", role: "status" });
    this.noLoad = h("p", { class: "dim" });
    this.summary = h("tbody");
    this.details = h("details", { class: "card" }, h("summary", {}, h("h2", { text: text("plots.values") })), this.#summaryTable());
    host.append(h("div", { class: "column" }, this.#controls(), this.joints, this.quantities, this.status, this.stack, this.details));
    app.arm.on("sample", () => this.#sample());
    app.arm.on("reset", () => {
      if (this.visible) this.show();
    });
    app.arm.on("description", () => {
      if (this.visible && this.charts.size === 0) this.show();
    });
    app.arm.on("link", () => {
      if (this.visible && app.arm.link === "live") this.#resume();
    });
    this.details.addEventListener("toggle", () => this.#summarise());
    new ResizeObserver(() => this.#resize()).observe(this.stack);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#recolour());
    document.addEventListener("visibilitychange", () => this.#resume());
  }

  show() {
    this.visible = true;
    this.held = null;
    this.recorder.start();
    this.#update();
  }

  hide() {
    this.visible = false;
    this.recorder.stop();
  }

  /** Fill the gap that a hidden page or a broken connection has left. */
  #resume() {
    if (this.visible && !document.hidden && !this.held) this.recorder.start();
  }

  #controls() {
    const length = h("select", { "aria-label": text("plots.length"), on: { change: () => this.#setLength(Number(length.value)) } },
      ...LENGTHS.map((seconds) =>
        h("option", { value: seconds, text: text(`plots.length_${seconds}`), selected: seconds === this.length })
      ));
    this.select = length;
    this.pause = button(text("plots.pause"), () => this.#togglePause(), { "aria-pressed": "false" });
    const limits = h("input", { type: "checkbox", checked: true, on: { change: () => this.#setLimits(limits.checked) } });
    return h("div", { class: "row" }, this.pause, length,
      button("+", () => this.#zoom(1 / ZOOM), { "aria-label": text("plots.zoom_in"), title: text("plots.zoom_in") }),
      button("−", () => this.#zoom(ZOOM), { "aria-label": text("plots.zoom_out"), title: text("plots.zoom_out") }),
      button("←", () => this.#move(-MOVE), { "aria-label": text("plots.earlier"), title: text("plots.earlier") }),
      button("→", () => this.#move(MOVE), { "aria-label": text("plots.later"), title: text("plots.later") }),
      h("label", {}, limits, text("plots.limits")), button(text("plots.csv"), () => this.#saveTable()),
      button(text("plots.png"), () => this.#savePicture()),
      copyButton(() =>
        "for name, position, velocity in zip(robot.state.names, robot.state.positions, robot.state.velocities):\n    print(name, position, velocity)"
      ));
  }

  #summaryTable() {
    const columns = ["line", "newest", "least", "most"];
    return h("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": text("plots.values") },
      h("table", {}, h("thead", {}, h("tr", {}, ...columns.map((name) => h("th", { scope: "col", text: text(`plots.col_${name}`) })))),
        this.summary));
  }

  /** Make the plots for the quantities of the arm. */
  #build() {
    const { quantities } = this.recorder;
    const key = quantities.map(({ id, lines }) => `${id} ${lines.map((line) => line.name)}`).join();
    if (key !== this.built) {
      this.built = key;
      for (const { chart, element } of this.charts.values()) {
        chart.destroy();
        element.remove();
      }
      this.charts.clear();
      this.joints.replaceChildren(...(quantities[0]?.lines ?? []).map((line, index) => this.#jointBox(line.name, index)));
      this.quantities.replaceChildren(...quantities.map(({ id }) => this.#quantityBox(id)));
      for (const quantity of quantities) {
        const place = h("div", { class: "plot", role: "img",
          "aria-label": text("plots.plot_of", { quantity: text(`plots.quantity_${quantity.id}`) }) });
        const element = h("section", {}, h("h2", { text: text(`plots.quantity_${quantity.id}`) }), place);
        if (quantity.id === "load") place.before(this.noLoad);
        this.stack.append(element);
        const chart = new Chart(place, quantity, (from, to) => this.#hold(from, to));
        chart.limits = this.limits;
        this.charts.set(quantity.id, { chart, element, wanted: true });
      }
    }
    this.#update();
    this.#draw();
  }

  /**
   * @param {string} name
   * @param {number} index
   */
  #jointBox(name, index) {
    const box = h("input", { type: "checkbox", checked: true, on: { change: () => {
      if (box.checked) this.hidden.delete(name);
      else this.hidden.add(name);
      for (const { chart } of this.charts.values()) chart.select((line) => line.joint < 0 || !this.hidden.has(line.name));
      this.#draw();
    } } });
    return h("label", { class: `joint-${index + 1}` }, box, h("span", { class: "swatch", "aria-hidden": "true" }), name);
  }

  /** @param {string} id */
  #quantityBox(id) {
    const box = h("input", { type: "checkbox", checked: true, on: { change: () => {
      const entry = this.charts.get(id);
      if (!entry) return;
      entry.wanted = box.checked;
      entry.element.hidden = !box.checked;
      this.#draw();
    } } });
    return h("label", {}, box, text(`plots.quantity_${id}`));
  }

  #sample() {
    if (!this.visible) return;
    this.recorder.add();
    if (this.held || this.charts.size === 0) return;
    this.#noteNoLoad();
    // Not before the picture has moved by a pixel.
    const pixel = (1000 * this.length) / Math.max(this.stack.clientWidth, 1);
    const now = performance.now();
    if (now - this.drawn >= Math.max(PERIOD, pixel)) this.#draw();
    if (now - this.summarised >= SUMMARY_PERIOD) this.#summarise();
  }

  /** Say which joints have no load, and why: their lines are gaps. */
  #noteNoLoad() {
    const now = performance.now();
    const { ring, quantities } = this.recorder;
    const { description } = this.app.arm;
    if (!ring || !description || now - this.noted < SUMMARY_PERIOD) return;
    this.noted = now;
    const { times, columns } = ring.rows();
    const first = times.findIndex((time) => time >= ring.last - NO_LOAD);
    if (first < 0) return;
    const lines = quantities.find(({ id }) => id === "load")?.lines ?? [];
    const without = lines.filter(({ column }) => columns[column].subarray(first).every(Number.isNaN));
    const [original, ours] = [true, false].map((wanted) =>
      without
        .filter(({ joint }) => (description.firmware[joint] === "protocol 1") === wanted)
        .map(({ name }) => name).join(", ")
    );
    const notes = [];
    if (original) notes.push(text("plots.no_load_original", { joints: original }));
    if (ours) notes.push(text("plots.no_load", { joints: ours }));
    setText(this.noLoad, notes.join(" "));
  }

  /** The values in view now. @returns {View | null} */
  get view() {
    if (this.held) return this.held;
    const { ring } = this.recorder;
    if (!ring) return null;
    const to = ring.last === -Infinity ? 0 : ring.last;
    return { ...ring.rows(), from: to - this.length, to, zero: to };
  }

  #draw() {
    const { view } = this;
    if (!this.visible || !view) return;
    this.drawn = performance.now();
    for (const { chart, wanted } of this.charts.values()) if (wanted) chart.draw(view);
    if (this.held) this.#summarise();
  }

  #summarise() {
    const { view } = this;
    if (!this.details.open || !view) return;
    this.summarised = performance.now();
    const from = view.times.findIndex((time) => time >= view.from);
    let to = view.times.length;
    while (to > 0 && view.times[to - 1] > view.to) to -= 1;
    const lines = this.#lines();
    while (this.summary.rows.length > lines.length) this.summary.deleteRow(-1);
    lines.forEach(({ line, name }, index) => {
      const row = this.summary.rows[index]
        ?? this.summary.appendChild(h("tr", {}, h("th", { scope: "row" }), ...[0, 1, 2].map(() => h("td", { class: "number" }))));
      const values = view.columns[line.column].subarray(Math.max(from, 0), to);
      let [least, most] = [Infinity, -Infinity];
      for (const value of values) {
        if (value < least) least = value;
        if (value > most) most = value;
      }
      const shown = [values[values.length - 1] ?? NaN, least, most];
      setText(row.cells[0], name);
      shown.forEach((value, column) => setText(row.cells[column + 1], Number.isFinite(value) ? `${number(value, 2)} ${line.unit}` : "–"));
    });
  }

  /** Lines that are seen, with their names. */
  #lines() {
    return [...this.charts.values()].filter(({ wanted }) => wanted).flatMap(({ chart }) =>
      chart.quantity.lines
        .filter((_, index) => chart.shown[index])
        .map((line) => {
          const quantity = text(`plots.quantity_${chart.quantity.id}`);
          return { line, name: line.joint < 0 ? text(`plots.line_${line.name}`) : `${line.name} ${quantity.toLowerCase()}` };
        })
    );
  }

  /** @param {number} seconds */
  #setLength(seconds) {
    this.length = seconds;
    if (this.held) this.#hold(this.held.to - seconds, this.held.to);
    else this.#draw();
  }

  /** @param {boolean} limits */
  #setLimits(limits) {
    this.limits = limits;
    for (const { chart } of this.charts.values()) chart.limits = limits;
    this.#draw();
  }

  #togglePause() {
    const { view } = this;
    if (this.held) {
      this.held = null;
      // The rows of the pause are in the ring.
      this.#draw();
    } else if (view) this.#hold(view.from, view.to);
    this.#update();
  }

  /**
   * Let the time stand, and show a part of it.
   *
   * @param {number} from Its begin [s].
   * @param {number} to Its end [s].
   */
  #hold(from, to) {
    const { ring } = this.recorder;
    if (!ring) return;
    if (!this.held) this.held = { ...ring.copy(), from, to, zero: ring.last };
    this.held.from = from;
    this.held.to = Math.max(to, from + SHORTEST / 10);
    this.#update();
    this.#draw();
  }

  /** @param {number} factor */
  #zoom(factor) {
    if (!this.held) {
      this.length = Math.min(Math.max(this.length * factor, SHORTEST), LONGEST);
      this.#update();
      this.#draw();
      return;
    }
    const { from, to } = this.held;
    const half = Math.min(((to - from) * factor) / 2, LONGEST / 2);
    this.#hold((from + to) / 2 - half, (from + to) / 2 + half);
  }

  /** @param {number} share */
  #move(share) {
    const { view } = this;
    if (!view) return;
    const step = (view.to - view.from) * share;
    this.#hold(view.from + step, view.to + step);
  }

  #update() {
    const held = this.held !== null;
    this.pause?.setAttribute("aria-pressed", String(held));
    if (this.pause) setText(this.pause, text(held ? "plots.continue" : "plots.pause"));
    if (this.select) this.select.value = String(this.length);
    const { problem } = this.recorder;
    setText(this.status, held ? text("plots.held") : problem ? text("plots.no_history", { problem }) : "");
  }

  #saveTable() {
    const { view } = this;
    if (!view) return;
    const lines = this.#lines();
    const names = new Map(lines.map(({ line, name }) => [line, name]));
    const table = csv(view, lines.map(({ line }) => line), (line) => names.get(line) ?? line.name);
    saveFile(this.#fileName("csv"), new Blob([table], { type: "text/csv" }));
  }

  #savePicture() {
    const charts = [...this.charts.values()].filter(({ wanted }) => wanted).map(({ chart }) => chart);
    this.app.attempt(async () => saveFile(this.#fileName("png"), await png(charts)));
  }

  /** @param {string} ending */
  #fileName(ending) {
    const name = (this.app.connection.welcome?.owner ?? "arm").replace(/[^\w-]/g, "_");
    return `${name}-${new Date().toISOString().slice(0, 19).replace(/[:T]/g, "-")}.${ending}`;
  }

  #resize() {
    for (const { chart } of this.charts.values()) chart.resize();
  }

  #recolour() {
    for (const { chart } of this.charts.values()) chart.rebuild();
    this.#draw();
  }
}
