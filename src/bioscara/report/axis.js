"use strict";
// Labels of axes: as many decimals as the distance between two ticks needs, and no more.
const decimals = (step) => {
  for (let digits = 0; digits < 15; digits++) {
    if (Math.abs(step - Number(step.toFixed(digits))) <= 1e-6 * step) return digits;
  }
  return 15;
};
// Rounded twice, because a small negative number becomes -0 first, and 0 then.
const fixed = (value, digits) => Number(value.toFixed(digits)).toFixed(digits);
const tickLabels = (ticks, step) => ticks.map((tick) => (tick == null ? "" : fixed(tick, decimals(step))));
// A value beside the chart gets decimals for a thousandth of the visible range, but not more than the
// data have: seven significant digits.
const valueLabel = (value, low, high, unit = "") => {
  if (value == null) return "-";
  const visible = Math.ceil(-Math.log10((high - low) / 1e3));
  const known = value === 0 ? 0 : 6 - Math.floor(Math.log10(Math.abs(value)));
  return fixed(value, Math.min(15, Math.max(0, Math.min(visible, known)))) + unit;
};
