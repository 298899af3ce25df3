// Jogs keep to the chosen speed: requirement jog_r8.

import assert from "node:assert/strict";
import "./no_page.mjs";
import test from "node:test";

import { jogCode, stepShare, stepTask, toolSpeed, velocityOf } from "../../src/bioscara/dashboard/page/js/control/jog_motion.js";

const SPEED = 0.1;
const [UPPER, FORE, HAND] = [0.3, 0.25, 0.1];
const joint = (unit) => ({ unit, max_velocity: 100 });
const ARM = {
  description: {
    parameters: {
      geometry: { upper_arm: UPPER, forearm: FORE, tool_x: HAND, tool_y: 0 },
      joints: [joint("rad"), joint("m"), joint("rad"), joint("rad")],
    },
  },
  workspace: null,
  sample: { names: ["j1", "j2", "j3", "j4"], commands: [0.1, 0.2, null, 0.4], positions: [1, 2, 0.3, 4] },
};
/** Shares of the axes that a gamepad moves together. */
const SHARES = [-1, -0.3, 0, 0.6, 1].flatMap((a) =>
  [-1, 0, 1].flatMap((b) => [-1, 0, 0.5, 1].flatMap((c) => [-1, 0, 1].map((d) => [a, b, c, d])))
);

/** Return the speed of the tool of a stretched or bent arm, whose joints have these velocities. */
function speedAt([, , j3, j4], [v1, v2, v3, v4]) {
  const hand = [HAND * Math.cos(j3 + j4), HAND * Math.sin(j3 + j4)];
  const elbow = [FORE * Math.cos(j3) + hand[0], FORE * Math.sin(j3) + hand[1]];
  const shoulder = [UPPER + elbow[0], elbow[1]];
  const [x, y] = [0, 1].map((each) => v1 * shoulder[each] + v3 * elbow[each] + v4 * hand[each]);
  return Math.hypot(x, y, v2);
}

test("jog_r8: axes that are moved together keep to the chosen speed", () => {
  let [ofTool, ofJoints] = [0, 0];
  for (const share of SHARES) {
    const { tool } = velocityOf("tool", share, SPEED, ARM, 0.3);
    ofTool = Math.max(ofTool, Math.hypot(tool[0], tool[1], tool[2]));
    const { joints } = velocityOf("joints", share, SPEED, ARM, 0);
    for (const j3 of [0, 1, 2, 3]) for (const j4 of [0, 1, 2, 3]) ofJoints = Math.max(ofJoints, speedAt([0, 0, j3, j4], joints));
  }
  assert.ok(0.099 < ofTool && ofTool < SPEED + 1e-9, `tool ${ofTool}`);
  assert.ok(0.08 < ofJoints && ofJoints < SPEED + 1e-9, `joints ${ofJoints}`);
});

test("nothing moves while the arm is unknown", () => {
  assert.deepEqual(velocityOf("joints", [1, 1, 1, 1], SPEED, { description: null, workspace: null, sample: null }, 0), {
    joints: [0, 0, 0, 0],
  });
  assert.equal(stepTask("joints", 0, 1, 1, { description: null, workspace: null, sample: null }, 0), null);
});

test("the tool moves along the axes of its frame", () => {
  const { tool } = velocityOf("tool", [1, 0, 0, 0], SPEED, ARM, Math.PI / 2);
  assert.deepEqual(tool.map((value) => Math.round(1e9 * value) / 1e9), [0, 0.1, 0, 0]);
});

test("a step begins at the commanded position, and at the measured one without a command", () => {
  const { kind, positions, velocity_scaling: share } = stepTask("joints", 1, 5, 0.5, ARM, 0);
  assert.deepEqual([kind, share, positions.map((value) => value.toFixed(9))], ["move_joints", 0.5, ["0.100000000", "0.205000000",
    "0.300000000", "0.400000000"]]);
});

test("the share of a step is within 0.001 and 1", () => {
  assert.equal(stepShare("tool", 0, 1e6, SPEED, ARM, 1e-6), 0.001);
  assert.equal(stepShare("tool", 0, 1, SPEED, ARM, 10), 1);
});

test("the code of a step does the same as its button", () => {
  assert.equal(jogCode("tool", 2, -5, false, SPEED, 0.25, ARM, 0), "robot.move_relative(z=-0.005, velocity_scaling=0.25)");
  assert.equal(jogCode("joints", 1, 5, false, SPEED, 0.5, ARM, 0), "robot.move_joints([0.1, 0.205, 0.3, 0.4], velocity_scaling=0.5)");
  assert.match(jogCode("tool", 0, 1, true, SPEED, 1, ARM, 0), /ToolVelocity\(x=0\.1\)/);
});

test("the speed of the tool is unknown without two samples of different times", () => {
  const at = (time, x) => ({ time, pose: [x, 0, 0, 0] });
  assert.ok(Math.abs(toolSpeed(at(1, 0), at(1.5, 0.1)) - 0.2) < 1e-12);
  for (const [before, now] of [[null, at(1, 0)], [at(1, 0), at(1, 0.1)], [at(2, 0), at(1, 0)]])
    assert.ok(Number.isNaN(toolSpeed(before, now)));
});
