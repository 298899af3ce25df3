// The visible part of the plots, as a file.

/** @import { Chart, View } from "./chart.js" */
/** @import { Line } from "./quantities.js" */

import { text } from "../texts.js";

/** Space between two plots in a picture [px]. */
const SPACE = 8;
/** Height of a title in a picture [px]. */
const TITLE = 22;

/**
 * Return the rows that are seen as a table, in SI units.
 *
 * @param {View} view The rows.
 * @param {Line[]} lines The columns.
 * @param {(line: Line) => string} name Returns the name of a column.
 * @returns {string} The table, with commas and a line of headings.
 */
export function csv(view, lines, name) {
  const rows = [["time [s]", ...lines.map((line) => `${name(line)} [${line.si}]`)].map(quoted).join(",")];
  for (let index = 0; index < view.times.length; index += 1) {
    const time = view.times[index];
    if (time < view.from || time > view.to) continue;
    const values = lines.map((line) => {
      const value = view.columns[line.column][index] * (line.si === "%" ? 1 : line.factor);
      return Number.isNaN(value) ? "" : String(Number(value.toPrecision(7)));
    });
    rows.push([time.toFixed(4), ...values].join(","));
  }
  return `${rows.join("\r\n")}\r\n`;
}

/** @param {string} cell */
function quoted(cell) {
  return /[",\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell;
}

/**
 * Return the plots as one picture.
 *
 * @param {Chart[]} charts The plots, from top to bottom.
 * @returns {Promise<Blob>} The picture, as PNG.
 */
export function png(charts) {
  const ratio = devicePixelRatio;
  const canvases = charts.map((chart) => chart.plot.ctx.canvas);
  const picture = document.createElement("canvas");
  picture.width = Math.max(1, ...canvases.map((canvas) => canvas.width));
  picture.height = Math.max(1, canvases.reduce((sum, canvas) => sum + canvas.height + ratio * (SPACE + TITLE), 0));
  const context = /** @type {CanvasRenderingContext2D} */ (picture.getContext("2d"));
  const style = getComputedStyle(document.documentElement);
  context.fillStyle = style.getPropertyValue("--surface");
  context.fillRect(0, 0, picture.width, picture.height);
  context.fillStyle = style.getPropertyValue("--text");
  context.font = `${14 * ratio}px sans-serif`;
  let top = 0;
  charts.forEach((chart, index) => {
    const names = chart.quantity.lines.filter((_, line) => chart.shown[line])
      .map((line) => (line.joint < 0 ? text(`plots.line_${line.name}`) : line.name)).join(", ");
    context.fillText(`${text(`plots.quantity_${chart.quantity.id}`)}: ${names}`, 8 * ratio, top + 16 * ratio);
    context.drawImage(canvases[index], 0, top + TITLE * ratio);
    top += canvases[index].height + ratio * (SPACE + TITLE);
  });
  return new Promise((resolve, reject) => {
    picture.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("the picture could not be made"))), "image/png");
  });
}
