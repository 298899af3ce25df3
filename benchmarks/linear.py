"""A line of the tool: its duration against a dense phase plane, a pause on it against a stop."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import toppra

from benchmarks.arm import NEAR
from benchmarks.measure import Row, at_most, medians
from benchmarks.peers import toppra_duration
from bioscara import Robot
from bioscara.errors import MotionCancelledError
from bioscara.kinematics import Geometry, Joints, Pose, Scara, batch
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, check
from bioscara.planning.collision.scene import Scene
from bioscara.planning.limits import REDUCED_SPEED, ToolLimits
from bioscara.planning.motions.cartesian import linear
from bioscara.sim import FirmwareBus, SimulatedArm

START, GOAL = Pose(0.45, -0.20, 0.25), Pose(0.35, 0.30, 0.28)
FREE = ToolLimits(math.inf, math.inf, math.inf, math.inf)
_PARAMETERS = load_parameters()
_LENGTHS = _PARAMETERS.geometry
_LIMITS = _PARAMETERS.joints
ARM = Scara(Geometry(_LENGTHS.upper_arm, _LENGTHS.forearm, _LENGTHS.height), _LIMITS)
# The elbow's side for which the reference of 1.698 s was computed.
FROM = ARM.inverse(START)[1]
_WAYPOINTS, _PEER_PIECES, _DENSE_PIECES = 51, 100, 5000


def _peer(waypoints: int, pieces: int) -> float:
    """Return the duration of the line as toppra plans it [s]."""
    way = np.linspace(0.0, 1.0, waypoints)
    poses = np.array(START) + way[:, None] * (np.array(GOAL) - np.array(START))
    return toppra_duration(way, batch.inverse(ARM, poses)[:, 1], _LIMITS, pieces)


def _excess(trajectory: Trajectory) -> float:
    """Return by what share a joint exceeds a limit, on a grid of 1 ms; negative if none does."""
    _, velocities, accelerations = trajectory.sample_many(np.arange(0, trajectory.duration, 1e-3))
    ratios = [
        np.abs(values[:, joint]).max() / most
        for joint, limit in enumerate(_LIMITS)
        for values, most in (
            (velocities, limit.max_velocity),
            (accelerations, limit.max_acceleration),
        )
    ]
    return float(max(ratios)) - 1.0


def _planned_and_checked() -> Trajectory:
    """Return the line, within every limit and clear of the arm itself."""
    line = linear(ARM, FROM, GOAL, _LIMITS, FREE)
    check(line, _LIMITS)
    Scene().check(ARM, line)
    return line


def _carried_on(robot: Robot, arm: SimulatedArm, *, pauses: bool) -> float:
    """Return the distance of the tool after a pause or a stop on a line at 250 mm/s [m]."""
    robot.move_joints(FROM)
    kinematics, limits = robot.plan.kinematics, robot.parameters.joints
    here = robot.plan.here()
    goal = Pose(*[a + b - c for a, b, c in zip(kinematics.forward(here), GOAL, START, strict=True)])
    tool = ToolLimits(speed=REDUCED_SPEED)
    window = robot.plan.workspace.windows[0]
    trajectory = linear(kinematics, here, goal, limits, tool, window=window)
    at = robot.clock.now() + trajectory.duration / 2.0
    places: list[Pose] = []

    def place() -> Pose:
        return kinematics.forward(Joints(*[arm.position(limit.name) for limit in limits]))

    def press(_: object) -> None:
        if robot.clock.now() >= at and not places:
            places.append(place())
            robot.pause() if pauses else robot.stop()
        elif places and robot.clock.now() > at + 1.0:
            robot.stop()

    with suppress(MotionCancelledError):
        robot.follow(trajectory, on_cycle=press)
    return math.dist(places[0][:3], place()[:3])


def _pause_and_stop() -> tuple[float, float]:
    """Return the distances of the tool of the simulated arm after a pause, and after a stop [m]."""
    arm = SimulatedArm(positions=NEAR, frequency=400e3)
    with (
        TemporaryDirectory() as evidence,
        Robot(FirmwareBus(arm), arm.clock, _PARAMETERS, "line", evidence=Path(evidence)) as robot,
    ):
        robot.home()
        robot.reduced_speed = False
        return _carried_on(robot, arm, pauses=True), _carried_on(robot, arm, pauses=False)


def rows() -> list[Row]:
    """Measure the line of 0.511 m."""
    toppra.setup_logging("ERROR")
    pause, stop = _pause_and_stop()
    line = _planned_and_checked()
    coarse, dense = _peer(_WAYPOINTS, _PEER_PIECES), _peer(401, _DENSE_PIECES)
    excess = _excess(line)
    took, alone = medians(_planned_and_checked, lambda: _peer(_WAYPOINTS, _PEER_PIECES))
    return [
        at_most(
            "a line of 0.511 m at the joints' limits, planned and checked",
            took,
            3,
            alone,
            f"toppra, {_PEER_PIECES} pieces, not checked",
        ),
        Row(
            "its duration",
            f"{line.duration:.4f} s",
            f"dense phase plane, {_DENSE_PIECES} pieces: {dense:.4f} s "
            f"({line.duration / dense:.4f} times); toppra, {_PEER_PIECES} pieces: {coarse:.4f} s",
            "at most 1.01 times",
            line.duration <= 1.01 * dense,
        ),
        Row(
            "largest excess over a joint's limit on it",
            f"{excess:.1e}",
            "the limit",
            "at most 1e-6",
            excess <= 1e-6,
        ),
        Row(
            "displacement of the tool after a pause at 250 mm/s",
            f"{1e3 * pause:.1f} mm ({pause / stop:.2f} times)",
            f"after a stop: {1e3 * stop:.1f} mm",
            "at most 1.2 times",
            pause <= 1.2 * stop,
        ),
    ]
