"""The logger ``bioscara``: calls, ends, refusals and faults; a slow handler delays no cycle."""

from __future__ import annotations

import logging
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from bioscara import BioscaraError, Pose, Robot
from bioscara.errors import UnreachableError
from simulated import simulated_robot

HALF = (0.3, 0.2, 0.8, -0.5)


class Kept(logging.Handler):
    """Keeps the texts; waits for ``go`` before each."""

    def __init__(self) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.threads: set[str] = set()
        self.go = threading.Event()
        self.go.set()

    def emit(self, record: logging.LogRecord) -> None:
        self.go.wait(10.0)
        self.texts.append(f"{record.levelname} {record.getMessage()}")
        self.threads.add(threading.current_thread().name)


@pytest.fixture
def kept() -> Iterator[Kept]:
    logger, handler = logging.getLogger("bioscara"), Kept()
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    yield handler
    logger.removeHandler(handler)
    logger.setLevel(before)


def test_a_robot_logs_what_is_done_with_it(kept: Kept, tmp_path: Path) -> None:
    arm, _, robot = simulated_robot(tmp_path, homed=True, at=HALF)
    with robot:
        robot.move_relative(z=0.01)
        with pytest.raises(UnreachableError) as refusal:
            robot.move_to(Pose(0.9, 0.0, 0.2))
        robot.move_relative(z=-0.01, wait=False).result()
        arm.add_obstacle("j1", 0.4)
        with pytest.raises(BioscaraError) as stall:
            robot.move_joints((0.9, 0.2, 0.8, -0.5))
    assert stall.value.evidence is not None
    assert kept.texts == [
        f"INFO connected: {robot.description}",
        "INFO move_relative() called",
        "INFO move_relative() succeeded",
        "INFO move_to() called",
        f"WARNING move_to() refused: {refusal.value}",
        "INFO move_relative() called",
        "INFO move_relative() succeeded",
        "INFO move_joints() called",
        f"ERROR move_joints() failed: {stall.value}",
        f"INFO closed: {robot.description}",
    ]
    assert stall.value.evidence in kept.texts[-2]


def test_a_handler_that_hangs_delays_no_cycle(kept: Kept, tmp_path: Path) -> None:
    _, _, robot = simulated_robot(tmp_path, homed=True, at=HALF)
    with robot:
        motion = robot.move_relative(z=0.01, wait=False)
        kept.go.clear()
        # The thread that runs the loop has ended it, and no handler has returned.
        motion.result(10.0)
        assert "INFO move_relative() succeeded" not in kept.texts
        kept.go.set()
    assert "INFO move_relative() succeeded" in kept.texts
    assert kept.threads == {"MainThread", "bioscara-log"}


def test_without_configuration_nothing_is_written() -> None:
    program = (
        "from bioscara import BioscaraError, Pose, Robot\n"
        "with Robot.simulated(homed=True) as robot:\n"
        "    try: robot.move_to(Pose(450.0, 0.0, 0.1))\n"
        "    except BioscaraError: pass\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"", b"")


def test_a_robot_that_cannot_be_opened_is_logged(kept: Kept) -> None:
    robot = Robot.connect("sim:/nowhere.sock")
    with pytest.raises(BioscaraError) as error:
        robot.open()
    assert kept.texts == [f"WARNING open() refused: {error.value}"]
