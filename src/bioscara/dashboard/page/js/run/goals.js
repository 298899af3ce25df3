// The goals of the arm: the one that runs, pause and resume, and how the latest goals ended.

/** @import { App } from "../app.js" */
/** @import { GoalValue } from "../../messages.d.ts" */

import { pauseButtons } from "../control/pause_buttons.js";
import { button, h, setText } from "../dom.js";
import { duration, millimetres, readable } from "../format.js";
import { copyButton } from "../python.js";
import { text } from "../texts.js";
import { card } from "./action.js";

/** Number of ended goals that are listed. */
const LISTED = 8;
/** Time between two requests for the progress [ms]. */
const LOOK = 250;
const ENDED = new Set(["succeeded", "cancelled", "failed"]);

/**
 * Build the goals.
 *
 * @param {App} app The page.
 * @returns {{element: HTMLElement, show: () => void, hide: () => void}} The part.
 */
export function goalsCard(app) {
  const { arm } = app;
  const running = h("ul", { class: "goals plain" });
  const list = h("ol", { class: "goals plain dim-rows" });
  /** @type {Map<number, {item: HTMLElement, update: (goal: GoalValue) => void}>} */
  let items = new Map();
  /** @type {ReturnType<typeof setInterval> | undefined} */
  let timer;

  function update() {
    const goals = Array.from(arm.goals.values());
    const open = goals.filter((goal) => !ENDED.has(goal.status));
    const kept = new Map();
    for (const goal of open) {
      const one = items.get(goal.goal) ?? runningGoal(app, goal);
      one.update(goal);
      kept.set(goal.goal, one);
    }
    if (kept.size !== items.size || open.some((goal) => !items.has(goal.goal))) {
      running.replaceChildren(...Array.from(kept.values(), ({ item }) => item));
    }
    items = kept;
    const ended = goals.filter((goal) => ENDED.has(goal.status)).slice(-LISTED).reverse();
    list.replaceChildren(...ended.map(endedGoal));
    none.hidden = open.length > 0;
    latest.hidden = ended.length === 0;
  }
  const latest = h("h3", { text: text("run.latest") });
  const none = h("p", { class: "dim", text: text("run.idle") });
  // Of an arm that does not answer it is not known that nothing runs.
  const known = () => setText(none, text(arm.link === "gone" ? "run.idle_unknown" : "run.idle"));

  /** Ask for the progress of the goal that runs: no event reports it. */
  function look() {
    for (const [number, { update: show }] of items) {
      app.ask({ kind: "get_goal", goal: number }).then((answer) => show(answer.goal), () => {});
    }
  }
  arm.follow(["goals", "reset"], update);
  arm.on("link", known);
  const element = card(text("run.goals"),
    h("div", { class: "row" }, pauseButtons(app), h("span", { class: "dim small", text: text("run.stop_code") }),
      copyButton(() => "robot.stop()")), none, running, latest, list);
  return {
    element,
    show: () => {
      clearInterval(timer);
      timer = setInterval(look, LOOK);
    },
    hide: () => clearInterval(timer),
  };
}

/**
 * @param {App} app
 * @param {GoalValue} goal
 */
function runningGoal(app, goal) {
  const id = `goal-${goal.goal}`;
  const bar = h("progress", { max: 1, "aria-labelledby": id });
  const words = h("span", { id });
  const cancel = button(text("run.cancel"), () => app.attempt(() => app.request({ kind: "cancel", goal: goal.goal })), {
    "aria-label": text("run.cancel_one", { name: goal.name }),
  });
  return {
    item: h("li", { class: "row" }, words, bar, cancel, copyButton(() => "motion = robot.unfold(wait=False)\nmotion.cancel()")),
    /** @param {GoalValue} now */
    update(now) {
      const { progress } = now;
      if (progress === null || Number.isNaN(progress)) bar.removeAttribute("value");
      else bar.value = progress;
      const share = progress === null || Number.isNaN(progress) ? "" : `${Math.round(100 * progress)} %`;
      setText(words, [now.name, share, now.duration ? duration(now.duration) : ""].filter(Boolean).join(" · "));
    },
  };
}

/** @param {GoalValue} goal */
function endedGoal(goal) {
  const tone = goal.status === "succeeded" ? "good" : goal.status === "failed" ? "danger" : "";
  const result = goal.failure ? readable(goal.failure.text) : goal.gripper ? gripperWords(goal.gripper) : "";
  return h("li", { class: "goal-ended" }, h("span", { class: `badge ${tone}`, text: text(`run.${goal.status}`) }), " ",
    h("span", { text: goal.name }), result ? h("span", { class: "dim", text: ` ${result}` }) : null);
}

/** @param {import("../../messages.d.ts").GripperValue} gripper */
function gripperWords({ position, stalled }) {
  return text(stalled ? "run.stalled" : "run.reached", { width: millimetres(position) });
}
