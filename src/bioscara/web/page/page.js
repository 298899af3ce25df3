"use strict";
// The status page: signs in with the token of the address, then shows what the owner sends.

const VERSION = 1;
const PERIOD = 0.05; // least time between two samples [s]
const EVENTS = 100; // events that are shown
const SILENCE = 1000; // time without a sample after which that is said [ms]
const OPEN = 1; // state of an open WebSocket
const QUALITIES = ["fresh", "stale", "assumed", "unknown"];

// Names come from other people and files: what does not print is shown as its code.
function printable(text) {
  return String(text).replace(
    /[\p{C}\p{Zl}\p{Zp}]/gu,
    (character) => "\\u{" + character.codePointAt(0).toString(16) + "}",
  );
}

// A number that is unknown is null.
function number(value, factor, digits, unit) {
  if (value === null || value === undefined) return "unknown";
  return (value * factor).toFixed(digits).replace(/^-(?=[0.]*$)/, "") + " " + unit;
}

// A position, or with a suffix a velocity, of a joint.
function shown(value, linear, suffix) {
  return linear ? number(value, 1e3, 2, "mm" + suffix) : number(value, 180 / Math.PI, 2, "\u00b0" + suffix);
}

// Waits 0.5 s, then longer each time, at most 10 s.
function pause(attempt) {
  return Math.min(500 * 2 ** attempt, 10000);
}

if (typeof module !== "undefined") {
  module.exports = { printable, number, shown, pause };
} else {
  start();
}

function start() {
  const at = (id) => document.getElementById(id);
  const session = crypto.getRandomValues(new Uint8Array(16)).reduce((text, byte) => text + byte.toString(16).padStart(2, "0"), "");
  let socket = null, attempt = 0, last = 0, request = 0, instance = "", linear = new Set(), cells = [], drawn = null, heard = 0, holder = null;

  function say(text) {
    at("message").textContent = printable(text);
    at("message").hidden = !text;
  }

  function badge(text, kind) {
    at("link").textContent = text;
    at("link").className = "badge " + kind;
  }

  function send(command) {
    request += 1;
    socket.send(JSON.stringify({ kind: "request", id: request, command }));
    return request;
  }

  async function signIn() {
    const token = new URLSearchParams(location.hash.slice(1)).get("token");
    if (token) {
      // Removed at once: it must not stay in the history.
      history.replaceState(null, "", location.pathname);
      const answer = await fetch("session", {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify({ token }),
      });
      if (!answer.ok) throw new Error((await answer.json()).text);
    }
    const scope = (await (await fetch("session")).json()).scope;
    if (!scope) throw new Error("not signed in: open the address that 'bioscara web' printed, or one with #token= and a token of its file");
    return scope;
  }

  function connect() {
    badge("connecting", "");
    const address = (location.protocol === "https:" ? "wss://" : "ws://") + location.host + "/ws";
    socket = new WebSocket(address);
    socket.onopen = () => socket.send(JSON.stringify({ kind: "hello", version: VERSION, client: "status page", session }));
    socket.onmessage = (message) => receive(JSON.parse(message.data));
    socket.onclose = (closed) => {
      badge("not connected", "broken");
      say(closed.reason || "the connection is broken");
      const over = closed.reason.includes("sign");
      if (!over) setTimeout(connect, pause(attempt++));
    };
  }

  function receive(message) {
    switch (message.kind) {
      case "welcome":
        attempt = 0;
        say("");
        badge("connected", "");
        heard = performance.now();
        if (message.instance !== instance) {
          // Another run of the owner counts its requests and events anew.
          at("events").replaceChildren();
          instance = message.instance;
          last = Math.max(message.last_event - EVENTS, 0);
        }
        at("title").textContent = printable(message.owner + ": " + message.arm);
        document.title = printable(message.owner) + " - Bioscara";
        send({ kind: "get_description" });
        send({ kind: "get_lease" });
        send({ kind: "subscribe", states: true, period: PERIOD, events_after: last });
        break;
      case "response":
        if (message.result.kind === "description") {
          linear = new Set(message.result.parameters.joints.filter((joint) => joint.unit === "m").map((joint) => joint.name));
        }
        if (message.result.kind === "lease_state") holder = message.result.lease.client;
        break;
      case "refusal":
        say(message.failure.text);
        break;
      case "state":
        heard = performance.now();
        badge("live", "live");
        // Drawn once for each frame of the screen: the newest one.
        if (drawn === null) requestAnimationFrame(() => { const newest = drawn; drawn = null; draw(newest); });
        drawn = message;
        break;
      case "event":
        last = message.number;
        if (message.lease) holder = message.lease.client;
        note(message);
        break;
    }
  }

  function note(event) {
    const line = document.createElement("li");
    line.textContent = new Date(event.wall * 1e3).toLocaleTimeString() + "  " + printable(event.text);
    at("events").prepend(line);
    while (at("events").children.length > EVENTS) at("events").lastChild.remove();
  }

  function draw(state) {
    if (cells.length !== state.names.length) {
      cells = state.names.map(() => {
        const row = document.createElement("tr");
        const made = [0, 1, 2, 3, 4].map(() => row.appendChild(document.createElement("td")));
        at("joints").append(row);
        return made;
      });
    }
    state.names.forEach((name, index) => {
      const straight = linear.has(name);
      const texts = [
        printable(name),
        shown(state.stale ? null : state.positions[index], straight, ""),
        shown(state.stale ? null : state.velocities[index], straight, "/s"),
        shown(state.commands[index], straight, ""),
        QUALITIES[state.qualities[index]],
      ];
      texts.forEach((text, column) => { cells[index][column].textContent = text; });
    });
    facts({
      motors: state.enabled ? "enabled" : "disabled",
      faults: state.fault,
      motion: state.paused ? "paused" : state.moving.join(", ") || "at rest",
      "commanded by": holder ?? "nobody",
      tool: state.pose ? state.pose.slice(0, 3).map((value) => number(value, 1e3, 1, "mm")).join(", ") + ", yaw " + shown(state.pose[3], false, "") : "unknown until all joints are homed",
      jaws: number(state.width, 1e3, 1, "mm"),
      speed: number(state.speed_override, 100, 0, "%"),
      cycle: String(state.cycle),
    });
  }

  function facts(values) {
    const list = at("facts");
    const wanted = Object.entries(values);
    if (list.children.length !== 2 * wanted.length) {
      list.replaceChildren(...wanted.flatMap(([name]) => {
        const term = document.createElement("dt");
        term.textContent = name;
        return [term, document.createElement("dd")];
      }));
    }
    wanted.forEach(([, value], index) => { list.children[2 * index + 1].textContent = printable(value); });
  }

  // What is shown may be old: that is said after a second.
  function watch() {
    const silence = performance.now() - heard;
    if (socket?.readyState === OPEN && silence > SILENCE) badge("no data for " + Math.round(silence / 1e3) + " s", "broken");
  }

  // Without a WebSocket by HTTP: a STOP is tried whenever it is asked for.
  async function stop() {
    if (socket?.readyState === OPEN) {
      send({ kind: "stop" });
      return;
    }
    try {
      const answer = await fetch("api/stop", { method: "POST" });
      say(answer.ok ? "stopped" : "STOP was refused: " + (await answer.json()).text);
    } catch (error) {
      say("STOP did not arrive: " + error.message);
    }
  }

  at("stop").onclick = stop;
  setInterval(watch, SILENCE / 2);
  signIn().then(
    (scope) => { badge(scope, ""); at("stop").disabled = false; connect(); },
    (error) => { badge("not connected", "broken"); say(error.message); },
  );
}
