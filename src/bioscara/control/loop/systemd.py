"""Reports to systemd that the loop runs: the protocol is a line of text in a datagram."""

from __future__ import annotations

import faulthandler
import os
import socket
from collections.abc import Mapping
from contextlib import suppress
from typing import Self

from bioscara.errors import ConfigurationError

_SHARE = 0.25
"""Share of the watchdog timeout after which systemd is notified again."""


class Watchdog:
    """Feeds the watchdog of the service whose main process this is.

    A service of ``Type=notify`` counts as started with the first feeding; with ``WatchdogSec`` it
    is ended when no other follows in time. Sending never blocks and never fails: without
    notifications systemd takes its own action.

    Args:
        address: Of systemd's socket, as in NOTIFY_SOCKET.
        timeout: How long systemd waits [s]; None if it does not watch.

    Attributes:
        interval: Time between feedings [s].
    """

    def __init__(self, address: str, timeout: float | None) -> None:
        # A leading @ stands for the NUL of Linux's abstract addresses.
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self.interval = None if timeout is None else _SHARE * timeout
        self._ready = False
        self._due = 0.0

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> Self | None:
        """Return the watchdog of this service, or None if systemd expects no notifications.

        systemd ends a service that falls silent with SIGABRT: the stacks of all threads are then
        written to the standard error stream.

        Raises:
            ConfigurationError: WATCHDOG_USEC is no number above zero.
        """
        address = environment.get("NOTIFY_SOCKET", "")
        if not address.startswith(("/", "@")):
            return None
        timeout = None
        text = environment.get("WATCHDOG_USEC", "")
        if text and environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid()):
            if not text.isascii() or not text.isdigit() or int(text) == 0:
                raise ConfigurationError(f"WATCHDOG_USEC={text} is no number above zero")
            timeout = int(text) * 1e-6
            if not faulthandler.is_enabled():
                faulthandler.enable()
        return cls(address, timeout)

    def feed(self, time: float) -> None:
        """Report that a good cycle has ended; sends no more than is needed.

        Args:
            time: Now, on any monotonic clock [s].
        """
        if not self._ready:
            self._ready = True
            self._send("READY=1")
            self._due = time
        if self.interval is not None and time >= self._due:
            self._due = time + self.interval
            self._send("WATCHDOG=1")

    def close(self) -> None:
        """Close the socket: nothing is sent any more."""
        self._socket.close()

    def _send(self, text: str) -> None:
        with suppress(OSError):
            self._socket.sendto(text.encode(), self._address)
