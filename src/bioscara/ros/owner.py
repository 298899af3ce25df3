"""The connection to the owner of the arm: made again when it breaks, with a lease when needed."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from bioscara.api import messages as m
from bioscara.errors import BioscaraError, LeaseError, OwnerLostError
from bioscara.remote.owner_socket import OwnerSocket
from bioscara.remote.remote_robot import RemoteRobot

T = TypeVar("T")

_RETRY = 0.25
"""Time between two attempts to connect [s]."""


class OwnerConnection:
    """A robot that an owner has, as long as there is one.

    The lease is taken by the first command, and given back when no command runs and no controller
    that commands anything is active.

    Args:
        name: Name of the owner.
        client: Name of this node, for messages to people.
        receive: Called with the latest sample, in a thread of its own.
        listed: Called there after each change of controllers or components.
        changed: Called with the reason when the owner was lost, with None when it was found.

    Attributes:
        name: As given.
        own: Names of the controllers that commands of this connection have loaded.
    """

    def __init__(
        self,
        name: str,
        client: str,
        receive: Callable[[m.ControllersSample], object],
        listed: Callable[[], object],
        changed: Callable[[str | None], object],
    ) -> None:
        self.name, self.own = name, set[str]()
        self._client = client
        self._receive, self._listed, self._changed = receive, listed, changed
        self._pid: int | None = None
        self._robot: RemoteRobot | None = None
        self._reason = f"the owner of arm {name} was not found yet"
        self._sample: m.ControllersSample | None = None
        self._waiting = threading.Condition()
        self._lost: OwnerLostError | None = None
        self._closed = False
        self._pending, self._turn = 0, threading.Lock()
        self._activity: int | None = None
        self._threads = [
            threading.Thread(target=target, name=f"bioscara-ros-{target.__name__[1:]}", daemon=True)
            for target in (self._connect, self._pass_on)
        ]

    def start(self, pid: int | None = None) -> None:
        """Begin to connect.

        Args:
            pid: Process of the owner, which no other one may be; None for any.
        """
        self._pid = pid
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """Give the lease back and disconnect."""
        with self._waiting:
            self._closed = True
            self._waiting.notify_all()
        for thread in self._threads:
            thread.join(10.0)
        if self._robot is not None:
            with suppress(BioscaraError):
                self._robot.close()

    @property
    def connected(self) -> bool:
        """Whether there is an owner."""
        return self._robot is not None and self._lost is None

    @property
    def reason(self) -> str:
        """Why there is none; empty if there is one."""
        return "" if self.connected else self._reason

    @property
    def silence(self) -> str:
        """Why calls of the owner fail, if it has been silent for too long; else empty."""
        robot = self._robot
        try:
            if robot is not None:
                robot.require_heard()
        except OwnerLostError as error:
            return str(error)
        return ""

    @property
    def robot(self) -> RemoteRobot:
        """The robot.

        Raises:
            OwnerLostError: There is no owner.
        """
        robot = self._robot
        if robot is None:
            raise OwnerLostError(self._reason)
        return robot

    def controllers(self) -> m.ControllerList:
        """Return the controllers and components, asked for now.

        Raises:
            OwnerLostError: There is no owner.
        """
        return self.robot.controllers.list()

    def command(self, call: Callable[[RemoteRobot], T]) -> T:
        """Carry out a command of a person or program, with the lease.

        A lease that was lost, as by a STOP, is taken again: this is a new request.

        Args:
            call: What to do; nothing is done where it raises a LeaseError.

        Raises:
            LeaseError: Another client commands the arm.
            OwnerLostError: There is no owner.
            BioscaraError: The error of the call.
        """
        with self._turn:
            self._pending += 1
        try:
            robot = self.robot
            try:
                return call(robot)
            except LeaseError as error:
                if error.holder:
                    # It has the cause and the remedy.
                    raise
                robot.acquire_lease()
                return call(robot)
        finally:
            with self._turn:
                self._pending -= 1
            self.settle()

    def settle(self) -> None:
        """Give the lease back unless something needs it."""
        with suppress(BioscaraError), self._turn:
            if self._pending:
                return
            robot = self.robot
            commanding = any(
                each.state == "active" and each.commands and each.name in self.own
                for each in robot.controllers.list().controllers
            )
            if not commanding:
                robot.release_lease()

    def _connect(self) -> None:
        while not self._closed:
            if self._lost is not None:
                self._leave(str(self._lost))
                self._lost = None
            if self._robot is None:
                self._find()
            with self._waiting:
                self._waiting.wait_for(lambda: self._closed or self._lost is not None, _RETRY)

    def _find(self) -> None:
        owner = OwnerSocket(self.name, self._pid)
        robot = RemoteRobot(owner, lost=self._note_loss, client=self._client)
        try:
            robot.open()
            robot.controllers.subscribe(self._take)
            robot.simulation.subscribe()
        except BioscaraError as error:
            self._reason = str(error)
            with suppress(BioscaraError):
                robot.close()
            return
        self._robot, self._activity = robot, None
        self._changed(None)

    def _leave(self, reason: str) -> None:
        robot, self._robot, self._reason = self._robot, None, reason
        self.own.clear()
        self._changed(reason)
        if robot is not None:
            with suppress(BioscaraError):
                robot.close()

    def _note_loss(self, error: OwnerLostError) -> None:
        with self._waiting:
            if not self._closed and self._robot is not None:
                self._lost = error
                self._waiting.notify_all()

    def _take(self, sample: m.ControllersSample) -> None:
        with self._waiting:
            self._sample = sample
            self._waiting.notify_all()

    def _pass_on(self) -> None:
        """Pass the latest sample on, in a thread that may be slow and may ask the owner."""
        while True:
            with self._waiting:
                self._waiting.wait_for(lambda: self._closed or self._sample is not None)
                if self._closed:
                    return
                sample, self._sample = self._sample, None
            if sample is None:
                continue
            self._receive(sample)
            if sample.activity != self._activity:
                with suppress(BioscaraError):
                    self._listed()
                    self._activity = sample.activity
                self.settle()
