"""Virtual time in cycles of the core, counted by ``clock.c`` before each instruction."""

from __future__ import annotations

import ctypes
import functools
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

FLASH, FLASH_SIZE = 0x0800_0000, 0x4_0000
RAM, RAM_SIZE = 0x2000_0000, 0x1_0000

SECOND = 1_680_000_000
"""Units of time in a second: 16, 20, 42 and 84 MHz are whole divisors."""
MICROSECOND = SECOND // 1_000_000

RUNNING, DEADLINE, SLEEP, EXCEPTION_RETURN, UNMASKED, LOST, NO_COPROCESSOR = range(7)
"""Reason why the core stopped."""


class Clock(ctypes.Structure):
    """The state that ``clock.c`` shares; its comments explain the fields."""

    _fields_ = [
        ("now", ctypes.c_int64),
        ("deadline", ctypes.c_int64),
        ("instructions", ctypes.c_int64),
        ("unit", ctypes.c_int32),
        ("wait", ctypes.c_int32),
        ("cached", ctypes.c_int32),
        ("prefetched", ctypes.c_int32),
        ("why", ctypes.c_int32),
        ("masked", ctypes.c_int32),
        ("fpu", ctypes.c_int32),
        ("fpca", ctypes.c_int32),
        ("lazy", ctypes.c_int32),
        ("conditional", ctypes.c_int32),
        ("look", ctypes.c_int32),
        ("after", ctypes.c_uint32),
        ("line", ctypes.c_uint32),
        ("stop", ctypes.c_void_p),
        ("flash", ctypes.c_void_p),
        ("ram", ctypes.c_void_p),
        ("held", ctypes.c_uint8 * (FLASH_SIZE // 16)),
        ("ring", ctypes.c_uint16 * 64),
        ("oldest", ctypes.c_uint32),
    ]


@functools.cache
def library() -> ctypes.CDLL:
    """Compile ``clock.c`` for this machine."""
    compiler = shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc")
    if compiler is None:
        raise RuntimeError(
            "the emulator needs a C compiler for tests/emulator/clock.c: "
            "on Debian and Ubuntu, apt install gcc libc6-dev"
        )
    source = Path(__file__).with_name("clock.c")
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / "clock.so"
        flags = ["-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
        subprocess.run([compiler, *flags, str(source), "-o", str(built)], check=True)
        return ctypes.CDLL(str(built))
