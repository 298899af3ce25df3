"""No control cycle waits for a disk: the loop's accesses to the file system, and their times."""

from __future__ import annotations

import errno
import gc
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from bioscara import Robot
from bioscara.control.loop.loop import CycleReport, Loop
from bioscara.drivers import Gripper, Pwm
from bioscara.errors import GripperError, MotionCancelledError
from bioscara.model import load_parameters
from bioscara.planning.motions.jog import JointVelocity
from bioscara.sim import FirmwareBus, SimulatedArm, SimulatedServo
from simulated import NEAR

ARM = load_parameters()
SLOW_DISK = 0.08
"""Longest duration of an fsync on a memory card [s]."""
IO = Path("/proc/thread-self/io")


class Asked(NamedTuple):
    """File system accesses of one cycle."""

    calls: list[str]
    transfers: int
    """Reads and writes of files that were open already."""


class Watch:
    """Records the file system accesses of each cycle of a loop.

    The interpreter's audit events show each path that is opened, changed or imported; the kernel
    counts the reads and writes of the thread; the remaining calls are replaced here.
    """

    def __init__(self) -> None:
        self.cycles: list[Asked] = []
        self.calls: list[str] | None = None

    def hook(self, event: str, arguments: tuple[object, ...]) -> None:
        files = event == "open" or event.startswith(("os.", "import", "shutil.", "tempfile."))
        if self.calls is not None and files:
            self.calls.append(f"{event} {arguments[0] if arguments else ''}")

    def seen(self, name: str, original: Callable[..., object]) -> Callable[..., object]:
        def call(*arguments: object, **keywords: object) -> object:
            if self.calls is not None:
                self.calls.append(f"{name} {arguments[:1]}")
            return original(*arguments, **keywords)

        return call

    def step(self, cycle: Callable[[], CycleReport]) -> CycleReport:
        counting = transfers() - transfers()
        before, calls = transfers(), []
        self.calls = calls
        try:
            return cycle()
        finally:
            self.calls = None
            self.cycles.append(Asked(calls, transfers() - before + counting))


WATCH = Watch()
sys.addaudithook(WATCH.hook)


def transfers() -> int:
    """Return how many reads and writes of files this thread has made."""
    return sum(int(line.split()[1]) for line in IO.read_text().splitlines() if "sysc" in line)


@pytest.fixture
def cycles(monkeypatch: pytest.MonkeyPatch) -> list[Asked]:
    WATCH.cycles.clear()
    gc.collect()  # Temporary folders of earlier tests would be removed in a cycle.
    for name in ("fsync", "fdatasync", "sync", "stat", "lstat", "access", "replace"):
        monkeypatch.setattr(os, name, WATCH.seen(name, getattr(os, name)))
    original = Loop.step
    monkeypatch.setattr(
        Loop, "step", lambda loop, before=None: WATCH.step(lambda: original(loop, before))
    )
    return WATCH.cycles


class World:
    """A robot whose disk is slow, or full, in the arm's own time."""

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.arm = SimulatedArm(seed=2, positions=NEAR)
        self.servo = SimulatedServo(ARM.gripper.outputs[0])
        self.file, self.full, self.syncs = folder / "width", False, 0
        gripper = Gripper(
            Pwm(ARM.gripper.outputs, self.arm.clock, self.servo.root), ARM.gripper, self.file
        )
        self.robot = Robot(
            FirmwareBus(self.arm), self.arm.clock, ARM, "disk", gripper=gripper, evidence=folder
        )
        patch.setattr(os, "fsync", self.fsync)

    def fsync(self, _: int) -> None:
        self.syncs += 1
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.arm.run(SLOW_DISK)

    def kept(self) -> float:
        return float(json.loads(self.file.read_text())["width"])


@pytest.fixture
def world(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> World:
    return World(tmp_path, monkeypatch)


def test_a_slow_disk_does_not_delay_the_jaws(world: World) -> None:
    with world.robot as robot:
        robot.home()
        for width in (0.06, 0.1, 0.05):
            assert robot.gripper.move(width).result().reached_goal
            assert world.kept() == pytest.approx(width)
        assert world.syncs == 6, "file and folder, once for each width"
        assert robot.faults == ()
        robot.move_joints((-2.0, 0.3, 2.0, 2.0))


def test_a_full_disk_refuses_a_gripper_motion_without_a_fault(world: World) -> None:
    with world.robot as robot:
        robot.home()
        robot.gripper.move(0.06)
        pulse, world.full = world.servo.pulse(), True
        with pytest.raises(GripperError, match="the gripper's width cannot be kept"):
            robot.gripper.move(0.1)
        assert world.servo.pulse() == pulse
        assert robot.gripper.move(0.06).result().reached_goal
        robot.move_joints((-2.0, 0.3, 2.0, 2.0))
        assert robot.faults == ()
        world.full = False
        assert robot.gripper.move(0.1).result().reached_goal


@pytest.mark.parametrize("full", [False, True])
def test_the_width_at_which_the_jaws_were_stopped_is_stored(
    world: World, full: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    with world.robot as robot:
        robot.gripper.move(0.11)
        steps, step = 0, Loop.step

        def stopping(loop: Loop, before: Callable[[], object] | None = None) -> CycleReport:
            nonlocal steps
            steps += 1
            if steps == 20:
                robot.stop()
                world.full = full
            return step(loop, before)

        monkeypatch.setattr(Loop, "step", stopping)
        with pytest.raises(MotionCancelledError, match="interrupted while moving the jaws"):
            robot.gripper.move(0.04)
        width = robot.runner.arm.session.gripper._gripper.state.width
        assert 0.045 < width < 0.105
        if full:
            assert world.kept() == pytest.approx(0.04)
            assert any("cannot be kept" in warning for warning in robot.warnings)
            world.full = False
            robot.gripper.disable()
        else:
            assert world.kept() == pytest.approx(width)
        assert robot.faults == ()


def test_a_cycle_accesses_no_file_except_the_servo_output(
    cycles: list[Asked], world: World
) -> None:
    """Also not in an arm's first motion, where a late import would."""
    duty = next(world.servo.root.glob("*/*/duty_cycle"))
    with world.robot as robot:
        robot.home()
        robot.move_joints((-2.0, 0.3, 2.0, 2.0))
        velocities = iter([JointVelocity(0.1)] * 5)
        robot.jog(lambda: next(velocities, None))
        assert len(cycles) > 1000
        assert [asked for asked in cycles if asked.calls or asked.transfers] == []
        for width in (0.06, 0.1):
            robot.gripper.move(width)
        told = [asked for asked in cycles if asked.calls or asked.transfers]
    assert told == [Asked([f"open {duty}"], 1)] * 2
