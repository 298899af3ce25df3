"""A recording served as an arm that clients can look at, and not command."""

from __future__ import annotations

import asyncio
import math
import time
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from bioscara.api import messages as m
from bioscara.api.framing import Framed
from bioscara.api.runtime import OwnerClaim
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import AccessError, InvalidArgumentError, RecordingError
from bioscara.kinematics import Pose
from bioscara.planning.arrays import Array
from bioscara.recording.content import GRIPPER, ArmStatus
from bioscara.recording.reading.json_messages import message_of
from bioscara.recording.reading.sample_table import TIME, sample_tables
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.rosbag.joint_states import ARM
from bioscara.rosbag.topics import Topic
from bioscara.server.clients.api_server import ApiServer
from bioscara.server.clients.client import ConnectedClient
from bioscara.server.state.history import StateHistory

SLOWEST, FASTEST = 0.01, 100.0
"""Range of the factor to real time."""
_USUAL_RATE = 100
"""Cycles per second of an arm whose recording does not say it [Hz]."""
_PERIOD = 0.01
"""Time between two steps [s]."""
_PATIENCE = 2.0
"""Time in which clients have to read the last messages [s]."""
_JSON: dict[str, type[Any]] = {
    Topic.STATUS: ArmStatus,
    Topic.EVENTS: m.Event,
    Topic.FAULTS: m.FaultList,
    Topic.WORKSPACE: m.WorkspaceState,
    Topic.STATISTICS: m.Statistics,
    Topic.PARAMETERS: m.Description,
    Topic.BODY_LIST: m.BodyList,
    Topic.WORLD: m.WorldSample,
}
_ANSWERS: dict[type[m.Command], type[m.Result]] = {
    m.GetDescription: m.Description,
    m.GetFaults: m.FaultList,
    m.GetWorkspace: m.WorkspaceState,
    m.GetStatistics: m.Statistics,
    m.GetBodies: m.BodyList,
}
"""Questions that the newest message of a kind answers."""
_NOTHING: dict[type[m.Command], m.AnyResult] = {
    m.GetLease: m.LeaseState(m.LeaseValue(None, 0, 0.0)),
    m.ListGoals: m.GoalList(()),
    m.GetSimulation: m.SimulationState(available=False, real_time_factor=math.nan, faults=()),
    m.GetJoints: m.JointList((), math.nan),
    m.ListControllers: m.ControllerList((), (), ()),
    m.ListFlightRecords: m.FlightRecordList(()),
}
"""Answers to questions about data that a recording does not have."""


class RecordedEvents:
    """The events of a recording that have happened by the time of the replay.

    Attributes:
        last: Number of the newest one; 0 before the first.
    """

    def __init__(self) -> None:
        self._events: list[m.Event] = []
        self.last = 0

    def add(self, event: m.Event) -> None:
        """Let the next event happen."""
        self._events.append(event)
        self.last = event.number

    def after(self, number: int) -> m.Event | None:
        """Return the event that follows a number; None if there is none yet."""
        index = bisect_right(self._events, number, key=lambda event: event.number)
        return self._events[index] if index < len(self._events) else None

    def framed(self, event: m.Event) -> Framed:
        """Return an event as bytes for the socket."""
        return Framed(event)


class ReplayedArm:
    """An arm as it was, for the socket of a server.

    Its time begins to pass when the first client connects, and it stays as it was at the end.

    Args:
        path: The recording.
        name: Name under which it is served.
        speed: Factor to real time.

    Attributes:
        name: As given.
        description: Which recording, in words.
        events: Its events so far.
        sample: The newest sample.
        controllers_sample: None: a recording has no controllers of clients.
        world_sample: The newest sample of the bodies around it; None before the first.
        changed: Called when there is a new sample, or a new event: then with True.
        ended: Whether the last sample is reached.

    Raises:
        InvalidArgumentError: The speed cannot be used.
        RecordingError: It cannot be read, or has no samples or no description.
    """

    def __init__(self, path: Path, name: str, speed: float = 1.0) -> None:
        if not SLOWEST <= speed <= FASTEST:
            raise InvalidArgumentError(f"speed {speed:g} is outside {SLOWEST:g} .. {FASTEST:g}")
        self.name, self._speed = name, speed
        self.events = RecordedEvents()
        self.changed: Callable[[bool], object] = lambda _: None
        self.ended = False
        self._said = [
            (each.log_time * 1e-9, message_of(each.data, _JSON[each.channel.topic]))
            for each in messages(path, FileScan(), set(_JSON))
        ]
        self._next_said = 0
        # A value first asked for after the first sample holds for the time before it, too.
        self._latest: dict[type[Any], Any] = {
            type(message): message
            for _, message in reversed(self._said)
            if type(message) in _ANSWERS.values()
        }
        self._rows = _rows(path)
        self._row = next(self._rows, None)
        if self._row is None:
            raise RecordingError(f"{path} has no samples to replay")
        self._time = self._first = self._row[TIME]
        self._begun: float | None = None
        self.sample: m.StateSample
        self.controllers_sample: m.ControllersSample | None = None
        self.world_sample: m.WorldSample | None = None
        rates = [message.rate for _, message in self._said if isinstance(message, m.Description)]
        self._history = StateHistory(
            _sample(self._row, None).names, rates[0] if rates else _USUAL_RATE
        )
        self._advance(self._first)
        if m.Description not in self._latest:
            raise RecordingError(f"{path} does not say which arm it is of")
        described: m.Description = self._latest[m.Description]
        self.description = f"recording {path.name} of {described.arm}"

    def handle(
        self,
        client: ConnectedClient,  # noqa: ARG002  as of an owner
        command: m.AnyCommand,
        epoch: int | None,  # noqa: ARG002
        clients: int,  # noqa: ARG002
    ) -> m.AnyResult:
        """Answer a question.

        Raises:
            AccessError: It is a command, or a question that recordings do not answer.
        """
        if isinstance(command, m.GetState):
            return self.sample
        if isinstance(command, m.GetHistory):
            return self._history.between(command.begin, command.end, command.points)
        if isinstance(command, m.GetWorld) and self.world_sample is not None:
            return self.world_sample
        if (nothing := _NOTHING.get(type(command))) is not None:
            return nothing
        answer: m.AnyResult | None = self._latest.get(_ANSWERS.get(type(command), m.Done))
        if answer is None:
            raise AccessError(f"{self.name} only shows {self.description}; command another arm")
        if isinstance(answer, m.Description):
            return msgspec.structs.replace(
                answer, name=self.name, arm=self.description, simulated=True
            )
        return answer

    def announce(self, what: str, text: str, client: str) -> None:
        """Begin when the first client connects; the events stay those of the recording."""
        del what, text, client
        if self._begun is None:
            self._begun = time.monotonic()

    def want(self, *, controllers: bool, world: bool) -> None:
        """Do nothing: all that was recorded is sent."""

    def state_of(self, session: str, *, connected: bool, gone: bool, forgotten: bool) -> None:
        """Do nothing: a recording has no lease and no goals."""

    def step(self) -> None:
        """Go on to the present time of the replay, and notify the server."""
        if self._begun is None or self.ended:
            return
        events = self.events.last
        due = self._first + self._speed * (time.monotonic() - self._begun)
        if self._advance(due):
            self.changed(True)
        if self.events.last != events:
            self.changed(False)

    def _advance(self, due: float) -> bool:
        """Go on to the last sample that is due; return whether there is a new one."""
        row = None
        while self._row is not None and self._row[TIME] <= due:
            row, self._row = self._row, next(self._rows, None)
            self._history.add(_sample(row, None))
        self.ended = self._row is None
        while self._next_said < len(self._said):
            moment, message = self._said[self._next_said]
            if moment > due and not self.ended:
                break
            self._next_said += 1
            self._latest[type(message)] = message
            if isinstance(message, m.Event):
                self.events.add(message)
            elif isinstance(message, m.WorldSample):
                self._take_world(message)
        if row is not None:
            self.sample = _sample(row, self._latest.get(ArmStatus))
        return row is not None

    def _take_world(self, changed: m.WorldSample) -> None:
        """Add the changes since the sample before, of the same list of bodies."""
        last = self.world_sample
        known = last.poses if last is not None and last.version == changed.version else ()
        poses = {pose.name: pose for pose in (*known, *changed.poses)}
        self.world_sample = msgspec.structs.replace(changed, poses=tuple(poses.values()))


async def serve_recording(
    arm: ReplayedArm, claim: OwnerClaim, ended: asyncio.Event, ready: Callable[[], object]
) -> None:
    """Serve a recording until ``ended``.

    Args:
        arm: The recording.
        claim: The claim to its name.
        ended: Set to end.
        ready: Called when clients can connect.

    Raises:
        OSError: The socket cannot be made.
    """
    server = ApiServer(arm)
    server.start()
    server.listen(claim.listener)
    try:
        ready()
        while not ended.is_set():
            arm.step()
            await asyncio.sleep(_PERIOD)
    finally:
        with suppress(TimeoutError):
            await asyncio.wait_for(server.close(), _PATIENCE)


def _rows(path: Path) -> Iterator[dict[str, float]]:
    """Yield the samples of a recording, one at a time."""
    for table in sample_tables(path, FileScan()):
        names = list(table)
        columns: list[Array] = list(table.values())
        for values in zip(*[column.tolist() for column in columns], strict=True):
            yield dict(zip(names, values, strict=True))


def _sample(row: Mapping[str, float], status: ArmStatus | None) -> m.StateSample:
    """Return the sample of a row.

    Raises:
        RecordingError: The recording has other columns, as of another arm.
    """
    names = tuple(
        column.removesuffix("_position")
        for column in row
        if column.endswith("_position") and not column.startswith(GRIPPER)
    )
    pose = Pose(row["tool_x"], row["tool_y"], row["tool_z"], row["tool_yaw"])
    # Recordings of earlier versions have none.
    loads = tuple([row.get(f"{name}_load", math.nan) for name in names])
    try:
        return m.StateSample(
            cycle=int(row[f"{ARM}_cycle"]),
            time=row[f"{ARM}_time"],
            names=names,
            positions=tuple([row[f"{name}_position"] for name in names]),
            velocities=tuple([row[f"{name}_velocity"] for name in names]),
            qualities=tuple([int(row[f"{name}_quality"]) for name in names]),
            stamps=tuple([row[f"{name}_stamp"] for name in names]),
            flags=tuple([int(row[f"{name}_flags"]) for name in names]),
            commands=tuple([row[f"{name}_command"] for name in names]),
            pose=None if math.isnan(pose.x) else pose,
            width=row[f"{GRIPPER}_position"],
            enabled=bool(row[f"{ARM}_enabled"]),
            fault=FaultState.CLEAR if status is None else FaultState(status.fault),
            paused=bool(row[f"{ARM}_paused"]),
            speed_override=row[f"{ARM}_speed_override"],
            moving=() if status is None else status.moving,
            late=row[f"{ARM}_late"],
            bus_time=row[f"{ARM}_bus_time"],
            stale=bool(row[f"{ARM}_stale"]),
            loads=None if all(map(math.isnan, loads)) else loads,
        )
    except (KeyError, ValueError) as error:
        raise RecordingError(
            f"the samples have no {error}, as those of a flight record or of another program: "
            "they cannot be replayed; 'bioscara view FILE' shows the motion"
        ) from error
