"""Reading the arm behind a socket while another program uses it."""

from __future__ import annotations

import contextlib
import select
import socket
import threading
from pathlib import Path

import pytest

from bioscara.bus import Transaction
from bioscara.errors import BusUnavailableError
from bioscara.sim import Onlooker, SocketBus
from bioscara.sim.framing import (
    ArmState,
    FrameKind,
    decode_state,
    encode_frame,
    encode_state,
)
from bioscara.sim.server import FRAME_TIMEOUT
from bioscara.sim.simulated_arm import JOINTS
from sim.served_arm import LIMIT, ManualClock, serving

PING = Transaction(0x11, b"\x40", 6)
POSITIONS = {"j1": -0.3, "j2": 0.12, "j3": 0.7, "j4": -1.1}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "arm.sock"


def look(onlooker: Onlooker, clock: ManualClock) -> ArmState:
    """Look once; the answer is due after a short time, which is let pass."""
    answers: list[ArmState] = []
    thread = threading.Thread(target=lambda: answers.append(onlooker.look()))
    thread.start()
    while thread.is_alive():
        clock.time += 1e-3
        thread.join(2e-3)
    return answers[0]


def test_the_state_is_the_true_one(path: Path) -> None:
    clock = ManualClock()
    with (
        serving(path, clock, positions=POSITIONS) as arm,
        contextlib.closing(Onlooker(path)) as onlooker,
    ):
        for _ in range(3):
            state = look(onlooker, clock)
            expected = [arm.position(joint) for joint in JOINTS]
            assert state.positions == pytest.approx(expected, abs=1e-6)
            assert state.positions == pytest.approx(tuple(POSITIONS.values()), abs=1e-3)


def test_a_state_survives_its_frame() -> None:
    state = ArmState(12.5, (1.0, -2.0, 3.0, 1e-9))
    assert decode_state(encode_state(state)) == state
    for size in (0, 39, 41):
        with pytest.raises(BusUnavailableError, match=f"a STATE of {size} bytes"):
            decode_state(bytes(size))


def test_looking_neither_takes_the_host_s_place_nor_its_bus_nor_its_time(path: Path) -> None:
    clock = ManualClock()
    begin = clock.time
    with serving(path, clock, positions=POSITIONS) as arm, SocketBus(path) as host:
        clock.time += 1.0
        transferred: list[object] = []

        def use() -> None:
            transferred.append(host.transfer([PING]))

        for _ in range(3):
            before = arm.now()
            with contextlib.closing(Onlooker(path)) as onlooker:
                state = look(onlooker, clock)
            # Simulated time follows real time, of which 20 ms are let pass for a look at most.
            assert before <= state.time <= before + clock.time - begin
            thread = threading.Thread(target=use)
            thread.start()
            while thread.is_alive():
                clock.time += 1e-3
                thread.join(2e-3)
        assert len(transferred) == 3
        assert transferred[0] == transferred[1] == transferred[2]


def test_many_looks_are_answered_at_a_bounded_rate(path: Path) -> None:
    clock = ManualClock()
    with (
        serving(path, clock, positions=POSITIONS),
        socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as eager,
    ):
        eager.settimeout(0.3)
        eager.connect(str(path))
        eager.sendall(b"".join(encode_frame(FrameKind.LOOK, number) for number in range(50)))
        # No time passes, so only the first one is answered.
        state = ArmState(0.0, tuple(POSITIONS.values()))
        assert len(eager.recv(1000)) == len(encode_frame(FrameKind.STATE, 0, encode_state(state)))
        with pytest.raises(TimeoutError):
            eager.recv(1000)


def test_a_program_that_stops_looking_is_disconnected(path: Path) -> None:
    clock = ManualClock()
    with serving(path, clock, positions=POSITIONS), contextlib.closing(Onlooker(path)) as onlooker:
        look(onlooker, clock)
        connection = onlooker._connection
        assert connection is not None
        clock.time += 2.0 * FRAME_TIMEOUT
        rest = b""
        while part := connection.recv(1000):
            rest += part
        assert b"at most" in rest
        with pytest.raises(BusUnavailableError):
            onlooker.look()
        assert look(onlooker, clock).positions == pytest.approx(tuple(POSITIONS.values()), abs=1e-3)


@pytest.mark.parametrize("kind", [FrameKind.REQUEST, FrameKind.STATE])
def test_after_a_look_other_frames_are_refused(path: Path, kind: FrameKind) -> None:
    clock = ManualClock()
    with (
        serving(path, clock, positions=POSITIONS),
        socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection,
    ):
        connection.settimeout(LIMIT)
        connection.connect(str(path))
        connection.sendall(encode_frame(FrameKind.LOOK, 0))
        while not select.select([connection], [], [], 2e-3)[0]:
            clock.time += 1e-3
        assert connection.recv(1000)
        body = bytes(40) if kind is FrameKind.STATE else b"\x00\x00"
        connection.sendall(encode_frame(kind, 1, body))
        clock.time += 0.02  # Before, its next frame is not due.
        assert b"was due" in connection.recv(1000)


def test_no_arm_behind_a_socket_names_the_command(path: Path) -> None:
    with pytest.raises(BusUnavailableError, match=f"bioscara simulate --socket {path}"):
        Onlooker(path).look()
