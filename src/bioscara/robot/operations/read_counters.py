"""Reading the counters of the joints while nothing moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from bioscara.drivers import Joint, Quality
from bioscara.drivers.link.joint_reports import FaultReport
from bioscara.errors import BioscaraError
from bioscara.protocol import Capability
from bioscara.robot.arm import Arm
from bioscara.robot.operations.operation import Cycles, Operation


class Counters(NamedTuple):
    """Counters of a joint since its boot.

    Attributes:
        report: Its latched fault, and the frames that arrived broken or were refused.
        bus_errors: Errors of the bus that it met; None if its firmware does not count them.
    """

    report: FaultReport
    bus_errors: int | None


class ReadCounters(Operation[Mapping[str, Counters]]):
    """Reads the counters of all joints that answer, one exchange between two cycles.

    It claims no device and leaves the remaining joints out as soon as something moves: on a bus of
    100 kHz an exchange takes the rest of a cycle, and no motion has to wait. Joints that did not
    answer in the last cycle are left out, as their silence would delay the next one, and so are
    those with their original firmware, which counts nothing.
    """

    devices = frozenset()

    def __init__(self) -> None:
        super().__init__("reading the counters")

    def cycles(self, arm: Arm) -> Cycles[Mapping[str, Counters]]:
        """Return the counters by the names of the joints."""
        found: dict[str, Counters] = {}
        for axis in arm.stack.hardware.axes:
            joint = axis.joint
            if joint.version < 2:
                continue
            values: list[Any] = []
            for read in _reads(joint):
                yield None
                if any(claim.devices for claim in arm.arbiter.running):
                    return found
                if axis.unreachable or axis.sample.quality is not Quality.FRESH:
                    break
                with suppress(BioscaraError):
                    values.append(read())
                # The exchange is not a late cycle.
                arm.restart_loop(self)
            if values and isinstance(values[0], FaultReport):
                found[axis.name] = Counters(values[0], values[1] if len(values) > 1 else None)
        return found


def _reads(joint: Joint) -> tuple[Callable[[], Any], ...]:
    hello = joint.hello
    if hello is None or not hello.capabilities & Capability.BUS_ERRORS:
        return (joint.get_fault,)
    return joint.get_fault, joint.get_bus_errors
