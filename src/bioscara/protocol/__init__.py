"""Wire protocol: conversion between values and bytes. No I/O.

``registers`` is the only table, ``rows`` defines its rows, ``enums`` names the numbers in it and
those on the wire, ``codec`` turns a row and its values into frames of version 1 or 2, ``crc`` is
their check byte, ``generate`` renders the table as the firmware's header and as docs/protocol.md.

Invariant: decode(encode(x)) = x up to the resolution of the field.
"""

from bioscara.protocol.codec import READ as READ
from bioscara.protocol.codec import TRAILER as TRAILER
from bioscara.protocol.codec import WRITE as WRITE
from bioscara.protocol.codec import Answer as Answer
from bioscara.protocol.codec import Message as Message
from bioscara.protocol.crc import crc8 as crc8
from bioscara.protocol.enums import BrakeMode as BrakeMode
from bioscara.protocol.enums import Capability as Capability
from bioscara.protocol.enums import Fault as Fault
from bioscara.protocol.enums import Flags as Flags
from bioscara.protocol.enums import JointState as JointState
from bioscara.protocol.enums import Refusal as Refusal
from bioscara.protocol.enums import Register as Register
from bioscara.protocol.enums import ResetCause as ResetCause
from bioscara.protocol.registers import MAGIC as MAGIC
from bioscara.protocol.registers import PROTOCOL as PROTOCOL
from bioscara.protocol.registers import REGISTERS as REGISTERS
from bioscara.protocol.registers import SILENCE as SILENCE
from bioscara.protocol.registers import WATCHDOG_MS as WATCHDOG_MS
