"""A client as the owner and as its own process know it, and results that come later."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from bioscara.api import messages as m
from bioscara.report import CycleRecord


class NamedClient(Protocol):
    """A client.

    Attributes:
        session: Random name of its session.
        name: Its name, for messages to people.
    """

    session: str
    name: str


class Client(NamedClient, Protocol):
    """A client as the owner knows it."""

    @property
    def connected(self) -> bool:
        """Whether its session has a connection."""

    @property
    def gone(self) -> bool:
        """Whether its process has ended, and nothing more can come from it."""

    def send_record(self, goal: int, record: CycleRecord) -> None:
        """Send the record of a control cycle of its goal, unless it reads too slowly."""


class ConnectedClient(NamedClient, Protocol):
    """A client as the process that answers it knows it."""

    @property
    def json(self) -> bool:
        """Whether it speaks JSON, and not msgpack."""


class Encoded(NamedTuple):
    """The result of a request, in the form of the client.

    Attributes:
        data: The result.
    """

    data: bytes


class Later(NamedTuple):
    """A request that takes longer than a thread of requests may be occupied.

    Attributes:
        work: Called in another thread.
        finish: Called with its result in the thread of the requests; returns that of the request,
            by default the same. None for Done.
    """

    work: Callable[[], Any]
    finish: Callable[[Any], m.AnyResult | None] = lambda result: result

    def ended(self, result: Any) -> m.AnyResult:
        """Return the result of the request for that of the work."""
        return self.finish(result) or m.Done()
