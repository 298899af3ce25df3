"""The simulated arm as an object, its determinism, and its life in a process of its own."""

from __future__ import annotations

import contextlib
import os
import socket
import stat
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from bioscara.bus import Transaction
from bioscara.errors import (
    BusTimeoutError,
    BusUnavailableError,
    InvalidArgumentError,
    NoAcknowledgeError,
)
from bioscara.sim import FirmwareBus, SimulatedArm, SocketBus, serve

PING = Transaction(0x11, b"\x0f", 2)
HELLO = b"\xc0\x01"


def test_the_same_seed_gives_the_same_bytes() -> None:
    def story(seed: int) -> list[object]:
        bus = FirmwareBus(SimulatedArm(seed=seed))
        requests = [Transaction(0x11, b"\x10\x14\x14\x00\x00", 1), Transaction(0x11, b"\x18", 5)]
        answers: list[object] = []
        for _ in range(200):
            answers += bus.transfer(requests)
            bus.arm.run(0.003)
        return answers

    assert story(5) == story(5)
    assert story(5) != story(6)


def test_a_version_1_arm_shows_no_magic() -> None:
    bus = FirmwareBus(SimulatedArm(v1=True))
    (answer,) = bus.transfer([Transaction(0x11, b"\xc0\x01\x02", 13)])
    assert isinstance(answer, bytes)
    assert answer[1:] == b"\xff" * 12
    assert answer[0] & 2


def test_nobody_answers_elsewhere_or_without_power() -> None:
    arm = SimulatedArm()
    bus = FirmwareBus(arm)
    arm.set_power("j2", False)
    answers = bus.transfer([PING, Transaction(0x12, b"\x0f", 2), Transaction(0x40, b"", 1)])
    assert answers[0] == b"O\x0c"
    assert all(isinstance(answer, NoAcknowledgeError) for answer in answers[1:])


def test_a_clock_held_low_too_long_is_a_timeout() -> None:
    arm = SimulatedArm()
    arm.set_stretch(0.05)
    (answer,) = FirmwareBus(arm).transfer([PING])
    assert isinstance(answer, BusTimeoutError)


def test_a_belt_that_slips_moves_the_joint_and_not_its_encoder() -> None:
    arm = SimulatedArm(positions={"j1": -2.0})
    bus, angle = FirmwareBus(arm), Transaction(0x11, b"\x18", 5)
    before = bus.transfer([angle])
    arm.slip_belt("j1", 0.05)
    assert arm.position("j1") == pytest.approx(-1.95, abs=1e-3)
    assert bus.transfer([angle]) == before


def test_odd_wishes_are_refused() -> None:
    arm = SimulatedArm()
    for wish in (
        lambda: arm.position("j5"),
        lambda: arm.run(float("nan")),
        lambda: arm.run(-1.0),
        lambda: arm.set_position("j1", float("inf")),
        lambda: SimulatedArm(frequency=1e6),
        lambda: SimulatedArm(seed=-1),
    ):
        with pytest.raises(InvalidArgumentError):
            wish()


@pytest.fixture
def served(tmp_path: Path) -> Iterator[tuple[SimulatedArm, Path]]:
    arm, path, ended = SimulatedArm(), tmp_path / "arm.sock", threading.Event()
    # Somebody died here and left this behind.
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as stale:
        stale.bind(str(path))
    thread = threading.Thread(target=serve, args=(arm, path, ended.is_set))
    thread.start()
    try:
        yield arm, path
    finally:
        ended.set()
        thread.join(10)
        assert not thread.is_alive()
        assert not path.exists()


def _connect(path: Path) -> SocketBus:
    bus = SocketBus(path)
    for _ in range(2000):
        try:
            bus.transfer([])
        except BusUnavailableError:
            continue
        return bus
    raise AssertionError("the arm never listened")


def test_an_arm_behind_a_socket_answers_the_same_bytes(served: tuple[SimulatedArm, Path]) -> None:
    bus = _connect(served[1])
    ok, nobody = bus.transfer([PING, Transaction(0x30, b"\x0f", 2)])
    assert ok == b"O\x0c"
    assert isinstance(nobody, NoAcknowledgeError)
    assert stat.S_IMODE(os.stat(served[1]).st_mode) == 0o600
    with pytest.raises(InvalidArgumentError, match="at most 255 bytes"):
        bus.transfer([PING, PING._replace(write=bytes(256))])
    bus.close()
    with pytest.raises(BusUnavailableError, match="closed"):
        bus.transfer([PING])


def test_clients_come_and_go_and_junk_is_hung_up_on(served: tuple[SimulatedArm, Path]) -> None:
    first = _connect(served[1])
    junk = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    junk.settimeout(5)
    junk.connect(str(served[1]))
    junk.sendall(b"\xff\xff" + b"x" * 10)
    # With unread bytes left, hanging up may come as a reset.
    with contextlib.suppress(ConnectionResetError):
        assert junk.recv(1) == b""
    junk.close()
    first.close()
    second = SocketBus(served[1])
    assert second.transfer([PING]) == [b"O\x0c"]
    second.close()


def test_a_second_arm_cannot_take_the_socket(served: tuple[SimulatedArm, Path]) -> None:
    _connect(served[1]).close()
    with pytest.raises(BusUnavailableError, match="cannot make the socket"):
        serve(SimulatedArm(), served[1], lambda: True)


def test_no_arm_behind_a_socket_names_the_command(tmp_path: Path) -> None:
    with pytest.raises(BusUnavailableError, match="bioscara simulate --socket"):
        SocketBus(tmp_path / "nothing").transfer([PING])
