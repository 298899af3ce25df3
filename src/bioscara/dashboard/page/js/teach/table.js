// The teach table: named poses, frames, tools. A change replaces it, with the revision that it applies to.

/** @import { App } from "../app.js" */
/** @import { Frame, NamedPose, TeachTable, Tool } from "../../messages.d.ts" */

import { ActionError } from "../app.js";
import { RequestError } from "../connection.js";
import { text } from "../texts.js";

/** Error of the owner for a change of another table than the present one. */
const CONFLICT = "ConflictError";
/** Time in which a changed workspace has to be known here [ms]. */
const KNOWN = 3000;

/** The table as the owner has it. */
export class Table {
  /** @param {App} app The page. */
  constructor(app) {
    this.app = app;
  }

  /** @returns {TeachTable | null} */
  get table() {
    return this.app.arm.workspace?.table ?? null;
  }

  /** @returns {NamedPose[]} */
  get poses() {
    return this.table?.poses ?? [];
  }

  /** @returns {Frame[]} */
  get frames() {
    return this.table?.frames ?? [];
  }

  /** @returns {Tool[]} */
  get tools() {
    return this.table ? [this.table.fingers, ...(this.table.tools ?? [])] : [];
  }

  /**
   * Return the pose of a name.
   *
   * @param {string} name Its name.
   */
  pose(name) {
    return this.poses.find((pose) => pose.name === name);
  }

  /**
   * Save a pose; it replaces that of its name at its place in the list.
   *
   * @param {NamedPose} pose The pose.
   * @param {string} [former] Name of the pose that it replaces; by default its own.
   */
  savePose(pose, former = pose.name) {
    return this.change((table) => ({ ...table, poses: replaced(table.poses ?? [], pose, former) }));
  }

  /** @param {string} name */
  deletePose(name) {
    return this.change((table) => ({ ...table, poses: (table.poses ?? []).filter((pose) => pose.name !== name) }));
  }

  /** @param {Frame} frame */
  saveFrame(frame) {
    return this.change((table) => ({ ...table, frames: replaced(table.frames ?? [], frame, frame.name) }));
  }

  /** @param {string} name */
  deleteFrame(name) {
    return this.change((table) => ({ ...table, frames: (table.frames ?? []).filter((frame) => frame.name !== name) }));
  }

  /**
   * Change the table; another client that was faster is named.
   *
   * @param {(table: TeachTable) => TeachTable} make Returns the new table.
   * @throws {RequestError} The owner refuses it.
   */
  async change(make) {
    const { arm } = this.app;
    const { workspace } = arm;
    if (!workspace) throw new ActionError(text("teach.unknown_table"));
    const { revision } = workspace;
    try {
      const goal = await this.app.start({ kind: "set_table", table: make(workspace.table), revision });
      const { failure } = await this.app.ended(goal.goal);
      if (failure) throw new RequestError(failure);
    } catch (error) {
      throw error instanceof RequestError ? this.#explained(error) : error;
    }
    await this.#known(revision);
  }

  /** @param {RequestError} error */
  #explained(error) {
    if (error.failure.error !== CONFLICT) return error;
    this.app.arm.refreshWorkspace();
    const faster = this.app.arm.events.findLast((event) => event.what === "workspace");
    const who = faster?.client || text("teach.another");
    return new ActionError(text("teach.conflict", { who }));
  }

  /**
   * Wait until the changed workspace is known here, so that the next change applies to it.
   *
   * @param {number} revision Revision before the change.
   */
  #known(revision) {
    const { arm } = this.app;
    return new Promise((resolve) => {
      const end = () => {
        forget();
        clearTimeout(timer);
        resolve(undefined);
      };
      const timer = setTimeout(end, KNOWN);
      const forget = arm.on("workspace", () => {
        if (arm.workspace?.revision !== revision) end();
      });
      if (arm.workspace?.revision !== revision) end();
    });
  }
}

/**
 * @template {{name: string}} T
 * @param {T[]} entries
 * @param {T} entry
 * @param {string} former
 * @returns {T[]}
 */
function replaced(entries, entry, former) {
  const at = entries.findIndex(({ name }) => name === former);
  return at < 0 ? [...entries, entry] : entries.with(at, entry);
}
