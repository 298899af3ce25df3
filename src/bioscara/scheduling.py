"""The operating system's scheduler: threads that wake up on time, and their wait for a processor.

Nothing here needs a privilege.
"""

from __future__ import annotations

import ctypes
import os
import platform
import threading
from contextlib import suppress

_PR_SET_TIMERSLACK = 29
_SLICE = 100_000
"""Requested time slice, the shortest that Linux grants [ns]; its default is about 3 ms."""
_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274, "riscv64": 274, "armv7l": 380, "armv6l": 380}
"""Number of the system call by machine; the C library has no function for it."""


class _Attributes(ctypes.Structure):
    """Linux's ``struct sched_attr``."""

    _fields_ = (
        ("size", ctypes.c_uint32),
        ("policy", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32),
        ("runtime", ctypes.c_uint64),
        ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    )


def wake_on_time() -> None:
    """Let this thread's sleeps end when they are due; needs no privilege and no priority.

    Linux otherwise rounds sleeps up by 50 us, and on a busy core lets the thread that computes
    finish its slice of some milliseconds first. From Linux 6.12 on, a thread that requests a
    shorter slice runs as soon as it wakes up; its share of the processor stays the same. Threads
    that this one starts inherit both. A thread of another policy, such as SCHED_FIFO, keeps its own.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
    number = _SCHED_SETATTR.get(platform.machine())
    if number is None or os.sched_getscheduler(0) != os.SCHED_OTHER:
        return
    wanted = _Attributes(
        size=ctypes.sizeof(_Attributes),
        policy=os.SCHED_OTHER,
        nice=os.getpriority(os.PRIO_PROCESS, 0),
        runtime=_SLICE,
    )
    # A kernel that refuses it leaves the slice as it was: the thread then wakes up later.
    libc.syscall(number, 0, ctypes.byref(wanted), 0)


class ProcessorWait:
    """For how long threads were ready to run while other threads had the processors.

    The kernel counts it. A process that is stopped or that computes is not ready, and does not
    count; where the kernel has no such count it is always 0.
    """

    def __init__(self) -> None:
        self._own = threading.local()

    def lap(self) -> float:
        """Return the wait of the calling thread since its last call [s]; 0 at its first."""
        own = self._own
        try:
            file = own.file
        except AttributeError:
            file = own.file = self._open()
            own.last = _run_delay(file)
        last, own.last = own.last, _run_delay(file)
        return float(own.last - last)

    def _open(self) -> int | None:
        """Return the calling thread's file, which is closed when the thread has ended."""
        with suppress(OSError):
            # As an attribute of the thread-local data, it is closed with the thread.
            self._own.keeper = open("/proc/thread-self/schedstat", "rb", buffering=0)  # noqa: SIM115
            return int(self._own.keeper.fileno())
        return None


def _run_delay(file: int | None) -> float:
    """Return the second number of a ``schedstat``: nanoseconds on the run queue, here in seconds."""
    if file is None:
        return 0.0
    try:
        return 1e-9 * int(os.pread(file, 100, 0).split()[1])
    except (OSError, IndexError, ValueError):
        return 0.0
