"""The simulated arm of the tests, in virtual time: as bytes on a bus, as joints, as a robot.

:func:`simulated_bus` is an arm behind a bus with injectable faults, :class:`World` adds the drivers
of its joints, :func:`simulated_robot` a :class:`~bioscara.robot.Robot`, and :func:`homed_robot` one
that is homed and ready to move. The arm stands close to its end stops, so that homing is short.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import bioscara.sim
from bioscara import Robot
from bioscara.bus import Bus, FaultyBus, Transaction
from bioscara.clock import SimulatedClock
from bioscara.drivers import Joint
from bioscara.errors import BusTimeoutError, CommunicationError
from bioscara.model import ArmParameters, JointParameters, load_parameters
from bioscara.protocol import Flags, Register
from bioscara.sim import FirmwareBus, SimulatedArm

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
NEAR = {"j1": -3.0, "j2": 0.33, "j3": 2.58, "j4": 2.9}
"""Close to the end stops that homing seeks."""


def home_error(joint: str, *, v1: bool) -> float:
    """Return the largest error of a homed joint's position [rad or m].

    Ours backs off and measures at rest, within 3 degrees of the motor. An original joint sets its
    zero in the moment in which the rotor snaps back against the stop: an electrical period of 7.2
    degrees and the yield of the belt.
    """
    parameters = next(row for row in ARM.joints if row.name == joint)
    return math.radians(15.0 if v1 else 3.0) / abs(parameters.reduction)


def clock_is_held(arm: SimulatedArm) -> bool:
    """Return whether a joint holds the clock, so that no transfer ends until its power is cycled.

    An original joint does so when more is read than it answers, for which one flipped bit in a
    request is enough.
    """
    (answer,) = FirmwareBus(arm).transfer((Transaction(0x11, bytes((Register.PING,)), 0),))
    return isinstance(answer, BusTimeoutError)


def home_together(joints: Sequence[Joint]) -> None:
    """Home joints at once: it takes half the time of one after the other.

    The links of a simulated arm pass through one another.
    """
    for joint in joints:
        joint.enable()
    for joint in joints:
        joint.stop()
    # While one waited for its rest, the others would not be kept alive.
    joints[0].clock.sleep_until(joints[0].clock.now() + 0.6)
    for joint in joints:
        joint.start_homing()
    moving = list(joints)
    while moving:
        moving[0].clock.sleep_until(moving[0].clock.now() + 0.03)
        ended = [joint for joint in moving if not joint.keep_alive() & Flags.BUSY]
        for joint in ended:
            joint.post_homing()
            moving.remove(joint)


def turn_by_hand(arm: SimulatedArm, joint: str, position: float) -> None:
    """Turn a joint whose motor is off to a position [rad], with 0.1 rad/s."""
    here = arm.position(joint)
    steps = math.ceil(abs(position - here) / 1e-3)
    for step in range(1, steps + 1):
        arm.set_position(joint, here + (position - here) * step / steps)
        arm.run(0.01)


class SimulatedBus(NamedTuple):
    """A simulated arm, and the bus with injectable faults in front of it."""

    arm: SimulatedArm
    bus: FaultyBus


class SimulatedRobot(NamedTuple):
    """A simulated arm, its bus, and a robot on them that is not yet connected."""

    arm: SimulatedArm
    bus: FaultyBus
    robot: Robot


def simulated_bus(
    *,
    seed: int = 1,
    v1: bool | Collection[str] = False,
    controllers_fed: bool = False,
    positions: Mapping[str, float] | None = None,
    frequency: float | None = 100e3,
    homed: bool = False,
    at: Sequence[float] | None = None,
) -> SimulatedBus:
    """Return an arm and its bus.

    Args:
        seed: Of the noise and of the faults.
        v1: True if all joints have their original firmware; or the names of such joints.
        controllers_fed: Whether the controllers stay on without the arm's supply.
        positions: Where joints stand [rad or m], instead of :data:`NEAR`.
        frequency: Of the bus [Hz]; None for a bus that takes no time.
        homed: Whether an earlier program homed and disabled the joints; they were just switched on
            otherwise.
        at: Where it left homed joints [rad or m]; None for near their end stops.
    """
    options = seed, v1 if isinstance(v1, bool) else frozenset(v1), controllers_fed, frequency
    where = tuple({**NEAR, **(positions or {})}.items())
    arm = copied(_homed(*options, where, tuple(at or ()))) if homed else _arm(*options, where)
    return SimulatedBus(arm, FaultyBus(FirmwareBus(arm), seed=seed, clock=arm.clock))


def _arm(
    seed: int,
    v1: bool | frozenset[str],
    controllers_fed: bool,
    frequency: float | None,
    where: tuple[tuple[str, float], ...],
) -> SimulatedArm:
    return SimulatedArm(
        seed=seed,
        v1=v1,
        controllers_fed=controllers_fed,
        positions=dict(where),
        frequency=frequency,
    )


@cache
def _homed(*made: Any) -> SimulatedArm:
    """Return an arm that is copied and never used: homing takes as long as many tests."""
    *options, at = made
    arm = _arm(*options)
    joints = [Joint(FirmwareBus(arm), arm.clock, parameters) for parameters in ARM.joints]
    for joint in joints:
        joint.init()
    home_together(joints)
    for joint, goal in zip(joints, at, strict=False):
        microstep = joint.feedback.transmission.microsteps_to_displacement(1)
        joint.move_steps(round((goal - joint.get_position()) / microstep))
    for joint in joints:
        joint.disable()
    return arm


def copied(arm: SimulatedArm) -> SimulatedArm:
    """Return another arm in the same state, which goes on by itself."""
    made = copy(arm)
    made._arm = type(arm._arm)(arm._arm)
    made.clock = SimulatedClock(made._arm.now, made.run)
    return made


def simulated_robot(
    evidence: Path | None = None,
    *,
    seed: int = 2,
    v1: bool = False,
    controllers_fed: bool = False,
    frequency: float | None = 100e3,
    homed: bool = False,
    at: Sequence[float] | None = None,
    parameters: ArmParameters = ARM,
    **options: Any,
) -> SimulatedRobot:
    """Return a robot on an arm of its own.

    Args:
        evidence: Folder for evidence of faults; None for that of the robot.
        seed: See :func:`simulated_bus`.
        v1: Likewise.
        controllers_fed: Likewise.
        frequency: Likewise.
        homed: Likewise.
        at: Likewise.
        parameters: Of the robot.
        **options: Further arguments of the robot, such as ``rate`` and ``gripper``.
    """
    arm, bus = simulated_bus(
        seed=seed,
        v1=v1,
        controllers_fed=controllers_fed,
        frequency=frequency,
        homed=homed,
        at=at,
    )
    if evidence is not None:
        options["evidence"] = evidence
    return SimulatedRobot(arm, bus, Robot(bus, arm.clock, parameters, "simulated", **options))


@contextmanager
def homed_robot(
    evidence: Path, at: Sequence[float], *, seed: int = 2, **options: Any
) -> Iterator[SimulatedRobot]:
    """Connect a robot to a homed arm and move its joints to ``at`` [rad or m].

    Args:
        evidence: Folder for evidence of faults.
        at: Positions of the joints.
        seed: Of the arm.
        **options: Of :func:`simulated_robot`.
    """
    made = simulated_robot(evidence, seed=seed, homed=True, at=at, **options)
    with made.robot as robot:
        robot.move_joints(at)
        yield made


class NearArm(SimulatedArm):
    """An arm that stands close to its end stops unless other positions are given."""

    def __init__(self, *, positions: Mapping[str, float] | None = None, **options: Any) -> None:
        super().__init__(positions={**NEAR, **(positions or {})}, **options)


@contextmanager
def standing_near_the_stops() -> Iterator[None]:
    """Let ``Robot.simulated`` and the commands simulate arms whose homing is short."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bioscara.sim, "SimulatedArm", NearArm)
        yield


class Tap(Bus):
    """Records the frames that reach the joints, and their calls."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self.calls: list[list[Transaction]] = []

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        self.calls.append(list(transactions))
        return self._bus.transfer(transactions)

    def close(self) -> None:
        self._bus.close()

    def count(self, register: Register) -> int:
        """Return how many frames of ``register`` arrived."""
        return sum(t.write[:1] == bytes((register,)) for call in self.calls for t in call)


class World:
    """An arm near its end stops, its bus with faults, and four unused drivers."""

    def __init__(
        self,
        *,
        v1: bool | Collection[str] = False,
        v1_frames: bool = False,
        controllers_fed: bool = False,
        frequency: float | None = 400e3,
    ) -> None:
        self.arm = SimulatedArm(
            seed=1,
            v1=v1,
            v1_frames=v1_frames,
            controllers_fed=controllers_fed,
            frequency=frequency,
        )
        for name, position in NEAR.items():
            self.arm.set_position(name, position)
            self.arm.reset(name)
        self.arm.run(1.0 if v1 else 0.2)
        self.tap = Tap(FirmwareBus(self.arm))
        self.bus = FaultyBus(self.tap, seed=1, clock=self.arm.clock)
        self.joints = [self.joint(parameters) for parameters in ARM.joints]

    def joint(self, parameters: JointParameters, **changes: Any) -> Joint:
        """Return a separate driver, as another host would have."""
        return Joint(self.bus, self.arm.clock, replace(parameters, **changes))

    def ready(self, *names: str) -> list[Joint]:
        """Return these joints, initialised, enabled and homed."""
        joints = [joint for joint in self.joints if joint.name in (names or NEAR)]
        for joint in joints:
            joint.init()
        home_together(joints)
        return joints


def greeted(name: str, **made: Any) -> tuple[World, Joint]:
    """Return a :class:`World`, made of these arguments, and one of its joints, initialised."""
    world = World(**made)
    joint = world.joints[NAMES.index(name)]
    joint.init()
    return world, joint


def ready(name: str, **made: Any) -> tuple[World, Joint]:
    """Return a :class:`World`, and one of its joints, initialised, enabled and homed."""
    world = World(**made)
    (joint,) = world.ready(name)
    return world, joint
