"""Sampling a trajectory: the controller's curve against plain numpy on the same points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.measure import Row, at_most, medians
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController, Point
from bioscara.control.controllers.joint_trajectory.goal_messages import JointTrajectory
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator
from bioscara.hardware import CommandInterface, LifecycleState, StateInterface

NAMES = ("j1", "j2", "j3", "j4")
COUNT = 100
CALLS = 5000
PERIOD = 0.01


def _points() -> list[Point]:
    """Return points of a smooth motion, a tenth of a second apart."""
    rows = []
    for index in range(COUNT):
        t = index * 0.1
        phases = [t * rate for rate in (0.3, 0.5, 0.7, 0.9)]
        rows.append(
            Point(
                t,
                tuple(float(0.1 * np.sin(phase)) for phase in phases),
                tuple(float(0.1 * np.cos(phase)) for phase in phases),
            )
        )
    rows[-1] = rows[-1]._replace(velocities=(0.0,) * 4)
    return rows


def _hermite(points: list[Point]) -> Callable[[float], tuple[np.ndarray, np.ndarray]]:
    """Return the plainest cubic Hermite evaluation of position and velocity of all joints."""
    times = np.array([point.time for point in points])
    positions = np.array([point.positions for point in points])
    velocities = np.array([point.velocities for point in points])

    def sample(time: float) -> tuple[np.ndarray, np.ndarray]:
        index = int(np.searchsorted(times, time, side="right")) - 1
        length = times[index + 1] - times[index]
        u = (time - times[index]) / length
        p0, p1 = positions[index], positions[index + 1]
        m0, m1 = velocities[index] * length, velocities[index + 1] * length
        position = (
            (2 * u**3 - 3 * u**2 + 1) * p0
            + (u**3 - 2 * u**2 + u) * m0
            + (3 * u**2 - 2 * u**3) * p1
            + (u**3 - u**2) * m1
        )
        velocity = (
            6 * (u**2 - u) * (p0 - p1) + (3 * u**2 - 4 * u + 1) * m0 + (3 * u**2 - 2 * u) * m1
        ) / length
        return position, velocity

    return sample


def _each(sample: Callable[[float], object]) -> Callable[[], None]:
    times = iter(np.linspace(0.0, 0.1 * (COUNT - 1.5), CALLS + 1).tolist())
    return lambda: (sample(next(times)), None)[1]


def _update() -> Callable[[], None]:
    """Return a function that updates the controller while it follows."""
    parameters = JointTrajectoryController.PARAMETERS.read(
        "jtc", {"joints": NAMES, "command_interfaces": ("position", "velocity")}
    )
    controller = JointTrajectoryController("jtc", parameters)
    controller.on_configure()
    controller.nominal_period = PERIOD
    kinds = ("position", "velocity")
    commands = [CommandInterface(name, kind) for kind in kinds for name in NAMES]
    states = [StateInterface(name, kind) for kind in kinds for name in NAMES]
    for handle in (*commands, *states):
        handle.value = 0.0
    controller.bind({h.name: h for h in commands}, {h.name: h for h in states})
    controller.on_activate(0.0)
    controller.state = LifecycleState.ACTIVE
    controller.send_trajectory(JointTrajectory(NAMES, tuple(_points())), 0.0)
    now = 0.0

    def cycle() -> None:
        nonlocal now
        now += PERIOD / 10.0
        for state in states:
            state.stamp = now - 0.002
        controller.update(now, PERIOD / 10.0)

    return cycle


def rows() -> list[Row]:
    """Measure one sample of four joints, and a whole update of the controller."""
    points = _points()
    own, update, peer = medians(
        _each(Interpolator(points).sample), _update(), _each(_hermite(points)), rounds=CALLS
    )
    whose = "numpy, cubic Hermite, position and velocity"
    what = "one sample of four joints: position, velocity, acceleration"
    controller = "one update of the trajectory controller, four joints"
    return [at_most(what, own, 1, peer, whose), at_most(controller, update, 2.5, peer, whose)]
