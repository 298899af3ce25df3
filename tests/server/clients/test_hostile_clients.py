"""Clients that send anything, or read nothing: others go on, and the control loop too."""

from __future__ import annotations

import grp
import io
import itertools
import json
import os
import random
import re
import socket
import struct
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.api import framing, messages as m
from bioscara.api.failures import error_of
from bioscara.api.gateway_pages import Announcement
from bioscara.api.runtime import VARIABLE, find
from bioscara.cli import main
from bioscara.errors import (
    AccessError,
    BusyOwnerError,
    ConfigurationError,
    InvalidArgumentError,
    ProtocolError,
)
from bioscara.robot import tasks
from bioscara.server.clients import connection, crowd
from bioscara.server.clients.client import Later
from bioscara.server.serve import Served
from bioscara.web.access.certificates import self_signed
from bioscara.web.access.tokens import default_path, load_tokens
from programs import LIMIT
from served import (
    NAME,
    RawClient,
    arm_served,
    events_since,
    eventually,
    good_client_works,
    memory_of,
)

pytestmark = pytest.mark.thorough

LATE = 0.1
"""Delay of a control cycle that no client may cause [s]; joints count on setpoints for longer."""
OTHER_USER = 65534


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    # In real time: whether the control loop is on time then shows.
    with arm_served(speed=1.0) as served:
        yield served


@pytest.fixture
def served(arm: Served) -> Iterator[Served]:
    """Require after each test that others can work, and that the loop was on time."""
    times: list[float] = []
    loop, robot = arm.robot.runner.arm.stack.loop, arm.robot
    overruns = loop.statistics.overruns

    def observe(_: object) -> None:
        times.append(time.monotonic())

    robot.runner.observers = (*robot.runner.observers, observe)
    eventually(lambda: len(times) > 5)
    yield arm
    gaps = [b - a for a, b in itertools.pairwise(times)]
    robot.runner.observers = tuple(each for each in robot.runner.observers if each is not observe)
    assert max(gaps) < loop.period + LATE
    assert loop.statistics.overruns == overruns
    assert robot.faults == ()
    with RawClient("cleaner") as cleaner:
        epoch = cleaner.acquire(force=True)
        cleaner.request(m.StopAll())
        cleaner.request(m.ReleaseLease(), epoch)
    eventually(lambda: not robot.is_moving)
    good_client_works()


def framed(data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + data


def refusal(client: RawClient) -> Exception:
    """Return the reason for which the owner ends the connection."""
    message = client.read(m.RequestFailed)
    assert message.id is None
    assert client.ended()
    return error_of(message.failure)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.usefixtures("served")
def test_garbage_ends_its_connection_alone(seed: int) -> None:
    with RawClient(greet=False) as client:
        client.send_bytes(framed(bytes([0xC1, seed]) + os.urandom(200)))
        assert isinstance(refusal(client), ProtocolError)
    with RawClient() as client:
        client.send_bytes(framed(bytes([0xC1, seed]) + os.urandom(200)))
        assert isinstance(refusal(client), ProtocolError)


@pytest.mark.usefixtures("served")
def test_nothing_after_the_message_that_cut_a_client_off_is_carried_out(arm: Served) -> None:
    events = arm.owner.events.last
    hello = m.ClientHello(version=m.VERSION, client="late", session="late")
    with RawClient(greet=False) as client:
        client.send_bytes(
            framed(b"\xc1")
            + framing.packed(hello)
            + framing.packed(m.ClientRequest(id=1, command=m.Pause()))
        )
        assert isinstance(refusal(client), ProtocolError)
    assert not arm.robot.runner.arm.paused
    assert all(event.client != "late" for event in events_since(arm, events))


@pytest.mark.usefixtures("served")
def test_half_a_message_and_silence_is_cut_off_in_time() -> None:
    with RawClient(greet=False) as client:
        client.send_bytes(struct.pack(">I", 200) + b"half")
        begin = time.monotonic()
        assert client.ended()
        assert 3.0 < time.monotonic() - begin < 8.0


@pytest.mark.parametrize("size", [(1 << 31) - 1, (1 << 32) - 1, framing.REQUEST_MAX + 1])
def test_the_announcement_of_a_huge_message_takes_no_memory(served: Served, size: int) -> None:
    with RawClient("look") as look:
        before = memory_of(look)
        for greet in (False, True):
            with RawClient(greet=greet) as client:
                client.send_bytes(struct.pack(">I", size))
                assert "is announced" in str(refusal(client))
        assert memory_of(look) - before < 4 << 20
    assert served.robot.is_homed


@pytest.mark.usefixtures("served")
def test_a_message_that_takes_long_to_read_is_refused_also_of_the_client_that_commands() -> None:
    with RawClient() as client:
        epoch = client.acquire()
        text = "x" * (framing.REQUEST_MAX - 200)
        with pytest.raises(InvalidArgumentError):
            client.request(m.Start(task=tasks.MoveNamed(name=text)), epoch)
        client.send_bytes(struct.pack(">I", framing.REQUEST_MAX + 1))
        assert "is announced" in str(refusal(client))


@pytest.mark.usefixtures("served")
def test_before_hello_only_little_is_accepted() -> None:
    with RawClient(greet=False) as client:
        client.send_bytes(struct.pack(">I", framing.HELLO_MAX + 1))
        assert isinstance(refusal(client), ProtocolError)


@pytest.mark.parametrize("depth", [100, 5_000, 100_000])
@pytest.mark.usefixtures("served")
def test_nested_bombs_are_refused(depth: int) -> None:
    packed = b"\x91" * depth + b"\x01"
    with RawClient() as client:
        client.send_bytes(framed(packed))
        assert isinstance(refusal(client), InvalidArgumentError | ProtocolError)
    text = b'{"kind":"request","id":7,"command":' + b"[" * depth + b"]" * depth + b"}"
    with JsonClient() as other:
        other.send(text)
        answer = other.read()
        assert answer["kind"] == "refusal"
    with RawClient() as client:
        epoch = client.acquire()
        nested: dict[str, object] = {}
        for _ in range(min(depth, 400)):
            nested = {"a": nested}
        kind = "forward_command_controller/ForwardCommandController"
        command = m.LoadController(name="x", type=kind, parameters=nested)
        with pytest.raises(ConfigurationError, match="x: a is not a known parameter"):
            client.request(command, epoch)


class JsonClient:
    """A client that speaks JSON."""

    def __init__(self, hello: bytes | None = None) -> None:
        self.frames = framing.MessageSplitter(framing.ANSWER_MAX)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(LIMIT)
        self.socket.connect(os.fspath(api_socket()))
        text = {"kind": "hello", "version": m.VERSION, "client": "json", "session": "json"}
        self.send(json.dumps(text).encode() if hello is None else hello)
        self.welcome = self.read()

    def __enter__(self) -> JsonClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, text: bytes) -> None:
        self.socket.sendall(framed(text))

    def read(self) -> dict[str, object]:
        while (payload := next(self.frames.feed(b""), None)) is None:
            data = self.socket.recv(1 << 16)
            if not data:
                raise EOFError
            payload = next(self.frames.feed(data), None)
            if payload is not None:
                break
        message = json.loads(payload)
        assert isinstance(message, dict)
        return message


def api_socket() -> Path:
    return find(NAME).socket


@pytest.mark.usefixtures("served")
def test_json_is_answered_in_json() -> None:
    with JsonClient() as client:
        assert client.welcome["kind"] == "welcome"
        client.send(b'{"kind":"request","id":3,"command":{"kind":"get_state"}}')
        answer = client.read()
        assert answer["id"] == 3
        result = answer["result"]
        assert isinstance(result, dict)
        assert result["kind"] == "state"
        for text, number in (
            (b'{"kind":"request","id":4,"command":{"kind":"fly"}}', 4),
            (b'{"kind":"request","id":5,"command":{"kind":"get_goal"}}', 5),
            (b'{"kind":"request","id":6,"command":{"kind":"get_goal","goal":"x"}}', 6),
            (b'{"kind":"request","id":7,"command":{"kind":"get_state","more":1}}', 7),
        ):
            client.send(text)
            answer = client.read()
            assert (answer["kind"], answer["id"]) == ("refusal", number)
        client.send(b'{"kind":"request","id":1' + b"0" * 400 + b',"command":{"kind":"fly"}}')
        assert client.read()["kind"] == "refusal"
    for text in (b"{", b'{"kind":"hello"}', b'{"kind":"hello","version":1,"client":"\\ud800"}'):
        with JsonClient(text) as client:
            assert client.welcome["kind"] == "refusal"


@pytest.mark.usefixtures("served")
def test_an_unknown_request_is_answered_and_the_connection_stays() -> None:
    with RawClient() as client:
        for number, command in enumerate(
            (
                {"kind": "fly"},
                {"kind": "start"},
                {"kind": "start", "task": {"kind": "dance"}},
                {"kind": "get_goal", "goal": 1.5},
                {"kind": "start", "task": {"kind": "move_named", "name": 3}},
                {
                    "kind": "start",
                    "task": {"kind": "attach", "load": {"name": "", "shape": {"corners": []}}},
                },
            ),
            start=1,
        ):
            client.send({"kind": "request", "id": number, "command": command})
            answer = client.answer(number)
            assert isinstance(answer, m.RequestFailed)
            assert answer.failure.error == "InvalidArgumentError"
        assert isinstance(client.answer(client.begin(m.GetLease(), number=99)), m.Response)


@pytest.mark.usefixtures("served")
def test_hello_has_rules() -> None:
    with RawClient() as client:
        client.send(m.ClientHello(version=m.VERSION, client="a", session="b"))
        assert "hello came twice" in str(refusal(client))
    with RawClient(greet=False) as client:
        client.send(m.ClientHello(version=99, client="a", session="b"))
        assert "version" in str(refusal(client))
    with RawClient(greet=False) as client:
        client.begin(m.GetState())
        assert "before hello" in str(refusal(client))
    for name, session in (("", "b"), ("a", ""), ("a" * 65, "b"), ("a", "b" * 65)):
        with RawClient(greet=False) as client:
            client.send(m.ClientHello(version=m.VERSION, client=name, session=session))
            assert "names of 1 to 64 characters" in str(refusal(client))


def test_control_characters_of_a_name_are_not_passed_on(served: Served) -> None:
    first = served.owner.events.last
    with RawClient("\x1b[2J\r\nforged: line\x00") as client:
        client.request(m.Pause())
        client.request(m.Resume(), client.acquire())
    for event in events_since(served, first):
        assert event.text.isprintable()
        assert event.client.isprintable()


@pytest.mark.realtime
@pytest.mark.parametrize("command", [m.GetState(), m.ListControllers(), m.GetDescription()])
def test_thousands_of_requests_without_reading_delay_no_other_client(
    served: Served, command: m.AnyCommand
) -> None:
    with RawClient("look") as look, RawClient("flood") as flood:
        before = memory_of(look)
        flood.socket.settimeout(0.5)
        longest = 0.0
        try:
            for number in range(0, 10_000, 500):
                block = b"".join(
                    framing.packed(m.ClientRequest(id=number + k + 1, command=command))
                    for k in range(500)
                )
                flood.send_bytes(block)
                begin = time.monotonic()
                look.request(m.GetLease())
                longest = max(longest, time.monotonic() - begin)
        except (TimeoutError, BrokenPipeError, ConnectionResetError):
            pass
        assert longest < 0.5
        assert memory_of(look) - before < 64 << 20
    assert served.robot.is_homed


def test_answers_to_queries_are_not_kept(served: Served) -> None:
    with RawClient("hungry") as client:
        for _ in range(50):
            client.request(m.ListControllers())
        before = memory_of(client)
        for _ in range(600):
            client.request(m.ListControllers())
        assert memory_of(client) - before < 2 << 20
    assert served.robot.is_homed


@pytest.mark.thorough
def test_a_subscriber_that_never_reads_takes_little_memory_and_is_cut_off(served: Served) -> None:
    with RawClient("look") as look, RawClient("deaf") as deaf, RawClient("noisy") as noisy:
        deaf.begin(m.Subscribe(states=True, events_after=0))
        before, begin = memory_of(look), time.monotonic()
        while time.monotonic() < begin + connection.DEAF + 2.0:
            noisy.request(m.Pause())
            time.sleep(2e-3)
        noisy.request(m.StopAll())
        assert memory_of(look) - before < 16 << 20
        with suppress(EOFError, ConnectionResetError):
            while time.monotonic() < begin + LIMIT:
                deaf.read(m.Event)
        assert deaf.ended()
        numbers = [event.number for event in deaf.events]
        # As a program that was suspended, it connects again and gets the rest, without a gap.
        with RawClient("deaf", deaf.session) as again:
            last = served.owner.events.last
            again.begin(m.Subscribe(events_after=numbers[-1]))
            while not again.events or again.events[-1].number < last:
                again.read(m.Event)
        numbers += [event.number for event in again.events]
        assert numbers[: last - numbers[0] + 1] == list(range(numbers[0], last + 1))


@pytest.mark.thorough
def test_a_subscriber_that_reads_a_little_at_a_time_is_not_cut_off(served: Served) -> None:
    with RawClient("slow") as slow:
        slow.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.begin(m.GetHistory(begin=0.0, points=5000))
        slow.begin(m.Subscribe(states=True, events_after=0))
        begin = time.monotonic()
        while time.monotonic() < begin + connection.DEAF + 1.0:
            assert slow.socket.recv(100)
            time.sleep(0.05)


@pytest.mark.usefixtures("served")
def test_events_that_are_not_kept_are_reported_as_a_gap(arm: Served) -> None:
    with RawClient() as client:
        client.begin(m.Subscribe(events_after=-5))
        client.read(m.Event)
        first = client.events[0]
        assert (first.what == "gap") == (arm.owner.events._kept[0].number > 1)
        assert first.number >= 1


def test_requests_in_work_are_limited_and_a_stop_never_waits(served: Served) -> None:
    plan = m.MakePlan(tasks.MoveNamed(name="center"))
    with RawClient("planner") as client, RawClient("commander") as commander:
        numbers = [client.begin(plan) for _ in range(200)]
        begin = time.monotonic()
        epoch = commander.acquire()
        task = tasks.MoveRelative(z=0.001)
        accepted = commander.request(m.Start(task=task), epoch)
        assert isinstance(accepted, m.Accepted)
        commander.request(m.StopAll())
        assert time.monotonic() - begin < 2.0
        client.request(m.StopAll())
        answers = [client.answer(number) for number in numbers]
        refused = [each for each in answers if isinstance(each, m.RequestFailed)]
        assert 0 < len(refused) < 200
        assert {each.failure.error for each in refused} == {"BusyOwnerError"}
        eventually(lambda: not served.robot.is_moving)


@pytest.mark.parametrize("command", [m.GetParameters(), m.GetJoints()])
def test_whatever_is_answered_later_is_limited(
    command: m.AnyCommand, served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = threading.Event()
    later = Later(go_on.wait, lambda _: m.Done())
    handlers = {**served.owner._handlers, type(command): lambda *_: later}
    monkeypatch.setattr(served.owner, "_handlers", handlers)
    with RawClient("asker") as client:
        numbers = [client.begin(command) for _ in range(connection.PENDING + 10)]
        # Answered at once, and after all that came before.
        client.request(m.GetLease())
        early = set(client._answers)
        go_on.set()
        assert early == set(numbers[connection.PENDING :])
        for number in numbers:
            answer = client.answer(number)
            if number in early:
                assert isinstance(answer, m.RequestFailed)
                assert answer.failure.error == "BusyOwnerError"
            else:
                assert isinstance(answer, m.Response)


@pytest.mark.usefixtures("served")
def test_a_request_that_came_before_is_not_carried_out_again(arm: Served) -> None:
    with RawClient("twice") as client:
        epoch = client.acquire()
        goals = arm.owner.goals.last
        number = client.begin(m.Start(task=tasks.MoveRelative(z=0.001)), epoch)
        first = client.answer(number)
        for _ in range(3):
            again = client.answer(client.begin(m.Start(task=tasks.Home()), epoch, number))
            assert again == first
        assert arm.owner.goals.last == goals + 1
        for _ in range(connection.ANSWERS + 10):
            client.begin(m.SetSpeedOverride(1.0), epoch, number := number + 1)
            client.answer(number)
        old = client.answer(client.begin(m.Start(task=tasks.Home()), epoch, 2))
        client.number = number
        assert isinstance(old, m.RequestFailed)
        assert "long ago" in old.failure.text
        assert arm.owner.goals.last == goals + 1
        client.request(m.ReleaseLease(), epoch)


@pytest.mark.usefixtures("served")
def test_a_session_with_a_connection_is_not_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection, "SESSIONS", 4)
    with RawClient("here", "long-lived") as client:
        number = client.begin(m.Pause())
        client.answer(number)
        for count in range(10):
            with RawClient("short", f"short-{count}"):
                pass
        with RawClient("here", "long-lived") as again:
            assert again.welcome.resumed
            recalled = again.answer(again.begin(m.Recall(number), number=50))
            assert isinstance(recalled, m.Response)
            assert isinstance(recalled.result, m.Done)
            again.request(m.StopAll())


@pytest.mark.usefixtures("served")
def test_a_program_with_too_many_connections_may_still_stop() -> None:
    clients: list[RawClient] = []
    try:
        for _ in range(crowd.EACH + crowd.RESERVED + 20):
            clients.append(RawClient("leaking"))
        newest = clients[-1]
        with pytest.raises(BusyOwnerError, match="only STOP is carried out"):
            newest.request(m.GetState())
        newest.request(m.StopAll())
        # The oldest that may only send STOP gave their places up.
        assert clients[crowd.EACH].ended()
        clients[crowd.EACH - 1].request(m.GetState())
        with JsonClient() as other:
            other.send(b'{"kind":"request","id":1,"command":{"kind":"get_state"}}')
            assert "only STOP" in str(other.read())
            other.send(b'{"kind":"request","id":2,"command":{"kind":"stop"}}')
            assert other.read()["kind"] == "response"
        with pytest.raises(BusyOwnerError, match="clients"):
            Robot.connect(f"arm:{NAME}").open()
    finally:
        for client in clients:
            client.socket.close()
    eventually(can_connect)


def can_connect() -> bool:
    with RawClient() as client, suppress(BusyOwnerError):
        client.request(m.GetState())
        return True
    return False


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be another user")
@pytest.mark.usefixtures("served")
def test_another_user_is_refused() -> None:
    path = api_socket()
    modes = [(each, each.stat().st_mode & 0o777) for each in (path.parent, path)]
    try:
        # To see the owner's own check behind that of the files.
        path.parent.chmod(0o755)
        path.chmod(0o666)
        assert as_user(OTHER_USER, OTHER_USER, lambda: greeted(path)) == AccessError.__name__
        assert as_user(0, 0, lambda: greeted(path)) == "welcome"
    finally:
        for each, mode in modes:
            each.chmod(mode)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be another user")
def test_members_of_the_group_find_the_owner_and_others_are_refused() -> None:
    with arm_served(group=grp.getgrgid(OTHER_USER).gr_name):
        assert as_user(OTHER_USER, OTHER_USER, greeted) == "welcome"
        assert as_user(12345, 12345, greeted) != "welcome"


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be another user")
def test_members_of_the_group_stop_the_arms_of_the_computer_and_others_learn_why_not() -> None:
    with arm_served(group=grp.getgrgid(OTHER_USER).gr_name) as served:
        last = served.owner.events.last
        assert as_user(OTHER_USER, OTHER_USER, said("stop")) == "0 left was stopped\n"
        assert any(event.what == "stop" for event in events_since(served, last))
        assert re.search("^left +sim ", as_user(OTHER_USER, OTHER_USER, said("arms")), re.M)
        for words in (["stop"], ["stop", NAME], ["arms"], ["status"], ["home"]):
            refused = as_user(12345, 12345, said(*words))
            assert refused[0] == "2", refused
            assert f"{api_socket().parent} cannot be listed" in refused


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be another user")
def test_a_user_cannot_serve_for_a_group_of_others(monkeypatch: pytest.MonkeyPatch) -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.chown(folder, OTHER_USER, OTHER_USER)
        monkeypatch.setenv(VARIABLE, folder)
        monkeypatch.setenv("XDG_STATE_HOME", folder)
        serve = said("serve", "--bus", "sim", "--group", grp.getgrgid(0).gr_name)
        refused = as_user(OTHER_USER, OTHER_USER, serve)
    assert refused.startswith(f"2 bioscara: {folder} cannot be given to the group"), refused
    assert "member of the group since login" in refused


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be another user")
def test_members_of_the_group_read_no_secret_next_to_the_socket() -> None:
    with arm_served(group=grp.getgrgid(OTHER_USER).gr_name):
        load_tokens(default_path(NAME))
        certificate, key = (api_socket().with_suffix(end) for end in (".crt", ".key"))
        self_signed(certificate, key, ["localhost"])
        announced = Announcement(NAME, 8080, "http://127.0.0.1:8080/")
        kept = {"left.lock", "left.crt", "left.key", "left.tokens", "left.8080.page", "left.sock"}
        assert kept <= {path.name for path in api_socket().parent.iterdir()}
        assert as_user(OTHER_USER, OTHER_USER, readable) == "left.crt left.lock"
        announced.close()


def readable() -> str:
    """Return the names of the files next to the socket that can be read."""
    files = [path for path in api_socket().parent.iterdir() if path.is_file()]
    return " ".join(sorted(path.name for path in files if os.access(path, os.R_OK)))


def said(*words: str) -> Callable[[], str]:
    """Return a function that returns status and output of a command."""

    def run() -> str:
        with redirect_stdout(io.StringIO()) as output, redirect_stderr(output):
            try:
                status = main(words)
            except SystemExit as refused:
                status = int(refused.code or 0)
        return f"{status} {output.getvalue()}"

    return run


def greeted(path: Path | None = None) -> str:
    """Return how the owner answers a hello: the class of its error or the kind of its answer."""
    hello = framing.packed(m.ClientHello(version=m.VERSION, client="other", session="other"))
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as link:
        link.settimeout(5.0)
        link.connect(os.fspath(path or api_socket()))
        # The owner may have refused already.
        with suppress(BrokenPipeError):
            link.sendall(hello)
        frames = framing.MessageSplitter(framing.ANSWER_MAX)
        payload = next(frames.feed(link.recv(1 << 16)))
        message = framing.from_owner.decode(payload)
        if isinstance(message, m.RequestFailed):
            return message.failure.error
        return str(message.__struct_config__.tag)


def as_user(uid: int, gid: int, action: Callable[[], str]) -> str:
    """Return the result of an action of another user, or the class of its error."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setgroups([])
            os.setgid(gid)
            os.setuid(uid)
            os.write(writer, action().encode())
        except BaseException as error:  # noqa: BLE001  of the child, passed to the test
            os.write(writer, type(error).__name__.encode())
        finally:
            os._exit(0)
    os.close(writer)
    os.waitpid(child, 0)
    with os.fdopen(reader) as told:
        return told.read()


def test_random_changes_of_real_requests_end_nothing_but_their_connection(served: Served) -> None:
    requests: list[m.AnyCommand] = [
        m.Start(task=tasks.MoveTo(pose=served.robot.pose), timeout=1.0),
        m.Start(task=m.SetScene(scene=m.SceneValue())),
        m.Start(task=m.SetTable(table=served.robot.table)),
        m.AcquireLease(),
        m.Subscribe(states=True, events_after=0),
        m.GetFlightRecord("x"),
        m.MakePlan(tasks.MoveNamed(name="center")),
    ]
    ended = 0
    for seed in range(150):
        choice = random.Random(seed)
        request = m.ClientRequest(id=1, command=choice.choice(requests), epoch=1)
        data = bytearray(framing.encode_packed(request))
        for _ in range(choice.randrange(1, 4)):
            data[choice.randrange(len(data))] = choice.randrange(256)
        with RawClient("fuzz") as client:
            client.send_bytes(framed(bytes(data)))
            try:
                client.read(m.RequestFailed | m.Response)
            except EOFError:
                ended += 1
    # Each gets an answer, or the reason for the end of its connection.
    assert ended == 0
