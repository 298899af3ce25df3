"""Facts of the owner that the routes need as values: asked for once, or seldom."""

from __future__ import annotations

import time
from typing import TypeVar

import msgspec

from bioscara.api import messages as m
from bioscara.errors import ProtocolError
from bioscara.model import ArmParameters
from bioscara.web.owner.queries import OwnerQueries

_AGE = 1.0
"""Age up to which description and workspace are used again [s]: views ask several times a second,
and the answers of an owner come from the thread of its control loop."""


_R = TypeVar("_R", bound=m.Result)


class OwnerFacts:
    """Asks the owner, and keeps the answers for a second.

    Args:
        queries: The client that asks.
    """

    def __init__(self, queries: OwnerQueries) -> None:
        self._queries = queries
        self._kept: dict[type[m.Result], tuple[float, m.Result]] = {}

    async def description(self) -> m.Description:
        """Return which arm it is, at most a second old.

        Raises:
            OwnerLostError: The owner does not run or does not answer.
            ProtocolError: The owner has another version.
        """
        return await self._recent(m.GetDescription(), m.Description)

    async def parameters(self) -> ArmParameters:
        """Return the parameters of the arm, at most a second old; raises as above."""
        return (await self.description()).parameters

    async def workspace(self) -> m.WorkspaceState:
        """Return tool, scene and load, at most a second old.

        Raises:
            OwnerLostError, ProtocolError: As above.
        """
        return await self._recent(m.GetWorkspace(), m.WorkspaceState)

    async def _recent(self, command: m.AnyCommand, kind: type[_R]) -> _R:
        kept = self._kept.get(kind)
        if kept is not None and time.monotonic() - kept[0] < _AGE and isinstance(kept[1], kind):
            return kept[1]
        answer = await self._queries.ask(command)
        try:
            value = msgspec.json.decode(answer, type=kind)
        except msgspec.DecodeError as error:
            raise ProtocolError(f"an answer of the owner cannot be used: {error}") from error
        self._kept[kind] = (time.monotonic(), value)
        return value
