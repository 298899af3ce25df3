"""The joints as they describe themselves: firmware, boot, temperature, counters of errors."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable

from bioscara.api import messages as m
from bioscara.hardware.axis import Axis
from bioscara.protocol import Capability, Fault
from bioscara.robot.operations.read_counters import Counters, ReadCounters
from bioscara.robot.runner import Runner

_COUNTERS_PERIOD = 2.0
"""Least time between two readings of the joints' counters [s]."""


class JointReports:
    """Describes the joints; keeps their counters, which are read at most every 2 s.

    Args:
        runner: Runs the operations of the arm.
        clock: Returns the time [s].
    """

    def __init__(self, runner: Runner, clock: Callable[[], float]) -> None:
        self._runner, self._arm, self._clock = runner, runner.arm, clock
        self._reading = threading.Lock()
        self._due = -math.inf
        self._counted = math.nan
        self._counters: dict[str, Counters] = {}

    def ask(self) -> m.JointList:
        """Return the joints; called by any thread but the loop's.

        Raises:
            NotInitializedError: The arm is not connected.
        """
        with self._reading:
            if self._clock() >= self._due and self._runner.watched:
                self._read()
        joints = tuple([self._joint(axis) for axis in self._arm.stack.hardware.axes])
        return m.JointList(joints, self._counted)

    def _read(self) -> None:
        read = self._runner.execute(ReadCounters())
        self._due = self._clock() + _COUNTERS_PERIOD
        if read:
            self._counters.update(read)
            self._counted = self._arm.session.clock.now()

    def _joint(self, axis: Axis) -> m.JointValue:
        hello = axis.joint.hello
        counters = self._counters.get(axis.name)
        return m.JointValue(
            name=axis.name,
            address=axis.parameters.address,
            protocol=axis.version,
            firmware="" if hello is None else ".".join(map(str, hello.firmware)),
            boot_id=None if hello is None else hello.boot_id,
            reset_cause="" if hello is None else _words(hello.reset_cause.name),
            capabilities=() if hello is None else _names(hello.capabilities),
            mode=_words(axis.mode.name),
            halted="" if axis.halted is None else str(axis.halted),
            hot=_hot(axis, counters),
            retries=axis.joint.session.retries,
            counters=None if counters is None else _counted(counters),
        )


def _hot(axis: Axis, counters: Counters | None) -> bool | None:
    if getattr(axis.halted, "fault", "") == Fault.OVERTEMPERATURE.name:
        return True
    return None if counters is None else counters.report.fault == Fault.OVERTEMPERATURE.name


def _counted(counters: Counters) -> m.JointCounters:
    report = counters.report
    return m.JointCounters(
        fault=report.fault,
        data=report.data,
        refusal=report.refusal,
        broken=report.crc_errors,
        refused=report.refusals,
        bus_errors=counters.bus_errors,
    )


def _names(capabilities: Capability) -> tuple[str, ...]:
    return tuple([_words(each.name or "") for each in capabilities])


def _words(name: str) -> str:
    return name.lower().replace("_", " ")
