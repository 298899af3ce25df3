"""A simulated robot with observed plant: the true positions of each joint's load and of the jaws.

Commands do not count here. The positions are those behind belt and screw, the width is what the
pulse at the simulated servo turns it to.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bioscara import Robot
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.errors import FollowingError, GoalAbortedError, StalledError
from bioscara.hardware import LifecycleState
from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.report import CycleRecord, Phase
from bioscara.robot.arm import Arm
from bioscara.robot.connection.stack import GRIPPER, HOLD
from bioscara.robot.operations.execution import MotionExecution, ready
from bioscara.robot.operations.operation import Cycles, OnCycle, Operation
from bioscara.robot.planner import Planner
from bioscara.sim import FirmwareBus
from oracle.oracle import HAND, LINKS, Oracle, load
from oracle.solids import Array

_WHOLE = load_parameters()
# Driven to and fro at its full acceleration, a joint stalls under any controller.
ARM = replace(
    _WHOLE,
    joints=tuple(
        replace(joint, max_acceleration=0.5 * joint.max_acceleration) for joint in _WHOLE.joints
    ),
)
NAMES = tuple(joint.name for joint in ARM.joints)
LOWER = np.array([joint.lower for joint in ARM.joints])
UPPER = np.array([joint.upper for joint in ARM.joints])
CENTER = (0.0, 0.2, 0.0, 0.0)
WIDTHS = (ARM.gripper.lower, ARM.gripper.upper)
"""Jaws from closed to the opening at the longest pulse of the servo [m]."""
REACH = np.array([0.80, 1.0, 0.48, 0.21, 0.5])
"""Largest displacement of a point of hand or plate per movement of j1 to j4 and of the width."""
STEP = 3e-3
"""Largest displacement of a point of the arm between two poses that are checked [m]."""
ELBOW = 1.5
"""Up to this angle of the elbow [rad] no pose is near to anything: test_oracle shows it."""
PLATE = ((0.060, -0.0427, -0.153), (0.178, 0.0427, -0.139))
"""A microplate between the fingers, corner to corner in the frame of the wrist [m]."""
PLATE_WIDTH = 0.0855

_HELD = load([[x, y, z] for x, y, z in itertools.product(*zip(*PLATE, strict=True))])
_NEAR = [(one, other) for one in LINKS[:2] for other in HAND]
BARE, CARRYING = Oracle(), Oracle([_HELD])
"""Judges of all links that could intersect."""
BARE_HAND = Oracle(pairs=_NEAR)
CARRYING_HAND = Oracle([_HELD], [*_NEAR, *((one, "load") for one in LINKS[:2])])
"""Judges of links near base and column; other links are near by their construction."""


def scene(*, carrying: bool) -> Scene:
    """Return the scene of the arm alone, empty or with a plate."""
    return Scene().carrying(Prism.between(*PLATE)) if carrying else Scene()


def judge_of(*, carrying: bool) -> Oracle:
    """Return the judge of the same."""
    return CARRYING if carrying else BARE


def dense(rows: Array) -> Array:
    """Return poses and widths, shape (n, 5), with those between them, no two :data:`STEP` apart."""
    if len(rows) < 2:
        return rows
    ways = np.abs(np.diff(rows, axis=0)) @ REACH
    counts = np.maximum(np.ceil(ways / STEP), 1).astype(np.intp)
    at = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(at)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[at]
    between = rows[at] + share[:, None] * (rows[at + 1] - rows[at])
    return np.concatenate((between, rows[-1:]))


def thinned(rows: Array) -> Array:
    """Return the poses of which one is nearly the next left out: the arm rests, or creeps."""
    way = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(rows, axis=0)) @ REACH)))
    number = np.floor(way / (STEP / 3.0)).astype(np.intp)
    kept: Array = rows[np.unique(number, return_index=True)[1]]
    return np.concatenate((kept, rows[-1:]))


def too_near(rows: Array, *, carrying: bool = False, room: float = 0.0) -> list[str]:
    """Return the pairs of links that come too near on a path, a line for each.

    Args:
        rows: j1 to j4 and the width, shape (n, 5).
        carrying: Whether a plate is held.
        room: How far hand and load must keep from base and column [m]; at 0 no links at all may
            intersect.
    """
    judge = judge_of(carrying=carrying)
    if room > 0.0:
        judge = CARRYING_HAND if carrying else BARE_HAND
    way = dense(thinned(rows))
    way = way[np.abs(way[:, 2]) > ELBOW]
    worst: dict[tuple[str, str], tuple[float, int]] = {}
    for hit in judge.hits(way[:, :4], way[:, 4], room):
        worst[hit.links] = min(worst.get(hit.links, (room, 0)), (hit.distance, hit.row))
    return [
        f"{other} to {one} {1e3 * distance:.1f} mm at {way[row, :4].round(4).tolist()}, "
        f"width {1e3 * way[row, 4]:.0f} mm"
        for (one, other), (distance, row) in worst.items()
    ]


def clearance(rows: Array, *, carrying: bool, within: float) -> float:
    """Return the clearance of hand and load to base and column on a path, up to ``within`` [m]."""
    judge = CARRYING_HAND if carrying else BARE_HAND
    way = dense(thinned(rows))
    return float(judge.clearances(way[:, :4], way[:, 4], within).min())


class Watched:
    """A homed simulated robot and a record of its plant.

    Args:
        seed: Of everything random in it.

    Attributes:
        robot: The robot.
        rows: True positions of joints and jaws, cycle by cycle: j1 to j4, width.
    """

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self.rows: list[tuple[float, ...]] = []
        self.carrying = False
        self._connect()

    def _connect(self) -> None:
        self._width = ARM.gripper.initial
        self.robot = Robot.simulated(ARM, seed=self._seed)
        assert isinstance(self.robot.bus, FirmwareBus)
        self.arm = self.robot.bus.arm
        self.robot.__enter__()
        self.robot.home()
        self.home = self.robot.state.positions

    def close(self) -> None:
        """Release the arm."""
        self.robot.__exit__(None, None, None)

    def renew(self) -> None:
        """Continue with another robot, equipped as this one, which may not know its position."""
        self.close()
        width, carrying, reduced = self.width, self.carrying, self.robot.reduced_speed
        self._seed += 1
        self._connect()
        self.robot.reduced_speed = reduced
        self.equip(width, carrying=carrying)

    def planner(self, start: Sequence[float]) -> Planner:
        """Return the robot's planner as of an arm that stands elsewhere."""
        return Planner(self.robot.plan.workspace, lambda: start)

    @property
    def width(self) -> float:
        """Width to which the pulse at the servo turns it [m]; without a pulse it stays."""
        pulse = self.robot._servo.pulse()  # type: ignore[attr-defined]
        if pulse is not None:
            jaws = ARM.gripper
            angle = (pulse - jaws.pulse_center) / jaws.pulse_per_deg
            self._width = jaws.zero_width + angle / jaws.deg_per_m
        return self._width

    @property
    def here(self) -> tuple[float, ...]:
        """True positions of joints and jaws: j1 to j4, width."""
        return (*(self.arm.position(name) for name in NAMES), self.width)

    def look(self, _: CycleRecord | None = None) -> None:
        """Record the present position of the plant."""
        self.rows.append(self.here)

    def seen(self) -> Array:
        """Return the positions recorded since the last call, and clear them."""
        rows, self.rows = np.array([*self.rows, self.here]), []
        return rows

    def equip(self, width: float, *, carrying: bool) -> None:
        """Open the jaws to a width, empty or with a plate, which has its own width; at home.

        There every width is free.
        """
        if np.abs(np.subtract(self.robot.state.positions, self.home)).max() > 5e-3:
            self.fold()
        self.robot.gripper.move(PLATE_WIDTH if carrying else width)
        self.carrying = carrying
        self.robot.scene = scene(carrying=carrying)

    def lead(self, places: Sequence[Sequence[float]]) -> None:
        """Go from place to place without a collision check of the arm itself."""
        robot = self.robot
        scene, reduced = robot.scene, robot.reduced_speed
        robot.scene, robot.reduced_speed = Scene(mounted=()), False
        try:
            for place in places:
                robot.move_joints(np.clip(place, LOWER, UPPER).tolist())
        finally:
            robot.scene, robot.reduced_speed = scene, reduced
            self.rows.clear()

    def fold(self) -> None:
        """Return to the position after homing, in reverse order of leaving it: the elbow last."""
        j1, j2, _, j4 = self.home
        here = self.robot.state.positions
        try:
            self.lead([(*here[:2], 0.0, here[3]), (j1, j2, 0.0, j4), self.home])
        except (StalledError, FollowingError, GoalAbortedError):
            # After any command before: a joint that cannot follow has lost its reference.
            self.renew()

    def stream(self, commands: Callable[[], Sequence[float] | None]) -> None:
        """Let a forward controller command positions, raw, until there is no more; then hold.

        Args:
            commands: Returns a position for each joint, or None to end.
        """
        raw = self._forward()
        self.robot.runner.execute(_Stream(raw, commands, self.look))

    def _forward(self) -> ForwardCommandController:
        manager, name = self.robot.runner.arm.stack.manager, "raw"
        if name not in {each.name for each in manager.controllers}:
            values = {"joints": NAMES, "interface_name": "position"}
            manager.load(name, ForwardCommandController.TYPE, values)
            manager.configure(name)
        forward = manager.controller(name)
        assert isinstance(forward, ForwardCommandController)
        return forward


class _Stream(Operation[None]):
    """Lets a forward controller command positions until there are no more, then holds."""

    def __init__(
        self,
        forward: ForwardCommandController,
        commands: Callable[[], Sequence[float] | None],
        on_cycle: OnCycle,
    ) -> None:
        super().__init__("stream()", on_cycle=on_cycle)
        self._forward, self._commands = forward, commands

    def prepare(self, arm: Arm) -> None:
        """Require that all joints are homed."""
        arm.positions()

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Pass the positions to the controller."""
        stack, clock = arm.stack, arm.session.clock
        yield from ready(arm, self)
        leaving = [
            other.name
            for other in stack.manager.controllers
            if other.state is LifecycleState.ACTIVE
            and other.command_interfaces
            and other.name != GRIPPER
        ]
        stack.manager.switch(clock.now(), [self._forward.name], leaving)

        def done() -> bool:
            values = self._commands()
            if values is None:
                return True
            self._forward.command(values)
            return False

        motion = MotionExecution(arm, self)
        yield from motion.run(done, Phase.JOG)
        stack.use(HOLD, clock.now())
        cycles = iter(range(40))
        yield from motion.run(lambda: next(cycles, None) is None, Phase.SETTLING)


def random_pose(rng: np.random.Generator, width: float, *, carrying: bool, room: float) -> Array:
    """Return a random pose at which hand and load are farther than ``room`` [m] from the arm.

    Every other one is folded up, where the hand is near base and column.
    """
    judge = CARRYING_HAND if carrying else BARE_HAND
    folded = rng.random() < 0.5
    while True:
        poses = rng.uniform(LOWER, UPPER, (16, 4))
        if folded:
            poses[:, 2] = rng.choice((-1.0, 1.0)) * rng.uniform(1.8, UPPER[2], 16)
        free = poses[judge.clearances(poses, width, room) >= room]
        if len(free):
            pose: Array = free[0]
            return pose
