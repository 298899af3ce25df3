"""Generation of the firmware's header and docs/protocol.md from the register table.

``python -m bioscara.protocol.generate ROOT`` writes both below a checkout; with ``--check`` it
writes nothing and fails when a file differs from the generated text.
"""

from __future__ import annotations

import argparse
import struct
import sys
from collections.abc import Callable
from enum import IntEnum, IntFlag
from pathlib import Path

from bioscara.protocol.codec import field_bounds
from bioscara.protocol.enums import (
    BrakeMode,
    Capability,
    Fault,
    Flags,
    JointState,
    Refusal,
    Register,
    ResetCause,
    Warnings,
)
from bioscara.protocol.registers import (
    BLOCK_SAMPLES,
    CAPTURE_SAMPLES,
    MAGIC,
    PROTOCOL,
    REGISTERS,
    VELOCITY_STEP_RPM,
)
from bioscara.protocol.rows import ABOVE_ZERO, Definition, Field, Kind

_ENUMS: tuple[type[IntEnum] | type[IntFlag], ...] = (
    Flags,
    JointState,
    Fault,
    Refusal,
    ResetCause,
    Capability,
    Warnings,
    BrakeMode,
)


def _size(fields: tuple[Field, ...]) -> int:
    return struct.calcsize("<" + "".join(field.kind.value for field in fields))


_HEADER_BEGIN = """\
// Generated from src/bioscara/protocol by python -m bioscara.protocol.generate.
// Do not edit: change the table and generate again.
#pragma once

#include <stdint.h>

namespace bioscara {
"""
_STRUCT = """\
// The range of a written value.
template <typename T>
struct Range {
  T lower;
  T upper;
};

enum class Direction : uint8_t { NONE, READ, WRITE, READ_WRITE, EXCHANGE };

// One row of the register table. Sizes are payload bytes; flags and trailer come on top.
struct Definition {
  Register code;
  Direction direction;
  uint8_t written;
  uint8_t read;
  uint8_t version;
  bool blocking;
  bool motion;
  bool setpoint;
  // Type of the first value written, and the place of its range: a number in kNumberRanges, a byte
  // and those after it in kByteRanges.
  Kind kind;
  uint8_t range;
};
"""
_HEADER_END = f"""\
constexpr uint16_t kMagic = 0x{MAGIC:04X};
constexpr uint8_t kProtocolVersion = {PROTOCOL};
constexpr float kVelocityStepRpm = {VELOCITY_STEP_RPM}F;
constexpr uint16_t kCaptureSamples = {CAPTURE_SAMPLES};
constexpr uint8_t kBlockSamples = {BLOCK_SAMPLES};
constexpr uint8_t kCaptureBlockMost = {(CAPTURE_SAMPLES - 1) // BLOCK_SAMPLES};

}}  // namespace bioscara
"""


def render_header() -> str:
    """Return the text of firmware/joint/src/generated/registers.h."""
    lines = [_HEADER_BEGIN]
    for enum in (Register, *_ENUMS):
        lines.append(f"enum class {enum.__name__} : uint8_t {{")
        lines += [f"  {member.name} = 0x{member.value:02X}," for member in enum]
        lines += ["};", ""]
    lines += [f"enum class Kind : uint8_t {{ {', '.join(kind.name for kind in Kind)} }};", ""]
    rows, numbers, octets = list[str](), list[str](), list[str]()
    for row in REGISTERS:
        kind = row.written[0].kind if row.written else Kind.U8
        ranges = octets if struct.calcsize(kind.value) == 1 else numbers
        flags = ", ".join(str(flag).lower() for flag in (row.blocking, row.motion, row.setpoint))
        rows.append(
            f"    {{Register::{row.register.name}, Direction::{row.access.name}, "
            f"{_size(row.written)}, {_size(row.read)}, {row.version}, {flags}, "
            f"Kind::{kind.name}, {len(ranges)}}},"
        )
        for field in row.written if ranges is octets else row.written[:1]:
            # The joint compares unsigned bytes: none that is signed has limits.
            low, high = (0, 255) if field.kind is Kind.I8 else field_bounds(field)
            text = (
                f"{low:.0f}, {high:.0f}" if ranges is octets else f"{float(low)}F, {float(high)}F"
            )
            ranges.append(f"    {{{text}}},  // {row.register.name} {field.name}")
    lines += [_STRUCT, "constexpr Range<float> kNumberRanges[] = {", *numbers, "};", ""]
    lines += ["constexpr Range<uint8_t> kByteRanges[] = {", *octets, "};", ""]
    lines += ["constexpr Definition kDefinitions[] = {", *rows]
    return "\n".join([*lines, "};", "", _HEADER_END])


def _payload(fields: tuple[Field, ...]) -> str:
    if not fields:
        return "-"
    return ", ".join(_describe(field) for field in fields)


def _describe(field: Field) -> str:
    text = f"{field.kind.name.lower()} {field.name}"
    if field.padding:
        return text
    unit = f" {field.unit}" if field.unit else ""
    text += f" [{field.unit}]" if field.unit else ""
    if field.scale != 1.0:
        text += f" in steps of {field.scale:g}{unit}"
    if field.lower is not None or field.upper is not None:
        low, high = field_bounds(field)
        least = "above 0" if low == ABOVE_ZERO else f"{low:g}"
        text += f" {least}.." if field.upper is None else f" {least}..{high:g}"
    return text


def _row(row: Definition) -> str:
    return (
        f"| 0x{row.register:02X} | {row.register.name} | {row.access.value} "
        f"| {_payload(row.written)} | {_payload(row.read)} | {'yes' if row.blocking else ''} "
        f"| {row.version} | {row.support.value} | {row.meaning} |"
    )


_PROSE = """\
# The wire protocol

<!-- Generated from src/bioscara/protocol by python -m bioscara.protocol.generate. -->

A joint is an I2C target; its address is 0x10 plus its number. Every transaction is a write and,
after a repeated start, a read. Numbers are little endian, angles are degrees of the motor shaft.

## Version 1

    write [register][payload]      read [payload][flags]

A write is answered with the flags alone, a read with the payload and the flags. Bits 4 to 7 of
the flags are zero. The flags state the joint's condition, not the result of the command just sent:
a command is executed after the transaction. A blocking command shows BUSY at once; the host polls
until it clears. The deviations of the original firmware, and their consequences for the host, are
in [a table of its own](drivers.md#joint-firmware-original-and-ours).

## Version 2

    write [register][payload][seq][crc]      read [payload][flags][seq][crc]

The trailer is a sequence number and a CRC-8 (polynomial 0x07, start 0) over the address byte of
that direction and all that follows it. A joint distinguishes the versions by length: no version 1
length of a register equals its version 2 length.

- A frame whose sequence number was the last one executed is answered again from memory. An older
  one (by signed 8-bit difference) is refused. So a host may repeat any frame whose answer it
  lost.
- A frame that is not executed is answered `[flags][seq][crc]` with REFUSED set, and filler where
  more bytes are requested. FAULT states the reason. A frame of which neither register and length
  nor CRC fit gets the flags alone, as one of version 1: the trailer is missing.
- `HELLO` is accepted with any sequence number. `ARM` with the joint's boot id and a session
  number that is new to this boot opens a session: sequence numbers count from its own, and
  every write without trailer but STOP is refused until the joint restarts or is disarmed.
- Without a session, a joint that received an intact frame with trailer refuses SETUP and the motion
  commands without one (TRAILER_REQUIRED) for 10 s: a version 2 host is using it. HELLO is such
  a frame; DISARM ends these 10 s at once. STOP, reads and settings are accepted always. So a
  greeting from before makes a version 1 host wait for 10 s, no longer.
- The joint's bootloader takes two steps, so that no single frame can start it: `DISARM`, then
  `BOOTLOADER`, both with the boot id of `HELLO`, nothing between them, in a disabled joint.
- `IMAGE`, `EXCEPTION`, `CAPTURE` and `CAPTUREBLOCK` came with the capability `DIAGNOSIS`; firmware
  without it refuses them with UNKNOWN_REGISTER. A captured block is requested by its number, so
  that each request of it gets the same errors, until a new CAPTURE makes all blocks OUT_OF_RANGE.
  `WARNINGS` came later, and HELLO has no bit left for it: its refusal shows that it is missing.
- Silence stops motion. A moving joint that receives no newer setpoint for the watchdog time (60
  ms unless set) ramps down, at least with the acceleration at which the arm is configured,
  disables itself and latches SETPOINT_LOST. Setpoints are the
  registers listed below the table; polls never count. A self-running command (HOME, MOVESTEPS and
  their like) is kept alive by writing WATCHDOG. A version 1 host has no such register: any
  intact frame keeps such a command alive, for 250 ms. Setpoints have to be repeated there, too.

## What the check byte catches

A frame has at most 13 bytes after its address byte. Of damage to it the CRC detects

- every error of one, two or three bits, and of any odd number of bits;
- every burst of up to 8 bits;
- 99.2 % of the errors of four bits, and 255 of 256 frames of noise.

A frame that passes the CRC is executed only if it is of a known register, has its exact length, and
is finite and within the limits of its fields. A copy of a frame is recognised while its sequence
number is among the last 128; one that is older counts as new. There is no secret in a frame: the
check is against noise on the wires, and everything that can write to the bus can move the arm.
Version 1 has no check at all.
"""


def render_page() -> str:
    """Return the text of docs/protocol.md."""
    lines = [
        _PROSE,
        "## Registers",
        "",
        "| code | name | use | written | read | blocking | since | existing firmware | meaning |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
        *(_row(row) for row in REGISTERS),
        "",
        "Setpoints: "
        + ", ".join(row.register.name for row in REGISTERS if row.setpoint)
        + ". Motion commands: "
        + ", ".join(row.register.name for row in REGISTERS if row.motion)
        + ".",
        "",
    ]
    for enum in _ENUMS:
        lines += [f"## {enum.__name__}", "", "| value | name |", "| --- | --- |"]
        width = 2 if issubclass(enum, IntFlag) else 0
        for member in enum:
            value = f"0x{member.value:0{width}X}" if width else str(member.value)
            lines.append(f"| {value} | {member.name} |")
        lines.append("")
    return "\n".join(lines).rstrip("\n") + "\n"


OUTPUTS: dict[str, Callable[[], str]] = {
    "firmware/joint/src/generated/registers.h": render_header,
    "docs/protocol.md": render_page,
}


def main(arguments: list[str] | None = None) -> int:
    """Write or check the generated files; return the exit status."""
    parser = argparse.ArgumentParser(description="Generate what follows from the register table.")
    parser.add_argument("root", type=Path, help="the checkout")
    parser.add_argument("--check", action="store_true", help="write nothing, fail when stale")
    options = parser.parse_args(arguments)
    stale = [
        name
        for name, render in OUTPUTS.items()
        if not (options.root / name).is_file() or (options.root / name).read_text() != render()
    ]
    for name in stale:
        if options.check:
            sys.stderr.write(f"{name} is stale; run python -m bioscara.protocol.generate .\n")
        else:
            (options.root / name).write_text(OUTPUTS[name]())
            sys.stdout.write(f"wrote {name}\n")
    return 1 if options.check and stale else 0


if __name__ == "__main__":
    sys.exit(main())
