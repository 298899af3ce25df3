"""Messages between the process that moves the arm and the process that answers its clients."""

from __future__ import annotations

from itertools import compress
from typing import Any

import msgspec

from bioscara.api import messages as m

SHOWN = 2000
"""Largest number of points of a trajectory in an answer."""


class ChannelMessage(msgspec.Struct, frozen=True, tag_field="kind", tag=True):
    """A message of the channel."""


# From the clients' process.


class Handle(ChannelMessage, frozen=True, kw_only=True, tag="handle"):
    """Carry out a command of a client.

    Attributes:
        id: Number of the answer; counted by the clients' process.
        session: Name of the client's session.
        client: Name of the client.
        command: The command.
        epoch: Epoch of its lease, if it carries one.
        trajectory: The points of its trajectory, as :func:`pickle.dumps` makes them; empty if it
            has none. Those in the command are left out.
    """

    id: int
    session: str
    client: str
    command: m.AnyCommand
    epoch: int | None
    trajectory: bytes = b""


class AskPlanningStart(ChannelMessage, frozen=True, tag="planning_start"):
    """Ask for the :class:`PlanningStart`.

    Attributes:
        id: Number of the answer.
    """

    id: int


class SessionState(ChannelMessage, frozen=True, tag="session"):
    """How a client is connected.

    Attributes:
        session: Name of its session.
        connected: Whether it has a connection.
        gone: Whether its process has ended.
        forgotten: Whether nothing more comes from that session.
    """

    session: str
    connected: bool
    gone: bool
    forgotten: bool = False


class Wanted(ChannelMessage, frozen=True, tag="wanted"):
    """Subscriptions of the clients.

    Attributes:
        controllers: Whether samples of controllers are wanted.
        world: Whether samples of the world are.
    """

    controllers: bool
    world: bool


class AddEvent(ChannelMessage, frozen=True, tag="add_event"):
    """Add an event of the clients' process; as the fields of :class:`m.Event`."""

    what: m.EventKind
    text: str
    client: str


class LogLine(ChannelMessage, frozen=True, tag="log"):
    """A line of the log of the clients' process; as the fields of a log record."""

    level: int
    logger: str
    text: str


class Ready(ChannelMessage, frozen=True, tag="ready"):
    """Clients of the socket that was handed over are answered from now on.

    Attributes:
        pid: The process that answers them.
    """

    pid: int


class Alive(ChannelMessage, frozen=True, tag="alive"):
    """The answer to :class:`AskAlive`."""


FromApi = Handle | AskPlanningStart | SessionState | Wanted | AddEvent | LogLine | Ready | Alive


# From the process that moves the arm.


class Begin(ChannelMessage, frozen=True, kw_only=True, tag="begin"):
    """First message: which arm it is.

    Attributes:
        name: Name of the owner.
        arm: Which arm on which bus, in words.
        rate: Control cycles per second [Hz].
        sample: The newest state.
        evidence: Folder of the flight records.
        group: Number of the group whose members may be clients; None for this user alone.
    """

    name: str
    arm: str
    rate: int
    sample: m.StateSample
    evidence: str
    group: int | None


class Answered(ChannelMessage, frozen=True, tag="answered"):
    """The result of a command, as msgpack.

    Attributes:
        id: Number of the answer.
        result: The result: one of :data:`m.AnyResult`, or :class:`PlanningStart`,
            :class:`GoalPaths` or :class:`WorldStill`.
    """

    id: int
    result: msgspec.Raw


class Refused(ChannelMessage, frozen=True, tag="refused"):
    """A command was refused, or failed.

    Attributes:
        id: Number of the answer.
        failure: Why.
    """

    id: int
    failure: m.FailureValue


class PlanningStart(ChannelMessage, frozen=True, tag="start"):
    """From where a plan begins.

    Attributes:
        workspace: Tool, scene and load, as :func:`pickle.dumps` makes them.
        positions: Where the joints are [rad, m, rad, rad].
    """

    workspace: bytes
    positions: tuple[float, ...]


class GoalPaths(ChannelMessage, frozen=True, tag="paths"):
    """A part of the trajectories of a goal.

    Attributes:
        points: Number of points of the longest one.
        paths: The trajectories, as :func:`pickle.dumps` makes them.
    """

    points: int
    paths: bytes


class WorldStill(ChannelMessage, frozen=True, tag="still"):
    """A simulated world at one time, to be drawn.

    Attributes:
        time: On the arm's clock [s].
        model: The engine's model, as :func:`pickle.dumps` makes it.
        state: Positions of joints and rotations of bodies, of
            :class:`bioscara.physics.stills.Still`, likewise.
    """

    time: float
    model: bytes
    state: bytes


class Record(ChannelMessage, frozen=True, tag="record"):
    """A record of a control cycle for the client of a session."""

    session: str
    cycle: m.GoalCycle


class EventAdded(ChannelMessage, frozen=True, tag="event_added"):
    """A new event."""

    event: m.Event


class KnownFaults(msgspec.Struct, frozen=True):
    """The faults, and the warnings of all clients.

    Attributes:
        list: Them, as a client gets them.
        authors: The session of the client that each warning concerns alone; empty for all.
    """

    list: m.FaultList
    authors: tuple[str, ...]

    def of(self, session: str) -> m.FaultList:
        """Return the faults, and the warnings that concern a client."""
        own = [author in {"", session} for author in self.authors]
        return msgspec.structs.replace(
            self.list,
            warnings=tuple(compress(self.list.warnings, own)),
            warned=tuple(compress(self.list.warned, own)),
        )


class NewSample(ChannelMessage, frozen=True, tag="sample"):
    """The state at the end of a cycle, and what else is wanted.

    Attributes:
        state: The state.
        controllers: That of the controllers; None while it is not wanted.
        world: The bodies, where there is a new sample of these.
    """

    state: m.StateSample
    controllers: m.ControllersSample | None
    world: m.WorldSample | None


class Known(ChannelMessage, frozen=True, tag="known"):
    """Changes of facts; come before samples and events that show them.

    Attributes:
        faults: The faults and warnings; None for those before.
        workspace: Tool, scene and load; None for those before.
    """

    faults: KnownFaults | None
    workspace: m.WorkspaceState | None


class AskAlive(ChannelMessage, frozen=True, tag="ask_alive"):
    """Answer at once: a process that does not is taken for hung."""


class End(ChannelMessage, frozen=True, tag="end"):
    """The arm is released: nothing more comes."""


FromOwnerProcess = (
    Begin | Answered | Refused | Record | EventAdded | NewSample | Known | AskAlive | End
)

Internal = PlanningStart | GoalPaths | WorldStill
"""Results that no client gets as they are."""

from_api: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(FromApi)
from_owner_process: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(FromOwnerProcess)
any_result: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(m.AnyResult)
internal: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Internal)
