"""All arms that are served on this computer, and STOP for each."""

from __future__ import annotations

import asyncio
import math
from contextlib import suppress

import msgspec

from bioscara.api import messages as m, runtime
from bioscara.api.gateway_pages import page_of
from bioscara.errors import AccessError, InvalidArgumentError, OwnerLostError
from bioscara.web.owner.joined_calls import JoinedCalls
from bioscara.web.owner.queries import OwnerQueries, RequestFailedError
from bioscara.web.owner.relay import WebClient

CYCLE = 0.01
"""Time in which further STOPs of a client are one [s]: a control cycle."""
_LOOKUP = 0.05
"""Least time between two searches for the owners of this computer [s]."""
_LOOK = 1.0
"""Time in which an owner has to say how its arm is [s]."""
_STOP = 2.0
"""Time in which the connection of a stop has to end [s]."""


class ServedArm(msgspec.Struct, frozen=True):
    """An arm that is served on this computer.

    Attributes:
        name: Name of its owner.
        arm: Which arm on which bus, in words.
        simulated: Whether it is simulated; null if its owner does not answer.
        state: Its state now; null if its owner does not answer.
        text: Why the state is unknown; empty otherwise.
        page: Address of its page; null if it has no gateway.
        here: Whether this gateway is its own.
    """

    name: str
    arm: str
    simulated: bool | None
    state: m.StateSample | msgspec.Raw | None
    text: str
    page: str | None
    here: bool


class StoppedArm(msgspec.Struct, frozen=True):
    """Outcome of a STOP.

    Attributes:
        name: Name of the arm's owner.
        stopped: Whether its owner has confirmed it.
        text: In words.
    """

    name: str
    stopped: bool
    text: str


class ServedArms:
    """Asks all owners of this computer.

    Args:
        here: Name of the owner that this gateway belongs to.
    """

    def __init__(self, here: str) -> None:
        self._here = here
        self._queries: dict[tuple[str, int], OwnerQueries] = {}
        self._described: dict[tuple[str, int], m.Description] = {}
        self._lookups: JoinedCalls[None, list[runtime.OwnerEntry]]
        self._lookups = JoinedCalls(_LOOKUP, self._look_up)
        self._stops: JoinedCalls[tuple[runtime.OwnerEntry, WebClient], StoppedArm]
        self._stops = JoinedCalls(CYCLE, lambda key, _: self._stopped(*key))
        self._found, self._found_at = list[runtime.OwnerEntry](), -math.inf

    async def _look_up(self, *_: object) -> list[runtime.OwnerEntry]:
        self._found = runtime.owners()
        self._found_at = asyncio.get_running_loop().time()
        return self._found

    async def look(self) -> list[ServedArm]:
        """Return the arms, by name; one whose owner does not answer in a second has no state."""
        owners = await self._lookups.do(None)
        await self._forget({(owner.name, owner.pid) for owner in owners})
        return list(await asyncio.gather(*map(self._look, owners)))

    async def stop(self, name: str, client: WebClient) -> StoppedArm:
        """Stop an arm.

        Args:
            name: Name of its owner.
            client: Name of the client that stops it.

        Raises:
            OwnerLostError: No owner of that name runs.
        """
        return await self._stops.do((await self._owner(name), client))

    async def _owner(self, name: str) -> runtime.OwnerEntry:
        try:
            runtime.require_name(name)
            # One that was found just now does not wait for the next search.
            fresh = asyncio.get_running_loop().time() < self._found_at + _LOOKUP
            owner = _of_name(self._found, name) if fresh else None
            owner = owner or _of_name(await self._lookups.do(None), name)
        except InvalidArgumentError as error:
            raise OwnerLostError(str(error)) from error
        except AccessError:
            # The folder cannot be listed.
            return runtime.find(name)
        if owner is None:
            raise OwnerLostError(f"no owner of arm {name} runs")
        return owner

    async def stop_all(self, client: WebClient) -> list[StoppedArm]:
        """Stop all arms of this computer, at the same time.

        Args:
            client: Name of the client that stops them.
        """
        owners = await self._lookups.do(None)
        return list(await asyncio.gather(*(self._stops.do((each, client)) for each in owners)))

    async def close(self) -> None:
        """Disconnect."""
        await self._forget(set())

    async def _forget(self, kept: set[tuple[str, int]]) -> None:
        """Disconnect from owners that have ended."""
        for key in self._queries.keys() - kept:
            self._described.pop(key, None)
            await self._queries.pop(key).close()

    async def _look(self, owner: runtime.OwnerEntry) -> ServedArm:
        key, here = (owner.name, owner.pid), owner.name == self._here
        queries = self._queries.setdefault(key, OwnerQueries(owner.name, "list of the arms"))
        try:
            async with asyncio.timeout(_LOOK):
                if key not in self._described:
                    answer = await queries.ask(m.GetDescription())
                    self._described[key] = msgspec.json.decode(answer, type=m.Description)
                state = await queries.ask(m.GetState())
        except TimeoutError:
            return self._unknown(owner, f"its owner, process {owner.pid}, does not answer")
        except (OwnerLostError, RequestFailedError, msgspec.DecodeError) as error:
            return self._unknown(owner, str(error))
        described = self._described[key]
        page = page_of(owner.name)
        return ServedArm(
            owner.name, described.arm, described.simulated, msgspec.Raw(state), "", page, here
        )

    def _unknown(self, owner: runtime.OwnerEntry, text: str) -> ServedArm:
        here, page = owner.name == self._here, page_of(owner.name)
        return ServedArm(owner.name, owner.bus, None, None, text, page, here)

    async def _stopped(self, owner: runtime.OwnerEntry, client: WebClient) -> StoppedArm:
        # A connection of its own: it waits behind no other request, and has the client's name.
        queries = OwnerQueries(owner.name, client.named("stop"))
        try:
            await queries.stop()
        except (OwnerLostError, RequestFailedError) as error:
            problem = str(error)
        else:
            return StoppedArm(owner.name, stopped=True, text=f"{owner.name} was stopped")
        finally:
            with suppress(TimeoutError):
                async with asyncio.timeout(_STOP):
                    await queries.close()
        text = f"{owner.name} may not have been stopped: {problem}; use the emergency stop"
        return StoppedArm(owner.name, stopped=False, text=text)


def _of_name(owners: list[runtime.OwnerEntry], name: str) -> runtime.OwnerEntry | None:
    return next((owner for owner in owners if owner.name == name), None)
