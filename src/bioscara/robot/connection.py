"""The arm as one object: connecting, stopping and leaving."""

from __future__ import annotations

import time
from collections.abc import Collection
from pathlib import Path
from types import TracebackType
from typing import Self

from bioscara.arguments import flag, number, shown
from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.control.manager.update_rate import require_rate
from bioscara.drivers import Gripper, Joint
from bioscara.errors import (
    HardwareError,
    InvalidArgumentError,
    LifecycleError,
    MotionCancelledError,
    NotInitializedError,
)
from bioscara.hardware import ArmHardware, GripperHardware, LifecycleState
from bioscara.hardware.safe_stop import release
from bioscara.model import ArmParameters, load_parameters
from bioscara.protocol import Flags
from bioscara.robot.call_arbiter import CallArbiter, exclusive
from bioscara.robot.fault_handling import FaultHandling
from bioscara.robot.gripper import RobotGripper
from bioscara.robot.pacing import PacedClock
from bioscara.robot.planner import Planner
from bioscara.robot.records import Cancelled, Observe, ignore, never
from bioscara.robot.running import Motion
from bioscara.robot.stack import Stack
from bioscara.robot.wiring import named, real_gripper, simulated

FAULTS = Path("faults")
"""Folder for the flight records of faults, unless another one is named."""
_PATIENCE = 15.0
"""Time after which a stopped call is at rest, or in a callback that may never return [s]."""


class Connection(FaultHandling):
    """The arm without its motions; base class of :class:`~bioscara.robot.Robot`.

    Args:
        bus: The bus of the joints; closed on leaving.
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        description: Which arm on which bus, in words.
        gripper: The driver of the gripper; None for the computer's own PWM output.
        servo: The simulated servo of that driver; referenced for the lifetime of the robot.
        rate: Control cycles per second [Hz]; None for the rate that suits the joints.
        evidence: Folder for the flight records of faults.
        full_speed: False keeps the tool at or below 250 mm/s, even if more is commanded.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.

    Attributes:
        bus: The bus of the joints.
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        description: Which arm on which bus, in words.
        plan: Plans motions from the arm's current position, without moving.
        gripper: The gripper.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        parameters: ArmParameters,
        description: str,
        *,
        gripper: Gripper | None = None,
        servo: object = None,
        rate: int | None = None,
        evidence: Path = FAULTS,
        full_speed: bool = False,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> None:
        parameters = _given(parameters)
        if not isinstance(evidence, str | Path):
            raise InvalidArgumentError(f"evidence is {shown(evidence)}; give the path of a folder")
        self.bus, self.clock = bus, clock
        self.parameters, self.description = parameters, description
        self._turn = CallArbiter()
        self._arm = ArmHardware("bioscara_arm", bus, clock, parameters.joints)
        self._jaws = GripperHardware(
            "bioscara_gripper", "gripper", gripper or real_gripper(parameters, clock), clock
        )
        self._servo = servo
        self.plan = Planner(parameters, self._here, self._turn, lambda: self.gripper.widths)
        self.gripper = RobotGripper(
            self._jaws,
            parameters.gripper,
            self._turn,
            self._running,
            lambda: self._motion(ignore, never),
            clock.now,
            self.plan.check_width,
        )
        self._pace_homing = flag("pace_homing", pace_homing)
        self._pace_motion = flag("pace_motion", pace_motion)
        self._rate = None if rate is None else require_rate(rate)
        self._evidence, self._speed = Path(evidence), 1.0
        self.plan.full_speed = full_speed
        self._stack: Stack | None = None
        self._begin = clock.now()

    @classmethod
    def simulated(
        cls,
        parameters: ArmParameters | None = None,
        *,
        v1: bool | Collection[str] = False,
        seed: int = 0,
        evidence: Path = FAULTS,
        full_speed: bool = False,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> Self:
        """Return an arm that is simulated in this process: firmware, physics and clock.

        Args:
            parameters: Parameters of the arm; the committed ones by default.
            v1: Whether its joints have their original firmware, as on existing arms; or the names
                of the joints that have it.
            seed: Seed of all random values in the simulation.
            evidence: Folder for the flight records of faults.
            full_speed: False keeps the tool at or below 250 mm/s.
            pace_homing: Whether homing takes as long as on the arm.
            pace_motion: Whether motion takes as long as on the arm.
        """
        parameters = load_parameters() if parameters is None else _given(parameters)
        wiring = simulated(parameters, v1=v1, seed=seed)
        return cls(
            **wiring._asdict(),
            parameters=parameters,
            evidence=evidence,
            full_speed=full_speed,
            pace_homing=pace_homing,
            pace_motion=pace_motion,
        )

    @classmethod
    def connect(
        cls,
        name: str,
        parameters: ArmParameters | None = None,
        *,
        rate: int | None = None,
        evidence: Path = FAULTS,
        full_speed: bool = False,
    ) -> Self:
        """Return the arm on the bus of this name.

        Args:
            name: ``linux:1``, ``linux:/dev/i2c-1``, or ``sim:/path.sock`` for an arm that
                ``bioscara simulate`` runs.
            parameters: Parameters of the arm; the committed ones by default.
            rate: Control cycles per second [Hz]; None for the rate that suits the joints.
            evidence: Folder for the flight records of faults.
            full_speed: False keeps the tool at or below 250 mm/s.

        Raises:
            InvalidArgumentError: There is no bus of that name.
        """
        parameters = load_parameters() if parameters is None else _given(parameters)
        wiring = named(name, parameters)
        return cls(
            **wiring._asdict(),
            parameters=parameters,
            rate=rate,
            evidence=evidence,
            full_speed=full_speed,
        )

    def __enter__(self) -> Self:
        try:
            self._connect()
        except MotionCancelledError:
            # Stopped once connected: the with statement is not entered and would not call __exit__.
            self.__exit__(None, None, None)
            raise
        return self

    @exclusive("connecting")
    def _connect(self) -> None:
        if self._stack is not None:
            raise LifecycleError("the robot is connected already; use the one there is")
        if self._arm.state is not LifecycleState.UNCONFIGURED:
            raise LifecycleError("the robot was shut down; make another one to connect again")
        try:
            self._arm.configure()
            self._stack = Stack(
                self._arm,
                self._jaws,
                self.plan.surroundings,
                self.clock,
                self.parameters,
                self._rate,
                self._evidence,
            )
            self._stack.broadcast(self.clock.now())
            # Notifies systemd of readiness and starts the evidence of faults latched earlier.
            self._cycle()
            self._take(self._arm.latched(Flags.FAULT | Flags.STALL))
        except BaseException:
            self._stack = None
            self.bus.close()
            raise

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        told, error, begin = "", exc, time.monotonic()
        # While shutdown is refused, a call is still using the bus, which stays open.
        while self._stack is not None:
            try:
                told = "; ".join(self.shutdown())
            except (KeyboardInterrupt, SystemExit) as interrupt:
                if self._turn.running is not None and time.monotonic() - begin >= _PATIENCE:
                    raise
                error = interrupt
        self.bus.close()
        if told and error is None:
            raise HardwareError(told)
        if told and error is not None:
            error.add_note(told)
        if error is not None and error is not exc:
            raise error

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The drivers of the joints."""
        return self._arm.joints

    @property
    def full_speed(self) -> bool:
        """Whether the tool may be faster than 250 mm/s; cannot be changed while a call runs."""
        return self.plan.full_speed

    @full_speed.setter
    @exclusive("setting full_speed")
    def full_speed(self, full_speed: bool) -> None:
        self.plan.full_speed = full_speed

    @property
    def speed(self) -> float:
        """Share of the planned or jog speed, 0 to 1; any thread may change it, 0 pauses."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        speed = number("speed", speed)
        if not 0.0 <= speed <= 1.0:
            raise InvalidArgumentError(f"speed {speed} is outside 0 .. 1")
        self._speed = speed

    def stop(self) -> None:
        """Stop the call that is using the arm, from any thread; returns at once.

        That call raises MotionCancelledError once the arm is at rest. If no call is using the
        arm, nothing happens: a later call is not affected.
        """
        self._turn.stop()

    @exclusive("shutdown()", last=True)
    def shutdown(self) -> list[str]:
        """Stop and disable all joints; does nothing if that is done already.

        A call that uses the arm, with the callback it may be in, is first stopped and awaited.

        Returns:
            A sentence for each joint that could not be stopped or disabled.

        Raises:
            BusyError: Called from a callback of the call that it would have to wait for.
        """
        if self._stack is None:
            return []
        if self._stack.watchdog is not None:
            self._stack.watchdog.close()
        problems = release(self.joints)
        # Not before: after an interruption, shutdown() can be called again.
        self._stack = None
        return problems

    def _running(self) -> Stack:
        if self._stack is None:
            raise NotInitializedError("the robot is not connected: use it in a with statement")
        return self._stack

    def _pace(self, paced: bool) -> None:
        if isinstance(self.clock, PacedClock):
            self.clock.paced = paced

    def _motion(
        self, observe: Observe, cancelled: Cancelled, timeout: float | None = None
    ) -> Motion:
        return Motion(
            self._running(),
            self.clock,
            self._begin,
            observe,
            cancelled,
            self._turn,
            lambda: self._speed,
            timeout,
        )


def _given(parameters: ArmParameters) -> ArmParameters:
    if not isinstance(parameters, ArmParameters):
        raise InvalidArgumentError(
            f"the parameters are {shown(parameters)}; give what load_parameters() returns"
        )
    return parameters
