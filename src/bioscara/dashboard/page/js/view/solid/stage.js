// Renderer, camera and lights of the 3D view; nothing here knows of the arm.

import { BufferAttribute, BufferGeometry, DirectionalLight, HemisphereLight, LineBasicMaterial, LineSegments, OrbitControls,
  PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "../../../vendor/three.js";
import { h } from "../../dom.js";

/** First target of the camera, and how far it is [m]. */
const MIDDLE = new Vector3(0.2, 0, 0.26);
const DISTANCE = 1.4;
/** Directions from the middle to the camera. */
const PRESETS = {
  iso: [0.75, -0.85, 0.6],
  front: [1, 0, 0.12],
  side: [0, -1, 0.12],
  top: [-0.0001, 0, 1],
};
/** Vertical field of view [degrees]; half size and step of the grid on the ground [m]. */
const FIELD = 38;
/** Width of the picture as a share of its height, below which it shows more from top to bottom. */
const WIDE = 1.4;
const GRID = 0.75;
const STEP = 0.125;
/** Names by which drivers that draw in software report themselves. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** @typedef {keyof typeof PRESETS | "follow"} Preset */

/** The stage. */
export class Stage {
  /**
   * @param {() => void} changed Called when the camera has moved.
   * @throws {Error} The browser has no WebGL.
   */
  constructor(changed) {
    this.canvas = h("canvas");
    this.host = h("div", { class: "view-canvas" }, this.canvas);
    this.changed = changed;
    this.renderer = renderer(this.canvas, true);
    this.#watch();
    const driver = this.renderer.getContext();
    const info = driver.getExtension("WEBGL_debug_renderer_info");
    this.slow = false;
    if (info && SOFTWARE.test(String(driver.getParameter(info.UNMASKED_RENDERER_WEBGL)))) this.#replace();
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FIELD, 1, 0.02, 20);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.host);
    this.controls.minDistance = 0.15;
    this.controls.maxDistance = 5;
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", changed);
    this.following = false;
    this.#light();
    this.grid = ground();
    this.scene.add(this.grid);
    this.look("iso");
    new ResizeObserver(() => {
      this.#fit();
      changed();
    }).observe(this.host);
  }

  #light() {
    const sun = new DirectionalLight("#ffffff", 2.2);
    sun.position.set(0.6, -1, 1.6);
    const fill = new DirectionalLight("#ffffff", 0.7);
    fill.position.set(-1, 0.8, 0.4);
    const sky = new HemisphereLight("#ffffff", "#8d95a0", 1.5);
    sky.position.set(0, 0, 1);
    this.scene.add(sun, fill, sky);
  }

  /** A canvas keeps its smoothing for life: another one takes its place. */
  #replace() {
    const canvas = h("canvas");
    this.renderer.dispose();
    // Browsers keep few contexts at once.
    this.renderer.forceContextLoss();
    this.canvas.replaceWith(canvas);
    this.canvas = canvas;
    this.renderer = renderer(canvas, false);
    this.#watch();
    this.#fit();
  }

  /** The graphics driver may start again, as after sleep; three.js then has all of it sent again. */
  #watch() {
    this.canvas.addEventListener("webglcontextrestored", () => this.changed());
  }

  /** Draw with less effort: rough edges, half the resolution. */
  reduce() {
    this.slow = true;
    this.#replace();
  }

  #fit() {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height || !this.camera) return;
    this.renderer.setPixelRatio(this.slow ? 0.5 : Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // A narrow picture shows as much from side to side as a wider one.
    const narrow = Math.max(1, (WIDE * height) / width);
    this.camera.fov = (360 / Math.PI) * Math.atan(Math.tan((FIELD * Math.PI) / 360) * narrow);
    this.camera.updateProjectionMatrix();
  }

  /** Draw. */
  render() {
    this.renderer.render(this.scene, this.camera);
  }

  /** @param {import("../palette.js").Palette} colors Colours. */
  paint(colors) {
    this.renderer.setClearColor(colors.back);
    this.grid.material.color.set(colors.grid);
  }

  /**
   * Move the camera.
   *
   * @param {Preset} preset Where to.
   */
  look(preset) {
    this.following = preset === "follow";
    if (preset === "follow") return;
    const [x, y, z] = PRESETS[preset];
    this.controls.target.copy(MIDDLE);
    this.camera.position.set(x, y, z).setLength(DISTANCE).add(MIDDLE);
    this.controls.update();
  }

  /**
   * Keep the tool in the middle, if it is followed.
   *
   * @param {number} x Where the tool is [m].
   * @param {number} y [m].
   * @param {number} z [m].
   */
  follow(x, y, z) {
    if (!this.following) return;
    const { target } = this.controls;
    this.camera.position.add({ x: x - target.x, y: y - target.y, z: z - target.z });
    target.set(x, y, z);
    this.camera.lookAt(target);
  }

  /**
   * Turn the camera about the middle.
   *
   * @param {number} left Angle [rad].
   * @param {number} up Angle [rad].
   */
  turn(left, up) {
    this.controls.rotateLeft(left);
    this.controls.rotateUp(up);
  }

  /**
   * Shift the picture.
   *
   * @param {number} right [pixel].
   * @param {number} down [pixel].
   */
  pan(right, down) {
    this.following = false;
    this.controls.pan(right, down);
  }

  /**
   * Make the picture larger or smaller.
   *
   * @param {number} factor Above 1 for larger.
   */
  zoom(factor) {
    this.controls.dollyOut(factor);
  }
}

/**
 * @param {HTMLCanvasElement} canvas
 * @param {boolean} antialias
 */
function renderer(canvas, antialias) {
  return new WebGLRenderer({ canvas, antialias, powerPreference: "low-power" });
}

function ground() {
  /** @type {number[]} */
  const ends = [];
  for (let at = -GRID; at <= GRID + 1e-9; at += STEP) ends.push(at, -GRID, 0, at, GRID, 0, -GRID, at, 0, GRID, at, 0);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(ends), 3));
  const grid = new LineSegments(geometry, new LineBasicMaterial());
  // Below the top of a table at height zero.
  grid.position.z = -0.004;
  return grid;
}
