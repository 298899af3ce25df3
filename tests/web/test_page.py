"""The script of the status page, by node."""

from __future__ import annotations

import json
import shutil
import subprocess
from importlib.resources import files

import pytest

NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="needs node, to run the script of the page")
PAGE = """
const elements = {};
class Element {
  constructor() { this.children = []; this.className = ""; this.hidden = true; }
  set textContent(text) { this.text = text; }
  get textContent() { return this.text ?? ""; }
  append(...more) { this.children.push(...more); }
  appendChild(one) { this.children.push(one); return one; }
  prepend(one) { this.children.unshift(one); }
  replaceChildren(...more) { this.children = more; }
  get lastChild() { const all = this.children; return { remove: () => all.pop() }; }
}
const log = [];
const sockets = [];
globalThis.document = { title: "", createElement: () => new Element(),
  getElementById: (id) => (elements[id] ??= new Element()) };
globalThis.location = { hash: "#token=secret", pathname: "/", host: "arm:1", protocol: "http:" };
globalThis.history = { replaceState: (...given) => {
  location.hash = "";
  log.push(["replaced", given[2]]);
} };
globalThis.requestAnimationFrame = (draw) => setTimeout(draw, 0);
globalThis.fetch = async (path, options) => {
  log.push([options?.method ?? "GET", path, options?.body ?? "", location.hash]);
  return { ok: true, json: async () => ({ scope: "operate" }) };
};
globalThis.WebSocket = class {
  constructor(address) { this.address = address; this.sent = []; this.readyState = 1; this.kept(); }
  kept() { sockets.push(this); }
  send(text) { this.sent.push(JSON.parse(text)); }
};
let now = 0;
globalThis.performance = { now: () => now };
let ticking = null;
globalThis.setInterval = (call) => { ticking = call; };
const delays = [];
const wait = setTimeout;
globalThis.setTimeout = (call, delay) => { delays.push(delay); return wait(call, 0); };
const turn = () => new Promise((done) => wait(done, 5));
"""


SCRIPT = files("bioscara.web").joinpath("page", "page.js").read_text("utf-8")


def evaluate(expression: str) -> object:
    """Return the value of an expression with the functions of the page."""
    return _run(f"{SCRIPT}\nconsole.log(JSON.stringify({expression}));")


def page(program: str, expression: str) -> object:
    """Run the page with a document of its own and a program; return the value of an expression."""
    script = SCRIPT.replace('typeof module !== "undefined"', "false")
    last = f"console.log(JSON.stringify({expression}));"
    return _run(f"{PAGE}\n{script}\n(async () => {{ await turn(); {program} {last} }})();")


def _run(program: str) -> object:
    assert NODE is not None
    words = [NODE, "--input-type=commonjs", "-"]
    done = subprocess.run(words, input=program, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Schütz j1", "Schütz j1"),
        ("a\nb", "a\\u{a}b"),
        ("\x1b[2J", "\\u{1b}[2J"),
        ("\u202eevil", "\\u{202e}evil"),
        ("a\u2028b\u200b", "a\\u{2028}b\\u{200b}"),
        ("<b>&amp;", "<b>&amp;"),
    ],
)
def test_names_are_shown_with_what_does_not_print_as_its_code(text: str, shown: str) -> None:
    assert evaluate(f"printable({json.dumps(text)})") == shown


def test_numbers_are_shown_in_degrees_and_millimetres() -> None:
    calls = "[shown(Math.PI, false, ''), shown(0.1234, true, '/s'), shown(null, true, '')]"
    assert evaluate(calls) == ["180.00 °", "123.40 mm/s", "unknown"]
    assert evaluate("[-1e-9, -0.1, 0].map((value) => number(value, 1, 1, 'm'))") == [
        "0.0 m",
        "-0.1 m",
        "0.0 m",
    ]


def test_the_token_leaves_the_address_before_it_is_sent_once() -> None:
    assert page("", "[log, sockets[0].address]") == [
        [
            ["replaced", "/"],
            ["POST", "session", '{"token":"secret"}', ""],
            ["GET", "session", "", ""],
        ],
        "ws://arm:1/ws",
    ]


STATE = {
    "kind": "state",
    "cycle": 7,
    "names": ["j1", "j\x1b2"],
    "positions": [1.0, 0.5],
    "velocities": [0.0, None],
    "commands": [1.0, None],
    "qualities": [0, 3],
    "pose": None,
    "width": None,
    "enabled": True,
    "fault": "clear",
    "paused": False,
    "speed_override": 1.0,
    "moving": ["home()"],
    "stale": False,
}
DESCRIPTION = {
    "kind": "description",
    "parameters": {"joints": [{"name": "j1", "unit": "rad"}, {"name": "j\x1b2", "unit": "m"}]},
}
WELCOME = {"kind": "welcome", "instance": "a", "last_event": 40, "owner": "left", "arm": "sim"}


def receive(*messages: object) -> str:
    """Return a program that lets the page receive messages."""
    sent = json.dumps([json.dumps(message) for message in messages])
    return f"for (const data of {sent}) sockets.at(-1).onmessage({{ data }}); await turn();"


def close(reason: str) -> str:
    """Return a program that closes the page's connection, and waits for the next one."""
    return f"sockets.at(-1).onclose({{ reason: {json.dumps(reason)} }}); await turn();"


def test_it_shows_the_newest_sample() -> None:
    response = {"kind": "response", "id": 1, "result": DESCRIPTION}
    older = {**STATE, "cycle": 6, "positions": [9.0, 9.0]}
    sent, rows, disabled, link = page(  # type: ignore[misc]
        "sockets[0].onopen();" + receive(WELCOME, response, older, STATE),
        "[sockets[0].sent.map((each) => each.command?.kind ?? each.kind),"
        "elements.joints.children.map((row) => row.children.map((cell) => cell.text)),"
        "elements.stop.disabled, elements.link.text]",
    )
    assert sent == ["hello", "get_description", "get_lease", "subscribe"]
    assert rows == [
        ["j1", "57.30 °", "0.00 °/s", "57.30 °", "fresh"],
        ["j\\u{1b}2", "500.00 mm", "unknown", "unknown", "unknown"],
    ]
    assert (disabled, link) == (False, "live")


def test_it_connects_again_and_asks_for_the_events_that_it_missed() -> None:
    event = {"kind": "event", "number": 41, "wall": 0.0, "text": "a\nb"}
    said, waited, after, shown, link = page(  # type: ignore[misc]
        receive(WELCOME, event)
        + close("the owner of arm left has ended")
        + "const said = [elements.message.text, elements.stop.disabled, elements.link.text];"
        + close("")
        + receive(WELCOME),
        "[said, delays, sockets[2].sent.at(-1).command.events_after,"
        "elements.events.children[0].text, elements.link.text]",
    )
    assert said == ["the owner of arm left has ended", False, "connecting"]
    assert waited == [500, 1000]
    assert after == 41
    assert shown.endswith("a\\u{a}b")
    assert link == "connected"


def test_after_a_restart_of_the_owner_it_asks_for_the_latest_events() -> None:
    event = {"kind": "event", "number": 41, "wall": 0.0, "text": "a"}
    again = {**WELCOME, "instance": "b", "last_event": 1234}
    program = receive(WELCOME, event) + close("") + receive(again)
    after = "[...sockets.map((each) => each.sent.at(-1).command.events_after),"
    assert page(program, after + "elements.events.children.length]") == [0, 1134, 0]


def test_after_a_sign_out_it_does_not_connect_again() -> None:
    assert page(receive(WELCOME) + close("signed out"), "sockets.length") == 1


def test_it_shows_who_commands() -> None:
    lease = {"client": "hand\n", "epoch": 1, "remaining": 1.0}
    answer = {"kind": "response", "id": 2, "result": {"kind": "lease_state", "lease": lease}}
    ended = {"kind": "event", "number": 41, "wall": 0.0, "text": "a"}
    program = receive(WELCOME, answer, STATE)
    holder = "elements.facts.children[7].text"
    assert page(program, holder) == "hand\\u{a}"
    program += receive({**ended, "lease": {**lease, "client": None}}, STATE)
    assert page(program, holder) == "nobody"


def test_silence_is_said_until_a_sample_arrives() -> None:
    program = receive(WELCOME, STATE) + "const seen = [elements.link.text]; now += 3000; ticking();"
    program += "seen.push(elements.link.text);" + receive(STATE)
    program += "ticking(); seen.push(elements.link.text);"
    assert page(program, "seen") == ["live", "no data for 3 s", "live"]


def test_stop_sends_a_stop() -> None:
    program = receive(WELCOME) + "elements.stop.onclick();"
    assert page(program, "sockets[0].sent.at(-1).command") == {"kind": "stop"}


def test_without_a_connection_stop_goes_by_http_and_a_failure_is_said() -> None:
    program = receive(WELCOME) + "sockets[0].readyState = 3; await elements.stop.onclick();"
    program += "const said = [elements.message.text]; const sent = log.at(-1).slice(0, 2);"
    program += "globalThis.fetch = async () => { throw new Error('no network'); };"
    program += "await elements.stop.onclick(); said.push(elements.message.text);"
    assert page(program, "[sent, said]") == [
        ["POST", "api/stop"],
        ["stopped", "STOP did not arrive: no network"],
    ]
