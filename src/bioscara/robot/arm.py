"""The parts of one arm that its operations use."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypeVar

from bioscara.arguments import flag, number
from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.errors import BioscaraError, InvalidArgumentError, NotHomedError
from bioscara.kinematics import Joints
from bioscara.robot.connection.arm_session import ArmSession
from bioscara.robot.connection.pacing import PacedClock
from bioscara.robot.connection.stack import Stack
from bioscara.robot.operations.arbiter import Arbiter, Claim, Device
from bioscara.robot.operations.running import Running
from bioscara.robot.planner import Planner, planned_here
from bioscara.robot.stops import Stops
from bioscara.robot.turn import Turn
from bioscara.robot.workspace.jaw_widths import JawWidths
from bioscara.robot.workspace.workspace import Workspace

T = TypeVar("T")


class Begun(Protocol):
    """What one operation may know of another."""

    claim: Claim
    devices: frozenset[Device]

    @property
    def name(self) -> str:
        """Name for messages."""

    @property
    def done(self) -> bool:
        """Whether it has ended."""

    @property
    def paused(self) -> bool:
        """Whether it was paused on its own."""


class Planning(Protocol):
    """Lets a function plan, as :func:`planned_here` does."""

    def __call__(
        self, make: Callable[[Planner], T], workspace: Workspace, positions: Sequence[float], /
    ) -> T:
        """Return the plan of the function."""


class Arm:
    """One arm, without its control loop, which a :class:`~bioscara.robot.runner.Runner` runs.

    Args:
        session: Connection to the arm.
        workspace: Tool, scene, load and speed limit at first.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.

    Attributes:
        session: As given.
        arbiter: Admits one operation to each device.
        turn: Which thread runs the control loop.
        begun: The operations that have begun and not ended; of the runner.
        stops: The stops that were requested.
        jaws: The widths that the gripper's jaws may have.
        bent_elbow: Position of j3 when the elbow was bent last, to either side [rad]; None if it
            was not yet.
        pace_homing: As given.
        pace_motion: As given.
        planning: Plans the motions that it is commanded, as :func:`planned_here` does.
    """

    def __init__(
        self,
        session: ArmSession,
        workspace: Workspace,
        *,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> None:
        self.session, self._workspace = session, workspace
        self.jaws = JawWidths(session.gripper, session.parameters.gripper)
        self.arbiter, self.turn, self.stops = Arbiter(), Turn(), Stops()
        self.begun: tuple[Begun, ...] = ()
        self.bent_elbow: float | None = None
        self.planning: Planning = planned_here
        self._pauses: dict[str, str] = {}
        self._speed_override = 1.0
        self.pace_homing = flag("pace_homing", pace_homing)
        self.pace_motion = flag("pace_motion", pace_motion)
        self._arranging = threading.Lock()

    @property
    def stack(self) -> Stack:
        """The control stack.

        Raises:
            NotInitializedError: The arm is not connected.
        """
        return self.session.stack

    def warn(self, text: str, call: str | None = None, author: str = "") -> None:
        """Add a warning that a person should see.

        Args:
            text: What happened.
            call: Name of the call in the warning; None for the calls that use the arm now.
            author: Key of the client whose motion it concerns alone; empty for all.
        """
        self.stack.supervisor.warn(text, self.session.clock.now(), call, author)

    @property
    def calls(self) -> str:
        """The names of the calls that use the arm or the gripper."""
        return ", ".join(claim.name for claim in self.arbiter.running)

    @property
    def operations(self) -> tuple[Begun, ...]:
        """The operations that were admitted and have not ended."""
        running = self.arbiter.running
        return tuple([each for each in self.begun if each.claim in running])

    @property
    def workspace(self) -> Workspace:
        """Tool, scene, load, speed limit and the widths that the jaws may have now."""
        # Another thread may replace the workspace at the same time: that must not be undone.
        with self._arranging:
            self._workspace = self._workspace.with_widths(*self.jaws.range())
            return self._workspace

    def use_workspace(self, workspace: Workspace) -> None:
        """Replace the workspace, for plans, jogs and limits; only within an operation."""
        with self._arranging:
            self._workspace = workspace
        if self.session.connected:
            self.stack.use_workspace(workspace)

    @property
    def speed_override(self) -> float:
        """Share of the planned or jog speed, 0 to 1; any thread may change it, 0 pauses."""
        return self._speed_override

    @speed_override.setter
    def speed_override(self, share: float) -> None:
        share = number("speed_override", share)
        if not 0.0 <= share <= 1.0:
            raise InvalidArgumentError(
                f"speed_override {share:g} is outside 0 .. 1: it is a share of the planned speed"
            )
        self._speed_override = share

    @property
    def paused(self) -> bool:
        """Whether all motions are paused."""
        return bool(self._pauses)

    @property
    def pauses(self) -> dict[str, str]:
        """Name of the author of each pause of all motions, by the author's key; oldest first."""
        return self._pauses.copy()

    def pause(self, author: str = "", name: str = "this program") -> None:
        """Pause all motions until :meth:`resume` of the same author, from any thread.

        Args:
            author: Key of who pauses; by default the program that has the arm.
            name: Name of the author, for messages to people.
        """
        self.session.maker.require()
        # One step of the interpreter, as the methods below: a signal handler may call it.
        self._pauses[author] = name

    def resume(self, author: str = "") -> None:
        """End the pause of an author; motions continue when none is left."""
        self._pauses.pop(author, None)

    def speed_of(self, operation: Running[Any]) -> float:
        """Return the share of the planned speed at which an operation moves now."""
        return 0.0 if self.paused or operation.paused else self._speed_override

    @property
    def held(self) -> bool:
        """Whether a pause holds all operations that have begun."""
        if self.paused or self._speed_override == 0.0:
            return True
        return all(operation.paused for operation in self.operations)

    @property
    def resumption(self) -> str:
        """What ends a pause, with the names of other programs that paused."""
        others = [name for author, name in self.pauses.items() if author]
        return f"resume() (paused by {', '.join(others)})" if others else "resume()"

    def pause_remedy(self, operation: Running[Any]) -> str | None:
        """Return what ends the pause of an operation; None if it is not paused."""
        if self.paused or operation.paused:
            return self.resumption
        return "a speed_override above 0" if self._speed_override == 0.0 else None

    def pace(self, *, homing: bool) -> None:
        """Hold simulated time back to real time, or not, as chosen for homing and for motion."""
        clock = self.session.clock
        if isinstance(clock, PacedClock):
            clock.paced = self.pace_homing if homing else self.pace_motion

    def states(self) -> JointStates:
        """Return the joint states: of the last cycle while the loop runs, else read now.

        Raises:
            BusyError: The loop runs and has not read the joints yet.
            FaultedError: The joints were released because of a fault, and are not recovered.
            BioscaraError: They were released without a fault.
        """
        stack = self.stack
        with self.turn.changed:
            stepped = self.turn.holder is not None
            if not stepped:
                states, now = stack.broadcaster.states, self.session.clock.now()
                if states is None or now - states.time > 2.0 * stack.loop.period:
                    stack.cycle()
        states = stack.broadcaster.states
        if states is None:
            if stepped and (running := self.arbiter.running):
                raise running[0].refuse("state")
            stack.supervisor.require_clear()
            raise BioscaraError("the joints are released and report no state; enable() them")
        return states

    def positions(self, reason: str = "its position is unknown; home() first") -> Joints:
        """Return the joint positions [rad, m, rad, rad].

        Args:
            reason: Why a joint that is not homed is refused, for the message.

        Raises:
            FaultedError: The position of a joint is unknown, and a fault is latched.
            NotHomedError: The position of a joint is unknown.
            BioscaraError: As :meth:`states`.
        """
        states = self.states()
        for name, position in zip(states.names, states.positions, strict=True):
            if math.isnan(position):
                # A joint that restarted is homed again once the fault is recovered from.
                self.stack.supervisor.require_clear()
                raise NotHomedError(f"{name} is not homed: {reason}", name)
        return Joints(*states.positions)

    def restart_loop(self, operation: Begun) -> None:
        """Begin the cycles anew after a time without them, unless the arm is moving.

        Args:
            operation: The operation that took that time; another operation may move the arm.
        """
        # One that is refused because of this operation, or has just ended, moves nothing.
        others = [each for each in self.operations if each is not operation]
        if not any(Device.ARM in other.devices for other in others):
            self.stack.loop.restart()

    def require_outside(self, name: str) -> None:
        """Raise in the thread that runs the loop, which would wait for itself.

        Args:
            name: Name of the call that is made in a callback.

        Raises:
            BusyError: This thread runs the loop.
            NotInitializedError: The arm belongs to a parent process, where the loop runs.
        """
        self.session.maker.require()
        if self.turn.mine:
            running = self.arbiter.running or (Claim("the control loop"),)
            raise running[0].refuse(name, inside=True)

    def stop(self) -> None:
        """Stop all operations and end all pauses, from any thread; returns at once.

        Raises:
            NotInitializedError: The arm belongs to a parent process.
        """
        self.session.maker.require()
        # First: an operation that claims its devices from now on is refused by this.
        self.stops.note()
        self.arbiter.stop()
        self._pauses.clear()
