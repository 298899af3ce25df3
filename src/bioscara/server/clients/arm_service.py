"""The interface of an arm that the socket needs: a link to its owner, or a replayed recording."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Protocol

from bioscara.api import messages as m
from bioscara.api.framing import Framed
from bioscara.server.clients.client import ConnectedClient, Encoded


class NumberedEvents(Protocol):
    """Events that clients get by number."""

    @property
    def last(self) -> int:
        """Number of the newest event; 0 before the first."""

    def after(self, number: int) -> m.Event | None:
        """Return the event that follows a number; None if there is none yet."""

    def framed(self, event: m.Event) -> Framed:
        """Return an event as bytes for the socket."""


class ArmService(Protocol):
    """An arm behind a socket; all methods are called in the thread of the requests.

    Attributes:
        changed: Called with True when there is a new sample, with False when there is a new event.
    """

    changed: Callable[[bool], object]

    @property
    def name(self) -> str:
        """Name under which it is served."""

    @property
    def description(self) -> str:
        """Which arm on which bus, in words."""

    @property
    def events(self) -> NumberedEvents:
        """Its events."""

    @property
    def sample(self) -> m.StateSample:
        """Its newest state."""

    @property
    def controllers_sample(self) -> m.ControllersSample | None:
        """The newest sample of its controllers; None if there is none."""

    @property
    def world_sample(self) -> m.WorldSample | None:
        """The newest sample of the bodies around it; None if there is none."""

    def want(self, *, controllers: bool, world: bool) -> None:
        """Make samples of the controllers, and of the world, from now on or not any more.

        Args:
            controllers: Whether a client has subscribed to those of the controllers.
            world: Whether one has to those of the world.
        """

    def handle(
        self, client: ConnectedClient, command: m.AnyCommand, epoch: int | None, clients: int
    ) -> m.AnyResult | Awaitable[m.AnyResult | Encoded]:
        """Carry out a command; arguments and errors as of ``Owner``."""

    def state_of(self, session: str, *, connected: bool, gone: bool, forgotten: bool) -> None:
        """Take it how a client is connected.

        Args:
            session: Its session.
            connected: Whether it has a connection.
            gone: Whether its process has ended, and nothing more can come from it.
            forgotten: Whether the session is not known any more.
        """

    def announce(self, what: m.EventKind, text: str, client: str) -> None:
        """Report an event of the server itself."""
