// A list of poses of which only the visible rows are elements: a thousand of them cost no more than ten.

/** @import { NamedPose } from "../../messages.d.ts" */

import { h, setText } from "../dom.js";
import { degrees, millimetres } from "../format.js";
import { text } from "../texts.js";

/** Height of a row [px], as in css/teach.css. */
const ROW = 36;
/** Rows that are seen at once, with those of a longer list behind a scroll bar. */
const SEEN = 7;
/** Rows that are made above and below the visible ones. */
const SPARE = 4;
let counted = 0;

/** The list: a listbox with one chosen row. */
export class PoseList {
  /**
   * @param {string} label Its name.
   * @param {(name: string) => void} choose Called when another row is chosen; an empty name for none.
   */
  constructor(label, choose) {
    this.choose = choose;
    /** @type {NamedPose[]} */
    this.poses = [];
    this.chosen = "";
    this.mounted = "";
    counted += 1;
    this.id = `pose-list-${counted}`;
    this.filler = h("div", { class: "pose-filler", role: "presentation" });
    this.rows = h("div", { class: "pose-rows", role: "presentation" });
    this.element = h("div", {
      class: "pose-list",
      role: "listbox",
      tabindex: "0",
      "aria-label": label,
      on: { scroll: () => this.#draw(), keydown: (/** @type {KeyboardEvent} */ event) => this.#key(event) },
    }, this.filler, this.rows);
    new ResizeObserver(() => this.#draw()).observe(this.element);
  }

  /**
   * Show other poses.
   *
   * @param {NamedPose[]} poses The poses.
   * @param {string} mounted Name of the mounted tool.
   */
  set(poses, mounted) {
    this.poses = poses;
    this.mounted = mounted;
    this.filler.style.height = `${ROW * poses.length}px`;
    this.element.style.height = poses.length ? `${ROW * Math.min(poses.length, SEEN) + 2}px` : "";
    if (poses.length) delete this.element.dataset.empty;
    else this.element.dataset.empty = text("teach.no_poses");
    if (this.chosen && !poses.some(({ name }) => name === this.chosen)) this.select("");
    this.#draw();
  }

  /**
   * Choose a row.
   *
   * @param {string} name Name of the pose; empty for none.
   * @param {boolean} [seen] Whether to scroll to it.
   */
  select(name, seen = false) {
    const changed = name !== this.chosen;
    this.chosen = name;
    const index = this.poses.findIndex((pose) => pose.name === name);
    if (seen && index >= 0) this.#scroll(index);
    this.#draw();
    if (changed) this.choose(name);
  }

  /** @param {number} index */
  #scroll(index) {
    const { element } = this;
    const top = index * ROW;
    if (top < element.scrollTop) element.scrollTop = top;
    else if (top + ROW > element.scrollTop + element.clientHeight) element.scrollTop = top + ROW - element.clientHeight;
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const page = Math.max(1, Math.floor(this.element.clientHeight / ROW) - 1);
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity }[event.key];
    if (step === undefined || !this.poses.length) return;
    event.preventDefault();
    const here = this.poses.findIndex((pose) => pose.name === this.chosen);
    const next = here < 0 ? (step > 0 ? 0 : this.poses.length - 1) : here + step;
    this.select(this.poses[Math.min(Math.max(next, 0), this.poses.length - 1)].name, true);
  }

  #draw() {
    const { scrollTop, clientHeight } = this.element;
    const first = Math.max(0, Math.floor(scrollTop / ROW) - SPARE);
    const last = Math.min(this.poses.length, Math.ceil((scrollTop + clientHeight) / ROW) + SPARE);
    this.rows.style.transform = `translateY(${first * ROW}px)`;
    while (this.rows.children.length > Math.max(0, last - first)) this.rows.lastChild?.remove();
    for (let index = first; index < last; index += 1) {
      let row = /** @type {HTMLElement | undefined} */ (this.rows.children[index - first]);
      if (!row) {
        row = this.#row();
        this.rows.append(row);
      }
      this.#fill(row, index);
    }
    const chosen = this.poses.findIndex(({ name }) => name === this.chosen);
    const visible = chosen >= first && chosen < last;
    if (visible) this.element.setAttribute("aria-activedescendant", `${this.id}-${chosen}`);
    else this.element.removeAttribute("aria-activedescendant");
  }

  #row() {
    const row = h("div", { class: "pose-row", role: "option" }, h("span", { class: "pose-name" }),
      h("span", { class: "pose-place number" }), h("span", { class: "pose-tool dim" }));
    row.addEventListener("click", () => this.select(row.dataset.name ?? ""));
    return row;
  }

  /**
   * @param {HTMLElement} row
   * @param {number} index
   */
  #fill(row, index) {
    const pose = this.poses[index];
    row.id = `${this.id}-${index}`;
    row.dataset.name = pose.name;
    row.setAttribute("aria-selected", String(pose.name === this.chosen));
    row.setAttribute("aria-setsize", String(this.poses.length));
    row.setAttribute("aria-posinset", String(index + 1));
    setText(row.children[0], pose.name);
    setText(row.children[1], placeOf(pose));
    const tool = pose.tool ?? "";
    setText(row.children[2], tool === this.mounted ? "" : tool);
  }
}

/**
 * Return where a pose is, in words.
 *
 * @param {NamedPose} pose The pose.
 */
export function placeOf(pose) {
  const place = pose.pose_tool_in_base;
  if (!place) return text("teach.joints_only");
  const [x, y, z, yaw] = place;
  return `${[x, y, z].map((value) => millimetres(value).replace(" mm", "")).join(" ")} mm ${degrees(yaw)}`;
}
