"""The operating system's scheduler: threads that wake up on time, and their wait for a processor.

Nothing here needs a privilege.
"""

from __future__ import annotations

import ctypes
import os
import platform
import threading
from contextlib import suppress

_PR_SET_NAME, _PR_SET_TIMERSLACK = 15, 29
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


def name_process(name: str) -> None:
    """Give this process another name in ``top``, of at most 15 characters.

    Processes that fork from each other have the same one otherwise.
    """
    ctypes.CDLL(None).prctl(_PR_SET_NAME, name.encode(), 0, 0, 0)


def wake_on_time() -> None:
    """Let this thread's sleeps end when they are due; needs no privilege and no priority.

    Linux otherwise rounds sleeps up by 50 us, and on a busy core lets the thread that computes
    finish its slice of some milliseconds first. From Linux 6.12 on, a thread that requests a
    shorter slice runs as soon as it wakes up; its share of the processor stays the same. Threads
    that this one starts inherit both. A thread of another policy, such as SCHED_FIFO, keeps its
    own.
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
            count: _RunQueueCount = own.count
        except AttributeError:
            count = own.count = _RunQueueCount()
        before, count.last = count.last, count.read()
        return count.last - before


class _RunQueueCount:
    """The kernel's count of one thread, the one that creates it; it is closed with that thread.

    Attributes:
        last: The last value read [s].
    """

    def __init__(self) -> None:
        self._file = -1
        with suppress(OSError):
            self._file = os.open("/proc/thread-self/schedstat", os.O_RDONLY | os.O_CLOEXEC)
        self.last = self.read()

    def __del__(self) -> None:
        if self._file >= 0:
            os.close(self._file)

    def read(self) -> float:
        """Return its time on the run queue, the second number of the file, in seconds."""
        try:
            return 1e-9 * int(os.pread(self._file, 100, 0).split()[1])
        except (OSError, IndexError, ValueError):
            return 0.0
