// A message to the person lasts as long as it is true.

import assert from "node:assert/strict";
import "./no_page.mjs";
import test from "node:test";

import { App, NoLeaseError } from "../../src/bioscara/dashboard/page/js/app.js";
import { RequestError } from "../../src/bioscara/dashboard/page/js/connection.js";

/** Return whether the message of an error holds, as a function, with the arm that it concerns. */
async function failing(error, state) {
  const arm = { commands: true, faulty: false, connection: { open: true }, sample: { moving: [], enabled: true, positions: [0] },
    ...state };
  const app = new App(arm.connection, arm);
  let found = null;
  app.messageListeners.push((...told) => (found = told[2]));
  await app.attempt(() => Promise.reject(error));
  return { arm, holds: found };
}

const refusal = (error) => new RequestError({ error, text: "refused", data: {} });

test("a refusal without the lease ends with the lease", async () => {
  for (const error of [new NoLeaseError("none"), refusal("LeaseError")]) {
    const { arm, holds } = await failing(error, { commands: false });
    assert.ok(holds());
    arm.commands = true;
    assert.ok(!holds());
  }
});

test("a refusal by a fault, another motion or a joint that is not homed ends with these", async () => {
  const sample = { moving: ["home()"], enabled: false, positions: [null] };
  for (const kind of ["FaultedError", "BusyError", "NotEnabledError", "NotHomedError"]) {
    const { arm, holds } = await failing(refusal(kind), { faulty: true, sample });
    assert.ok(holds(), kind);
    arm.faulty = false;
    arm.sample = { moving: [], enabled: true, positions: [0] };
    assert.ok(!holds(), kind);
  }
});

test("a refusal by a state that the page does not see, or by a value, stays", async () => {
  for (const kind of ["FaultedError", "LimitError"]) {
    const { holds } = await failing(refusal(kind), {});
    assert.ok(holds(), kind);
  }
});
