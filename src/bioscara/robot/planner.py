"""Planning of motions from the arm's current position; nothing moves."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from bioscara.arguments import flag, items, number, numbers, shown
from bioscara.errors import InvalidArgumentError, TrajectoryError, ZoneError
from bioscara.extras import install, require
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.kinematics.pose import require_near, require_near_place, wrapped
from bioscara.model import ArmParameters
from bioscara.notebook import table
from bioscara.planning import Trajectory, check
from bioscara.planning.collision.unfolding import by_open_elbow, joined
from bioscara.planning.limits import (
    FULL,
    REDUCED_SPEED,
    SLOWEST,
    JointLimits,
    MotionLimits,
    ToolLimits,
    check_share,
)
from bioscara.planning.motions.cartesian import circular, linear
from bioscara.planning.motions.jog import JogGenerator
from bioscara.planning.motions.point_to_point import point_to_point
from bioscara.planning.motions.sequence import sequence
from bioscara.planning.motions.tool_speed import UNPLANNED_SHARE, reduced
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.planning.moving_average import averaged, most_jerk, velocity_jumps
from bioscara.planning.trajectory.retiming import stretch_factor, stretched
from bioscara.planning.trajectory.rounding import rounded
from bioscara.robot.workspace.workspace import Workspace

if TYPE_CHECKING:
    from bioscara.report.picture import Picture

ACCELERATION_SHARE = 0.8
"""Share of a joint's acceleration that motions planned here use. At full acceleration a joint that
slips a step could not catch up before it has to brake, and would overshoot."""
_END_STOP_TOLERANCE = 1e-3
"""Tolerated reading beyond its limit of a joint pressed against its end stop [rad or m]."""
_JERK_SHARE = 2.0
"""Share of its highest acceleration by which a joint's acceleration may rise per time without
oscillation [1/s]."""
_ROUNDINGS, _LONGER, _ENOUGH = 30, 1.08, 1.0 + 1e-3
"""How often a duration is tried in which corners can be rounded, the factor to the next one where
it is too short for them, and the factor by which a limit may be exceeded by rounding errors."""


@lru_cache(maxsize=4)
def _planned_limits(parameters: ArmParameters) -> tuple[JointLimits, ...]:
    return tuple(MotionLimits.of(limit, ACCELERATION_SHARE) for limit in parameters.joints)


class Plan(NamedTuple):
    """A planned motion that was checked to be free of collisions.

    Attributes:
        trajectory: Of all joints, from the arm's current position.
        notes: How the plan differs from the request, such as that it takes longer to keep the tool
            at 250 mm/s.
        tool: Limits of the tool that the whole plan was kept to.
        workspace: The workspace that it was made in, for its picture; None if it is not known.
    """

    trajectory: Trajectory
    notes: tuple[str, ...] = ()
    tool: ToolLimits = FULL
    workspace: Workspace | None = None

    def __repr__(self) -> str:
        notes = "".join(f"; {note}" for note in self.notes)
        return f"<Plan {', '.join(self.trajectory.joint_names)}: {self.duration:.2f} s{notes}>"

    def _repr_html_(self) -> str:
        notes = [("note", note) for note in self.notes]
        return self.trajectory._repr_html_() + (table(notes) if notes else "")

    @property
    def duration(self) -> float:
        """Duration of the trajectory [s]."""
        return self.trajectory.duration

    def plot(self) -> Picture:
        """Draw joints and tool with their limits, and the path of the tool among the zones.

        A notebook shows the figure; elsewhere ``plan.plot().savefig("plan.png")`` writes it.

        Raises:
            NotSupportedError: matplotlib is not installed.
            InvalidArgumentError: The plan has no workspace, as none of a planner.
        """
        require("matplotlib", "plot()", install("plot"))
        space = self.workspace
        if space is None:
            raise InvalidArgumentError(
                "the plan has no workspace, so its limits are not known; plot one of robot.plan"
            )
        # Imported here: reports are not needed to plan.
        from bioscara.report.plan_png import draw_plan  # noqa: PLC0415

        limits = space.parameters.joints
        return draw_plan(self.trajectory, space.kinematics, limits, self.tool, scene=space.scene)


T = TypeVar("T")


def planned_here(
    make: Callable[[Planner], T], workspace: Workspace, positions: Sequence[float]
) -> T:
    """Return the plan of a function, in this thread.

    An arm has this function for its motions, or another one that lets a process plan them.

    Args:
        make: The function.
        workspace: The workspace.
        positions: Where the joints are [rad, m, rad, rad].
    """
    here = Joints(*positions)
    return make(Planner(workspace, lambda: here))


class Planner:
    """Plans motions of one arm in one workspace, from where it is; nothing moves.

    Every plan starts at the arm's current position, stays within the limits of joints and tool,
    and keeps clear of the scene. Its methods are named as those of ``Robot`` that move.

    Args:
        workspace: Parameters of the arm, tool, scene and speed limit.
        measured: Returns the measured joint positions [rad, m, rad, rad].

    Attributes:
        workspace: As given.
        joint_names: Names of the joints, in order.
    """

    __slots__ = ("_limits", "_measured", "_planned_limits", "joint_names", "workspace")

    def __init__(self, workspace: Workspace, measured: Callable[[], Sequence[float]]) -> None:
        self.workspace, self._measured = workspace, measured
        self._limits = workspace.parameters.joints
        self._planned_limits = _planned_limits(workspace.parameters)
        self.joint_names = tuple(limit.name for limit in self._limits)

    def __repr__(self) -> str:
        space = self.workspace
        speed = "reduced" if space.reduced_speed else "full"
        zones = len(space.scene.zones)
        return f"<Planner tool {space.tool.name}, {speed} speed, {zones} zones>"

    @property
    def kinematics(self) -> Scara:
        """Kinematics of the arm with its tool."""
        return self.workspace.kinematics

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
        arm, scene = self.kinematics, self.workspace.surroundings
        low, high = scene.widths
        swept = replace(scene, widths=(min(low, width), max(high, width)))
        swept.check_standing(arm, self.here(), scene)

    def here(self) -> Joints:
        """Return the joint positions; a joint pressed against its end stop counts as at its limit.

        Raises:
            NotHomedError: The position of a joint is unknown.
        """
        return self._clipped_at_end_stops(self._measured())

    def pose_of(self, target: Pose | str, frame: str | None = None, *, via: bool = False) -> Pose:
        """Return a pose of the tool in the base.

        Args:
            target: The pose, or its name in the teach table.
            frame: Name of the work frame that the pose is given in; None for the base.
            via: Whether it is a point on an arc, whose yaw is not used.

        Raises:
            InvalidArgumentError: It is not a pose, no pose or frame has that name, the pose was
                taught with another tool, or a frame is given with a name.
        """
        table = self.workspace.table
        if not isinstance(target, str):
            what, require = (
                ("the via", require_near_place) if flag("via", via) else ("the goal", require_near)
            )
            pose = require(what, target)
            return pose if frame is None else table.frame(frame).compose(pose)
        if frame is not None:
            raise InvalidArgumentError(
                f"the taught pose {target} is in the base; leave the frame {frame} out"
            )
        taught = table.pose(target)
        if taught.joints is not None:
            return self.kinematics.forward(taught.joints)
        mounted = self.workspace.tool.name
        if taught.tool != mounted or taught.pose_tool_in_base is None:
            raise InvalidArgumentError(
                f"pose {target} was taught with tool {taught.tool}, the arm has {mounted}; "
                f"set robot.tool = {taught.tool!r} once that is mounted"
            )
        return taught.pose_tool_in_base

    def arc_of(
        self, via: Pose | str, pose: Pose | str, frame: str | None = None
    ) -> tuple[Pose, Pose]:
        """Return the point on an arc and its goal in the base; as :meth:`pose_of`.

        The frame is that of values given by numbers.
        """
        named = isinstance(via, str), isinstance(pose, str)
        point = self.pose_of(via, None if named == (True, False) else frame, via=True)
        return point, self.pose_of(pose, None if named == (False, True) else frame)

    def move_joints(
        self,
        positions: Sequence[float],
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
    ) -> Plan:
        """Plan to joint positions; all joints start and end together.

        If the arm would come too near to itself on this path because it is folded up at the start
        or the goal, the elbow opens alone first and closes alone at last, if that path is free; a
        note says so. Joints that were pushed beyond a limit by hand are moved back by the plan.

        Args:
            positions: One for each joint [rad or m].
            velocity_scaling: Share of the speed limits to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.

        Raises:
            TrajectoryError: The goal is outside the limits or not finite.
            ZoneError: The path is not free.
        """
        remedy = "give one for each joint, or a pose to move_to()"
        if isinstance(positions, Pose):
            raise TrajectoryError(f"the positions of the joints are {shown(positions)}; {remedy}")
        goal = items("the positions of the joints", positions, remedy, error=TrajectoryError)
        if len(goal) != len(self.joint_names):
            raise TrajectoryError(f"{len(goal)} positions for {len(self.joint_names)} joints")
        here, share = self.here(), check_share(velocity_scaling, "velocity_scaling")
        limits = self._slowed_limits(acceleration_scaling)
        direct = point_to_point(self.joint_names, here, goal, limits, velocity_scaling=share)
        try:
            smooth, slowdown = self._smoothed(direct, here)
            return self._collision_free(smooth, here, slowdown=slowdown)
        except ZoneError as error:
            plan = (
                self._by_open_elbow(here, goal, limits, share)
                if self._is_self_collision(error)
                else None
            )
            if plan is None:
                raise
            return plan

    def unfold(
        self,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
    ) -> Plan:
        """Plan to open the elbow alone, j3 to 0, so that a folded arm can move freely.

        From the position in which homing leaves the arm, this is free at every width of the
        gripper, and every position with an open elbow, such as ``center``, can be reached
        afterwards.

        Args:
            velocity_scaling: Share of the speed limits to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.

        Raises:
            NotHomedError: The position of a joint is unknown.
            ZoneError: The path is not free.
        """
        goal = self.here()._replace(j3=0.0)
        try:
            return self.move_joints(
                goal, velocity_scaling=velocity_scaling, acceleration_scaling=acceleration_scaling
            )
        except ZoneError as error:
            if error.zone in ("base_link", "link_1"):
                # Not this very call again.
                error.remedy = (
                    "jog j3 or j4 to where the way is free, or disable() the arm and open the "
                    "elbow by hand"
                )
            raise

    def move_to(
        self,
        pose: Pose | str,
        *,
        frame: str | None = None,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
    ) -> Plan:
        """Plan to a pose by the closest joint solution; the tool's path is not a line.

        Args:
            pose: Pose of the tool, or its name in the teach table.
            frame: Name of the work frame that the pose is given in; None for the base.
            velocity_scaling: Share of the speed limits to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.

        Raises:
            UnreachableError: The arm cannot reach the pose.
            ZoneError: The path is not free.
        """
        goal = self.pose_of(pose, frame)
        return self.move_joints(
            self.kinematics.solve(goal, self.here()),
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
        )

    def move_named(
        self,
        name: str,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
    ) -> Plan:
        """Plan to a pose of the teach table.

        Args:
            name: Name of the pose.
            velocity_scaling: Share of the speed limits to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.

        Raises:
            InvalidArgumentError: No pose has that name, or it was taught with another tool.
            UnreachableError: The arm cannot reach the pose.
            ZoneError: The path is not free.
        """
        taught = self.workspace.table.pose(name)
        if taught.joints is not None:
            return self.move_joints(
                taught.joints,
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            )
        return self.move_to(
            name, velocity_scaling=velocity_scaling, acceleration_scaling=acceleration_scaling
        )

    def jog(self, start: Sequence[float], *, elbow: float | None = None) -> JogGenerator:
        """Return a jog that starts at rest.

        Args:
            start: Joint positions at the start [rad, m, rad, rad].
            elbow: A position of j3 in which the elbow was bent last [rad]: from straight it bends
                to that side. None if it is unknown: then to where it has more room.

        Raises:
            InvalidArgumentError: A value is not a finite number.
            TrajectoryError: A joint was pushed beyond a limit.
            ZoneError: The arm's clearance is too small.
        """
        start = self._require_within_limits(
            self._clipped_at_end_stops(self._joint_positions("the start", start))
        )
        workspace = self.workspace
        return JogGenerator(
            workspace.kinematics,
            self._planned_limits,
            start,
            workspace.surroundings,
            UNPLANNED_SHARE * workspace.commanded_speed,
            workspace.windows,
            elbow,
        )

    def move_linear(
        self,
        pose: Pose | str,
        *,
        frame: str | None = None,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
    ) -> Plan:
        """Plan to a pose along a line.

        Args:
            pose: Pose of the tool, or its name in the teach table.
            frame: Name of the work frame that the pose is given in; None for the base.
            velocity_scaling: Share of the tool's speed limit to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.

        Raises:
            UnreachableError, TrajectoryError: The arm cannot follow that line.
            ZoneError: The path is not free.
        """
        goal = self.pose_of(pose, frame)
        return self._along(linear, (goal,), velocity_scaling, acceleration_scaling)

    def move_relative(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        yaw: float = 0.0,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
    ) -> Plan:
        """Plan along a line by a displacement of the tool, along the axes of the base.

        Args:
            x: [m].
            y: [m].
            z: [m].
            yaw: Rotation about the vertical [rad], by less than half a turn.
            velocity_scaling: As for :meth:`move_linear`.
            acceleration_scaling: As for :meth:`move_linear`.

        Raises:
            InvalidArgumentError: A value is not finite or too large, or all are zero.
            UnreachableError, TrajectoryError, ZoneError: As :meth:`move_linear`.
        """
        by = require_near("the displacement", Pose(x, y, z, yaw))
        if abs(by.yaw) >= math.pi:
            raise InvalidArgumentError(
                f"the displacement turns the tool by {by.yaw:g} rad: less than half a turn, "
                f"{math.pi:.4f} rad, is possible in one motion; make two"
            )
        here = self.kinematics.forward(self._start_of_path())
        goal = Pose(here.x + by.x, here.y + by.y, here.z + by.z, wrapped(here.yaw + by.yaw))
        return self.move_linear(
            goal, velocity_scaling=velocity_scaling, acceleration_scaling=acceleration_scaling
        )

    def move_circular(
        self,
        via: Pose | str,
        pose: Pose | str,
        *,
        frame: str | None = None,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
    ) -> Plan:
        """Plan to a pose along an arc.

        Args:
            via: A pose on the arc, or its name in the teach table; its yaw is not used.
            pose: The goal pose of the tool, likewise.
            frame: Name of the work frame that both are given in; None for the base.
            velocity_scaling: Share of the tool's speed limit to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.

        Raises:
            UnreachableError, TrajectoryError: The arm cannot follow that arc.
            ZoneError: The path is not free.
        """
        point, goal = self.arc_of(via, pose, frame)
        return self._along(circular, (point, goal), velocity_scaling, acceleration_scaling)

    def _along(
        self,
        shape: Callable[..., Trajectory],
        poses: tuple[Pose, ...],
        velocity_scaling: float,
        acceleration_scaling: float,
    ) -> Plan:
        """Plan along a line or an arc to poses of the tool."""
        here, tool = self._start_of_path(), self._tool_limits(acceleration_scaling)
        trajectory = shape(
            self.kinematics,
            here,
            *poses,
            self._slowed_limits(acceleration_scaling),
            tool,
            velocity_scaling=check_share(velocity_scaling, "velocity_scaling"),
            window=self.workspace.windows[0],
        )
        return self._collision_free(trajectory, here, tool=tool)

    def move_sequence(
        self,
        waypoints: Sequence[Waypoint],
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
    ) -> Plan:
        """Plan along several waypoints with rounded corners, without a stop.

        Args:
            waypoints: Waypoints of the tool in the base.
            velocity_scaling: Share of the speeds of the waypoints to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.

        Raises:
            UnreachableError, TrajectoryError: The arm cannot reach a waypoint; names the waypoint.
            ZoneError: The path is not free.
        """
        here = self._start_of_path()
        share = check_share(velocity_scaling, "velocity_scaling")
        if share < 1.0:
            waypoints = [
                replace(each, velocity_scaling=max(share * each.velocity_scaling, SLOWEST))
                for each in items("the waypoints", waypoints)
            ]
        trajectory, warnings = sequence(
            self.kinematics,
            here,
            waypoints,
            self._slowed_limits(acceleration_scaling),
            self._tool_limits(acceleration_scaling),
            self.workspace.windows[0],
        )
        return self._collision_free(trajectory, here, warnings)

    def check_trajectory(
        self, trajectory: Trajectory, elsewhere: Sequence[float], *, planned: bool = False
    ) -> Plan:
        """Check a trajectory; slow it down and average it where necessary.

        The plan has all joints: a joint that is not in the trajectory holds its position.

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
            MotionLimits.of(limit)._replace(lower=min(limit.lower, at), upper=max(limit.upper, at))
            for limit, at in zip(self._limits, self._measured(), strict=True)
        ]
        notes = check(trajectory, limits)
        here = Joints(*elsewhere)
        trajectory = trajectory.completed(self.joint_names, here)
        slowdown = 1.0
        if not flag("planned", planned):
            trajectory, slowdown = self._smoothed(trajectory, here)
        return self._collision_free(trajectory, here, tuple(notes), slowdown=slowdown)

    def _smoothed(self, trajectory: Trajectory, here: Joints) -> tuple[Trajectory, float]:
        """Smooth a joint motion, unless full speed is enabled.

        Lines between points are rounded at the points where the motion then takes as long as it
        was asked to, and else where it is shorter than the averaged one.

        Returns:
            The motion, and the factor in time by which it was slowed down before that.
        """
        if not self.workspace.reduced_speed:
            return trajectory, 1.0
        found = self._rounded(trajectory, here) if trajectory.velocities is None else None
        if found is not None and found[1] == 1.0:
            return found
        smooth = self._averaged(trajectory, here)
        return found if found is not None and found[0].duration < smooth[0].duration else smooth

    def _averaged(self, trajectory: Trajectory, here: Joints) -> tuple[Trajectory, float]:
        """Average a motion over the periods of the belts, as :meth:`_smoothed`."""
        # Slow down before averaging. Stretching an averaged motion would stretch the window too,
        # which must match the belt's period; and a motion that is slow enough needs no averaging.
        speed = self.workspace.commanded_speed
        trajectory, factor = reduced(trajectory, self.kinematics, here, speed)
        max_acceleration = {limit.name: limit.max_acceleration for limit in self._limits}
        jerks = most_jerk(trajectory).tolist()
        if all(
            jerk <= _JERK_SHARE * max_acceleration[name]
            for name, jerk in zip(trajectory.joint_names, jerks, strict=True)
        ):
            return trajectory, factor
        longest, *others = self.workspace.windows
        smooth = averaged(trajectory, longest)
        if velocity_jumps(trajectory):
            # Once averaged, its acceleration jumps, too high where the velocity did: in proportion.
            slower = stretch_factor(smooth, self._limits) ** 2
            trajectory, factor = stretched(trajectory, slower), slower * factor
            for window in (longest, longest, *others):
                trajectory = averaged(trajectory, window)
            smooth = trajectory
        # Between its points the averaged curve may exceed a limit by a thousandth.
        return stretched(smooth, stretch_factor(smooth, self._limits)), factor

    def _rounded(self, trajectory: Trajectory, here: Joints) -> tuple[Trajectory, float] | None:
        """Round the corners of a motion through points without velocities, as :meth:`_smoothed`.

        It takes as long as before where that is slow enough. None where no such motion is found.
        """
        by_name = {limit.name: limit for limit in self._limits}
        highest = [_JERK_SHARE * by_name[name].max_acceleration for name in trajectory.joint_names]
        speed, factor, share = self.workspace.commanded_speed, 1.0, 1.0
        for _ in range(_ROUNDINGS):
            motion = rounded(stretched(trajectory, factor), [share * jerk for jerk in highest])
            if motion is None:
                factor *= _LONGER
                continue
            slower = max(
                stretch_factor(motion, self._limits),
                reduced(motion, self.kinematics, here, speed)[1],
            )
            jerks = most_jerk(motion).tolist()
            steeper = max(map(operator.truediv, jerks, highest))
            if slower <= _ENOUGH and steeper <= _ENOUGH:
                return motion, factor
            factor *= slower
            # Corners near to each other add up.
            share /= max(steeper, 1.0)
        return None

    def _joint_positions(self, what: str, joints: Sequence[float]) -> Joints:
        values = numbers(what, joints, "give one for each joint", error=TrajectoryError)
        if len(values) != len(self.joint_names):
            raise TrajectoryError(
                f"{what}: {len(values)} positions for {len(self.joint_names)} joints"
            )
        return Joints(*values)

    def _by_open_elbow(
        self, here: Joints, goal: Sequence[float], limits: Sequence[JointLimits], share: float
    ) -> Plan | None:
        """Plan with the elbow moving alone while it is not open; None if no such path is free."""
        waypoints = by_open_elbow(here, goal)
        if len(waypoints) == 2:
            return None
        note = "the elbow moves alone while the arm is folded up: otherwise the hand would touch it"
        try:
            motions = [
                point_to_point(self.joint_names, start, end, limits, velocity_scaling=share)
                for start, end in pairwise(waypoints)
            ]
            legs = [self._smoothed(motion, here)[0] for motion in motions]
            return self._collision_free(joined(legs), here, (note,))
        except (TrajectoryError, ZoneError):
            return None  # Also if a joint was pushed beyond its limit, where it must not stay.

    def _is_self_collision(self, error: ZoneError) -> bool:
        """Return whether the arm would collide with itself."""
        return error.zone not in {"table", *(zone.name for zone in self.workspace.scene.zones)}

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

    def _slowed_limits(self, acceleration_scaling: float) -> Sequence[JointLimits]:
        """Return the joint limits of planned motions, with a share of their accelerations."""
        share = check_share(acceleration_scaling, "acceleration_scaling")
        if share == 1.0:
            return self._planned_limits
        return [MotionLimits.of(limit, share) for limit in self._planned_limits]

    def _tool_limits(self, acceleration_scaling: float) -> ToolLimits:
        """Return the limits of the tool on a path, with a share of its accelerations."""
        share = check_share(acceleration_scaling, "acceleration_scaling")
        if not self.workspace.reduced_speed:
            return replace(FULL, speed=self.workspace.commanded_speed)
        usual = ToolLimits(speed=self.workspace.commanded_speed)
        return replace(
            usual,
            acceleration=share * usual.acceleration,
            yaw_acceleration=share * usual.yaw_acceleration,
        )

    def _collision_free(
        self,
        trajectory: Trajectory,
        here: Joints,
        notes: tuple[str, ...] = (),
        tool: ToolLimits | None = None,
        slowdown: float = 1.0,
    ) -> Plan:
        """Return the plan of a trajectory, slowed down where the tool is too fast, if it is free.

        Args:
            trajectory: The trajectory.
            here: Positions of the joints that it does not name [rad, m, rad, rad].
            notes: Notes on the plan so far.
            tool: Limits of the tool that the trajectory was kept to; None for the speed alone.
            slowdown: Factor in time by which it was slowed down already.

        Raises:
            ZoneError: The path is not free.
        """
        workspace = self.workspace
        speed, load = workspace.commanded_speed, workspace.load
        if math.isfinite(speed):
            trajectory, factor = reduced(trajectory, self.kinematics, here, speed)
            factor *= slowdown
            if round(factor, 2) > 1.0:
                what = "the tool" if load is None else f"the tool and {load.name}"
                limit = speed if load is not None and speed == load.max_speed else REDUCED_SPEED
                notes += (
                    f"takes {factor:.2f} times as long to keep {what} at {1e3 * limit:.0f} mm/s",
                )
        arm, scene = self.kinematics, self.workspace.surroundings
        scene.check(arm, trajectory, here)
        return Plan(trajectory, notes, tool or replace(FULL, speed=speed), workspace)
