"""The arm as it is now, for plans from where it is."""

from __future__ import annotations

import msgspec

from bioscara.api import messages as m
from bioscara.web.owner.queries import OwnerQueries


class _Sample(msgspec.Struct):
    """The part of a :class:`~bioscara.api.messages.StateSample` that is needed here."""

    positions: tuple[float | None, ...]
    pose: object


async def arm_now(queries: OwnerQueries) -> tuple[m.WorkspaceState, tuple[float | None, ...]]:
    """Return the workspace and the joint positions [rad, m, rad, rad]; none if it is not homed.

    Raises:
        BioscaraError: The owner does not answer.
    """
    # Asked for now, not a second ago: the table may just have been changed.
    workspace = msgspec.json.decode(await queries.ask(m.GetWorkspace()), type=m.WorkspaceState)
    return workspace, await joints_now(queries)


async def joints_now(queries: OwnerQueries) -> tuple[float | None, ...]:
    """Return the joint positions [rad, m, rad, rad]; none if the arm is not homed.

    Raises:
        BioscaraError: The owner does not answer.
    """
    sample = msgspec.json.decode(await queries.ask(m.GetState()), type=_Sample)
    # Without a pose a joint is not homed, and its position is an assumption.
    return () if sample.pose is None else sample.positions
