"""Planning of the motions that clients command, in a process of its own."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import TypeVar

from bioscara.errors import BioscaraError
from bioscara.processes.worker import Worker
from bioscara.robot.planner import Planner
from bioscara.robot.workspace.workspace import Workspace
from bioscara.server.channel import work

T = TypeVar("T")

_TIMEOUT = 30.0
"""Longest time of a plan [s]: to check a trajectory of 80 minutes takes as long."""
_MEMORY = 512
"""Memory that a plan may take [MiB]."""


class MotionPlanning:
    """Lets a process plan, in which no question of another client waits.

    It has the interface of :func:`bioscara.robot.planner.planned_here`. The thread that asks waits,
    and leaves the processor to the control loop.
    """

    def __init__(self) -> None:
        self._worker = Worker(memory=_MEMORY)
        self._lock = threading.Lock()
        self._workspace: tuple[Workspace | None, bytes] = None, b""

    def start(self, workspace: Workspace) -> None:
        """Begin the process, and let it plan once, as its first plan takes ten times as long.

        Returns at once.

        Args:
            workspace: The workspace.
        """
        self._worker.start()
        threading.Thread(
            target=self._warm_up, args=(workspace,), name="bioscara-planning", daemon=True
        ).start()

    def _warm_up(self, workspace: Workspace) -> None:
        here = [0.5 * (each.lower + each.upper) for each in workspace.parameters.joints]
        with suppress(BioscaraError):
            self(work.warm_up, workspace, here)

    def __call__(
        self, make: Callable[[Planner], T], workspace: Workspace, positions: Sequence[float], /
    ) -> T:
        """Return the plan of a function.

        Args:
            make: The function, picklable.
            workspace: The workspace.
            positions: Where the joints are [rad, m, rad, rad].

        Raises:
            EffortError: It takes more time or memory.
            Exception: As the function does.
        """
        with self._lock:
            if workspace is not self._workspace[0]:
                self._workspace = workspace, pickle.dumps(workspace)
            data = self._workspace[1]
        plan: Callable[..., T] = work.planned
        return self._worker.call(_TIMEOUT, plan, make, data, tuple(positions))

    def close(self) -> None:
        """End the process."""
        self._worker.close()
