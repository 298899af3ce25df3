// A field that the page has filled in has the value that it was given, not the rounded one that it shows.

import assert from "node:assert/strict";
import "./no_page.mjs";
import test from "node:test";

import { exactly } from "../../src/bioscara/dashboard/page/js/run/action.js";

test("its own rounding is not sent, a person's text is", () => {
  const input = { value: "" };
  const field = exactly(input, 1e-3);
  assert.ok(Number.isNaN(field.value()));
  field.set(0.329996);
  assert.equal(input.value, "330");
  assert.equal(field.value(), 0.329996);
  input.value = "330.5";
  assert.equal(field.value(), 0.3305);
});
