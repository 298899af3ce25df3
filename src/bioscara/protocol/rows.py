"""Types of the rows of the register table."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from bioscara.protocol.enums import Register

ABOVE_ZERO = 2.0**-149
"""Lower limit of a float that must exceed zero: the smallest that 32 bits hold."""


class Kind(Enum):
    """Type of a field; the value is its :mod:`struct` code (little endian on the wire)."""

    U8 = "B"
    I8 = "b"
    U16 = "H"
    I16 = "h"
    U32 = "I"
    I32 = "i"
    F32 = "f"


class Access(Enum):
    """How a register is used."""

    NONE = "-"
    READ = "R"
    WRITE = "W"
    READ_WRITE = "R/W"
    """Written with a payload, read without one."""
    EXCHANGE = "X"
    """A payload each way in one transaction."""


class Support(Enum):
    """Support of a register by the version 1 firmware on existing arms."""

    YES = "yes"
    NAMED = "named only"
    NO = "no"


@dataclass(frozen=True, slots=True)
class Field:
    """One value in a payload.

    Attributes:
        name: Name of the value.
        kind: Type on the wire.
        unit: Unit of the value, ``""`` for a pure number.
        lower: Lowest meaningful value; None for the lowest of the type.
        upper: Highest meaningful value; None for the highest of the type.
        scale: Value of one step of an integer field: value = integer * scale.
        padding: True for a byte that is sent as zero and ignored.
    """

    name: str
    kind: Kind
    unit: str = ""
    lower: float | None = None
    upper: float | None = None
    scale: float = 1.0
    padding: bool = False


@dataclass(frozen=True, slots=True)
class Definition:
    """One row of the table.

    Attributes:
        register: The code.
        access: How it is used.
        meaning: Its effect, for the generated page and header.
        written: Payload of a write or exchange, in wire order.
        read: Payload of a read or exchange, in wire order, flags not included.
        version: First protocol version that knows it.
        support: Its support by existing version 1 firmware.
        blocking: BUSY until it ends; the host polls.
        motion: It can move the joint: needs an enabled joint, and a trailer once armed.
        setpoint: Whether each intact, newer frame feeds the joint's setpoint watchdog.
    """

    register: Register
    access: Access
    meaning: str
    written: tuple[Field, ...] = ()
    read: tuple[Field, ...] = ()
    version: int = 1
    support: Support = Support.YES
    blocking: bool = False
    motion: bool = False
    setpoint: bool = False
