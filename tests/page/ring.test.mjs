// The newest rows are kept, in arrays that are made once.

import assert from "node:assert/strict";
import test from "node:test";

import { Ring } from "../../src/bioscara/dashboard/page/js/plots/ring.js";

const plain = ({ times, columns }) => [[...times], [...columns[0]]];

test("the newest rows are kept in arrays that are made once", () => {
  const ring = new Ring(4, 1);
  const { buffer } = ring.columns[0];
  for (const time of [1, 2, 2, 3, 1, 4, 5, 6]) ring.push(time, () => (time === 5 ? null : 10 * time));
  const kept = ring.copy();
  ring.push(7, () => 70);
  assert.deepEqual(plain(kept), [[3, 4, 5, 6], [30, 40, NaN, 60]]);
  assert.deepEqual(plain(ring.rows()), [[4, 5, 6, 7], [40, NaN, 60, 70]]);
  assert.equal(ring.columns[0].buffer, buffer);
});

test("a ring that was cleared takes an older time", () => {
  const ring = new Ring(4, 1);
  ring.push(5, () => 1);
  ring.clear();
  assert.deepEqual(plain(ring.rows()), [[], []]);
  ring.push(2, () => 3);
  assert.deepEqual(plain(ring.rows()), [[2], [3]]);
});
