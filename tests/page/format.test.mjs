// Numbers as people read them.

import assert from "node:assert/strict";
import test from "node:test";

import { degrees, duration, millimetres, number, position, velocity } from "../../src/bioscara/dashboard/page/js/format.js";

test("an unknown number is a dash, and zero has no sign", () => {
  for (const unknown of [null, undefined, NaN]) assert.equal(number(unknown, 2), "–");
  assert.equal(number(-0.001, 2), "0.00");
  assert.equal(number(-0.01, 2), "-0.01");
  assert.equal(millimetres(null), "– mm");
});

test("lengths are in mm and angles in degrees", () => {
  assert.equal(position(0.12345, "m"), "123.45 mm");
  assert.equal(position(Math.PI / 2, "rad"), "90.00°");
  assert.equal(velocity(0.25, "m"), "250.0 mm/s");
  assert.equal(velocity(-Math.PI, "rad"), "-180.0°/s");
  assert.equal(millimetres(0.05, 0), "50 mm");
  assert.equal(degrees(Math.PI), "180.0°");
});

test("a duration has the unit that suits it", () => {
  assert.deepEqual([0.0125, 1, 119.94, 120, 3725].map(duration), ["13 ms", "1.0 s", "119.9 s", "2 min 0 s", "62 min 5 s"]);
});
