"""A simulated robot whose plant is looked at: where the load of each joint and the jaws really are.

Commands do not count here. The positions are those behind belt and screw, the width is what the
pulse at the simulated servo turns it to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from bioscara.control.forward_command_controller import ForwardCommandController
from bioscara.errors import FollowingError, GoalAbortedError, StalledError
from bioscara.hardware import State
from bioscara.model import load_parameters
from bioscara.planning.shapes import Prism
from bioscara.planning.zones import Scene
from bioscara.report import CycleRecord, Phase
from bioscara.robot import Robot
from bioscara.robot.records import never
from bioscara.robot.stack import GRIPPER, HOLD
from bioscara.sim import FirmwareBus
from oracle.oracle import HAND, LINKS, Oracle, load
from oracle.solids import Array

_WHOLE = load_parameters()
# Thrown to and fro at its full acceleration, a joint stalls whoever commands it.
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
WIDTHS = (ARM.gripper.lower, 0.112)
"""Jaws from closed to as far open as the longest pulse turns the servo [m]."""
REACH = np.array([0.80, 1.0, 0.48, 0.21, 0.5])
"""How far a point of hand or plate goes at most per movement of j1 to j4 and of the width."""
STEP = 3e-3
"""So far a point of the arm goes at most between two poses that are looked at [m]."""
ELBOW = 1.5
"""Up to this angle of the elbow [rad] no pose is near to anything: test_oracle shows it."""
PLATE = ((0.060, -0.0427, -0.153), (0.178, 0.0427, -0.139))
"""A microplate between the fingers, corner to corner in the frame of the wrist [m]."""
PLATE_WIDTH = 0.0855

BARE = Oracle()
CARRYING = Oracle(
    [load([[x, y, z] for x in (0.060, 0.178) for y in (-0.0427, 0.0427) for z in (-0.153, -0.139)])]
)


def scene(*, carrying: bool) -> Scene:
    """Return the scene of the arm alone, empty or with a plate."""
    return Scene().carrying(Prism.between(*PLATE)) if carrying else Scene()


def oracle(*, carrying: bool) -> Oracle:
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


def require_clear(rows: Array, *, carrying: bool = False) -> list[str]:
    """Return what intersects on a way, a line for each pair of links; nothing where it is clear.

    Args:
        rows: j1 to j4 and the width, shape (n, 5).
        carrying: Whether a plate is held.
    """
    way = dense(thinned(rows))
    way = way[np.abs(way[:, 2]) > ELBOW]
    worst: dict[tuple[str, str], tuple[float, int]] = {}
    for hit in oracle(carrying=carrying).hits(way[:, :4], way[:, 4]):
        worst[hit.links] = min(worst.get(hit.links, (0.0, 0)), (hit.distance, hit.row))
    return [
        f"{one} {-1e3 * depth:.1f} mm in {other} at {way[row, :4].round(4).tolist()}, "
        f"width {1e3 * way[row, 4]:.0f} mm"
        for (one, other), (depth, row) in worst.items()
    ]


class Watched:
    """A homed simulated robot and a record of its plant.

    Args:
        seed: Of everything random in it.

    Attributes:
        robot: The robot.
        rows: Where joints and jaws really were, cycle by cycle: j1 to j4, width.
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
        """Go on with another robot, equipped as this one, which may not know where it is."""
        self.close()
        width, carrying, full = self.width, self.carrying, self.robot.full_speed
        self._seed += 1
        self._connect()
        self.robot.full_speed = full
        self.equip(width, carrying=carrying)

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
        """Where joints and jaws really are: j1 to j4, width."""
        return (*(self.arm.position(name) for name in NAMES), self.width)

    def look(self, _: CycleRecord | None = None) -> None:
        """Take note of where the plant is."""
        self.rows.append(self.here)

    def seen(self) -> Array:
        """Return what was noted since the last time, and forget it."""
        rows, self.rows = np.array([*self.rows, self.here]), []
        return rows

    def equip(self, width: float, *, carrying: bool) -> None:
        """Open the jaws so far, empty or with a plate, which has its own width."""
        self.robot.gripper.move(PLATE_WIDTH if carrying else width)
        self.carrying = carrying
        self.robot.plan.scene = scene(carrying=carrying)

    def lead(self, places: Sequence[Sequence[float]]) -> None:
        """Go from place to place without a look at the arm itself."""
        plan = self.robot.plan
        scene, speed = plan.scene, plan.full_speed
        plan.scene, plan.full_speed = Scene(mounted=()), True
        try:
            for place in places:
                self.robot.move_joints(np.clip(place, LOWER, UPPER).tolist())
        finally:
            plan.scene, plan.full_speed = scene, speed
            self.rows.clear()

    def fold(self) -> None:
        """Go back to where homing left the arm, by the way out: the elbow last."""
        j1, j2, _, j4 = self.home
        here = self.robot.state.positions
        try:
            self.lead([(*here[:2], 0.0, here[3]), (j1, j2, 0.0, j4), self.home])
        except (StalledError, FollowingError, GoalAbortedError):
            # Whatever it was thrown to before, a joint that cannot follow has lost its reference.
            self.renew()

    def stream(
        self, interfaces: Sequence[str], commands: Callable[[], Sequence[Sequence[float]] | None]
    ) -> None:
        """Let forward controllers command all joints, raw, until there is no more; then hold.

        Args:
            interfaces: What they command.
            commands: Returns for each of these a value for each joint, or None to end.
        """
        robot = self.robot
        robot.plan.here()
        robot._ready()
        stack = robot._running()
        raw = [self._forward(interface) for interface in interfaces]
        leaving = [
            other.name
            for other in stack.manager.controllers
            if other.state is State.ACTIVE and other.command_interfaces and other.name != GRIPPER
        ]
        stack.manager.switch(robot.clock.now(), [each.name for each in raw], leaving)

        def done() -> bool:
            values = commands()
            if values is None:
                return True
            for each, some in zip(raw, values, strict=True):
                each.command(some)
            return False

        motion = robot._motion(self.look, never)
        motion.run(done, Phase.JOG)
        stack.use(HOLD, robot.clock.now())
        cycles = iter(range(40))
        motion.run(lambda: next(cycles, None) is None, Phase.STOPPING)

    def _forward(self, interface: str) -> ForwardCommandController:
        manager, name = self.robot._running().manager, f"raw {interface}"
        if name not in {each.name for each in manager.controllers}:
            values = {"joints": NAMES, "interface_name": interface}
            manager.load(name, ForwardCommandController.TYPE, values)
            manager.configure(name)
        forward = manager.controller(name)
        assert isinstance(forward, ForwardCommandController)
        return forward


def random_pose(rng: np.random.Generator, width: float, *, carrying: bool, room: float) -> Array:
    """Return a random pose at which no links are nearer to each other than ``room`` [m].

    Every other one is folded up, where the hand is near base and column.
    """
    judge = oracle(carrying=carrying)
    folded = rng.random() < 0.5
    while True:
        poses = rng.uniform(LOWER, UPPER, (16, 4))
        if folded:
            poses[:, 2] = rng.choice((-1.0, 1.0)) * rng.uniform(1.8, UPPER[2], 16)
        near = judge_clearances(judge, poses, width, room)
        if (near >= room).any():
            pose: Array = poses[int(np.argmax(near >= room))]
            return pose


def judge_clearances(judge: Oracle, poses: Array, width: float, within: float) -> Array:
    """Return how far hand and load are from base and column, at most ``within`` [m]."""
    found = np.full(len(poses), within)
    for hit in judge.hits(poses, width, within):
        if hit.links[0] in LINKS[:2] and hit.links[1] in (*HAND, "load"):
            found[hit.row] = min(found[hit.row], hit.distance)
    return found
