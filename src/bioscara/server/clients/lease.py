"""The lease: at most one client commands the arm."""

from __future__ import annotations

from collections.abc import Callable

from bioscara.api.messages import LeaseValue
from bioscara.arguments import number
from bioscara.errors import InvalidArgumentError, LeaseError
from bioscara.server.clients.client import Client

SHORTEST, LONGEST = 0.2, 60.0
"""Range of the time to live [s]."""


class Lease:
    """The client that may command the arm, and the time until which it may.

    Each holder gets a higher epoch, which its commands carry: one that was sent before another
    client took over is recognised and refused.

    Args:
        clock: Returns the time [s].

    Attributes:
        epoch: The number of the last lease; 0 before the first.
        holder: ClientSession of the holder, or empty.
        client: Name of the holder, or empty.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.epoch = 0
        self.holder = self.client = ""
        self._client: Client | None = None
        self._time_to_live = self._until = 0.0

    @property
    def remaining(self) -> float:
        """Time until the lease lapses [s]; 0 without a holder."""
        return max(self._until - self._clock(), 0.0) if self.holder else 0.0

    def value(self) -> LeaseValue:
        """Return the lease as it is now."""
        return LeaseValue(self.client or None, self.epoch, self.remaining)

    def acquire(self, client: Client, time_to_live: float, *, force: bool) -> None:
        """Give the lease to a client; the one that holds it already gets a new epoch.

        Args:
            client: The client.
            time_to_live: Time after which the lease lapses unless it is renewed [s].
            force: Whether to take it from another client.

        Raises:
            InvalidArgumentError: The time is not possible.
            LeaseError: Another client holds it.
        """
        time_to_live = number("time_to_live", time_to_live)
        if not SHORTEST <= time_to_live <= LONGEST:
            raise InvalidArgumentError(
                f"time_to_live {time_to_live:g} s is outside {SHORTEST:g} .. {LONGEST:g} s"
            )
        if self.holder and self.holder != client.session and not force:
            raise LeaseError(
                f"{self.client} commands the arm; wait until it has released it, or take it over",
                self.client,
            )
        self.epoch += 1
        self.holder, self.client, self._client = client.session, client.name, client
        self._time_to_live = time_to_live
        self.renew()

    def renew(self) -> None:
        """Let the lease lapse its time to live from now."""
        self._until = self._clock() + self._time_to_live

    def require(self, session: str, epoch: int | None) -> None:
        """Check a command.

        Raises:
            LeaseError: The client does not hold the lease.
        """
        if self.holder and self.holder == session and epoch == self.epoch:
            return
        if self.holder and self.holder != session:
            raise LeaseError(f"{self.client} commands the arm; nothing was done", self.client)
        if epoch is None:
            raise LeaseError("this needs the lease of the arm; acquire it first")
        raise LeaseError(
            f"the lease {epoch} of this client has ended; acquire it again once the arm is safe"
        )

    def lapsed(self) -> str:
        """Return why it has just ended without a release, in words; it has no holder then.

        Returns:
            The reason; empty if it goes on, or has no holder.
        """
        if self._client is None:
            return ""
        name = self.client
        if self._client.gone:
            self.end()
            return f"{name} has ended, and its lease with it"
        if self._clock() >= self._until:
            self.end()
            return f"the lease of {name} has lapsed"
        return ""

    def end(self) -> None:
        """Remove the holder."""
        self.holder = self.client = ""
        self._client = None
