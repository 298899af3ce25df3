"""How goals of clients are followed: measured at the joints and at the plant.

Run by hand it prints the table of docs/ros2.md: PYTHONPATH=tests python -m
server.controllers.goal_tracking
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from bioscara import Robot
from bioscara.control.controllers.joint_trajectory import (
    Goal,
    GoalStatus,
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.model import ArmParameters
from bioscara.remote import RemoteRobot
from bioscara.server.serve import ServeSettings, serving
from client_controllers import JOINTS, POSITION_JTC, VELOCITY_JTC, Site, parameter_file
from served import HALF, NAME, own_robot, runtime_folder
from simulated import ARM, simulated_bus

RATE = 50
"""Cycles per second, as in the bringup: velocities of four joints take more of the bus."""
_STANDS = 5e-3
"""Share of its highest speed below which a joint of the plant stands."""


class Cycle(NamedTuple):
    """One control cycle.

    Attributes:
        time: Its begin [s].
        executing: Whether a goal ran.
        error: Reference minus measured position of each joint, at the measurement [rad or m].
        reference: Position of each joint [rad or m].
        measured: Position of each joint [rad or m].
        plant: Position of each joint behind its belt [rad or m].
        speed: Highest speed of a joint there, as a share of its limit.
    """

    time: float
    executing: bool
    error: tuple[float, ...]
    reference: tuple[float, ...]
    measured: tuple[float, ...]
    plant: tuple[float, ...]
    speed: float


class Tracking(NamedTuple):
    """How a goal was followed.

    Attributes:
        status: How the last goal ended.
        path: Largest distance of a measured joint from the reference, in time [mrad or mm].
        end: Distance of the plant from the reference when the result came, without the constant
            error of homing [mrad or mm].
        moved: Way of the plant after the result [mrad or mm].
        late: Time from the plant's rest to the result [s].
        asked: Duration of the goal as sent [s].
        took: Time from the begin of its motion to its result [s].
    """

    status: str
    path: float
    end: float
    moved: float
    late: float
    asked: float
    took: float


def quintic(here: Sequence[float], there: Sequence[float], time: float) -> tuple[Point, ...]:
    """Return points with velocities and accelerations, from rest to rest, as MoveIt sends them."""
    points = []
    for share in np.linspace(0.0, 1.0, 21):
        s, t = float(share), time
        at = 10 * s**3 - 15 * s**4 + 6 * s**5
        speed = (30 * s**2 - 60 * s**3 + 30 * s**4) / t
        change = (60 * s - 180 * s**2 + 120 * s**3) / t**2
        way = [b - a for a, b in zip(here, there, strict=True)]
        columns = [tuple(factor * each for each in way) for factor in (at, speed, change)]
        positions = tuple(a + b for a, b in zip(here, columns[0], strict=True))
        points.append(Point(s * t, positions, columns[1], columns[2]))
    return tuple(points)


@contextmanager
def tracked(
    name: str, parameters: ArmParameters = ARM, speed: float = 20.0
) -> Iterator[tuple[Site, list[Cycle]]]:
    """Serve an arm whose client has activated a controller, and record each cycle.

    Args:
        name: The controller.
        parameters: Of the arm.
        speed: Factor by which its time is faster than real time.
    """
    with runtime_folder() as folder:
        evidence, arm = folder / "faults", simulated_bus(seed=2, homed=True, at=HALF).arm
        with own_robot(evidence, arm=arm, rate=RATE, parameters=parameters) as robot:
            robot.enable()
            settings = ServeSettings(NAME, "sim", evidence=evidence, real_time_factor=speed)
            with serving(robot, settings) as served, Robot.connect(f"arm:{NAME}") as client:
                assert isinstance(client, RemoteRobot)
                site = Site(served, client)
                site.activated(name)
                yield site, _recorded(site, name)


def _recorded(site: Site, name: str) -> list[Cycle]:
    cycles: list[Cycle] = []
    arm = site.served.robot.runner.arm
    controller = arm.stack.manager.controller(name)
    assert isinstance(controller, JointTrajectoryController)

    def record(report: Any) -> None:
        feedback, goal = controller.feedback, controller.goal
        if feedback is not None:
            executing = goal is not None and goal.status is GoalStatus.EXECUTING
            cycles.append(
                Cycle(
                    report.time, executing, feedback.error.positions, feedback.desired.positions,
                    feedback.actual.positions, site.positions, site.speed,
                )
            )  # fmt: skip

    runner = site.served.robot.runner
    runner.observers = (*runner.observers, record)
    return cycles


Send = Callable[[Sequence[Point]], int]


def slow(site: Site, here: Sequence[float], send: Send) -> float:
    """Six seconds, well below all limits."""
    return _sent(send, quintic(here, _off(here, 0.3, 0.02, 0.2, 0.2), 6.0))


def fast(site: Site, here: Sequence[float], send: Send) -> float:
    """As fast as the joints can: faster than the tool may be."""
    return _sent(send, quintic(here, _off(here, 0.3, 0.01, 0.2, 0.2), 1.6))


def over_the_cap(site: Site, here: Sequence[float], send: Send) -> float:
    """Three times as fast as the tool may be."""
    return _sent(send, quintic(here, _off(here, 0.8), 1.7))


def one_joint(site: Site, here: Sequence[float], send: Send) -> float:
    """A point without velocities, for the lift alone, in a quarter of the time that it needs."""
    return _sent(send, [Point(1.0, _off(here, 0.0, 0.1))])


def repeated(site: Site, here: Sequence[float], send: Send) -> float:
    """Sent four times, each 0.3 s after the one before."""
    for _ in range(3):
        send([Point(2.0, _off(here, 0.3, 0.02, 0.2, 0.2))])
        site.passed(0.3)
    return _sent(send, [Point(2.0, _off(here, 0.3, 0.02, 0.2, 0.2))])


def cancelled(site: Site, here: Sequence[float], send: Send) -> float:
    """Cancelled in the middle."""
    goal = send(quintic(here, _off(here, 0.4, 0.02, 0.2, 0.2), 4.0))
    # It is planned first, in real time.
    site.moving()
    site.passed(1.5)
    (name,) = site.newest.active
    site.robot.controllers.cancel(name, goal)
    return 2.0


def replaced(site: Site, here: Sequence[float], send: Send) -> float:
    """Replaced in motion by one that leads back."""
    send(quintic(here, _off(here, 0.4, 0.02, 0.2, 0.2), 4.0))
    site.moving()
    site.passed(1.5)
    return _sent(send, [Point(3.0, _off(here, -0.2))])


def at_the_limits(site: Site, here: Sequence[float], send: Send) -> float:
    """To the ends of the lift and, as near as velocities alone get to it, of the wrist."""
    _, lift, _, wrist = site.served.robot.parameters.joints
    there = (here[0], lift.upper, here[2], wrist.upper - 0.02)
    return _sent(send, quintic(here, there, 14.0))


GOALS = (slow, fast, over_the_cap, one_joint, repeated, cancelled, replaced, at_the_limits)


def track(name: str, goal: Callable[[Site, Sequence[float], Send], float]) -> Tracking:
    """Follow a goal and return how."""
    with tracked(name) as (site, cycles):
        numbers: list[int] = []

        def send(points: Sequence[Point]) -> int:
            trajectory = JointTrajectory(JOINTS, tuple(points))
            numbers.append(site.robot.controllers.follow(name, Goal(trajectory)))
            return numbers[-1]

        asked = goal(site, site.robot.state.positions, send)
        ended = [site.ended(number) for number in numbers][-1]
        site.passed(2.0)
        return _evaluated(list(cycles), ended.status, asked)


def _evaluated(cycles: list[Cycle], status: str, asked: float) -> Tracking:
    running = [index for index, cycle in enumerate(cycles) if cycle.executing]
    result = cycles[running[-1] + 1]
    begin = max(index for index in running if index - 1 not in running)
    last = cycles[-1]
    constant = np.subtract(last.plant, last.measured)
    moving = [cycle.time for cycle in cycles if cycle.speed > _STANDS]
    return Tracking(
        status,
        1e3 * max(max(map(abs, cycles[index].error)) for index in running),
        1e3 * float(np.abs(np.subtract(result.plant, result.reference) - constant).max()),
        1e3 * float(np.abs(np.subtract(last.plant, result.plant)).max()),
        result.time - moving[-1],
        asked,
        result.time - cycles[begin].time,
    )


def _off(here: Sequence[float], *by: float) -> tuple[float, ...]:
    return tuple(a + b for a, b in zip(here, (*by, 0.0, 0.0, 0.0, 0.0), strict=False))


def _sent(send: Send, points: Sequence[Point]) -> float:
    send(points)
    return points[-1].time


def main() -> None:
    """Print the table."""
    for name in (POSITION_JTC, VELOCITY_JTC):
        assert name in parameter_file()
        for goal in GOALS:
            row = track(name, goal)
            print(  # noqa: T201  that is its purpose
                f"| {name.split('_')[0]} | {goal.__name__.replace('_', ' ')} | {row.asked:.1f} s |"
                f" {row.took:.2f} s | {row.path:.2f} | {row.end:.2f} | {row.moved:.2f} |"
                f" {row.late:.2f} s |"
            )


if __name__ == "__main__":
    main()
