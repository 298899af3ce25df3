// Placements of links, and frames; that the whole arm is where Python has it is tested in the browser.

import assert from "node:assert/strict";
import test from "node:test";

import { compose, identity, Kinematics, placed, upright } from "../../src/bioscara/dashboard/page/js/view/kinematics.js";

const near = (found, expected) =>
  [...found].forEach((value, index) => assert.ok(Math.abs(value - expected[index]) < 1e-12, `${found} is not ${expected}`));
const joint = (name, type, parent, child, more = {}) => ({
  name,
  type,
  parent,
  child,
  origin: [0, 0, 0, 0, 0, 0],
  axis: [0, 0, 1],
  lower: -3,
  upper: 3,
  mimic: null,
  ...more,
});
const MODEL = {
  base: "base",
  tool: "hand",
  links: ["base", "column", "arm", "hand", "jaw"].map((name) => ({ name, visuals: [] })),
  joints: [
    joint("lift", "prismatic", "base", "column", { lower: 0.1, upper: 0.4 }),
    joint("turn", "revolute", "column", "arm", { origin: [0.2, 0, 0, 0, 0, 0] }),
    joint("flange", "fixed", "arm", "hand", { origin: [0.3, 0, 0, 0, 0, 0] }),
    joint("jaw", "prismatic", "hand", "jaw", { axis: [1, 0, 0], mimic: { joint: "gripper", multiplier: 0.5, offset: 0.01 } }),
  ],
};
const placedAt = (positions) => {
  const kinematics = new Kinematics(MODEL, ["lift", "turn"]);
  const room = kinematics.room();
  kinematics.place(positions, room);
  return { kinematics, room };
};

test("a pose in a frame is turned with it", () => {
  near(compose([1, 2, 3, Math.PI / 2], [0.1, 0, 0.2, 0.3]), [1, 2.1, 3.2, Math.PI / 2 + 0.3]);
});

test("an upright frame at the origin moves nothing", () => {
  near(upright([0, 0, 0, 0]), identity());
  near(placed([1, 2, 3, 0, 0, Math.PI / 2]), [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]);
});

test("links are moved by the joints below them, and a jaw by the width that it follows", () => {
  const { kinematics, room } = placedAt({ lift: 0.3, turn: Math.PI / 2, gripper: 0.08 });
  near(room.get("hand").subarray(12, 15), [0.2, 0.3, 0.3]);
  near(room.get("jaw").subarray(12, 15), [0.2, 0.35, 0.3]);
  near(kinematics.toolPose(room, [0.1, 0, 0, 0.5]), [0.2, 0.1, 0.3, Math.PI / 2 + 0.5]);
});

test("a joint of unknown position stands at its limit next to zero", () => {
  near(placedAt({ lift: null }).room.get("column").subarray(12, 15), [0, 0, 0.1]);
});
