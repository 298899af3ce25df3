"""Mutual exclusion of the operations that use the arm or its gripper, across all threads."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum

from bioscara.errors import BusyError, MotionCancelledError

_POLL = 0.1
"""Polling period of a shutdown that waits for a claim's end, in case no event is set [s]."""


class Device(Enum):
    """A part of the arm that is used by one at a time."""

    ARM = "arm"
    GRIPPER = "gripper"


ARM, GRIPPER = frozenset({Device.ARM}), frozenset({Device.GRIPPER})
EVERYTHING = ARM | GRIPPER


@dataclass(eq=False, slots=True)
class Claim:
    """Exclusive use of devices, from when it is admitted to its release.

    Attributes:
        name: Name of the called method, for messages.
        devices: What it uses.
        thread: The thread that claimed it.
        begin: Time of the claim [s], on the machine's monotonic clock, not the arm's clock.
        released: Set at its end.
        ended: Whether it has ended.
        stopped: Whether a stop was requested.
    """

    name: str
    devices: frozenset[Device] = EVERYTHING
    thread: threading.Thread = field(default_factory=threading.current_thread)
    begin: float = field(default_factory=time.monotonic)
    released: threading.Event = field(default_factory=threading.Event)
    ended: bool = False
    stopped: bool = False

    def refuse(self, name: str, *, inside: bool = False) -> BusyError:
        """Return the error for another call that is refused while this claim lasts.

        Args:
            name: Name of the refused call.
            inside: Whether it was made in a callback of the claiming operation.
        """
        return BusyError(name, self.name, time.monotonic() - self.begin, self.thread.name, inside)

    def require_not_stopped(self) -> None:
        """Raise if a stop was requested.

        Raises:
            MotionCancelledError: It was.
        """
        if self.stopped:
            raise MotionCancelledError(f"{self.name} was stopped before anything moved")

    def release(self) -> None:
        """End the exclusive use."""
        # The attribute first: a KeyboardInterrupt can be raised at a function call, and the
        # devices would never be released.
        self.ended = True
        self.released.set()


class Arbiter:
    """Admits one claim at a time to each device.

    There is no queue: a queued motion could begin after a stop.
    """

    def __init__(self) -> None:
        self._claims: tuple[Claim, ...] = ()
        self._closing: tuple[Claim, ...] = ()
        self._admission = threading.Lock()

    @property
    def running(self) -> tuple[Claim, ...]:
        """The claims that have not ended, in the order of their admission."""
        return tuple([claim for claim in self._claims if not claim.ended])

    def take(self, claim: Claim) -> None:
        """Admit a claim.

        Raises:
            BusyError: Another one has a device of it, of any thread.
        """
        with self._admission:
            for other in (*self.running, *self._closing):
                if other.devices & claim.devices:
                    raise other.refuse(claim.name)
            self._claims = (*self.running, claim)

    @contextmanager
    def claimed(self, name: str, devices: frozenset[Device] = EVERYTHING) -> Iterator[Claim]:
        """Have exclusive use of devices for a block of code.

        Args:
            name: Name of the caller in messages.
            devices: What it uses.

        Raises:
            BusyError: Another claim has a device of it, of any thread.
            MotionCancelledError: It was stopped; its caller must not continue.
        """
        claim = Claim(name, devices)
        try:
            self.take(claim)
            yield claim
        finally:
            claim.ended = True
            claim.released.set()
        if claim.stopped:
            raise MotionCancelledError(f"{name} was stopped; nothing moves")

    @contextmanager
    def seized(self, name: str) -> Iterator[None]:
        """Stop all claims, wait for their ends, and have exclusive use for a block of code.

        Args:
            name: Name of the caller in messages.
        """
        claim = Claim(name)
        try:
            self._seize(claim)
            yield
        finally:
            claim.ended = True
            claim.released.set()

    def _seize(self, claim: Claim) -> None:
        try:
            with self._admission:
                self._closing = (*self._closing, claim)
            while True:
                with self._admission:
                    running = self.running
                    if not running:
                        self._claims = (claim,)
                        break
                for other in running:
                    other.stopped = True
                running[0].released.wait(_POLL)
        finally:
            self._closing = tuple([each for each in self._closing if each is not claim])

    def stop(self) -> None:
        """Request the end of all claims, from any thread or signal handler; never blocks."""
        stopped: tuple[Claim, ...] = ()
        # Repeated: the stop also applies to a claim that began while another one ended.
        while (running := self.running) != stopped:
            for claim in running:
                claim.stopped = True
            stopped = running
