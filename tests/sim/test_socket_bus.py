"""The simulated arm behind a socket: matching of answers, admission of hosts, and the clock."""

from __future__ import annotations

import contextlib
import math
import os
import random
import select
import signal
import socket
import stat
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import pytest

from bioscara.bus import Transaction
from bioscara.errors import BusUnavailableError, InvalidArgumentError, NoAcknowledgeError
from bioscara.sim import SimulatedArm, SocketBus, framing, serve, server, socket_bus
from bioscara.sim.framing import FrameKind, encode_frame, encode_hello, encode_request
from bioscara.sim.socket_bus import ServedClock
from sim.served_arm import LIMIT, HeldArm, ManualClock, serving

PING, PONG = Transaction(0x11, b"\x0f", 2), b"O\x0c"
FLAGS_ONLY, NO_PAYLOAD = Transaction(0x11, b"\x29\x00", 1), b"\x0c"
TIME = bytes(16)
"""Times of 0, with which the body of a request and of a reply begins."""
SEEDS = range(int(os.environ.get("BIOSCARA_FAULT_SEEDS", "24")))


def until(condition: Callable[[], bool], what: str) -> None:
    """Wait for a condition."""
    begin = time.monotonic()
    while not condition():
        assert time.monotonic() - begin < LIMIT, f"never: {what}"


@contextlib.contextmanager
def client(path: Path) -> Iterator[socket.socket]:
    """A connection that sends nothing unasked."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(LIMIT)
        connection.connect(str(path))
        yield connection


def hung_up(connection: socket.socket) -> bool:
    """Return whether the other side has closed."""
    poll = select.poll()
    poll.register(connection, 0)
    return bool(poll.poll(0))


def everything(connection: socket.socket) -> bytes:
    """Return all that comes until the other side closes."""
    parts = b""
    # With unread bytes left, hanging up may come as a reset.
    with contextlib.suppress(ConnectionResetError):
        while part := connection.recv(1000):
            parts += part
    return parts


def free(path: Path) -> bool:
    """Return whether a host is admitted."""
    with SocketBus(path) as bus:
        try:
            bus.transfer([])
        except BusUnavailableError:
            return False
        return True


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "arm.sock"


@pytest.fixture
def arm(path: Path) -> Iterator[HeldArm]:
    # A process died here and left this behind.
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stale:
        stale.bind(str(path))
    with serving(path) as served:
        yield served


@pytest.mark.usefixtures("arm")
def test_an_arm_behind_a_socket_answers_the_same_bytes(path: Path) -> None:
    bus = SocketBus(path)
    ok, absent = bus.transfer([PING, Transaction(0x30, b"\x0f", 2)])
    assert ok == PONG
    assert isinstance(absent, NoAcknowledgeError)
    assert bus.transfer([PING] * 150) == [PONG] * 150
    assert stat.S_IMODE(os.stat(path).st_mode) == 0o600
    with pytest.raises(InvalidArgumentError, match="at most 255 bytes"):
        bus.transfer([PING, PING._replace(write=bytes(256))])
    assert bus.transfer([PING]) == [PONG]
    bus.close()
    with pytest.raises(BusUnavailableError, match="closed; make a new one"):
        bus.transfer([PING])


@pytest.mark.usefixtures("arm")
def test_a_transfer_is_not_faster_than_the_bus(path: Path) -> None:
    with SocketBus(path) as bus:
        bus.transfer([])
        begin = time.monotonic()
        bus.transfer([PING] * 50)
        # 57 bits each at 100 kHz.
        assert time.monotonic() - begin >= 50 * 57e-5


@pytest.mark.usefixtures("arm")
def test_a_second_arm_cannot_take_the_socket(path: Path) -> None:
    with pytest.raises(BusUnavailableError, match="cannot make the socket"):
        serve(SimulatedArm(), path, lambda: True)
    with SocketBus(path) as bus:
        assert bus.transfer([PING]) == [PONG]


def test_no_arm_behind_a_socket_names_the_command(path: Path) -> None:
    with pytest.raises(BusUnavailableError, match="bioscara simulate --socket"):
        SocketBus(path).transfer([PING])


# Interruptions.


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Let SIGINT interrupt: a shell starts background programs with it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_inside_a_transfer_leaves_no_reply_behind(arm: HeldArm, path: Path) -> None:
    caught, main = threading.Event(), threading.main_thread().ident
    assert main is not None

    def press_ctrl_c() -> None:
        del arm.during
        signal.pthread_kill(main, signal.SIGINT)
        assert caught.wait(LIMIT)

    with SocketBus(path) as bus:
        assert bus.transfer([PING]) == [PONG]
        arm.during = press_ctrl_c
        with pytest.raises(KeyboardInterrupt):
            bus.transfer([PING])
        caught.set()
        assert bus.transfer([FLAGS_ONLY]) == [NO_PAYLOAD]
        assert bus.transfer([PING]) == [PONG]


@pytest.mark.usefixtures("arm")
def test_an_interruption_anywhere_in_a_transfer_leaves_the_next_intact(path: Path) -> None:
    files = {socket_bus.__file__, framing.__file__}
    errors: list[BaseException] = []

    def interrupted_at(line: int, bus: SocketBus) -> bool:
        """Transfer; the given line of the bus's code raises. Return whether it was reached."""
        count = 0

        def trace(frame: FrameType, event: str, _: object) -> object:
            nonlocal count
            if frame.f_code.co_filename not in files:
                return None
            count += event == "line"
            if event == "line" and count == line:
                raise KeyboardInterrupt
            return trace

        before = sys.gettrace()
        sys.settrace(trace)  # type: ignore[arg-type]
        try:
            bus.transfer([PING])
        except KeyboardInterrupt as error:
            # As an interactive interpreter keeps it, with all objects that its frames refer to.
            errors.append(error)
        finally:
            sys.settrace(before)
        return count >= line

    for connected in (False, True):
        line = 1
        while True:
            with SocketBus(path) as bus:
                if connected:
                    bus.transfer([PING])
                if not interrupted_at(line, bus):
                    break
                assert bus.transfer([FLAGS_ONLY]) == [NO_PAYLOAD], f"line {line}"
                assert bus.transfer([PING]) == [PONG], f"line {line}"
            line += 1
        assert line > 30
    assert errors


@contextlib.contextmanager
def false_arm(path: Path, answer: bytes) -> Iterator[None]:
    """Welcomes one host and gives this answer to its first request."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        listener.bind(str(path))
        listener.listen()

        def act() -> None:
            connection, _ = listener.accept()
            with connection:
                connection.recv(1000)
                connection.sendall(encode_frame(FrameKind.WELCOME, 0))
                connection.recv(1000)
                connection.sendall(answer)
                connection.recv(1000)

        thread = threading.Thread(target=act)
        thread.start()
        yield
        thread.join(LIMIT)
        assert not thread.is_alive()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (encode_frame(FrameKind.REPLY, 2, TIME), "number 2 came where .* number 1"),
        (encode_frame(FrameKind.WELCOME, 1), "WELCOME number 1 came where REPLY"),
        (encode_frame(FrameKind.REPLY, 1, TIME + b"\2\0\0\0\0\0"), "2 results for 1"),
        (encode_frame(FrameKind.REPLY, 1, TIME + b"\1\0\0\2O"), "ends too early"),
        (encode_frame(FrameKind.REPLY, 1, TIME + b"\1\0\0\2O\x0c."), "continues after its end"),
        (struct.pack("<HBI", 0xFFFF, FrameKind.REPLY, 1), "at most"),
        (encode_frame(FrameKind.REPLY, 1, struct.pack("<dd", math.nan, 0.0)), "the times nan"),
        (b"\0\0\x77\0\0\0\0", "kind"),
        (encode_frame(FrameKind.REFUSAL, 0, b"no more"), "no more"),
        (b"\1", "went away or hangs"),
    ],
)
def test_a_reply_that_belongs_to_another_request_or_none_is_refused(
    path: Path, answer: bytes, words: str
) -> None:
    with false_arm(path, answer), SocketBus(path) as bus:
        with pytest.raises(BusUnavailableError, match=words):
            bus.transfer([PING])
        # Nothing of that connection is left.
        path.unlink()
        with pytest.raises(BusUnavailableError, match="no simulated arm"):
            bus.transfer([PING])


# One host at a time.

HOST = """
import sys
from bioscara.bus import Transaction
from bioscara.sim import SocketBus
with SocketBus(sys.argv[1]) as bus:
    print(bus.transfer([Transaction(0x11, bytes((0x0f,)), 2)]), flush=True)
    sys.stdin.read()
"""


@pytest.mark.usefixtures("arm")
@pytest.mark.parametrize("end", ["close", "kill"])
def test_a_second_host_is_refused_with_name_and_pid_of_the_first(
    path: Path, tmp_path: Path, end: str
) -> None:
    script = tmp_path / "pipetting.py"
    script.write_text(HOST)
    with subprocess.Popen(
        [sys.executable, str(script), str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as first:
        try:
            assert first.stdin
            assert first.stdout
            assert first.stdout.readline() == f"{[PONG]}\n"
            with SocketBus(path) as second:
                for _ in range(3):
                    with pytest.raises(
                        BusUnavailableError, match=rf"used by pipetting\.py \(pid {first.pid}\)"
                    ):
                        second.transfer([PING])
                if end == "kill":
                    first.kill()
                else:
                    first.stdin.close()
                first.wait(LIMIT)
                assert second.transfer([PING]) == [PONG]
        finally:
            first.kill()


@pytest.mark.usefixtures("arm")
def test_of_hosts_that_connect_at_once_one_is_admitted(path: Path) -> None:
    for _ in range(10):
        with contextlib.ExitStack() as stack:
            hosts = [stack.enter_context(client(path)) for _ in range(8)]
            for host in hosts:
                host.sendall(HELLO)
            answers = sorted(host.recv(1000)[2] for host in hosts)
            assert answers == [FrameKind.WELCOME] + 7 * [FrameKind.REFUSAL]
        until(lambda: free(path), "the arm is free again")


@pytest.mark.usefixtures("arm")
def test_a_host_is_named_by_the_kernel_and_not_by_itself(path: Path) -> None:
    with SocketBus(path) as first, SocketBus(path) as second:
        first.transfer([])
        with pytest.raises(
            BusUnavailableError, match=rf"another bus of this program, .*pid {os.getpid()}"
        ):
            second.transfer([])


def test_refusals_take_nothing_from_the_host(path: Path) -> None:
    clock = ManualClock()
    with serving(path, clock) as arm, SocketBus(path) as bus, contextlib.ExitStack() as stack:
        offset = clock.time - arm.now()
        bus.transfer([PING])
        # So long the arm's time waits for the next request.
        clock.time += server._PATIENCE + 0.05
        until(lambda: arm.now() >= clock.time - offset - 0.05, "the arm catches up")
        before, sent = arm.now(), arm.transferred
        for _ in range(20):
            refused = stack.enter_context(client(path))
            refused.sendall(HELLO)
            assert b"used by" in everything(refused)
        assert arm.transferred == sent
        # Neither time of the arm nor of its bus was taken, and the host is still connected.
        assert arm.now() == before
        assert bus.transfer([PING]) == [PONG]


@pytest.mark.usefixtures("arm")
def test_a_host_that_was_killed_with_a_request_underway_is_no_obstacle(path: Path) -> None:
    for _ in range(20):
        with client(path) as first:
            greet(first)
            first.sendall(encode_frame(FrameKind.REQUEST, 1, encode_request([PING], 0.0)))
        with SocketBus(path) as second:
            assert second.transfer([FLAGS_ONLY]) == [NO_PAYLOAD]


# Slow, half-dead and sending invalid data.

HELLO = encode_frame(FrameKind.HELLO, 0, encode_hello())
REQUEST = encode_frame(FrameKind.REQUEST, 1, encode_request([PING] * 20, 0.0))


@pytest.mark.parametrize("host", [False, True])
def test_a_client_that_sends_a_byte_at_a_time_holds_nothing_up(path: Path, host: bool) -> None:
    clock = ManualClock()
    step = server.FRAME_TIMEOUT / 10.0
    with serving(path, clock) as arm, client(path) as slow:
        if host:
            greet(slow)
        dribble, begin, wall = REQUEST if host else HELLO, arm.now(), clock.time

        # So long the arm's time waits for a host's next request.
        lag = server._PATIENCE if host else 1e-6

        def live() -> None:
            clock.time += step
            until(lambda: arm.now() >= begin + clock.time - wall - lag, "the arm lives on")

        for byte in dribble[:9]:
            slow.sendall(bytes((byte,)))
            live()
        assert not hung_up(slow)
        # More than a whole timeout after the first byte, which may be read some steps late.
        for _ in range(8):
            live()
        until(lambda: hung_up(slow), "a slow client is disconnected")
        assert b"it waits at most 1 s for a whole frame" in everything(slow)


def test_a_host_is_served_while_a_client_sends_slowly(path: Path, arm: HeldArm) -> None:
    with client(path) as slow, SocketBus(path) as bus:
        slow.sendall(HELLO[:5])
        begin, served = arm.now(), 0
        while not hung_up(slow):
            assert bus.transfer([PING]) == [PONG]
            served += 1
        assert served > 10
        assert arm.now() - begin > 0.5 * server.FRAME_TIMEOUT
        assert bus.transfer([PING]) == [PONG]


def test_a_transfer_begins_when_it_was_sent_though_the_server_wakes_late(path: Path) -> None:
    clock = ManualClock()
    late, waited = 0.01, 0.0
    with serving(path, clock) as arm, client(path) as host:
        offset = clock.time - arm.now()
        began: list[float] = []
        arm.during = lambda: began.append(arm.now() + offset)
        greet(host)
        for sequence in range(1, 21):
            sent = clock.time
            body = encode_request([PING], sent)
            clock.time += late
            host.sendall(encode_frame(FrameKind.REQUEST, sequence, body))
            before = waited
            _, end, waited = framing.decode_reply(host.recv(1000)[7:], 1)
            assert began[-1] + before == pytest.approx(sent, abs=1e-6)
            assert began[-1] + waited < end <= began[-1] + waited + 1.5e-3
            clock.time += late


def test_the_arm_waits_for_a_starved_host_and_not_for_one_that_says_nothing(path: Path) -> None:
    clock = ManualClock()
    with serving(path, clock) as arm, client(path) as host:
        greet(host)
        last, total, offset = clock.time, 0.0, clock.time - arm.now()
        for sequence, (late, starved, granted) in enumerate(
            [(0.15, 0.1, 0.1), (0.15, 0.0, 0.0), (0.15, 1e9, 0.15), (0.15, -1.0, 0.0)], 1
        ):
            clock.time = last + late
            body = encode_request([PING], clock.time, starved)
            host.sendall(encode_frame(FrameKind.REQUEST, sequence, body))
            _, last, waited = framing.decode_reply(host.recv(1000)[7:], 1)
            assert waited - total == pytest.approx(granted, abs=0.002)
            assert arm.now() == pytest.approx(last - offset - waited, abs=1e-6)
            total = waited
        # For a host that is silent for longer, as one that is stopped, time goes on.
        clock.time = last + server._PATIENCE + 0.01
        until(lambda: arm.now() >= clock.time - offset - total - 0.01, "the arm goes on")


def greet(connection: socket.socket) -> None:
    """Become the host."""
    connection.sendall(HELLO)
    assert connection.recv(1000) == encode_frame(FrameKind.WELCOME, 0)


def starve(connection: socket.socket, clock: ManualClock, sequence: int) -> float:
    """Ask as a host that was late for 0.1 s; returns for how long the arm has waited for it [s]."""
    clock.time += 0.1
    body = encode_request([PING], clock.time, 0.1)
    connection.sendall(encode_frame(FrameKind.REQUEST, sequence, body))
    _, end, waited = framing.decode_reply(connection.recv(1000)[7:], 1)
    clock.time = max(clock.time, end)
    return waited


def test_the_next_host_does_not_wait_as_long_as_the_arm_waited_for_the_one_before(
    path: Path,
) -> None:
    clock = ManualClock()
    with serving(path, clock):
        for _ in range(2):
            with client(path) as host:
                greet(host)
                waited = [starve(host, clock, sequence) for sequence in range(1, 11)]
                assert waited == pytest.approx([0.1 * n for n in range(1, 11)], abs=0.02)
            until(lambda: free(path), "the host has left")


def test_the_first_wait_of_a_host_is_as_long_as_it_says(path: Path) -> None:
    clock = ManualClock()
    with serving(path, clock), SocketBus(path) as bus:
        with client(path) as host:
            greet(host)
            for sequence in range(1, 11):
                starve(host, clock, sequence)
        until(lambda: free(path), "the host has left")
        due = bus.clock.now() + 0.01
        bus.transfer([PING])
        begin = time.monotonic()
        bus.clock.sleep_until(due)
        assert time.monotonic() - begin < 0.5


@pytest.mark.realtime
def test_the_clock_of_a_host_does_not_leap_when_it_connects_again() -> None:
    clock = ServedClock()
    clock.begin_connection()
    clock.end_transfer(0.0, 0.75, 0.0)
    assert time.monotonic() - clock.now() == pytest.approx(0.75, abs=0.05)
    clock.begin_connection()
    clock.end_transfer(0.0, 0.0, 0.0)
    assert time.monotonic() - clock.now() == pytest.approx(0.75, abs=0.05)


def test_a_host_that_takes_no_replies_is_disconnected(path: Path) -> None:
    clock = ManualClock()
    request = [Transaction(0x11, b"\x0f", 255)] * 64
    with serving(path, clock) as arm, client(path) as deaf:
        deaf.sendall(HELLO)
        deaf.settimeout(0.05)
        sequence, begin = 1, arm.now()
        while not hung_up(deaf):
            with contextlib.suppress(TimeoutError, OSError):
                body = encode_request(request, 0.0)
                deaf.sendall(encode_frame(FrameKind.REQUEST, sequence, body))
                sequence += 1
            clock.time += 0.2
            assert sequence < 1000
        assert arm.now() > begin
        with SocketBus(path) as bus:
            clock.time += 10.0
            bus_answers = threading.Thread(target=bus.transfer, args=([],))
            bus_answers.start()
            bus_answers.join(LIMIT)
            assert not bus_answers.is_alive()


@pytest.mark.parametrize(
    ("junk", "words"),
    [
        (b"\xff\xff" + b"x" * 10, "kind"),
        (b"GET / HTTP/1.1\r\n\r\n", "kind"),
        (struct.pack("<HBI", 0xFFFF, FrameKind.HELLO, 0), "at most"),
        (encode_frame(FrameKind.REQUEST, 1, TIME + b"\0\0"), "REQUEST number 1 came where HELLO"),
        (encode_frame(FrameKind.HELLO, 0, b"BSIM"), "at least"),
        (encode_frame(FrameKind.HELLO, 0, b"XSIM\1"), "same version"),
        (HELLO + HELLO, "HELLO number 0 came where REQUEST number 1"),
        (HELLO + encode_frame(FrameKind.REQUEST, 2, TIME + b"\0\0"), "number 2 came where"),
        (HELLO + encode_frame(FrameKind.REQUEST, 1, TIME + b"\xff\xff"), "65535 transactions"),
        (
            HELLO + encode_frame(FrameKind.REQUEST, 1, struct.pack("<dd", 0.0, math.inf)),
            "the times 0.0 and inf",
        ),
        (HELLO + encode_frame(FrameKind.REQUEST, 1, TIME + b"\2\0\x11\0\1"), "ends too early"),
        (HELLO + encode_frame(FrameKind.REQUEST, 1, TIME + b"\1\0\x91\0\1"), "address 0x91"),
        (HELLO + encode_frame(FrameKind.REQUEST, 1, TIME + b"\0\0\0"), "continues after its end"),
    ],
)
@pytest.mark.usefixtures("arm")
def test_bytes_that_are_no_frame_are_refused_with_the_reason(
    path: Path, junk: bytes, words: str
) -> None:
    with client(path) as connection:
        connection.sendall(junk)
        assert words in everything(connection).decode(errors="replace")
    with SocketBus(path) as bus:
        assert bus.transfer([PING]) == [PONG]


@pytest.mark.usefixtures("arm")
@pytest.mark.parametrize("seed", SEEDS)
def test_noise_from_clients_does_not_block_the_host(path: Path, seed: int) -> None:
    chance = random.Random(seed)
    frames = HELLO + REQUEST
    with SocketBus(path) as bus:
        assert bus.transfer([PING]) == [PONG]
        for _ in range(10):
            noise = bytearray(frames[: chance.randrange(len(frames) + 1)])
            for _ in range(chance.randrange(4)):
                noise[chance.randrange(len(noise) + 1) :] = chance.randbytes(chance.randrange(50))
            with client(path) as connection:
                with contextlib.suppress(OSError):
                    connection.sendall(noise)
                assert bus.transfer([FLAGS_ONLY, PING]) == [NO_PAYLOAD, PONG]


@pytest.mark.usefixtures("arm")
def test_many_silent_connections_do_not_block_the_host(path: Path) -> None:
    with SocketBus(path) as bus, contextlib.ExitStack() as stack:
        assert bus.transfer([PING]) == [PONG]
        crowd = [stack.enter_context(client(path)) for _ in range(40)]
        assert bus.transfer([PING]) == [PONG]
        assert b"connections" in everything(crowd[-1])
        assert bus.transfer([PING]) == [PONG]
