// The steps of a recovery: homing is one of them where a joint is not homed.

import assert from "node:assert/strict";
import "./no_page.mjs";
import test from "node:test";

import { Recovery } from "../../src/bioscara/dashboard/page/js/health/recovery.js";

/** Return a recovery with what shows it a sample. */
function recovery() {
  const listeners = {};
  const arm = { sample: null, on: (topic, listener) => (listeners[topic] = listener) };
  const made = new Recovery({ arm });
  const see = (fault, flags, { enabled = false, moving = [] } = {}) => {
    arm.sample = { fault, names: ["j1", "j2"], flags, enabled, moving, stale: false };
    arm.faulty = fault !== "clear";
    listeners.sample();
    const { step } = made;
    return step && `${step.number} of ${step.count}: ${step.kind}${step.busy ? " (busy)" : ""}`;
  };
  return see;
}

const HOMED = [0, 0];
const LOST = [0, 0x04];

test("three steps where the joints are still homed", () => {
  const see = recovery();
  assert.equal(see("latched", HOMED), "1 of 3: acknowledge");
  assert.equal(see("acknowledged", HOMED), "2 of 3: recover");
  assert.equal(see("clear", HOMED), "3 of 3: enable");
  assert.equal(see("clear", HOMED, { enabled: true }), null);
});

test("homing is the fourth where a joint is not", () => {
  const see = recovery();
  assert.equal(see("stopping", LOST), "1 of 4: stopping (busy)");
  assert.equal(see("acknowledged", LOST), "2 of 4: recover");
  assert.equal(see("clear", LOST), "3 of 4: enable");
  assert.equal(see("clear", LOST, { enabled: true }), "4 of 4: home");
  assert.equal(see("clear", LOST, { enabled: true, moving: ["home()"] }), "4 of 4: home (busy)");
  assert.equal(see("clear", HOMED, { enabled: true }), null);
});

test("an arm that is not homed for another reason needs no recovery", () => {
  assert.equal(recovery()("clear", LOST, { enabled: true }), null);
});
