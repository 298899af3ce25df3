// The state of the page: the worst one counts.

import assert from "node:assert/strict";
import "./no_page.mjs";
import test from "node:test";

import { pageState } from "../../src/bioscara/dashboard/page/js/states.js";

const LIVE = { link: "live", sample: { moving: [] }, faulty: false, commands: false, lease: null };
const CASES = [
  [{}, "no-lease"],
  [{ lease: { client: "other" } }, "lease-elsewhere"],
  [{ lease: { client: "page" }, commands: true }, "commanding"],
  [{ commands: true, faulty: true }, "fault"],
  [{ faulty: true, sample: { moving: ["recover()"] } }, "recovering"],
  [{ faulty: true, sample: { moving: ["acknowledge()"] } }, "recovering"],
  [{ faulty: true, sample: { moving: ["home()"] } }, "fault"],
  [{ sample: null }, "no-lease"],
  ...["signed-out", "mismatch", "connecting", "gone", "stale"].map((link) => [{ link, faulty: true, commands: true }, link]),
];

for (const [given, state] of CASES) {
  test(`${JSON.stringify(given)}: ${state}`, () => assert.equal(pageState({ ...LIVE, ...given }), state));
}
