// Disturbances of the world around a simulated arm: push, tilt, obstacle, take away. They need no lease.

/** @import { App } from "../app.js" */
/** @import { AnyCommand, BodyShape } from "../../messages.d.ts" */

import { button, h, setValues } from "../dom.js";
import { DEGREE, MM } from "../format.js";
import { copyButton, pythonNumber, pythonText } from "../python.js";
import { text } from "../texts.js";

/** Links of the arm that can be pushed. */
const LINKS = ["link_1", "link_2", "link_3", "link_4"];
/** Kinds that can be tilted: those that nothing moves, but the table. */
const TILTED = new Set(["nest", "wall", "obstacle"]);

/**
 * A disturbance.
 *
 * @typedef {Object} Disturbance
 * @property {string} id Its id, also of its texts.
 * @property {((shapes: BodyShape[]) => string[]) | null} bodies Names of the bodies that it can concern; null for a new one.
 * @property {[string, number, string, number][]} fields Id, first value, unit of the person, and that unit in SI units.
 * @property {(name: string, values: number[]) => AnyCommand} command The command.
 * @property {(name: string, values: string[]) => string} python The call with the same effect.
 */

/** @param {number[]} values @returns {[number, number, number]} */
const lowerOf = ([x, y, z, a, b]) => [x - a / 2, y - b / 2, z];
/** @param {number[]} values @returns {[number, number, number]} */
const upperOf = ([x, y, z, a, b, c]) => [x + a / 2, y + b / 2, z + c];

/** @type {Disturbance[]} */
const DISTURBANCES = [
  {
    id: "push",
    bodies: (shapes) => [...shapes.filter(([, kind]) => kind === "labware").map(([name]) => name), ...LINKS],
    fields: [["x", 2, "N", 1], ["y", 0, "N", 1], ["z", 0, "N", 1], ["duration", 0.2, "s", 1]],
    command: (name, [x, y, z, duration]) => ({ kind: "push_body", name, force: [x, y, z], duration }),
    python: (name, [x, y, z, duration]) => `push(${name}, (${x}, ${y}, ${z}), ${duration})`,
  },
  {
    id: "tilt",
    bodies: (shapes) => shapes.filter(([, kind]) => TILTED.has(kind)).map(([name]) => name),
    fields: [["height", 2, "mm", MM], ["direction", 0, "°", DEGREE]],
    command: (name, [height, direction]) => ({ kind: "tilt_body", name, height, direction }),
    python: (name, [height, direction]) => `tilt(${name}, ${height}, ${direction})`,
  },
  {
    id: "obstacle",
    bodies: null,
    fields: [["x", 300, "mm", MM], ["y", 0, "mm", MM], ["z", 0, "mm", MM], ["length", 50, "mm", MM], ["width", 50, "mm", MM], ["height",
      100, "mm", MM]],
    command: (name, values) => ({ kind: "add_obstacle", name, lower: lowerOf(values), upper: upperOf(values) }),
    python: (name, values) => {
      const numbers = values.map(Number);
      const [lower, upper] = [lowerOf(numbers), upperOf(numbers)].map((corner) => corner.map((each) => pythonNumber(each)).join(", "));
      return `add_obstacle(${name}, (${lower}), (${upper}))`;
    },
  },
  {
    id: "remove",
    bodies: (shapes) => shapes.filter(([, kind]) => kind === "labware" || TILTED.has(kind)).map(([name]) => name).reverse(),
    fields: [],
    command: (name) => ({ kind: "take_away", name }),
    python: (name) => `take_away(${name})`,
  },
];

/** One disturbance's part of the panel. */
class WorldCard {
  /**
   * @param {App} app
   * @param {Disturbance} disturbance
   */
  constructor(app, disturbance) {
    this.app = app;
    this.disturbance = disturbance;
    const { id, bodies, fields } = disturbance;
    const named = { "aria-label": text("world.body") };
    this.name = bodies ? h("select", named) : h("input", { ...named, value: text("world.obstacle_name"), maxlength: 64 });
    this.inputs = fields.map(([, first]) => h("input", { type: "number", step: "any", class: "bench-value", value: first }));
    this.go = button(text(`world.do_${id}`), () => this.#do());
    const labels = fields.map(([field, , unit], index) => h("label", {}, text(`world.field_${field}`), this.inputs[index], unit));
    this.element = h("section", { class: "card column bench-card", "aria-label": text(`world.${id}`) },
      h("h2", { text: text(`world.${id}`) }), h("p", { text: text(`world.about_${id}`) }),
      h("div", { class: "row" }, this.name, ...labels, this.go, copyButton(() => this.#python())));
  }

  /** Offer the bodies of now. @param {BodyShape[]} shapes */
  offer(shapes) {
    const { bodies } = this.disturbance;
    if (!bodies) return;
    const { value } = this.name;
    this.name.replaceChildren(...bodies(shapes).map((name) => h("option", { value: name, text: name })));
    if (bodies(shapes).includes(value)) this.name.value = value;
  }

  /** @param {boolean} allowed */
  permit(allowed) {
    setValues(this.go, { disabled: !allowed });
  }

  /** The values in SI units. */
  #values() {
    return this.inputs.map((input, index) => input.valueAsNumber * this.disturbance.fields[index][3]);
  }

  async #do() {
    const values = this.#values();
    if (values.some(Number.isNaN)) {
      this.app.say(text("bench.no_number"), "error");
      return;
    }
    await this.app.attempt(() => this.app.ask(this.disturbance.command(this.name.value, values)));
  }

  #python() {
    const values = this.#values().map((value) => pythonNumber(Number.isNaN(value) ? 0 : value));
    return `robot.simulation.${this.disturbance.python(pythonText(this.name.value), values)}`;
  }
}

/** All disturbances; hidden for an arm without a world. */
export class WorldCards {
  /** @param {App} app The page. */
  constructor(app) {
    this.app = app;
    this.cards = DISTURBANCES.map((disturbance) => new WorldCard(app, disturbance));
    this.element = h("div", { class: "column", hidden: true }, h("h2", { text: text("world.title") }),
      h("div", { class: "bench-grid" }, ...this.cards.map((card) => card.element)));
    app.arm.follow(["bodies"], () => {
      const { bodies } = app.arm;
      setValues(this.element, { hidden: bodies === null });
      if (bodies) { for (const card of this.cards) card.offer(bodies.bodies); }
    });
  }

  /** Let them be pressed or not. @param {boolean} allowed Whether this page may. */
  permit(allowed) {
    for (const card of this.cards) card.permit(allowed);
  }
}
