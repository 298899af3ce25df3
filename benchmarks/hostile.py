"""A moving arm with hostile viewers: lateness of its control loop, and STOP."""

from __future__ import annotations

import itertools
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.measure import Row, at_most, duration
from benchmarks.owner_process import Arm, served
from benchmarks.server import Client, stop_delays
from bioscara.api import messages as m, runtime
from bioscara.robot import tasks

VIEWERS = int(os.environ.get("BIOSCARA_VIEWERS", "8"))
SECONDS = float(os.environ.get("BIOSCARA_SECONDS", "8"))
"""Time for which the loop is observed with the attack and without, in turns [s]."""
TURNS = int(os.environ.get("BIOSCARA_TURNS", "2"))
STOPS = int(os.environ.get("BIOSCARA_STOPS", "30"))
NAME = "attacked"
PEACE = (0.2, 0.0, 0.8, -0.5)
_TESTS = Path(__file__).parents[1] / "tests"
_FLOOD = _TESTS / "hostile/owner_flood.py"


@contextmanager
def attacked(name: str, viewers: int = VIEWERS) -> Iterator[None]:
    """Let hostile viewers ask an owner everything, as fast as it reads, for a block of code.

    One process has all of them: like attackers on other computers, they take little of this one.
    """
    process = subprocess.Popen(
        [sys.executable, "-u", str(_FLOOD), name, "questions", str(viewers)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.fspath(_TESTS)},
    )
    assert process.stdout
    try:
        while "flooding" not in process.stdout.readline():
            pass
        time.sleep(2.0)
        yield
    finally:
        process.kill()
        process.wait()


class Mover:
    """A client that jogs the arm to and fro, and counts what ended its motion."""

    def __init__(self, name: str) -> None:
        self._client = Client(name, "mover")
        self.faults = 0

    def move(self, seconds: float) -> None:
        """Move for a time."""
        end, client = time.monotonic() + seconds, self._client
        # Anew each time: nothing renews it in between.
        epoch = client.ask(m.AcquireLease(time_to_live=60.0, force=True)).lease.epoch
        for sign in itertools.cycle((1.0, -1.0)):
            if time.monotonic() > end:
                return
            task = tasks.MoveJoints(positions=(0.5 * sign, *PEACE[1:]), velocity_scaling=0.5)
            begun = client.ask(m.Start(task=task), epoch)
            while client.ask(m.GetGoal(begun.goal.goal)).goal.status in {"running", "waiting"}:
                time.sleep(0.05)
            state = client.ask(m.GetGoal(begun.goal.goal)).goal
            if state.status != "succeeded":
                self.faults += 1
                return


def intervals(arm: Arm) -> list[float]:
    """Return by how much each cycle came later after the one before than the period [s]."""
    arm.tell("mark")
    time.sleep(SECONDS)
    return list(np.maximum(np.diff(arm.cycles()[:, 0]) - 0.01, 0.0))


def rows() -> list[Row]:
    """Measure, and compare with the same attack on another arm of this computer."""
    late: dict[str, list[float]] = {"here": [], "elsewhere": []}
    with TemporaryDirectory(prefix="b") as folder:
        os.environ[runtime.VARIABLE] = folder
        with served(NAME) as arm, served("other"):
            mover = Mover(NAME)
            for place, name in [("elsewhere", "other"), ("here", NAME)] * TURNS:
                with attacked(name):
                    moving = threading.Thread(target=mover.move, args=(SECONDS,))
                    moving.start()
                    late[place] += intervals(arm)
                    moving.join()
            with attacked(NAME):
                stops = stop_delays(arm, NAME, STOPS)
    here, elsewhere = (float(np.percentile(late[each], 99)) for each in ("here", "elsewhere"))
    stop = float(np.percentile(stops, 99))
    return [
        at_most(
            f"lateness of the loop beside {VIEWERS} hostile viewers, p99",
            here,
            1.5,
            elsewhere,
            "the same attack on another arm",
        ),
        Row(
            "faults of the moving arm",
            str(mover.faults),
            "none",
            "0",
            mover.faults == 0,
            math.inf if mover.faults else 0.0,
        ),
        Row(
            f"STOP beside {VIEWERS} hostile viewers, p99",
            f"{duration(stop)}, median {duration(float(np.median(stops)))}",
            "the loop's period: 10 ms",
            "at most 20 ms",
            stop <= 0.02,
            stop / 0.02,
        ),
    ]
