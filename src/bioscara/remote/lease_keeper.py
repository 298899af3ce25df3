"""Renewal of a client's lease while its program runs."""

from __future__ import annotations

import threading
from contextlib import suppress

from bioscara.api import messages as m
from bioscara.errors import BioscaraError, LeaseError, OwnerLostError
from bioscara.remote.link import PATIENCE, OwnerLink
from bioscara.robot.stops import Stops

TIME_TO_LIVE = 2.0
"""Time for which the owner waits for a client that is silent [s]."""
_RENEWALS = 4
"""Renewals within that time."""


class LeaseKeeper:
    """Takes the lease with the first command, and renews it.

    A lease that another one has ended, by a stop or a takeover, is not taken again
    automatically: the program may not know that the arm was stopped.

    Attributes:
        stops: The stops that this client has requested or seen.
    """

    def __init__(self, link: OwnerLink) -> None:
        self._link = link
        self._epoch: int | None = None
        self._lost = ""
        self.stops = Stops()
        self._ended = threading.Event()
        self._lock = threading.Lock()

    @property
    def held(self) -> int | None:
        """The epoch of the lease, as far as this client knows; None unless it holds it."""
        return self._epoch

    def epoch(self) -> int:
        """Return the epoch of the lease, which is taken now unless it is held.

        Raises:
            LeaseError: Another client commands the arm, or has ended the lease of this one.
            OwnerLostError: The owner does not run.
        """
        self._link.maker.require()
        with self._lock:
            if self._epoch is not None:
                return self._epoch
            if self._lost:
                self._link.require()
                raise LeaseError(
                    f"{self._lost}; acquire_lease() once the arm is safe to move again"
                )
        return self.acquire(force=False)

    def acquire(self, *, force: bool) -> int:
        """Take the lease.

        Args:
            force: Whether to take it from another client.

        Raises:
            LeaseError: Another client commands the arm.
        """
        with self._lock:
            command = m.AcquireLease(time_to_live=TIME_TO_LIVE, force=force)
            result = self._link.request(command)
            if not isinstance(result, m.LeaseState):
                raise LeaseError("the owner did not give a lease")
            self._epoch, self._lost = result.lease.epoch, ""
            self._ended.set()
            self._ended = threading.Event()
            threading.Thread(
                target=self._renew,
                args=(self._ended, self._epoch),
                name="bioscara-lease",
                daemon=True,
            ).start()
            return self._epoch

    def release(self) -> bool:
        """Give the lease back, if it is held; return whether the owner still answers."""
        with self._lock:
            epoch, self._epoch = self._epoch, None
            self._ended.set()
        if epoch is not None:
            # It may have ended.
            with suppress(LeaseError):
                try:
                    self._link.request(m.ReleaseLease(), epoch, timeout=PATIENCE)
                except OwnerLostError:
                    return False
        return True

    def lose(self, reason: str) -> None:
        """Note that the lease has ended without this client's doing."""
        if self._epoch is not None:
            self._epoch, self._lost = None, reason
            self._ended.set()

    def note(self, event: m.Event) -> None:
        """Take an event that concerns the lease."""
        if event.what == "stop":
            self.stops.note()
        lease, epoch = event.lease, self._epoch
        if lease is None or epoch is None:
            return
        if lease.epoch > epoch or (lease.epoch == epoch and lease.client is None):
            self.lose(event.text)

    def _renew(self, ended: threading.Event, epoch: int) -> None:
        while not ended.wait(TIME_TO_LIVE / _RENEWALS):
            try:
                self._link.request(m.RenewLease(), epoch)
            except BioscaraError as error:
                if not ended.is_set():
                    self.lose(str(error))
                return
