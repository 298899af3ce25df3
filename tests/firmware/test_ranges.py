"""The codec of the host and the compiled firmware accept the same values of every register."""

from __future__ import annotations

import math
import struct
from dataclasses import replace

import numpy as np
import pytest

from bioscara.errors import InvalidArgumentError, LimitError
from bioscara.protocol import TRAILER, WRITE, Refusal, Register, crc8
from bioscara.protocol.codec import field_bounds
from bioscara.protocol.rows import Field, Kind
from firmware.host import Host

OTHERWISE = {"ARM", "DISARM", "BOOTLOADER", "TRACK", "TRACKLOAD", "CLEARFAULT", "CAPTUREBLOCK"}
"""Registers whose values the joint judges by its state."""


def places(field: Field) -> list[float]:
    """Return the limits of a field, and where its type has them one step beyond each."""
    low, high = field_bounds(field)
    if field.kind is Kind.F32:
        with np.errstate(over="ignore"):
            beyond = np.nextafter(
                np.array((low, high), np.float32), np.array((-math.inf, math.inf), np.float32)
            )
        return [low, high, *beyond.tolist()]
    least, most = field_bounds(replace(field, lower=None, upper=None))
    return [low, high, *(at for at in (low - 1, high + 1) if least <= at <= most)]


@pytest.mark.parametrize(
    "register", [code for code in WRITE if code.name not in OTHERWISE], ids=lambda code: code.name
)
def test_host_and_joint_accept_the_same_values(register: Register) -> None:
    message, fields = WRITE[register], WRITE[register].definition.written
    for index, value in ((i, at) for i, field in enumerate(fields) for at in places(field)):
        values = [field_bounds(field)[0] for field in fields]
        values[index] = value
        try:
            message.encode_v1(
                [v for v, field in zip(values, fields, strict=True) if not field.padding]
            )
        except (LimitError, InvalidArgumentError):
            accepted = False
        else:
            accepted = True
        host = Host()  # Not enabled: it judges the values first, and moves nothing.
        host.sequence += 1
        body = bytes((register,)) + b"".join(
            struct.pack("<" + field.kind.value, v if field.kind is Kind.F32 else int(v))
            for v, field in zip(values, fields, strict=True)
        )
        body += bytes((host.sequence,))
        frame = body + bytes((crc8(bytes((host.address << 1,)) + body),))
        host.raw(frame, message.answer_size + TRAILER)
        refusal = host.read(Register.FAULT)[2]
        assert (refusal in (Refusal.NONE, Refusal.NOT_ENABLED)) == accepted, (index, value)
