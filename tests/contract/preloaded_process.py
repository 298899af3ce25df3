"""The process behind :class:`preload.PreloadedBus`: carries out calls that arrive on stdin."""

from __future__ import annotations

import ctypes
import os
import pickle
import sys
from collections.abc import Callable

from smbus2 import SMBus, i2c_msg

from bioscara.bus import LinuxBus, Transaction
from bioscara.errors import BioscaraError, InvalidArgumentError

DEVICE = os.environ.get("BIOSCARA_SHIM_DEVICE", "")


def smbus2(transactions: list[Transaction]) -> list[bytes] | int:
    messages, reads = [], []
    for address, write, read in transactions:
        if write:
            messages.append(i2c_msg.write(address, write))
        if read:
            reads.append(i2c_msg.read(address, read))
            messages.append(reads[-1])
    try:
        with SMBus(DEVICE) as bus:
            bus.i2c_rdwr(*messages)
    except OSError as error:
        return error.errno or -1
    return [bytes(message) for message in reads]


def shim(name: str, *arguments: int) -> int:
    function = getattr(ctypes.CDLL(None), name)
    function.restype = ctypes.c_long
    return int(function(*(ctypes.c_long(argument) for argument in arguments)))


def main() -> None:
    bus = LinuxBus(DEVICE)
    calls: dict[str, Callable[..., object]] = {
        "transfer": bus.transfer,
        "close": bus.close,
        "statistics": lambda: tuple(bus.statistics),
        "smbus2": smbus2,
        "shim": shim,
    }
    while True:
        try:
            name, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        answer: object
        try:
            answer = calls[name](*arguments)
        except InvalidArgumentError as error:
            answer = InvalidArgumentError(str(error))
        except BioscaraError as error:
            answer = error
        pickle.dump(answer, sys.stdout.buffer)
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
