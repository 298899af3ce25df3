"""Reports of a version 2 joint about itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from bioscara.protocol import Answer, Capability, Fault, Refusal, ResetCause


@dataclass(frozen=True, slots=True)
class Hello:
    """Identity of a joint.

    Attributes:
        protocol: Version of the protocol it speaks.
        firmware: Version of its firmware, major and minor.
        joint: Number of the joint, as its firmware was built.
        boot_id: A number that differs between boots.
        reset_cause: Why it booted.
        capabilities: Functions that it supports beyond version 1.
    """

    protocol: int
    firmware: tuple[int, int]
    joint: int
    boot_id: int
    reset_cause: ResetCause
    capabilities: Capability

    @property
    def starts_bootloader(self) -> bool:
        """Whether it starts its bootloader on request."""
        return bool(self.capabilities & Capability.BOOTLOADER)

    @property
    def reports_load(self) -> bool:
        """Whether it reports its load in answers to setpoints."""
        return bool(self.capabilities & Capability.LOAD)

    @classmethod
    def from_answer(cls, answer: Answer) -> Self:
        """Return the decoded answer to HELLO."""
        _, protocol, major, minor, joint, boot_id, cause, capabilities = map(int, answer.values)
        known = cause in ResetCause.__members__.values()
        return cls(
            protocol,
            (major, minor),
            joint,
            boot_id,
            ResetCause(cause) if known else ResetCause.UNKNOWN,
            Capability(capabilities),
        )


@dataclass(frozen=True, slots=True)
class FaultReport:
    """Reason of a joint's autonomous stop, and its refusals.

    Attributes:
        fault: Name of the first fault since cleared, ``"NONE"`` without one.
        data: The number stored with it; for its meaning see :class:`bioscara.protocol.Fault`.
        refusal: Name of the reason of the last refusal.
        crc_errors: Frames that arrived broken, since boot.
        refusals: Frames that were refused, since boot.
    """

    fault: str
    data: float
    refusal: str
    crc_errors: int
    refusals: int

    @classmethod
    def from_answer(cls, answer: Answer) -> Self:
        """Return the decoded answer to FAULT; a number of newer firmware is named by its digits."""
        fault, data, refusal, crc_errors, refusals = answer.values
        return cls(
            _name(Fault, int(fault)),
            data,
            _name(Refusal, int(refusal)),
            int(crc_errors),
            int(refusals),
        )


_EXCEPTIONS = {2: "NMI", 3: "HardFault", 4: "MemManage", 5: "BusFault", 6: "UsageFault"}
"""Names of the processor's exceptions, from the Cortex-M4 generic user guide."""
_FIRST_INTERRUPT = 16


@dataclass(frozen=True, slots=True)
class ExceptionReport:
    """An exception of the processor that restarted a joint.

    Attributes:
        vector: Number of its vector: 2 for NMI, 3 for HardFault; 16 and more are interrupts; 0
            where the program itself gave up.
        address: Address of the instruction; 0 where the stack was unusable.
        status: Fault status of the Cortex-M4, its register CFSR.
        starts: Starts of the joint since then; 1 for the present one.
    """

    vector: int
    address: int
    status: int
    starts: int

    def __str__(self) -> str:
        place = f"at {self.address:#010x}" if self.address else "at an unknown address"
        return f"{self.name} {place} (CFSR {self.status:#010x})"

    @property
    def name(self) -> str:
        """Name of the exception, as ``HardFault``."""
        if self.vector >= _FIRST_INTERRUPT:
            return f"interrupt {self.vector - _FIRST_INTERRUPT}"
        return _EXCEPTIONS.get(self.vector, f"exception {self.vector}")

    @classmethod
    def from_answer(cls, answer: Answer) -> Self | None:
        """Return the decoded answer to EXCEPTION; None if there was none since power came up."""
        vector, address, status, starts = map(int, answer.values)
        return cls(vector, address, status, starts) if starts else None


def _name(kind: type[Fault] | type[Refusal], number: int) -> str:
    try:
        return kind(number).name
    except ValueError:
        return f"number {number}"
