// Numbers as people read them.

import assert from "node:assert/strict";
import test from "node:test";

import { degrees, duration, millimetres, number, position, readable, velocity } from "../../src/bioscara/dashboard/page/js/format.js";

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

test("texts of the owner have mm and degrees, and no paths of fields", () => {
  const cases = [
    ["j2: goal 0.9 m is outside -0.0016 .. 0.338 m", "j2: goal 900 mm is outside -1.6 .. 338 mm"],
    ["j1: goal 9 rad is outside -3.04647 .. 3.04647 rad; are these degrees? angles are radians",
      "j1: goal 515.662° is outside -174.55 .. 174.55°"],
    ["(2, 0, 0.2) m, yaw 1.5708 rad cannot be reached: the wrist would be 1.2664 m beyond the reach of 0.6145 m",
      "(2000, 0, 200) mm, yaw 90.0002° cannot be reached: the wrist would be 1266.4 mm beyond the reach of 614.5 mm"],
    ["it would take j2 at 5.01 m, 4.67 m beyond its range -0.0016 .. 0.338 m",
      "it would take j2 at 5010 mm, 4670 mm beyond its range -1.6 .. 338 mm"],
    ["width 0.5 m is outside 0.04 .. 0.112 m; give a width between these, in metres",
      "width 500 mm is outside 40 .. 112 mm; give a width between these"],
    ["at most 0.25 m/s, 1 rad/s²", "at most 250 mm/s, 57.2958°/s²"],
    ["the request cannot be used: Expected `float`, got `null` - at `$.command.motion.z`",
      "the request cannot be used: a number is missing: z"],
    ["start and goal are the same pose: 0 m and 0 rad apart; leave one of them out", "the tool is there already"],
    ["Expected `str`, got `int` - at `$.command.task.name`", "Expected `str`, got `int`"],
    ["j3 at -2.7 rad, 0.07328 rad beyond its range -2.62672 .. 2.62672 rad or j3 at 2.7 rad",
      "j3 at -154.699°, 4.19863° beyond its range -150.5 .. 150.5° or j3 at 154.699°"],
    ["arm.yaml, line 3: joints.j2.upper: 3 is outside -2 .. 2 m", "arm.yaml, line 3: joints.j2.upper: 3000 is outside -2000 .. 2000 mm"],
    ["step 3, 0.5 m; segment 2 begins 0.01 (m or rad) beside it", "step 3, 500 mm; segment 2 begins 0.01 (m or rad) beside it"],
    ["blend 50 m is more than 0.1 m; are these millimetres? lengths are metres", "blend 50000 mm is more than 100 mm"],
    // No quantities of these units, or of which one is not known.
    ["j1 ends at 0.5 rad/s or m/s, 0.001 is the most", "j1 ends at 0.5 rad/s or m/s, 0.001 is the most"],
    ["its range -2.62672 .. 2.62672", "its range -2.62672 .. 2.62672"],
    ["speed_override 3 is outside 0 .. 1; 12 ms, 3 min, j1 (0x11), 5 mm",
      "speed_override 3 is outside 0 .. 1; 12 ms, 3 min, j1 (0x11), 5 mm"],
  ];
  for (const [given, expected] of cases) assert.equal(readable(given), expected);
});
