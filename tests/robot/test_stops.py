"""A stop ends all that runs in one call: waits, plans, and the operations that would follow."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar

import pytest

from bioscara import MotionCancelledError, Robot, StepSequence, run_sequence
from bioscara.errors import BioscaraError, FaultedError, LimitError, MotionTimeoutError
from bioscara.planning.collision.scene import Scene
from bioscara.report import Phase
from bioscara.robot.sequences.steps import Run
from bioscara.robot.tasks import MoveGripper, MoveJoints, Wait
from programs import wait_until
from served import HALF, own_robot
from simulated import NAMES, simulated_bus

AWAY = MoveJoints(positions=(0.9, 0.15, 0.2, 0.7))
LONG = 60.0


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    arm = simulated_bus(seed=2, homed=True, at=HALF).arm
    with own_robot(tmp_path_factory.mktemp("evidence"), arm=arm) as made:
        yield made


def places(robot: Robot) -> list[float]:
    """Return where the joints of the simulated arm are."""
    return [robot.bus.arm.position(name) for name in NAMES]  # type: ignore[attr-defined]


class Planned(StepSequence):
    """A sequence that calls ``planned``, if it is set, while it is planned."""

    planned: ClassVar[Callable[[], None] | None] = None

    def runs(self, first: int = 0, last: int | None = None) -> Iterator[Run]:
        *most, end = super().runs(first, last)
        yield from most
        if Planned.planned is not None:
            Planned.planned()
        yield end


def by_another_thread(stop: Callable[[], None]) -> None:
    thread = threading.Thread(target=stop)
    thread.start()
    thread.join()


def by_a_signal(stop: Callable[[], None]) -> None:
    before = signal.signal(signal.SIGUSR1, lambda *_: stop())
    os.kill(os.getpid(), signal.SIGUSR1)
    signal.signal(signal.SIGUSR1, before)


@pytest.mark.parametrize("by", [lambda stop: stop(), by_another_thread, by_a_signal])
@pytest.mark.parametrize("when", ["planning", "before a step", "in a wait"])
def test_a_stop_ends_a_sequence_and_nothing_moves_afterwards(
    when: str,
    by: Callable[[Callable[[], None]], None],
    robot: Robot,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot.move_joints(HALF)
    before = places(robot)
    robot.gripper.move(0.08)
    sequence = Planned(steps=(Wait(LONG), MoveGripper(0.05), AWAY))
    if when == "planning":
        monkeypatch.setattr(Planned, "planned", lambda: by(robot.stop))
    labels: list[str] = []

    def on_step(run: Run) -> None:
        labels.append(run.label)
        if when == "before a step":
            by(robot.stop)

    def on_cycle(_: object) -> None:
        if when == "in a wait":
            by(robot.stop)

    begin = robot.clock.now()
    with pytest.raises(MotionCancelledError):
        run_sequence(robot, sequence, on_step=on_step, on_cycle=on_cycle)
    assert robot.clock.now() - begin < 0.2
    assert labels == ([] if when == "planning" else ["1 wait"])
    assert places(robot) == pytest.approx(before, abs=1e-4)
    assert robot.gripper.width != pytest.approx(0.05)
    # A later call goes ahead.
    run_sequence(robot, StepSequence(steps=(Wait(0.1), AWAY)))
    assert robot.state.positions == pytest.approx(AWAY.positions, abs=1e-3)


def test_after_a_stop_no_call_of_a_block_begins_and_calls_of_others_do(robot: Robot) -> None:
    robot.move_joints(HALF)
    before = places(robot)
    plan = robot.plan.move_joints(AWAY.positions)
    with robot.one_call() as call:
        robot.gripper.move(0.05)
        assert not call.stopped
        with robot.one_call() as inner:
            robot.stop()
            assert inner.stopped
        assert call.stopped
        for begin in (
            lambda: robot.do(AWAY),
            lambda: robot.do(AWAY, wait=False),
            lambda: robot.execute(plan),
            lambda: robot.jog(lambda: None),
            lambda: robot.gripper.move(0.08),
            lambda: robot.rest(1.0),
            lambda: setattr(robot, "scene", Scene()),
            lambda: setattr(robot, "reduced_speed", True),
        ):
            with pytest.raises(MotionCancelledError, match="was stopped before anything moved"):
                begin()
        assert places(robot) == pytest.approx(before, abs=1e-4)
        assert robot.gripper.width == pytest.approx(0.05)
        other = threading.Thread(target=lambda: robot.move_joints(AWAY.positions))
        other.start()
        other.join()
        assert robot.state.positions == pytest.approx(AWAY.positions, abs=1e-3)
    robot.move_joints(HALF)


def test_a_rest_runs_cycles_of_the_arms_time_and_a_pause_holds_it(robot: Robot) -> None:
    phases: list[Phase] = []
    begin = robot.clock.now()
    robot.rest(6.0, on_cycle=lambda record: phases.append(record.phase))
    assert robot.clock.now() - begin == pytest.approx(6.0, abs=2.0 * robot.period)
    assert len(phases) == pytest.approx(6.0 / robot.period, abs=3)
    assert set(phases) == {Phase.WATCHING}

    cycles = 0

    def pausing(_: object) -> None:
        nonlocal cycles
        cycles += 1
        if cycles == 50:
            robot.pause()
        if cycles == 150:
            robot.resume()

    begin = robot.clock.now()
    robot.rest(1.0, on_cycle=pausing)
    assert robot.clock.now() - begin == pytest.approx(2.0, abs=5 * robot.period)
    with pytest.raises(MotionTimeoutError, match=r"not done within 0.5 s"):
        robot.rest(1.0, timeout=0.5)
    with pytest.raises(LimitError, match=r"is outside 0 .. 3600 s"):
        robot.rest(-1.0)
    robot.rest(0.0)


def test_a_rest_uses_no_device_and_follows_the_clock_of_a_watched_arm(tmp_path: Path) -> None:
    with Robot.simulated(evidence=tmp_path) as robot:
        robot.rest(0.5)
        assert not robot.is_enabled
        robot.watch(real_time_factor=20.0)
        begin = robot.state.time
        rest = robot.rest(2.0, wait=False)
        assert not robot.is_moving
        robot.enable()
        rest.result()
        assert rest.progress == 1.0
        # By the clock of this computer it would be 40 s.
        assert 1.9 < robot.state.time - begin < 20.0
        rest = robot.rest(LONG, wait=False)
        robot.simulate_fault("reset", "j1")
        with pytest.raises(BioscaraError, match="j1"):
            rest.result(60.0)
        wait_until(lambda: bool(robot.faults), "the fault is latched")
        with pytest.raises(FaultedError):
            robot.rest(1.0)
