// Numbers as text. Inside, lengths are in m and angles in rad; people read mm and degrees.

export const DEGREE = Math.PI / 180;
export const MM = 1e-3;

/**
 * Return a number as text.
 *
 * @param {number | null | undefined} value The number; null if it is unknown.
 * @param {number} digits Digits after the point.
 * @returns {string} The text; a dash for an unknown number.
 */
export function number(value, digits) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  return value.toFixed(digits).replace(/^-(?=[0.]*$)/, "");
}

/**
 * Return a position of a joint in the unit that people read.
 *
 * @param {number | null} value Position [rad or m].
 * @param {string} unit `rad` or `m`.
 * @returns {string} In degrees or mm, with its unit.
 */
export function position(value, unit) {
  return unit === "m" ? `${scaled(value, MM, 2)} mm` : `${scaled(value, DEGREE, 2)}°`;
}

/**
 * Return a velocity of a joint in the unit that people read.
 *
 * @param {number | null} value Velocity [rad/s or m/s].
 * @param {string} unit `rad` or `m`.
 * @returns {string} In degrees/s or mm/s, with its unit.
 */
export function velocity(value, unit) {
  return unit === "m" ? `${scaled(value, MM, 1)} mm/s` : `${scaled(value, DEGREE, 1)}°/s`;
}

/**
 * Return a length in mm.
 *
 * @param {number | null} value Length [m].
 * @param {number} [digits] Digits after the point.
 * @returns {string} In mm, with its unit.
 */
export function millimetres(value, digits = 1) {
  return `${scaled(value, MM, digits)} mm`;
}

/**
 * Return an angle in degrees.
 *
 * @param {number | null} value Angle [rad].
 * @param {number} [digits] Digits after the point.
 * @returns {string} In degrees, with its unit.
 */
export function degrees(value, digits = 1) {
  return `${scaled(value, DEGREE, digits)}°`;
}

/**
 * Return a duration.
 *
 * @param {number} value Duration [s].
 * @returns {string} In the unit that suits it.
 */
export function duration(value) {
  if (value < 1) return `${Math.round(1e3 * value)} ms`;
  if (value < 120) return `${value.toFixed(1)} s`;
  return `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`;
}

const NUMBER = String.raw`[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?`;
/** A number, a range, a number outside of it or a list in brackets, with their unit; not one that may be of either unit, as "rad/s or m/s". */
const QUANTITIES = new RegExp(
  String
    .raw`(?<![\w.])(?<numbers>(?:${NUMBER} is outside )?${NUMBER}(?: \.\. ${NUMBER})?|\(${NUMBER}(?:, ${NUMBER})*\)) (?<unit>rad|m)(?<rate>/s²?)?(?![\w²/]| or (?:rad|m)\b)`,
  "g",
);
/** Hints at units, which a person who gives mm and degrees does not need. */
const HINT =
  /(?:; | \()are these (?:mm\/s or degrees|millimetres|degrees)\?(?: (?:angles|lengths|velocities) are (?:radians|metres|m\/s and rad\/s))?\)?|; (?:angles|lengths) are in (?:rad|m), not in (?:degrees|mm)|, in metres\b/g;

/**
 * Return a text of the owner, whose lengths are in m and angles in rad, for people.
 *
 * @param {string} message The text.
 * @returns {string} In mm and degrees, without the paths of fields in messages.
 */
export function readable(message) {
  return message
    .replace(/Expected `(?:float|int)`, got `null` - at `\$[^`]*?(\w+)(?:\[\d+\])?`/, "a number is missing: $1")
    .replace(/ - at `\$[^`]*`/, "")
    .replace(/^start and goal are the same pose: .*/, "the tool is there already")
    .replace(HINT, "")
    .replace(QUANTITIES, (_, numbers, unit, rate) => {
      const [factor, shown] = unit === "m" ? [MM, " mm"] : [DEGREE, "°"];
      const converted = numbers.replace(new RegExp(NUMBER, "g"),
        (/** @type {string} */ each) => String(Number((Number(each) / factor).toPrecision(6))));
      return `${converted}${shown}${rate ?? ""}`;
    });
}

/**
 * @param {number | null} value
 * @param {number} unit
 * @param {number} digits
 */
function scaled(value, unit, digits) {
  return number(value === null ? null : value / unit, digits);
}
