"""Planning of motions from the arm's current position; nothing moves."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from bioscara.arguments import flag, items, number, numbers, shown
from bioscara.errors import InvalidArgumentError, TrajectoryError, ZoneError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.model import ArmParameters
from bioscara.model.parameters import JERK_TIME
from bioscara.planning import Trajectory, check
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.unfolding import by_open_elbow, joined
from bioscara.planning.limits import FULL, REDUCED_SPEED, ToolLimits, check_share
from bioscara.planning.motions.cartesian import circular, linear
from bioscara.planning.motions.jog import Jog
from bioscara.planning.motions.point_to_point import point_to_point
from bioscara.planning.motions.sequence import sequence
from bioscara.planning.motions.tool_speed import COMMANDED_SPEED, UNPLANNED_SHARE, reduced
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.planning.moving_average import averaged, most_jerk
from bioscara.planning.trajectory.retiming import stretch_factor, stretched
from bioscara.robot.connection.call_arbiter import CallArbiter, exclusive
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.tools import Tool, fingers, kinematics_of

ACCELERATION_SHARE = 0.8
"""Share of a joint's acceleration that motions planned here use. At full acceleration a joint that
slips a step could not catch up before it has to brake, and would overshoot."""
_END_STOP_TOLERANCE = 1e-3
"""Tolerated reading beyond its limit of a joint pressed against its end stop [rad or m]."""
_JERK_SHARE = 2.0
"""Share of its highest acceleration by which a joint's acceleration may rise per time without
oscillation [1/s]."""
_REDUCED = replace(FULL, speed=COMMANDED_SPEED)
"""Tool limits on any path unless full speed is enabled; lines and arcs have further limits."""


class Plan(NamedTuple):
    """A planned motion that was checked to be free of collisions.

    Attributes:
        trajectory: Of all joints, from the arm's current position.
        notes: Notes on the plan for the user.
        tool: Limits of the tool that the whole plan was kept to.
    """

    trajectory: Trajectory
    notes: tuple[str, ...] = ()
    tool: ToolLimits = FULL


class Planner:
    """Plans for one arm with one tool.

    Every plan starts at the arm's current position, stays within the limits of joints and tool,
    and keeps clear of the scene.

    Args:
        parameters: Parameters of the arm.
        measured: Returns the measured joint positions [rad, m, rad, rad].
        arbiter: Call arbiter of the arm that is planned for; None if there is no arm to move.
        widths: Returns the smallest and the largest width that the gripper may have now [m]; None
            if the width is unknown, for the full range of the gripper.

    Attributes:
        table: The named tools and poses.
        kinematics: Kinematics of the arm with its tool.
    """

    def __init__(
        self,
        parameters: ArmParameters,
        measured: Callable[[], Sequence[float]],
        arbiter: CallArbiter | None = None,
        widths: Callable[[], tuple[float, float]] | None = None,
    ) -> None:
        self._tool = fingers(parameters)
        self.table = TeachTable(self._tool)
        self.kinematics = kinematics_of(parameters)
        every = parameters.gripper.lower, parameters.gripper.upper
        self._widths = widths or (lambda: every)
        self._scene = self._surroundings = Scene(widths=every)
        self._arbiter = arbiter or CallArbiter()
        self._full_speed = False
        self._limits, self._measured = parameters.joints, measured
        self._periods = parameters.belt_periods
        self._planned_limits = tuple(
            replace(limit, max_acceleration=ACCELERATION_SHARE * limit.max_acceleration)
            for limit in parameters.joints
        )
        self._names = tuple(limit.name for limit in parameters.joints)

    @property
    def tool(self) -> Tool:
        """The mounted tool; :meth:`use_tool` changes it."""
        return self._tool

    @property
    def full_speed(self) -> bool:
        """Whether the tool may be faster than 250 mm/s."""
        return self._full_speed

    @full_speed.setter
    def full_speed(self, full_speed: bool) -> None:
        self._full_speed = flag("full_speed", full_speed)

    @property
    def scene(self) -> Scene:
        """Surroundings to keep clear of; cannot be changed while a call uses the arm."""
        return self._scene

    @scene.setter
    @exclusive("setting scene")
    def scene(self, scene: Scene) -> None:
        if not isinstance(scene, Scene):
            raise InvalidArgumentError(f"the scene is {shown(scene)}; give Scene(...)")
        self._scene = self._surroundings = scene

    def surroundings(self) -> tuple[Scara, Scene]:
        """Return the arm with its tool, and the scene with the current widths of the gripper."""
        widths = self._widths()
        # The same object as long as nothing changes, so that its precomputed data stay valid.
        if self._surroundings.widths != widths:
            self._surroundings = replace(self._scene, widths=widths)
        return self.kinematics, self._surroundings

    def check_width(self, width: float) -> None:
        """Check that the jaws may move to a width at the arm's current position.

        Args:
            width: Width between the jaws [m].

        Raises:
            InvalidArgumentError: The width is no finite number.
            ZoneError: The clearance of a jaw would be too small.
            NotHomedError: The position of a joint is unknown.
        """
        width = number("the width", width)
        arm, scene = self.surroundings()
        low, high = scene.widths
        swept = replace(scene, widths=(min(low, width), max(high, width)))
        swept.check_standing(arm, self.here(), scene)

    def here(self) -> Joints:
        """Return the joint positions; a joint pressed against its end stop counts as at its limit.

        Raises:
            NotHomedError: The position of a joint is unknown.
        """
        return self._clipped_at_end_stops(self._measured())

    def joints(self, goal: Sequence[float], speed: float = 1.0) -> Plan:
        """Plan to joint positions; all joints start and end together.

        If the arm would come too near to itself on this path because it is folded up at the start
        or the goal, the elbow opens alone first and closes alone at last, if that path is free; a
        note says so. Joints that were pushed beyond a limit by hand are moved back by the plan.

        Args:
            goal: One position for each joint [rad or m].
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            TrajectoryError: The goal is outside the limits or not finite.
            ZoneError: The path is not free.
        """
        remedy = "give one for each joint, or a pose to move_to()"
        if isinstance(goal, Pose):
            raise TrajectoryError(f"the positions of the joints are {shown(goal)}; {remedy}")
        goal = items("the positions of the joints", goal, remedy, error=TrajectoryError)
        if len(goal) != len(self._names):
            raise TrajectoryError(f"{len(goal)} positions for {len(self._names)} joints")
        here = self.here()
        direct = point_to_point(self._names, here, goal, self._planned_limits, speed=speed)
        try:
            smooth, slowdown = self._smoothed(direct, here)
            return self._collision_free(smooth, here, slowdown=slowdown)
        except ZoneError as error:
            plan = (
                self._by_open_elbow(here, goal, speed) if self._is_self_collision(error) else None
            )
            if plan is None:
                raise
            return plan

    def unfold(self, speed: float = 1.0) -> Plan:
        """Plan to open the elbow alone, j3 to 0, so that a folded arm can move freely.

        From the position in which homing leaves the arm, this is free at every width of the
        gripper, and every position with an open elbow, such as ``center``, can be reached
        afterwards.

        Args:
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            NotHomedError: The position of a joint is unknown.
            ZoneError: The path is not free.
        """
        here = self.here()._replace(j3=0.0)
        return self.joints(here, speed)

    def to(self, pose: Pose, speed: float = 1.0) -> Plan:
        """Plan to a pose by the closest joint solution; the tool's path is not a line.

        Args:
            pose: Pose of the tool in the base.
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            UnreachableError: The arm cannot reach the pose.
            ZoneError: The path is not free.
        """
        return self.joints(self.kinematics.solve(pose, self.here()), speed)

    def named(self, name: str, speed: float = 1.0) -> Plan:
        """Plan to a pose of the teach table.

        Args:
            name: Name of the pose.
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            InvalidArgumentError: No pose has that name, or it was taught with another tool.
            UnreachableError: The arm cannot reach the pose.
            ZoneError: The path is not free.
        """
        taught = self.table.pose(name)
        if taught.joints is not None:
            return self.joints(taught.joints, speed)
        if taught.tool != self.tool.name or taught.pose_tool_in_base is None:
            raise InvalidArgumentError(
                f"pose {name} was taught with tool {taught.tool}, the arm has {self.tool.name}; "
                f"set plan.use_tool({taught.tool!r}) once that is mounted"
            )
        return self.to(taught.pose_tool_in_base, speed)

    @exclusive("use_tool()")
    def use_tool(self, name: str) -> None:
        """Plan for another tool of the teach table from now on.

        Args:
            name: Name of the mounted tool.

        Raises:
            InvalidArgumentError: No tool has that name.
            BusyError: A call is using the arm.
        """
        self._tool = self.table.tool(name)
        old = self.kinematics
        self.kinematics = Scara(old.geometry, old.limits, self.tool.pose_tool_in_flange, old.base)

    def jog(self, start: Sequence[float]) -> Jog:
        """Return a jog that starts at rest.

        Args:
            start: Joint positions at the start [rad, m, rad, rad].

        Raises:
            TrajectoryError: A joint was pushed beyond a limit.
            ZoneError: The arm's clearance is too small.
        """
        start = self._require_within_limits(
            self._clipped_at_end_stops(self._joint_positions("the start", start))
        )
        speed = math.inf if self.full_speed else UNPLANNED_SHARE * COMMANDED_SPEED
        arm, scene = self.surroundings()
        return Jog(arm, self._planned_limits, start, scene, speed, self.windows)

    @property
    def windows(self) -> tuple[float, ...]:
        """Durations of the command averaging that keeps the belts from oscillating [s]."""
        if self.full_speed:
            return (JERK_TIME,)
        return self._periods[:2]

    def linear(self, pose: Pose, speed: float = 1.0) -> Plan:
        """Plan to a pose along a line.

        Args:
            pose: Pose of the tool in the base.
            speed: Share of the tool's speed limit to use, 0.001 to 1.

        Raises:
            UnreachableError, TrajectoryError: The arm cannot follow that line.
            ZoneError: The path is not free.
        """
        here = self._start_of_path()
        tool = self._tool_limits()
        speed, window = check_share(speed), self.windows[0]
        trajectory = linear(
            self.kinematics, here, pose, self._planned_limits, tool, speed=speed, window=window
        )
        return self._collision_free(trajectory, here, tool=tool)

    def circular(self, via: Pose, pose: Pose, speed: float = 1.0) -> Plan:
        """Plan to a pose along an arc.

        Args:
            via: A pose on the arc; its yaw is not used.
            pose: The goal pose; both are poses of the tool in the base.
            speed: Share of the tool's speed limit to use, 0.001 to 1.

        Raises:
            UnreachableError, TrajectoryError: The arm cannot follow that arc.
            ZoneError: The path is not free.
        """
        here = self._start_of_path()
        tool = self._tool_limits()
        speed, window, limits = check_share(speed), self.windows[0], self._planned_limits
        trajectory = circular(
            self.kinematics, here, via, pose, limits, tool, speed=speed, window=window
        )
        return self._collision_free(trajectory, here, tool=tool)

    def sequence(self, waypoints: Sequence[Waypoint]) -> Plan:
        """Plan along several waypoints with rounded corners, without a stop.

        Args:
            waypoints: Waypoints of the tool in the base.

        Raises:
            UnreachableError, TrajectoryError: The arm cannot reach a waypoint; names the waypoint.
            ZoneError: The path is not free.
        """
        here = self._start_of_path()
        trajectory, warnings = sequence(
            self.kinematics,
            here,
            waypoints,
            self._planned_limits,
            self._tool_limits(),
            self.windows[0],
        )
        return self._collision_free(trajectory, here, warnings)

    def trajectory(
        self, trajectory: Trajectory, elsewhere: Sequence[float], *, planned: bool = False
    ) -> Plan:
        """Check a trajectory; slow it down and average it where necessary.

        Args:
            trajectory: Trajectory of some or all joints.
            elsewhere: Positions of the joints that it does not name [rad, m, rad, rad].
            planned: Whether it was planned here: it is then smooth already and not averaged, and
                its path is unchanged.

        Raises:
            TrajectoryError: The trajectory exceeds a limit.
            ZoneError: Its path is not free.
        """
        if not isinstance(trajectory, Trajectory):
            raise InvalidArgumentError(f"{shown(trajectory)} is not a Trajectory")
        elsewhere = self._joint_positions("the other joints", elsewhere)
        limits = [
            # A joint beyond a limit can only have been pushed there: it may only move back.
            replace(limit, lower=min(limit.lower, at), upper=max(limit.upper, at))
            for limit, at in zip(self._limits, self.here(), strict=True)
        ]
        notes = check(trajectory, limits)
        here = Joints(*elsewhere)
        slowdown = 1.0
        if not flag("planned", planned):
            trajectory, slowdown = self._smoothed(trajectory, here)
        return self._collision_free(trajectory, here, tuple(notes), slowdown=slowdown)

    def _smoothed(self, trajectory: Trajectory, here: Joints) -> tuple[Trajectory, float]:
        """Smooth a joint motion by averaging, unless full speed is enabled.

        Returns:
            The motion, and the factor in time by which it was slowed down before averaging.
        """
        if self.full_speed:
            return trajectory, 1.0
        # Slow down before averaging. Stretching an averaged motion would stretch the window too,
        # which must match the belt's period; and a motion that is slow enough needs no averaging.
        trajectory, factor = reduced(trajectory, self.kinematics, here, COMMANDED_SPEED)
        max_acceleration = {limit.name: limit.max_acceleration for limit in self._limits}
        jerks = most_jerk(trajectory).tolist()
        if all(
            jerk <= _JERK_SHARE * max_acceleration[name]
            for name, jerk in zip(trajectory.joint_names, jerks, strict=True)
        ):
            return trajectory, factor
        smooth = averaged(trajectory, self.windows[0])
        # Between its points the averaged curve may exceed a limit by a thousandth.
        return stretched(smooth, stretch_factor(smooth, self._limits)), factor

    def _joint_positions(self, what: str, joints: Sequence[float]) -> Joints:
        values = numbers(what, joints, "give one for each joint", error=TrajectoryError)
        if len(values) != len(self._names):
            raise TrajectoryError(f"{what}: {len(values)} positions for {len(self._names)} joints")
        return Joints(*values)

    def _by_open_elbow(self, here: Joints, goal: Sequence[float], speed: float) -> Plan | None:
        """Plan with the elbow moving alone while it is not open; None if no such path is free."""
        waypoints = by_open_elbow(here, goal)
        if len(waypoints) == 2:
            return None
        note = "the elbow moves alone while the arm is folded up: otherwise the hand would touch it"
        try:
            motions = [
                point_to_point(self._names, start, end, self._planned_limits, speed=speed)
                for start, end in pairwise(waypoints)
            ]
            legs = [self._smoothed(motion, here)[0] for motion in motions]
            return self._collision_free(joined(legs), here, (note,))
        except (TrajectoryError, ZoneError):
            return None  # Also if a joint was pushed beyond its limit, where it must not stay.

    def _is_self_collision(self, error: ZoneError) -> bool:
        """Return whether the arm would collide with itself."""
        return error.zone not in {"table", *(zone.name for zone in self.scene.zones)}

    def _start_of_path(self) -> Joints:
        """Return the joint positions; raise if one is outside its limits."""
        return self._require_within_limits(self.here())

    def _clipped_at_end_stops(self, joints: Sequence[float]) -> Joints:
        """Return positions at their limits where they exceed them by no more than an end stop."""
        clipped = []
        for limit, value in zip(self._limits, joints, strict=True):
            within = min(max(value, limit.lower), limit.upper)
            clipped.append(within if abs(value - within) <= _END_STOP_TOLERANCE else value)
        return Joints(*clipped)

    def _require_within_limits(self, start: Joints) -> Joints:
        problems = self.kinematics.beyond(start)
        if problems:
            raise TrajectoryError(
                f"the arm is outside its limits: {'; '.join(problems)}; move it back by its "
                "joints: move_joints(), or bioscara move --joints"
            )
        return start

    def _tool_limits(self) -> ToolLimits:
        return FULL if self.full_speed else ToolLimits(speed=COMMANDED_SPEED)

    def _collision_free(
        self,
        trajectory: Trajectory,
        here: Joints,
        notes: tuple[str, ...] = (),
        tool: ToolLimits = _REDUCED,
        slowdown: float = 1.0,
    ) -> Plan:
        """Return the plan of a trajectory, slowed down where the tool is too fast, if it is free.

        Args:
            trajectory: The trajectory.
            here: Positions of the joints that it does not name [rad, m, rad, rad].
            notes: Notes on the plan so far.
            tool: Limits of the tool that the trajectory was kept to, unless full speed is enabled.
            slowdown: Factor in time by which it was slowed down already.

        Raises:
            ZoneError: The path is not free.
        """
        if not self.full_speed:
            trajectory, factor = reduced(trajectory, self.kinematics, here, COMMANDED_SPEED)
            factor *= slowdown
            if round(factor, 2) > 1.0:
                notes += (
                    f"takes {factor:.2f} times as long to keep the tool at "
                    f"{1e3 * REDUCED_SPEED:.0f} mm/s",
                )
        arm, scene = self.surroundings()
        scene.check(arm, trajectory, here)
        return Plan(trajectory, notes, FULL if self.full_speed else tool)
