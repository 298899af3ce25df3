// The handle of the target in 3D: its disc moves it level, its arrow up and down, its knob turns it.

/** @import { Pose } from "../../../messages.d.ts" */
/** @import { Palette } from "../palette.js" */
/** @import { Stage } from "./stage.js" */

import { CylinderGeometry, Group, Mesh, MeshBasicMaterial, MeshLambertMaterial, Plane, Raycaster, SphereGeometry, Vector2,
  Vector3 } from "../../../vendor/three.js";

/** Size of the handle as a share of its distance from the camera. */
const SIZE = 0.085;

/** @typedef {"level" | "height" | "yaw"} Part */

/** The handle. */
export class Handle {
  /**
   * @param {Stage} stage The stage.
   * @param {(pose: Pose) => void} drag Called with the pose to which it is dragged.
   * @param {(turning: boolean) => void} busy Called when a drag begins and ends.
   */
  constructor(stage, drag, busy) {
    this.stage = stage;
    this.drag = drag;
    this.busy = busy;
    this.group = new Group();
    this.group.visible = false;
    /** @type {MeshLambertMaterial[]} */
    this.materials = [];
    /** @type {{part: Part, touch: Mesh}[]} */
    this.touched = [];
    this.#build();
    /** @type {Pose} */
    this.pose = [0, 0, 0, 0];
    /** @type {{part: Part, offset: Vector3, pointer: number} | null} */
    this.held = null;
    this.ray = new Raycaster();
    this.plane = new Plane();
    this.point = new Vector3();
    // Before the camera's own listeners, which then see that they are not meant.
    stage.host.addEventListener("pointerdown", (event) => this.#press(event), { capture: true });
    stage.host.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) stage.host.addEventListener(end, () => this.#release());
  }

  #build() {
    this.#add("level", new CylinderGeometry(0.45, 0.45, 0.06, 40), [0, 0, 0], true, new CylinderGeometry(0.6, 0.6, 0.3, 16));
    this.#add("height", new CylinderGeometry(0.05, 0.05, 0.9, 12), [0, 0, 0.5], true, new CylinderGeometry(0.28, 0.28, 0.9, 8));
    this.#add("height", new CylinderGeometry(0, 0.16, 0.36, 20), [0, 0, 1.1], true, new CylinderGeometry(0.3, 0.3, 0.6, 8));
    this.#add("yaw", new CylinderGeometry(0.04, 0.04, 0.6, 8), [0.7, 0, 0], false, new SphereGeometry(0.1));
    this.#add("yaw", new SphereGeometry(0.16, 16, 12), [1.05, 0, 0], false, new SphereGeometry(0.36, 8, 6));
  }

  /**
   * @param {Part} part
   * @param {import("../../../vendor/three.js").BufferGeometry} shape
   * @param {[number, number, number]} at
   * @param {boolean} standing
   * @param {import("../../../vendor/three.js").BufferGeometry} larger
   */
  #add(part, shape, at, standing, larger) {
    const material = new MeshLambertMaterial({ transparent: true, opacity: 0.9, depthTest: false });
    const seen = new Mesh(shape, material);
    const touch = new Mesh(larger, new MeshBasicMaterial());
    // Found by rays, and not drawn.
    touch.visible = false;
    for (const each of [seen, touch]) {
      each.position.set(...at);
      // Cylinders are made along y.
      if (standing) each.rotation.x = Math.PI / 2;
      else each.rotation.z = Math.PI / 2;
      each.renderOrder = 6;
      this.group.add(each);
    }
    this.materials.push(material);
    this.touched.push({ part, touch });
  }

  /**
   * Show it at the target.
   *
   * @param {Pose | null} pose The target; null for none.
   * @param {Palette} colors Colours.
   */
  draw(pose, colors) {
    this.group.visible = pose !== null;
    if (!pose) return;
    this.pose = pose;
    this.group.position.set(pose[0], pose[1], pose[2]);
    this.group.rotation.z = pose[3];
    this.group.scale.setScalar(SIZE * this.stage.camera.position.distanceTo(this.group.position));
    for (const material of this.materials) material.color.set(colors.target);
  }

  /** @param {PointerEvent} event */
  #press(event) {
    if (!this.group.visible || event.button !== 0 || !event.isPrimary) return;
    this.#aim(event);
    const hits = this.ray.intersectObjects(this.touched.map(({ touch }) => touch), false);
    const found = this.touched.find(({ touch }) => touch === hits[0]?.object);
    if (!found) return;
    this.held = { part: found.part, offset: new Vector3(), pointer: event.pointerId };
    if (!this.#reach(event)) {
      this.held = null;
      return;
    }
    this.held.offset.copy(this.point).sub(this.group.position);
    this.stage.controls.enabled = false;
    this.stage.host.setPointerCapture(event.pointerId);
    this.busy(true);
  }

  /** @param {PointerEvent} event */
  #move(event) {
    if (!this.held || event.pointerId !== this.held.pointer) return;
    if (!(event.buttons & 1)) {
      this.#release();
      return;
    }
    if (!this.#reach(event)) return;
    const [x, y, z, yaw] = this.pose;
    const { part, offset } = this.held;
    if (part === "yaw") {
      this.drag([x, y, z, Math.atan2(this.point.y - y, this.point.x - x)]);
      return;
    }
    const at = this.point.clone().sub(offset);
    this.drag(part === "level" ? [at.x, at.y, z, yaw] : [x, y, at.z, yaw]);
  }

  #release() {
    if (!this.held) return;
    this.held = null;
    this.stage.controls.enabled = true;
    this.busy(false);
  }

  /**
   * Find where the pointer is, on the plane in which the held part moves.
   *
   * @param {PointerEvent} event
   */
  #reach(event) {
    this.#aim(event);
    const normal = new Vector3(0, 0, 1);
    if (this.held?.part === "height") {
      this.stage.camera.getWorldDirection(normal);
      normal.z = 0;
      // Seen from straight above, the height cannot be dragged.
      if (normal.length() < 0.05) return false;
      normal.normalize();
    }
    this.plane.setFromNormalAndCoplanarPoint(normal, this.group.position);
    return this.ray.ray.intersectPlane(this.plane, this.point) !== null;
  }

  /** @param {PointerEvent} event */
  #aim(event) {
    const { left, top, width, height } = this.stage.host.getBoundingClientRect();
    const [x, y] = [(event.clientX - left) / width, (event.clientY - top) / height];
    this.ray.setFromCamera(new Vector2(2 * x - 1, 1 - 2 * y), this.stage.camera);
  }
}
