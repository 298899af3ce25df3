"""Trajectories of clients that are not planned: slowed for the limits, and followed at once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from bioscara.control.controllers.joint_trajectory import (
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.control.controllers.joint_trajectory.goal_conversion import PreparedTrajectory
from bioscara.control.controllers.joint_trajectory.stream import LONGEST, StreamedPoint
from bioscara.errors import NotHomedError
from bioscara.planning import Sample
from bioscara.planning.motions.tool_speed import UNPLANNED_SHARE, reduced
from bioscara.robot.arm import Arm
from bioscara.robot.operations.controllers.goal_course import motion_of, within

_HELD = 2.0
"""Factor by which a stream takes longer, from which on the log reports it."""


def slowed(
    arm: Arm, controller: JointTrajectoryController, trajectory: JointTrajectory
) -> tuple[JointTrajectory, float]:
    """Return a trajectory that is not planned, slow enough for the limits, and its share of speed.

    The limits are those of raw commands. Its path is kept, as far as it is known: from where the
    arm was sent to, through its points.

    Args:
        arm: The arm.
        controller: The controller, active.
        trajectory: The trajectory, of checked form.
    """
    prepared, here = controller.prepare_trajectory(trajectory), controller.commanded
    points = controller.arranged(prepared, here)
    if len({tuple(map(bool, point[1:])) for point in points}) > 1:
        points = [Point(point.time, point.positions) for point in points]
    factor = _slower(arm, controller, points, here)
    if factor <= 1.0:
        return trajectory, 1.0
    slower = [
        point._replace(
            time=factor * point.time,
            velocities=tuple([value / factor for value in point.velocities]),
            accelerations=tuple([value / factor**2 for value in point.accelerations]),
        )
        for point in prepared.trajectory.points
    ]
    return replace(prepared.trajectory, points=tuple(slower)), 1.0 / factor


def _slower(
    arm: Arm,
    controller: JointTrajectoryController,
    points: Sequence[Point],
    here: Sequence[float],
) -> float:
    """Return the factor by which a motion from a place through points has to take longer."""
    names, space = controller.parameters.joints, arm.workspace
    limits = [arm.stack.hardware.limits[name] for name in names]
    asked = motion_of(names, points, here)
    course = within(asked, limits)
    if math.isfinite(space.commanded_speed):
        speed = UNPLANNED_SHARE * space.commanded_speed
        # Of an arm that is not homed nothing is known about the tool.
        with suppress(NotHomedError):
            course, _ = reduced(course, space.kinematics, arm.positions(), speed)
    return course.duration / asked.duration if asked.duration else 1.0


def streamed_point(
    arm: Arm, controller: JointTrajectoryController, prepared: PreparedTrajectory
) -> StreamedPoint | None:
    """Return a trajectory as a point of a stream; None if it is none.

    A point of a stream is sent alone, for a time soon after. Its speed is that from the point
    before; one that is too fast is slowed down, on a line from where the arm is to be then.

    Args:
        arm: The arm.
        controller: The controller, active.
        prepared: The trajectory.
    """
    sent, parameters, now = prepared.trajectory, controller.parameters, arm.session.clock.now()
    joints, time = arm.stack.manager.limiter.joints, (sent.stamp or now) + sent.points[-1].time
    if (
        len(sent.points) > 1
        or not 0.0 < time - now <= LONGEST
        or parameters.interpolation_method != "splines"
        or parameters.positions_upsampling.enable
        or not joints.keys() >= set(parameters.joints)
    ):
        return None
    stream = controller.stream(now)
    base = controller.commanded if stream is None else stream.end
    (point,) = controller.arranged(prepared, base)
    begin, start = now, base

    def slower() -> float:
        """Return the factor by which the point is later, from there."""
        return max(_slower(arm, controller, [Point(time - begin, point.positions)], start), 1.0)

    if stream is None:
        factor = slower()
    else:
        on_course = controller.time_on_course(now) - now
        begin, start = stream.start_of(time + on_course)
        begin -= on_course
        if (factor := slower()) > 1.0:
            begin, start = stream.here
            begin -= on_course
            time = max(time, begin + arm.stack.loop.period)
            factor = slower()
        if factor > _HELD and not stream.warned:
            stream.warned = True
            arm.warn(
                "the points are too fast for the joints or the tool: they are followed at "
                f"{100.0 / factor:.0f} % of their speed",
                controller.name,
            )
    sent_to = [joints[name] for name in parameters.joints]
    state = Sample(
        tuple([joint.sent for joint in sent_to]), tuple([joint.speed for joint in sent_to]), ()
    )
    return StreamedPoint(
        begin + factor * (time - begin),
        point.positions,
        factor > 1.0,
        state,
        arm.workspace.raw_windows,
    )
