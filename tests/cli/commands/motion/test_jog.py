"""``bioscara jog`` in a terminal: keys move the arm, and it is released at the end."""

from __future__ import annotations

import os
import pty
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

import bioscara.sim
from bioscara import Robot
from bioscara.cli import main
from bioscara.model import load_parameters
from bioscara.sim import FirmwareBus, SimulatedArm
from cli.said import Said
from simulated import NEAR

JOINTS = ("j1", "j2", "j3", "j4")


@pytest.fixture
def arm(monkeypatch: pytest.MonkeyPatch) -> SimulatedArm:
    """The arm of every command, homed and unfolded."""
    arm = SimulatedArm(positions=NEAR)
    with Robot(FirmwareBus(arm), arm.clock, load_parameters(), "before") as robot:
        robot.home()
        robot.unfold()
    monkeypatch.setattr(bioscara.sim, "SimulatedArm", lambda **_: arm)
    return arm


@pytest.fixture
def user(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The user's side of the terminal that is standard input."""
    typed, program = pty.openpty()
    with os.fdopen(program) as file:
        monkeypatch.setattr(sys, "stdin", file)
        yield typed
    os.close(typed)


@contextmanager
def typing(user: int, keys: Iterator[bytes]) -> Iterator[None]:
    """Type keys, 200 a second."""
    done = threading.Event()

    def type_() -> None:
        while not done.wait(0.005):
            with suppress(BlockingIOError):
                os.write(user, next(keys))

    os.set_blocking(user, False)
    thread = threading.Thread(target=type_)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


@pytest.mark.parametrize(
    ("mode", "key", "joint"), [(b"", b"f", "j2"), (b"m", b"\x1b[A", "j1"), (b"n", b"f", "j2")]
)
def test_a_held_key_moves_the_arm_and_q_releases_it(
    mode: bytes, key: bytes, joint: str, arm: SimulatedArm, user: int, said: Said
) -> None:
    before = {name: arm.position(name) for name in ("j1", "j2")}

    def moved(name: str) -> float:
        return abs(arm.position(name) - before[name])

    def keys() -> Iterator[bytes]:
        while moved("j2") < 0.002:
            yield b"f"  # Keys that are typed before the jog do not count.
        yield mode
        while moved(joint) < 0.008:
            yield key
        while True:
            yield b"q"

    with typing(user, keys()):
        out = said.output("jog")
    assert "\n--pose " in out
    assert "\n--joints " in out
    assert moved(joint) > 0.007
    assert not any(arm.has_torque(name) for name in JOINTS)


def test_q_during_a_step_ends(arm: SimulatedArm, user: int) -> None:
    before = arm.position("j2")

    def keys() -> Iterator[bytes]:
        while abs(arm.position("j2") - before) < 0.002:
            yield b"f"
        yield b"n"
        while abs(arm.velocity("j2")) > 1e-4:
            yield b""
        while abs(arm.velocity("j2")) < 1e-4:
            yield b"f"  # Again: a whole step may pass between two looks at its velocity.
        yield b"q"  # Once.
        while True:
            yield b""

    with typing(user, keys()):
        assert main(["jog"], paced=False) == 0
    assert not any(arm.has_torque(name) for name in JOINTS)


def test_the_table_says_why_the_arm_is_held(
    arm: SimulatedArm, user: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown, screen = bytearray(), pty.openpty()
    reader = threading.Thread(target=_read_all, args=(screen[0], shown))
    reader.start()
    monkeypatch.setenv("TERM", "xterm")
    held = b"x, y held: the elbow is straight; move inwards"

    def keys() -> Iterator[bytes]:
        # The unfolded arm points to negative x.
        while held not in shown:
            yield b"s"
        height = arm.position("j2")
        while abs(arm.position("j2") - height) < 0.002:
            yield b"f"
        while True:
            yield b"q"

    with os.fdopen(screen[1], "w") as file:
        monkeypatch.setattr(sys, "stdout", file)
        with typing(user, keys()):
            assert main(["jog"], paced=False) == 0
    reader.join()
    os.close(screen[0])
    assert held in shown
    assert arm.position("j3") == pytest.approx(0.0, abs=2e-3)


def _read_all(descriptor: int, into: bytearray) -> None:
    # A terminal whose other side is closed raises an error.
    with suppress(OSError):
        while part := os.read(descriptor, 4096):
            into.extend(part)


@pytest.mark.parametrize("command", ["move", "run", "run a sequence"])
def test_p_pauses_a_motion_and_c_continues_it(
    command: str, arm: SimulatedArm, user: int, tmp_path: Path, said: Said
) -> None:
    begin, stood = arm.position("j1"), list[float]()

    def rests() -> bool:
        return abs(arm.velocity("j1")) < 1e-4

    def keys() -> Iterator[bytes]:
        while rests():
            yield b""
        yield b"p"
        while not rests():
            yield b""
        stood.append(arm.position("j1"))
        yield from [b""] * 10
        stood.append(arm.position("j1"))
        yield b"c"
        while True:
            yield b""

    sequence = tmp_path / "steps.yaml"
    goal = "{j1: 0.3, j2: 0.2, j3: 0.5, j4: 0.0}"
    sequence.write_text(f"schema: 1\nsteps:\n- {{kind: move_joints, positions: {goal}}}\n...\n")
    trajectory = tmp_path / "slow.csv"
    trajectory.write_text("time,j1\n0,0.0\n20,0.3\n")
    target = ("--joints", "0.3", "0.2", "0.5", "0", "--velocity-scaling", "0.05")
    words = {
        "move": ("move", *target),
        "run": ("run", str(trajectory), "--out", str(tmp_path / "o")),
    }
    words["run a sequence"] = ("run", str(sequence))
    with typing(user, keys()):
        out = said.output(*words[command])
    assert "keys: p pauses the motion, c continues it; Ctrl-C stops" in out
    assert "paused: c continues, Ctrl-C stops" in out
    assert stood[1] == pytest.approx(stood[0], abs=1e-4)
    assert begin < stood[0] < 0.29
    assert arm.position("j1") == pytest.approx(0.3, abs=5e-3)


def test_without_a_terminal_nothing_is_opened(
    arm: SimulatedArm, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    reader, writer = os.pipe()
    with os.fdopen(reader) as file:
        monkeypatch.setattr(sys, "stdin", file)
        assert "run it in a terminal" in said.failure("jog")
    os.close(writer)
    assert not any(arm.has_torque(name) for name in JOINTS)
