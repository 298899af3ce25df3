// A hold beats only while it may: requirement jog_r7.

import assert from "node:assert/strict";
import { setImmediate } from "node:timers/promises";
import test from "node:test";

import { Hold } from "../../src/bioscara/dashboard/page/js/control/hold.js";

/** Carry out steps: a time that passes [ms], a press "+KEY", a release "-KEY", a tick, or why nothing may move. */
async function held(steps) {
  const log = [];
  const over = {};
  const why = { old: "", backlog: "", busy: "" };
  let time = 0;
  const hold = new Hold({
    now: () => time,
    refusal: () => why.busy,
    doubt: () => why.old,
    backlog: () => why.backlog,
    start: async () => log.push("start"),
    beat: async () => {
      log.push("beat");
    },
    end: (goal) => {
      log.push("end");
      over[goal]?.();
    },
    over: (goal) =>
      new Promise((resolve) => {
        over[goal] = resolve;
      }),
    changed: () => {},
  });
  for (const step of steps) {
    if (typeof step === "number") time += step;
    else if (step.startsWith("+")) hold.press(step.slice(1), () => ({ joints: [1, 0, 0, 0] }));
    else if (step.startsWith("-")) hold.release(step.slice(1));
    else if (step === "tick") hold.tick();
    else if (step in why) why[step] = step;
    else hold.end(step);
    await setImmediate();
    await setImmediate();
  }
  return { log, state: hold.state, why: hold.why };
}

const CASES = [
  [["+a", 50, "tick", 50, "tick", "-a"], ["start", "beat", "beat", "end"], "idle"],
  // An old sample, or a network that takes nothing.
  [["+a", 50, "tick", "old", 50, "tick", 50, "tick"], ["start", "beat", "end"], "idle"],
  [["+a", 50, "tick", "backlog", 50, "tick"], ["start", "beat"], "running"],
  [["+a", 50, "tick", "backlog", 250, "tick"], ["start", "beat", "end"], "idle"],
  [["old", "+a", 50, "tick"], [], "idle"],
  [["busy", "+a", 50, "tick"], [], "idle"],
  // A late tick sends nothing more.
  [["+a", 50, "tick", 300, "tick", 50, "tick"], ["start", "beat", "end"], "idle"],
  // Two presses are none, until both are released.
  [["+a", 50, "tick", "+b", 50, "tick", "-a", 50, "tick"], ["start", "beat", "end"], "idle"],
  [["+a", "+a", 50, "tick"], ["start", "beat"], "running"],
  [["+a", "blur", 50, "tick", "+a", 50, "tick"], ["start", "end"], "idle"],
  // Released before the owner has answered, and pressed again: the former jog ends first.
  [["+a", "-a", "+a", 50, "tick"], ["start", "end", "start", "beat"], "running"],
];

for (const [steps, log, state] of CASES) {
  test(`jog_r7: ${steps.join(" ")}`, async () => {
    const found = await held(steps);
    assert.deepEqual(found.log, log);
    assert.equal(found.state, state);
  });
}

test("why a press did nothing is not replaced later", async () => {
  assert.equal((await held(["busy", "+a", "later"])).why, "busy");
});
