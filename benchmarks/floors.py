"""Least work for a task, in plain Python or compiled: the lower bound of this computer."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence

import numpy as np

from bioscara.bus import Bus, Transaction
from bioscara.errors import CommunicationError

_OUT, _BACK = struct.Struct("<Bfh"), struct.Struct("<fhBB")
_SCALES = ((35.0, 0.1), (-1570.8, 0.02), (24.0, 0.3), (12.0, 0.4))
_PIECES = ((0.1, 0.2, 0.3, -0.1),) * 4
_LIMITS = ((-3.0, 3.0), (0.0, 0.33), (-2.6, 2.6), (-3.0, 3.0))
ADDITIONS = 100_000


class _EchoBus(Bus):
    """A minimal bus within this process."""

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        return [bytes(item.read) for item in transactions]

    def close(self) -> None:
        pass


def exchange() -> Callable[[], None]:
    """Return a function that packs, calls the bus and unpacks for four joints in plain floats."""
    bus = _EchoBus()

    def run() -> None:
        frames = [
            Transaction(0x11, _OUT.pack(0xD5, 0.5 * scale + offset, 1), 8)
            for scale, offset in _SCALES
        ]
        for data, (scale, offset) in zip(bus.transfer(frames), _SCALES, strict=True):
            angle, _, _, _ = _BACK.unpack(data)  # type: ignore[arg-type]
            (angle - offset) / scale

    return run


def cycle() -> Callable[[], None]:
    """Return a function that reads, samples, clips and writes four joints in plain floats."""
    bus = _EchoBus()

    def run(t: float = 0.3) -> None:
        frames = []
        for (a, b, c, d), (lower, upper), (scale, offset) in zip(
            _PIECES, _LIMITS, _SCALES, strict=True
        ):
            position = min(max(a + t * (b + t * (c + t * d)), lower), upper)
            velocity = b + t * (2.0 * c + t * 3.0 * d)
            data = _OUT.pack(0xD5, position * scale + offset, int(velocity))
            frames.append(Transaction(0x11, data, 8))
        for data, (scale, offset) in zip(bus.transfer(frames), _SCALES, strict=True):
            angle, speed, _, _ = _BACK.unpack(data)  # type: ignore[arg-type]
            (angle - offset) / scale, speed / scale

    return run


def additions() -> Callable[[], object]:
    """Return a function that adds :data:`ADDITIONS` doubles, compiled, each to the sum before."""
    numbers = np.ones(ADDITIONS)
    sums = np.empty(ADDITIONS)
    return lambda: np.cumsum(numbers, out=sums)
