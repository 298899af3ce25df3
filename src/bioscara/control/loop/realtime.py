"""Linux facilities for a loop with deadlines, and the condition of the computer."""

from __future__ import annotations

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bioscara.errors import ConfigurationError, RealtimeError
from bioscara.processes.scheduling import wake_on_time

PRIORITY = 80
"""Above the kernel's threaded interrupts (50), below its watchdogs (99)."""
THROTTLED = Path("/sys/devices/platform/soc/soc:firmware/get_throttled")
"""Where a Raspberry Pi reports undervoltage and throttling, in hexadecimal."""

_LOCK_CURRENT_AND_FUTURE = 1 | 2
_REMEDY = (
    "give the user 'rtprio {priority}' and 'memlock unlimited' in /etc/security/limits.d and log "
    "in again, or the service LimitRTPRIO={priority} and LimitMEMLOCK=infinity; or run without it"
)
_CONDITIONS = (
    (0x1, "undervoltage"),
    (0x2, "frequency capped"),
    (0x4, "throttled"),
    (0x8, "soft temperature limit"),
)


@contextmanager
def realtime(priority: int = PRIORITY) -> Iterator[None]:
    """Let this thread run before all others, with its memory locked.

    Existing objects are left out of garbage collections. Processes that it starts do not inherit
    the priority. The previous settings are restored afterwards.

    Args:
        priority: Of SCHED_FIFO, 1 .. 99.

    Raises:
        ConfigurationError: The priority is outside its range.
        RealtimeError: The system does not permit it; nothing was changed.
    """
    if not 1 <= priority <= 99:
        raise ConfigurationError(f"real-time priority {priority} is outside 1 .. 99")
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    _schedule(os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority), priority)
    try:
        if _libc().mlockall(_LOCK_CURRENT_AND_FUTURE):
            raise _refused("locking memory", ctypes.get_errno(), priority)
        wake_on_time()
        gc.collect()
        gc.freeze()
        yield
    finally:
        gc.unfreeze()
        _libc().munlockall()
        os.sched_setscheduler(0, policy, parameters)


def conditions(path: Path = THROTTLED) -> str:
    """Return in words why the computer is slowed down now; empty if it is not, or if unknown.

    Args:
        path: File with the flags.
    """
    try:
        flags = int(path.read_text(), 16)
    except (OSError, ValueError):
        return ""
    return ", ".join(text for bit, text in _CONDITIONS if flags & bit)


def _schedule(policy: int, parameters: os.sched_param, priority: int) -> None:
    try:
        os.sched_setscheduler(0, policy, parameters)
    except PermissionError as error:
        raise _refused(f"SCHED_FIFO at priority {priority}", error.errno or 0, priority) from error


def _refused(what: str, number: int, priority: int) -> RealtimeError:
    return RealtimeError(
        f"{what} is not permitted ({os.strerror(number)}); " + _REMEDY.format(priority=priority)
    )


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)
