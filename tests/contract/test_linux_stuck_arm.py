"""An arm behind the Linux bus when a line is held low: each transaction takes a kernel timeout."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.bus import FaultyBus, When
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import BusStuckError, JointLostError, OverrunError
from bioscara.report import CycleRecord
from bioscara.sim import SimulatedArm
from contract.preload import PreloadedBus
from simulated import ARM, NAMES, simulated_bus

TIMEOUT = 0.010
START, GOAL = (-2.5, 0.30, 2.2, 2.5), (-1.5, 0.25, 0.8, 1.0)
OpenLinux = Callable[..., PreloadedBus]


class Scene:
    """A robot on the Linux bus in front of an arm in virtual time, whose lines can be held."""

    def __init__(self, open_linux: OpenLinux, folder: Path, *, v1: bool = False) -> None:
        self.arm: SimulatedArm
        self.wire: FaultyBus
        self.arm, self.wire = simulated_bus(seed=3, v1=v1, frequency=400e3)
        self.bus = open_linux("pi4", self.wire)
        self.robot = Robot(self.bus, self.arm.clock, ARM, "linux", evidence=folder)

    def hold(self) -> None:
        self.wire.stuck(recognised=False, timeout=TIMEOUT)

    def move(self, strike: Callable[[], object]) -> None:
        """Move; the fault strikes in the fiftieth cycle."""
        cycles = 0

        def observe(_: CycleRecord) -> None:
            nonlocal cycles
            cycles += 1
            if cycles == 50:
                strike()

        self.robot.move_joints(GOAL, on_cycle=observe)


@pytest.fixture(params=[False, True], ids=["v2", "v1"])
def scene(open_linux: OpenLinux, tmp_path: Path, request: pytest.FixtureRequest) -> Scene:
    return Scene(open_linux, tmp_path, v1=request.param)


def test_bus5_a_held_line_is_the_first_fault_and_the_only_one(scene: Scene) -> None:
    robot, arm = scene.robot, scene.arm
    with robot:
        robot.home()
        robot.move_joints(START)
        with pytest.raises(BusStuckError) as caught:
            scene.move(scene.hold)
        (fault,) = robot.faults
        assert (fault.kind, fault.source) == (FaultKind.BUS_STUCK, "bioscara_arm")
        assert caught.value.reopened >= 1
        told = re.search(r"(\d+) transactions in a row with 4 joints", str(fault))
        assert told is not None
        # Those that were tried, not those that were answered without a try.
        assert 4 < int(told[1]) < 20
        robot.acknowledge()
        with pytest.raises(BusStuckError, match="re-opening the adapter"):
            robot.recover()
        scene.wire.clear()
        before = [arm.position(name) for name in NAMES]
        robot.recover()
        robot.enable()
        assert robot.state.positions == pytest.approx(before, abs=0.02)
        robot.move_joints(START)
        assert arm.position("j1") == pytest.approx(START[0], abs=0.01)


def test_one_slow_joint_is_no_stuck_bus(scene: Scene) -> None:
    robot = scene.robot
    with robot:
        robot.home()
        robot.move_joints(START)
        with pytest.raises((JointLostError, OverrunError)):
            scene.move(lambda: scene.wire.slow(2 * TIMEOUT, When(address=0x12), timeout=TIMEOUT))
        # Two frames of an original joint, each with its repetition, take longer than joints wait;
        # which of the two limits is met first depends on the cycle.
        late = {FaultKind.OVERRUN} if robot.joints[0].version == 1 else set()
        assert {fault.kind for fault in robot.faults} <= {FaultKind.JOINT_LOST, *late}
        scene.wire.clear()


def test_bus5_a_held_line_prevents_connecting_and_says_how_to_free_it(scene: Scene) -> None:
    scene.hold()
    with pytest.raises(BusStuckError, match="switch the joints off and on"):
        scene.robot.open()
