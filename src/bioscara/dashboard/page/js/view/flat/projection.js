// One flat picture: from above, or from the side. Inside it lengths are in mm, as type is not drawn below 1.

/** @import { Pose } from "../../../messages.d.ts" */

import { printable } from "../../dom.js";

/** Half of the visible area, around the column, and the height that is shown from the side [mm]. */
const HALF = 800;
const BOTTOM = -100;
const TOP = 620;
/** Radius of the target's handle [mm]. */
const HANDLE = 45;

/** The picture. */
export class Projection {
  /**
   * @param {"top" | "side"} kind From where.
   * @param {(a: number, b: number) => void} drag Called with the place to which the target is dragged: x and y, or x
   *   and z [m].
   */
  constructor(kind, drag) {
    this.kind = kind;
    const box = kind === "top" ? [-HALF, -HALF, 2 * HALF, 2 * HALF] : [-HALF, -TOP, 2 * HALF, TOP - BOTTOM];
    this.element = /** @type {SVGSVGElement} */ (svg("svg", { viewBox: box.join(" "), "aria-hidden": "true" }));
    this.surroundings = svg("g", {});
    this.bodies = svg("g", { class: "bodies" });
    const body = (/** @type {string} */ name) => /** @type {SVGGElement} */ (
      svg("g", { class: name }, svg("polyline", { class: "limb" }), svg("polyline", { class: "tool" }))
    );
    this.live = body("live");
    this.commanded = body("commanded");
    this.planned = body("planned");
    this.trace = svg("polyline", { class: "trace" });
    this.path = svg("polyline", { class: "path" });
    this.pair = svg("polyline", { class: "pair" });
    this.target = svg("g", { class: "target" }, svg("circle", { r: HANDLE }), svg("path", { d: `M0,0 H${1.7 * HANDLE}` }));
    this.element.append(this.surroundings, this.bodies, this.live, this.commanded, this.planned, this.trace, this.path, this.pair,
      this.target);
    this.#drag(drag);
  }

  /** @param {(a: number, b: number) => void} drag */
  #drag(drag) {
    let held = false;
    const move = (/** @type {PointerEvent} */ event) => {
      if (!held) return;
      if (!(event.buttons & 1)) {
        held = false;
        return;
      }
      const matrix = this.element.getScreenCTM();
      if (!matrix) return;
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
      drag(at.x / 1000, -at.y / 1000);
    };
    this.target.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      held = true;
      this.element.setPointerCapture(event.pointerId);
    });
    this.element.addEventListener("pointermove", move);
    for (const end of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) {
      this.element.addEventListener(end, () => {
        held = false;
      });
    }
  }

  /**
   * Return where a place is in the picture, whose second axis goes down.
   *
   * @param {number} x [m].
   * @param {number} y [m].
   * @param {number} z [m].
   * @returns {[number, number]} Its place [mm].
   */
  of(x, y, z) {
    return [round(1000 * x), round(-1000 * (this.kind === "top" ? y : z))];
  }

  /**
   * Return places as the points of a line.
   *
   * @param {ArrayLike<number>} points x, y, z of each [m].
   * @param {number} count Number of them.
   * @returns {string} The points.
   */
  line(points, count) {
    const places = [];
    for (let point = 0; point < 3 * count; point += 3) places.push(this.of(points[point], points[point + 1], points[point + 2]).join(","));
    return places.join(" ");
  }

  /** @param {Pose | null} pose The target; null for none. */
  showTarget(pose) {
    attributes(this.target, { visibility: pose ? "visible" : "hidden" });
    if (!pose) return;
    const [u, v] = this.of(pose[0], pose[1], pose[2]);
    const turn = this.kind === "top" ? -pose[3] / (Math.PI / 180) : 0;
    attributes(this.target, { transform: `translate(${u} ${v}) rotate(${round(turn)})` });
  }
}

/**
 * Make an element of SVG.
 *
 * @param {string} tag Its name.
 * @param {Record<string, string | number>} values Its attributes.
 * @param {...(Element | string)} children Its children.
 * @returns {SVGElement} The element.
 */
export function svg(tag, values, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  attributes(element, values);
  element.append(...children.map((child) => (typeof child === "string" ? printable(child) : child)));
  return element;
}

/**
 * Set attributes that differ.
 *
 * @param {Element} element The element.
 * @param {Record<string, string | number>} values The attributes.
 */
export function attributes(element, values) {
  for (const [name, value] of Object.entries(values)) {
    if (element.getAttribute(name) !== String(value)) element.setAttribute(name, String(value));
  }
}

/** @param {number} value @returns {number} In tenths. */
function round(value) {
  return Math.round(10 * value) / 10;
}
