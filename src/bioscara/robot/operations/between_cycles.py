"""Work between two control cycles, in the thread that runs them; nothing moves."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import EVERYTHING, Device
from bioscara.robot.operations.operation import Cycles, Operation

T = TypeVar("T")


class BetweenCycles(Operation[T]):
    """Calls a function while no control cycle runs.

    Args:
        name: Name of the work in messages.
        work: The function.
        devices: The used devices; none for work that only reads.
    """

    def __init__(
        self, name: str, work: Callable[[Arm], T], devices: frozenset[Device] = EVERYTHING
    ) -> None:
        self.devices = devices
        super().__init__(name)
        self._work = work

    def prepare(self, arm: Arm) -> None:
        """Refuse to wait for cycles that do not come: the arm must be connected."""
        _ = arm.stack

    def cycles(self, arm: Arm) -> Cycles[T]:
        """Call the function, without a control cycle."""
        if self.devices:
            self.claim.require_not_stopped()
        result = self._work(arm)
        if self.devices:
            # It may have taken longer than a cycle.
            arm.restart_loop(self)
        return result
        yield
