"""Wire protocol: conversion between values and bytes. No I/O.

``registers`` is the only table, ``rows`` defines its rows, ``enums`` names the numbers in it and
those on the wire, ``codec`` turns a row and its values into frames of version 1 or 2, ``crc`` is
their check byte, ``generate`` renders the table as the firmware's header and as docs/protocol.md.

Invariant: decode(encode(x)) = x up to the resolution of the field.
"""

from bioscara.protocol.codec import (
    READ as READ,
    TRAILER as TRAILER,
    WRITE as WRITE,
    Answer as Answer,
    Message as Message,
)
from bioscara.protocol.crc import crc8 as crc8
from bioscara.protocol.enums import (
    BrakeMode as BrakeMode,
    Capability as Capability,
    Fault as Fault,
    Flags as Flags,
    JointState as JointState,
    Refusal as Refusal,
    Register as Register,
    ResetCause as ResetCause,
    Warnings as Warnings,
)
from bioscara.protocol.registers import (
    MAGIC as MAGIC,
    PROTOCOL as PROTOCOL,
    REGISTERS as REGISTERS,
    SILENCE as SILENCE,
    WATCHDOG_MS as WATCHDOG_MS,
)
