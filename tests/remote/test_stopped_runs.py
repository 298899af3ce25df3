"""A stop ends a run on an arm that another process owns, whichever client stops it, and when."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from bioscara import MotionCancelledError, OwnerLostError, StepSequence, run_sequence
from bioscara.planning import Trajectory
from bioscara.remote import RemoteRobot
from bioscara.robot.sequences.steps import Run
from bioscara.robot.tasks import MoveJoints, Wait
from programs import environment, wait_for_line
from served import HALF, NAME, arm_served, runtime_folder
from simulated import NAMES

AWAY = MoveJoints(positions=(0.9, 0.15, 0.2, 0.7), velocity_scaling=0.5)
LONG = 3600.0
Start = Callable[..., subprocess.Popen[str]]


def stopped(robot: RemoteRobot, stop: Callable[[], object], when: str) -> None:
    """Let a run be stopped, and require that the arm stays where it is."""
    begun: list[str] = []

    class Planned(StepSequence):
        def runs(self, first: int = 0, last: int | None = None) -> Iterator[Run]:
            *most, end = super().runs(first, last)
            yield from most
            if when == "planning":
                stop()
            yield end

    def on_step(run: Run) -> None:
        begun.append(run.label)
        if when == "before a step":
            stop()
        if when == "in a wait" and len(begun) == 2:
            waiting.start()

    waiting = threading.Thread(target=stop)
    before = robot.state.positions
    with pytest.raises(MotionCancelledError):
        run_sequence(robot, Planned(steps=(Wait(0.1), Wait(LONG), AWAY)), on_step=on_step)
    assert len(begun) == ("planning", "before a step", "in a wait").index(when)
    assert not robot.is_moving
    assert robot.state.positions == pytest.approx(before, abs=1e-4)
    if when == "in a wait":
        waiting.join()


def test_a_stop_ends_a_sequence_and_nothing_moves_afterwards(start: Start, tmp_path: Path) -> None:
    def command() -> None:
        assert start("-m", "bioscara", "stop", "--arm", NAME, env=environment()).wait(20.0) == 0

    words = ("--name", NAME, "--real-time-factor", "10", "--table", str(tmp_path / "poses.yaml"))
    with runtime_folder():
        owner = start("-m", "bioscara", "serve", *words, env=environment())
        wait_for_line(owner, "is served")
        with RemoteRobot(NAME) as robot:
            robot.home()
            robot.move_joints(HALF)
            for stop in (robot.stop, command):
                for when in ("planning", "before a step", "in a wait"):
                    stopped(robot, stop, when)
                    robot.acquire_lease()
            # Later calls go ahead; a wait is one of the arm's time.
            begin, real = robot.state.time, time.monotonic()
            run_sequence(robot, StepSequence(steps=(Wait(5.0), AWAY)))
            assert robot.state.positions == pytest.approx(AWAY.positions, abs=2e-3)
            assert robot.state.time - begin > 5.0
            assert time.monotonic() - real < 5.0
            rest = robot.rest(LONG, wait=False)
            owner.kill()
            with pytest.raises(OwnerLostError):
                rest.result(20.0)


def test_a_stop_between_the_requests_of_one_call_ends_it() -> None:
    begun = threading.Event()

    class Sent(Trajectory):
        def __getattribute__(self, name: str) -> object:
            if name == "positions":
                begun.set()
            return super().__getattribute__(name)

    times = np.linspace(0.0, 600.0, 60_001)
    share = (0.5 - 0.5 * np.cos(np.pi * times / times[-1]))[:, None]
    slow = Sent(NAMES, times, HALF + share * (0.4, 0.0, 0.0, 0.0))
    ended: list[BaseException] = []

    def follow() -> None:
        try:
            robot.follow(slow, approach=True)
        except BaseException as error:  # noqa: BLE001  compared below
            ended.append(error)

    with arm_served(speed=5.0) as served, RemoteRobot(NAME) as robot:
        for delay in (0.0, 0.002, 0.01, 0.05, 0.1, 0.2, 0.4, 0.8):
            begun.clear()
            thread = threading.Thread(target=follow)
            thread.start()
            begun.wait()
            time.sleep(delay)
            robot.stop()
            thread.join(20.0)
            assert isinstance(ended.pop(), MotionCancelledError), delay
            assert not served.robot.is_moving
