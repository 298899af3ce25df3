"""The samples, events and answers of an owner, in the order of their arrival."""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from contextlib import suppress
from typing import TypeVar

import msgspec

from bioscara.api import messages as m
from bioscara.api.values import joined_parts
from bioscara.errors import BioscaraError, OwnerLostError, ProtocolError
from bioscara.physics.camera import CameraView
from bioscara.remote.link import OwnerLink

R = TypeVar("R", bound=m.Result)

STATISTICS_PERIOD = 10.0
"""Time between two questions for the statistics [s]."""
IMAGE_PERIOD = 0.25
"""Time between two questions for an image [s]."""
_PATIENCE = 2.0
"""Time in which the owner has to send the rest at the end [s]."""
_QUESTIONS: dict[str, m.AnyCommand] = {
    "fault": m.GetFaults(),
    "faults_cleared": m.GetFaults(),
    "workspace": m.GetWorkspace(),
    "parameters": m.GetParameters(),
}
"""Questions that follow events of each kind."""

FeedItem = (
    m.StateSample
    | m.WorldSample
    | m.BodyList
    | m.ImageFile
    | m.Event
    | m.Statistics
    | m.FaultList
    | m.WorkspaceState
    | m.ParametersState
    | m.GoalTrajectories
    | m.FlightRecordFile
)


class ArmFeed:
    """Receives samples and events, and asks for the details of events, until :meth:`close`.

    Args:
        arm: Name of the owner.
        view: Camera and size of images of its world; None for none.

    Attributes:
        welcome: The owner's greeting.
        description: The arm.
        first: Its state at the begin.
        standing: Its overlay, workspace and faults then.
        lost: Why no more comes; empty while the owner runs.

    Raises:
        OwnerLostError: No owner of that name runs, or it does not answer.
        BioscaraError: It refuses to answer.
    """

    def __init__(self, arm: str, view: CameraView | None = None) -> None:
        self._items: deque[FeedItem] = deque()
        self._questions: queue.SimpleQueue[m.AnyCommand | None] = queue.SimpleQueue()
        self._last_event = 0
        self._bodies = 0
        self._image: m.GetImage | None = None
        if view is not None:
            width, height = view.size
            self._image = m.GetImage(camera=view.camera, width=width, height=height)
        self.lost = ""
        # All events that the owner keeps: also those since an earlier recorder was killed.
        self._link = OwnerLink(arm, self._receive, self._owner_lost, events_after=0)
        self._link.open()
        try:
            self.welcome = self._link.welcome
            self.description = self._answer(m.GetDescription(), m.Description)
            self.first = self._answer(m.GetState(), m.StateSample)
            self.standing = (
                self._answer(m.GetParameters(), m.ParametersState),
                self._answer(m.GetWorkspace(), m.WorkspaceState),
                self._answer(m.GetFaults(), m.FaultList),
            )
            if self._image is not None:
                # Refused here, rather than never there.
                self._answer(self._image, m.ImageFile)
            self._link.subscribe(states=True)
            self._link.subscribe_to_world()
        except BaseException:
            self._link.close()
            raise
        self._asking = threading.Thread(target=self._run, name="bioscara-feed", daemon=True)
        self._asking.start()

    def take(self) -> list[FeedItem]:
        """Return the items since the last call."""
        items = self._items
        return [items.popleft() for _ in range(len(items))]

    def ask(self, command: m.AnyCommand) -> None:
        """Ask the owner soon; the answer comes as an item."""
        self._questions.put(command)

    def report(self, text: str) -> None:
        """Report to all clients of the owner; nothing happens if that does not answer."""
        with suppress(BioscaraError):
            self._link.request(m.Report(text))

    def finish(self) -> None:
        """Wait until all that the owner did until now has come."""
        # The answer to the last question follows the events before it.
        self._questions.put(m.GetStatistics())
        self._questions.put(None)
        self._asking.join(_PATIENCE)

    def close(self) -> None:
        """Disconnect."""
        self._questions.put(None)
        self._link.close()

    def _receive(self, message: m.FromOwner) -> None:
        if isinstance(message, m.StateSample):
            self._items.append(message)
        elif isinstance(message, m.WorldSample):
            if message.version != self._bodies:
                self._bodies = message.version
                self._questions.put(m.GetBodies())
            self._items.append(message)
        elif isinstance(message, m.Event) and message.number > self._last_event:
            # A repeated subscription repeats the events that were being sent.
            self._last_event = message.number
            self._items.append(message)
            if message.number > self._link.welcome.last_event:
                self._follow(message)

    def _follow(self, event: m.Event) -> None:
        if event.what == "goal_accepted" and event.goal is not None:
            self._questions.put(m.GetTrajectories(event.goal.goal))
        elif (question := _QUESTIONS.get(event.what)) is not None:
            self._questions.put(question)

    def _owner_lost(self, error: OwnerLostError) -> None:
        self.lost = str(error)
        self._questions.put(None)

    def _run(self) -> None:
        regular: list[tuple[m.GetStatistics | m.GetImage, float]] = [
            (m.GetStatistics(), STATISTICS_PERIOD)
        ]
        if self._image is not None:
            regular.append((self._image, IMAGE_PERIOD))
        dues = dict.fromkeys(range(len(regular)), time.monotonic())
        while True:
            which = min(dues, key=dues.__getitem__)
            command: m.AnyCommand | None
            try:
                command = self._questions.get(timeout=max(dues[which] - time.monotonic(), 0.0))
            except queue.Empty:
                command, period = regular[which]
                dues[which] = time.monotonic() + period
            if command is None:
                return
            # A goal may be forgotten, or the owner be lost: then there is nothing to record.
            with suppress(BioscaraError):
                answer = self._link.request(command)
                if isinstance(answer, m.GoalTrajectories):
                    answer = self._whole(answer)
                if isinstance(answer, FeedItem):
                    self._items.append(answer)

    def _whole(self, answer: m.GoalTrajectories) -> m.GoalTrajectories:
        """Ask for the points that did not fit into an answer."""
        while (
            count := max((len(each.times) for each in answer.trajectories), default=0)
        ) < answer.points:
            asked = m.GetTrajectories(answer.goal, count)
            more = self._answer(asked, m.GoalTrajectories).trajectories
            pairs = zip(answer.trajectories, more, strict=True)
            joined = tuple([joined_parts(*pair) for pair in pairs])
            answer = msgspec.structs.replace(answer, trajectories=joined)
        return answer

    def _answer(self, command: m.AnyCommand, kind: type[R]) -> R:
        answer = self._link.request(command)
        if not isinstance(answer, kind):
            raise ProtocolError(f"the owner answered {command} by {type(answer).__name__}")
        return answer
