"""Faults since the arm was clear, and the flight record of each group of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from bioscara.control.faults.flight_recorder import Evidence, FlightRecord
from bioscara.control.faults.kinds import ArmFault, FaultKind, Stop, indicates_power_loss
from bioscara.errors import BioscaraError, JointLostError, NotEnabledError

_AT_ONCE = 0.1
"""Joints that drop out within this time dropped out together [s]."""
_STRONGEST_FIRST = tuple(Stop)
EvidenceWriter = Callable[[Evidence, str, Sequence[ArmFault]], Path]
"""Writes a flight record, under a name, with the faults until its end; returns the new file."""


class FaultLog:
    """Faults in order of occurrence, with evidence for each group that occurred together.

    Attributes:
        faults: The faults, first cause first.
    """

    def __init__(self, record: FlightRecord, write: EvidenceWriter, joints: int) -> None:
        self._record, self._write, self._joints = record, write, joints
        self._groups: list[tuple[int, Evidence]] = []
        self.faults: list[ArmFault] = []

    @property
    def stop(self) -> Stop:
        """The strongest stop that any of the faults requires; there is at least one."""
        return min((fault.kind.stop for fault in self.faults), key=_STRONGEST_FIRST.index)

    def add(self, fault: ArmFault) -> bool:
        """Add a fault; return whether it is the first of its kind from its source.

        A loss of power is one fault: that other joints dropped out at once, and joints that do not
        answer could not be released, is its consequence.
        """
        lost_power = isinstance(fault.cause, BioscaraError) and indicates_power_loss(fault.cause)
        for old in self.faults:
            if old.kind is not FaultKind.POWER_LOST or fault.time - old.time > _AT_ONCE:
                continue
            silent = isinstance(old.cause, JointLostError)
            if lost_power or (silent and fault.kind is FaultKind.HARDWARE_FAILED):
                return False
        for old in self.faults:
            # One that was reclassified is not added again under its first kind.
            same = old.kind is fault.kind or (lost_power and old.kind is FaultKind.POWER_LOST)
            if same and old.source == fault.source:
                return False
        self.faults.append(fault)
        self._detect_power_loss(fault.time)
        return True

    def freeze(self) -> None:
        """Set the flight record aside as evidence of the faults since the last call."""
        self._groups.append((len(self.faults), self._record.freeze()))

    def keep(self) -> None:
        """Write the flight records that were set aside, each with the faults until then.

        Evidence written before is not written again. Faults whose record was not set aside yet
        get the current one.

        Raises:
            OSError: One cannot be written.
        """
        groups, begin = list(self._groups), 0
        if not groups or groups[-1][0] < len(self.faults):
            groups.append((len(self.faults), self._record.freeze()))
        for end, evidence in groups:
            new = [number for number in range(begin, end) if not self.faults[number].evidence]
            begin = end
            if not new:
                continue
            name = (
                f"fault-{self.faults[new[0]].kind.name.lower()}-{datetime.now(UTC):%Y%m%dT%H%M%S}"
            )
            path = self._write(evidence, name, self.faults[:end])
            for number in new:
                self.faults[number] = replace(self.faults[number], evidence=path)

    def clear(self) -> None:
        """Forget all faults."""
        self.faults.clear()
        self._groups.clear()

    def _detect_power_loss(self, time: float) -> None:
        """Reclassify as POWER_LOST where several joints dropped out as on a loss of power."""
        latest = [
            (number, fault)
            for number, fault in enumerate(self.faults)
            if time - fault.time <= _AT_ONCE
        ]
        # Joints that received nothing for too long release autonomously, still powered.
        unheard = any(fault.kind is FaultKind.OVERRUN for _, fault in latest)
        recent = {
            fault.source: number
            for number, fault in reversed(latest)
            if isinstance(fault.cause, BioscaraError)
            and indicates_power_loss(fault.cause)
            and not (unheard and isinstance(fault.cause, NotEnabledError))
        }
        if len(recent) >= self._joints - 1:
            first, *others = sorted(recent.values())
            self.faults[first] = replace(self.faults[first], kind=FaultKind.POWER_LOST)
            kept = self._groups[-1][0] if self._groups else 0
            for number in reversed(others):
                if number >= kept:
                    del self.faults[number]
