"""What carries the messages between a program and an owner: bytes out, messages in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from bioscara.api import messages as m


class TransportConnection(Protocol):
    """A connection that carries messages; one thread receives while others send, one at a time."""

    def send(self, data: bytes) -> None:
        """Send a message; if this raises, a part may have been sent.

        Raises:
            OSError: The connection has ended, or the other end takes nothing.
        """

    def receive(self) -> list[m.FromOwner]:
        """Wait for further messages, and return them.

        Raises:
            AccessError: The other end has ended it, and connecting again does not help.
            OSError: It has ended, or nothing came before :meth:`greeted`.
            OwnerError, msgspec.DecodeError: It has ended, or a message cannot be used.
        """

    def wait_turn(self, size: int) -> None:
        """Wait until the other end may be sent a message of so many bytes."""

    def greeted(self) -> None:
        """Wait for messages as long as it takes from now on, as the owner has greeted."""

    def end(self) -> None:
        """End the connection: the threads that send and receive return."""

    def close(self) -> None:
        """Forget the connection, which goes on where another process has it."""


class Transport(Protocol):
    """A way to an owner.

    Attributes:
        name: Name of the arm or its address, for messages to people.
        pause: Time between two tries to connect [s].
        silence: Time without anything from the owner after which it counts as lost, where it sends
            samples [s].
    """

    name: str
    pause: float
    silence: float

    @property
    def direct_stop(self) -> Callable[[str, str], object] | None:
        """Stops all motion on a way of its own, for the name of a client and its session.

        It raises BioscaraError if the owner does not confirm that. None if there is no such way.
        """

    def encoded(self, message: object) -> bytes:
        """Return a message as bytes."""

    def ended(self) -> bool:
        """Return whether the owner has certainly ended, so that connecting again is of no use."""

    def connect(self, patience: float) -> TransportConnection:
        """Connect.

        Args:
            patience: Time in which the other end has to answer, and later to take a part of a
                message [s].

        Raises:
            AccessError: The answering process is not to be trusted, or refuses this program.
            OwnerLostError: None runs, or it does not answer.
            ProtocolError: It is no owner.
            OSError: The connection broke.
        """
