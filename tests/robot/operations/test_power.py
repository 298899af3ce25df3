"""Enabling and disabling take seconds: control cycles, and their observers, go on meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from bioscara.errors import FaultedError, HardwareError, JointError, MotionCancelledError
from bioscara.hardware import LifecycleState
from bioscara.sim import SimulatedArm
from robot.bench import Bench
from simulated import NAMES, NEAR

GAP = 0.05
"""Longest time between two cycles [s]: a step of enabling may take some cycles of the bus."""


@pytest.fixture(params=[False, True], ids=["v2", "v1"])
def made(tmp_path: Path, request: pytest.FixtureRequest) -> Bench:
    arm = SimulatedArm(seed=2, positions=NEAR, v1=request.param)
    return Bench(arm, tmp_path / "evidence")


def times(scene: Bench, call: Callable[[], object]) -> list[float]:
    """Return the times of the cycles of a call, with those of its begin and its end [s]."""
    seen = [scene.arm.clock.now()]
    runner = scene.robot.runner
    before, runner.observers = runner.observers, (lambda cycle: seen.append(cycle.time),)
    call()
    runner.observers = before
    return [*seen, scene.arm.clock.now()]


def test_cycles_go_on_while_the_joints_are_enabled_and_disabled(made: Bench) -> None:
    with made.robot as robot:
        for call in (robot.enable, robot.disable, robot.enable, robot.disable):
            seen = times(made, call)
            assert seen[-1] - seen[0] > 0.2
            assert max(after - before for before, after in pairwise(seen)) < GAP, call
            enabled = robot.runner.arm.stack.hardware.state is LifecycleState.ACTIVE
            assert enabled == (call == robot.enable)
            assert all(made.arm.has_torque(name) == enabled for name in NAMES)
        assert robot.runner.arm.stack.loop.statistics.overruns == 0
        assert robot.warnings == ()


def after_cycles(scene: Bench, count: int, act: Callable[[], object]) -> None:
    """Do something in the cycle of that number from now on."""
    runner = scene.robot.runner
    cycles = iter(range(count, -1, -1))
    runner.observers = (lambda _: next(cycles, 1) == 0 and act(),)


def released(scene: Bench) -> bool:
    state = scene.robot.runner.arm.stack.hardware.state
    return state < LifecycleState.ACTIVE and not any(map(scene.arm.has_torque, NAMES))


def test_a_stop_while_joints_are_enabled_releases_them(made: Bench) -> None:
    with made.robot as robot:
        after_cycles(made, 5, robot.stop)
        with pytest.raises(MotionCancelledError, match="before anything moved"):
            robot.enable()
        assert released(made)
        robot.enable()
        assert not released(made)


def test_a_joint_lost_meanwhile_is_the_fault_and_the_others_are_released(made: Bench) -> None:
    with made.robot as robot:
        after_cycles(made, 5, lambda: made.arm.set_power("j4", False))
        with pytest.raises((FaultedError, JointError), match="j4"):
            robot.enable()
        assert robot.faults[0].source == "j4"
        assert released(made)


def test_a_joint_lost_while_joints_are_disabled_keeps_none_enabled(made: Bench) -> None:
    with made.robot as robot:
        robot.enable()
        after_cycles(made, 3, lambda: made.arm.set_power("j4", False))
        with pytest.raises(HardwareError, match="j4 may be energised"):
            robot.disable()
        assert released(made)
        assert [fault.source for fault in robot.faults] == ["j4"]
        made.arm.set_power("j4", True)


def test_ctrl_c_while_joints_are_disabled_keeps_none_enabled(made: Bench) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    with made.robot as robot:
        robot.enable()
        after_cycles(made, 3, interrupt)
        with pytest.raises(KeyboardInterrupt):
            robot.disable()
        assert released(made)
