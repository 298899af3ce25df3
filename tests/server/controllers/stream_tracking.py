"""How streams of single points are followed: measured at the joints, in virtual time.

Run by hand it prints the table of docs/ros2.md: PYTHONPATH=tests python -m
server.controllers.stream_tracking
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, cast

import numpy as np

from bioscara.api import messages as m
from bioscara.control.controllers.joint_trajectory import (
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.server.clients.client import Client, Later
from client_controllers import JOINTS, POSITION_JTC, VELOCITY_JTC, Site
from served import eventually
from server.controllers.goal_tracking import RATE, Cycle, tracked

FORMS = ("positions", "velocities", "accelerations")
"""Fields of the points, each with those before."""
AHEAD = (0.01, 0.02, 0.034, 0.1)
"""Times that the points are ahead [s]."""
CONTROLLERS = (POSITION_JTC, VELOCITY_JTC)
SWING, FREQUENCY = 0.1, 0.3
"""Way of each joint to and fro, in rad or m, and how often a second; the lift's is a tenth."""
_PERIOD = 0.02
"""Time from point to point [s]."""
_LONG = 10.0 / 3.0 * 2.0
"""Duration of a stream [s]: two swings."""


Arrives = Callable[["Owner", float], bool]
"""Called before the point of a time is sent; returns whether it arrives."""


class Followed(NamedTuple):
    """How a stream was followed, of the first joint.

    Attributes:
        amplitude: Its way to and fro as a share of that of the points.
        lag: Time by which it is behind the points [s].
        acceleration: The highest that was commanded, of any joint, as a share of its limit.
        end: Distance from the last point, 0.5 s after its time [mrad].
        warnings: Warnings of the arm.
    """

    amplitude: float
    lag: float
    acceleration: float
    end: float
    warnings: tuple[str, ...]


def point(here: Sequence[float], time: float, form: str, ahead: float) -> Point:
    """Return the point for a time of the stream."""
    phase, rate = 2.0 * math.pi * FREQUENCY * time, 2.0 * math.pi * FREQUENCY
    half = (0.5 * SWING, 0.05 * SWING, 0.5 * SWING, 0.5 * SWING)
    columns = (
        tuple([at + way * (1.0 - math.cos(phase)) for at, way in zip(here, half, strict=True)]),
        tuple([way * rate * math.sin(phase) for way in half]),
        tuple([way * rate**2 * math.cos(phase) for way in half]),
    )
    return Point(ahead, *columns[: 1 + FORMS.index(form)])


def follow(
    name: str,
    form: str,
    ahead: float,
    *,
    arrives: Arrives = lambda *_: True,
    faster: float = 1.0,
) -> Followed:
    """Stream points to a controller and return how it follows them.

    Args:
        name: The controller.
        form: Of the points.
        ahead: Time that they are ahead [s].
        arrives: Called before the point of a time is sent; returns whether it arrives.
        faster: Factor by which the points are faster than they should be.
    """
    with tracked(name) as (site, cycles):
        here = site.served.robot.state.positions
        runner = site.served.robot.runner
        joints = runner.arm.stack.manager.limiter.joints
        commands: list[tuple[float, ...]] = []
        begun: list[float] = []
        sent = _streamed(Owner(site, name), here, form, ahead, arrives, faster)

        def send(report: Any) -> None:
            begun[:] = begun or [report.time]
            commands.append(tuple(joints[each].speed for each in JOINTS))
            next(sent, None)

        runner.observers = (*runner.observers, send)
        end = _LONG + ahead + 1.0
        eventually(
            lambda: begun and cycles[-1].time > begun[0] + end, 60.0, what="the end of the stream"
        )
        limits = [joints[each].max_acceleration for each in JOINTS]
        row = _evaluated(list(cycles), commands, limits, here, begun[0], ahead)
        return row._replace(
            warnings=tuple(str(each) for each in runner.arm.stack.supervisor.warnings)
        )


class Owner:
    """Requests to the owner in the thread of its control loop, between two cycles.

    Attributes:
        controller: The controller that is streamed to.
    """

    def __init__(self, site: Site, name: str) -> None:
        self._runner = site.served.robot.runner
        self._handlers = site.served.owner._controllers.handlers
        # It is between cycles already.
        self._runner.between_cycles = lambda _, work: work()  # type: ignore[assignment,method-assign]
        controller = self._runner.arm.stack.manager.controller(name)
        assert isinstance(controller, JointTrajectoryController)
        self.controller = controller

    def now(self) -> float:
        """Return the time of the arm."""
        return self._runner.arm.session.clock.now()

    def do(self, command: m.ControllerCommand) -> None:
        """Carry out a request."""
        later = self._handlers[type(command)](cast("Client", None), command, 0)
        assert isinstance(later, Later)
        later.work()

    def send(self, *points: Point, joints: Sequence[str] = JOINTS) -> None:
        """Send a trajectory."""
        trajectory = JointTrajectory(tuple(joints), points)
        self.do(m.StreamTrajectory(controller=self.controller.name, trajectory=trajectory))

    def scale(self, factor: float) -> None:
        """Choose the share of the speed."""
        self.do(m.SetControllerScaling(controller=self.controller.name, factor=factor))


def _streamed(
    owner: Owner,
    here: Sequence[float],
    form: str,
    ahead: float,
    arrives: Arrives,
    faster: float,
) -> Iterator[None]:
    """Send a point every 20 ms."""
    begin = owner.now()
    for number in range(round(_LONG / _PERIOD) + 1):
        due = number * _PERIOD
        while owner.now() < begin + due - 1e-9:
            yield
        if arrives(owner, due):
            owner.send(point(here, (due + ahead) * faster, form, ahead))


def _evaluated(
    cycles: Sequence[Cycle],
    commands: Sequence[Sequence[float]],
    limits: Sequence[float],
    here: Sequence[float],
    begin: float,
    ahead: float,
) -> Followed:
    times = np.array([each.time for each in cycles]) - begin
    measured = np.array([each.measured[0] for each in cycles]) - here[0]

    def asked(time: Any) -> Any:
        phase = 2.0 * math.pi * FREQUENCY * np.clip(time, 0.0, _LONG + ahead)
        return 0.5 * SWING * (1.0 - np.cos(phase))

    streamed = (times > 1.0) & (times < _LONG)
    lags = np.arange(-0.2, 1.0, 0.002)
    off = [float(((measured - asked(times - lag))[streamed] ** 2).sum()) for lag in lags]
    accelerations = np.abs(np.diff(np.array(commands), axis=0)) * RATE / np.array(limits)
    at_end = np.interp(_LONG + ahead + 0.5, times, measured)
    return Followed(
        float(np.ptp(measured)) / SWING,
        float(lags[int(np.argmin(off))]),
        float(accelerations.max()),
        1e3 * abs(float(at_end - asked(_LONG + ahead))),
        (),
    )


def main() -> None:
    """Print the table."""
    for name in CONTROLLERS:
        for form in FORMS:
            for ahead in AHEAD:
                row = follow(name, form, ahead)
                print(  # noqa: T201  that is its purpose
                    f"| {name.split('_')[0]} | {form} | {1e3 * ahead:.0f} ms | "
                    f"{100.0 * row.amplitude:.1f} % | {row.lag:.3f} s | "
                    f"{100.0 * row.acceleration:.0f} % | {row.end:.2f} |"
                )


if __name__ == "__main__":
    main()
