// A work frame taught by two points: both are taken at the tool, the frame is shown, then saved.

/** @import { App } from "../app.js" */
/** @import { Pose } from "../../messages.d.ts" */

import { ActionError } from "../app.js";
import { button, h, setText } from "../dom.js";
import { degrees, MM, millimetres, number } from "../format.js";
import { copyButton, pythonPose, pythonText } from "../python.js";
import { action } from "../run/action.js";
import { text } from "../texts.js";
import { APART, frameOf } from "./two_points.js";

/** Least difference in height of the points that is shown [m]. */
const LEAST_RISE = 0.5 * MM;

/**
 * Build the part.
 *
 * @param {App} app The page.
 * @param {() => string} name Returns the name of the frame that the person has given.
 * @param {(pose: Pose) => Promise<void>} save Saves the frame of that name.
 * @returns {HTMLElement} The part.
 */
export function pointFrame(app, name, save) {
  /** @type {{origin: Pose | null, onX: Pose | null}} */
  const points = { origin: null, onX: null };
  const shown = h("p", { class: "frame-found", role: "status" });
  const found = () => (points.origin && points.onX ? frameOf(points.origin, points.onX) : null);
  const tooNear = () => text("teach.too_near", { distance: millimetres(found()?.distance ?? 0), least: millimetres(APART, 0) });
  const missing = () => {
    const frame = found();
    if (!frame) return text("teach.two_missing");
    return frame.apart ? (name() ? "" : text("teach.no_name")) : tooNear();
  };
  const keep = action(app, text("teach.save_two"), async () => {
    const frame = found();
    if (frame) await save(frame.pose);
  }, { enabled: false, homed: false, extra: missing });

  function show() {
    const frame = found();
    shown.classList.toggle("danger", frame !== null && !frame.apart);
    if (!frame) {
      setText(shown, "");
      return;
    }
    if (!frame.apart) {
      setText(shown, tooNear());
      return;
    }
    const [, , , yaw] = frame.pose;
    const rise = Math.abs(frame.rise) < LEAST_RISE ? "" : text("teach.two_rise", { rise: number(frame.rise / MM, 1) });
    const said = text("teach.two_found", { place: placeOf(frame.pose), yaw: degrees(yaw), distance: millimetres(frame.distance) });
    setText(shown, rise ? `${said} ${rise}` : said);
  }

  /**
   * @param {"origin" | "onX"} which
   * @param {string} label
   * @param {string} python Its name in Python.
   */
  function taken(which, label, python) {
    const place = h("span", { class: "number", text: text("teach.two_not_taken") });
    const take = button(label, () =>
      app.attempt(async () => {
        const { sample, fresh } = app.arm;
        if (!fresh) throw new ActionError(text("refusal.stale"));
        if (!sample?.pose) throw new ActionError(text("refusal.not_homed"));
        points[which] = sample.pose;
        setText(place, placeOf(sample.pose));
        show();
      }));
    return h("div", { class: "row" }, take, copyButton(() => `${python} = robot.pose`), place);
  }
  const code = () => {
    const { origin, onX } = points;
    const given = origin && onX ? [origin, onX].map(pythonPose) : ["origin", "on_x"];
    const taking = origin && onX ? "" : "origin = robot.pose  # at the origin\non_x = robot.pose  # at a point of the x axis\n";
    return `${taking}robot.table = robot.table.with_frame(Frame.from_points(${pythonText(name() || "name")}, ${given.join(", ")}))`;
  };
  return h("section", { class: "column", "aria-label": text("teach.two_points") }, h("h3", { text: text("teach.two_points") }),
    h("p", { class: "dim small", text: text("teach.two_means") }), taken("origin", text("teach.take_origin"), "origin"),
    taken("onX", text("teach.take_x"), "on_x"), shown, h("div", { class: "row" }, keep, copyButton(code)));
}

/**
 * Return a place in words.
 *
 * @param {Pose} pose The pose.
 * @returns {string} x, y and z.
 */
export function placeOf([x, y, z]) {
  return `${[x, y, z].map((value) => number(value / MM, 1)).join(" ")} mm`;
}
