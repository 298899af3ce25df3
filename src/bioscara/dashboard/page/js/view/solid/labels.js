// Names of the bodies in 3D, as text of the page.

/** @import { PerspectiveCamera } from "../../../vendor/three.js" */
/** @import { Layer } from "../picture.js" */

import { Vector3 } from "../../../vendor/three.js";
import { h, setText } from "../../dom.js";

/**
 * @typedef {Object} Label
 * @property {string} text The text.
 * @property {[number, number, number]} at Where it is [m].
 * @property {Layer} layer Layer that it belongs to.
 * @property {boolean} [tool] Whether its place is in the frame of the tool.
 */

/** The labels of a view. */
export class Labels {
  constructor() {
    this.host = h("div", { class: "view-labels", "aria-hidden": "true" });
    /** @type {HTMLElement[]} */
    this.spans = [];
    this.place = new Vector3();
  }

  /**
   * Draw them.
   *
   * @param {Label[]} labels The labels.
   * @param {Set<Layer>} layers Layers that are shown.
   * @param {PerspectiveCamera} camera The camera.
   * @param {[number, number, number]} tool Where the tool is [m].
   */
  draw(labels, layers, camera, tool) {
    const shown = layers.has("labels") ? labels.filter((label) => layers.has(label.layer)) : [];
    while (this.spans.length < shown.length) {
      const span = h("span");
      this.spans.push(span);
      this.host.append(span);
    }
    const { clientWidth: width, clientHeight: height } = this.host;
    this.spans.forEach((span, index) => {
      const label = shown[index];
      span.hidden = !label;
      if (!label) return;
      this.place.set(...label.at);
      if (label.tool) this.place.add({ x: tool[0], y: tool[1], z: tool[2] });
      this.place.project(camera);
      span.hidden = this.place.z > 1;
      setText(span, label.text);
      const [x, y] = [((this.place.x + 1) * width) / 2, ((1 - this.place.y) * height) / 2];
      span.style.transform = `translate(${x.toFixed(0)}px, ${y.toFixed(0)}px)`;
    });
  }
}
