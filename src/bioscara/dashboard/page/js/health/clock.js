// Times of the clock on the wall.

const TIME = new Intl.DateTimeFormat([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" });

/**
 * Return a time of day.
 *
 * @param {number} wall Seconds since 1970.
 * @returns {string} Hours, minutes and seconds here.
 */
export function clockTime(wall) {
  return TIME.format(1000 * wall);
}
