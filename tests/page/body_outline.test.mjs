// The outline of a body in a flat picture, by hand.

import assert from "node:assert/strict";
import { test } from "node:test";

import { bodyOutline } from "../../src/bioscara/dashboard/page/js/view/flat/body_outline.js";

const TOP = { of: (x, y) => [Math.round(1000 * x), Math.round(-1000 * y)] };
const SIDE = { of: (x, _, z) => [Math.round(1000 * x), Math.round(-1000 * z)] };
const PLATE = ["plate", "labware", true, [[0, 0, 0.01, 0.06, 0.04, 0.01], [0, 0, 0.03, 0.01, 0.01, 0.01]]];

/** @param {string} points */
function corners(points) {
  return points.split(" ").sort();
}

test("an upright body is a rectangle from above and from the side", () => {
  const pose = ["plate", 0.3, 0.1, 0, 1, 0, 0, 0];
  assert.deepEqual(corners(bodyOutline(TOP, PLATE, pose)), ["240,-140", "240,-60", "360,-140", "360,-60"]);
  assert.deepEqual(corners(bodyOutline(SIDE, PLATE, pose)), ["240,-40", "240,0", "360,-40", "360,0"]);
});

test("a quarter turn about the vertical changes its sides, and one about x lays it on its side", () => {
  const half = Math.SQRT1_2;
  assert.deepEqual(corners(bodyOutline(TOP, PLATE, ["plate", 0, 0, 0, half, 0, 0, half])), ["-40,-60", "-40,60", "40,-60", "40,60"]);
  assert.deepEqual(corners(bodyOutline(TOP, PLATE, ["plate", 0, 0, 0, half, half, 0, 0])), ["-60,0", "-60,40", "60,0", "60,40"]);
});
