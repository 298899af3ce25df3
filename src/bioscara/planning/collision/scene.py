"""Where the arm may be: named zones, the table and the arm itself, kept clear by a margin.

All coordinates are in the frame of the arm's base, wherever the base stands. A keep-out zone is a
space that no body enters, a keep-in zone one that no body leaves. All parts of the arm that can
meet are kept apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bioscara.arguments import flag, shown
from bioscara.errors import ConfigurationError, InvalidArgumentError, TrajectoryError
from bioscara.kinematics import Scara
from bioscara.planning.collision.arm_bodies import GRIPPER, WIDTHS, WRIST, Body
from bioscara.planning.collision.goal_slack import goal_slack
from bioscara.planning.collision.scene_pairs import Layout, layout_of
from bioscara.planning.collision.scene_values import (
    FAR,
    check_name,
    check_number,
    check_range,
    make_tuples,
    replace_values,
)
from bioscara.planning.collision.shapes import Array, Prism
from bioscara.planning.collision.swept import refusal, sweep
from bioscara.planning.trajectory.trajectory import Trajectory

MARGINS = (1e-3, 0.1)
"""Smallest and largest margin [m]: what is missed between samples is less than the smallest."""
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Box:
    """A box that stands upright.

    Attributes:
        name: Of the zone.
        lower: Smallest x, y, z [m], base frame.
        upper: Largest x, y, z [m].
        yaw: Turn about its centre [rad].
        keep_in: Whether bodies must stay inside; else they must stay outside.
        links: Names of the links that it is for; empty for all that move.

    Raises:
        ConfigurationError: A value cannot be.
    """

    name: str
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    yaw: float = 0.0
    keep_in: bool = False
    links: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        make_tuples(self, "lower", "upper", "links")
        check_name(self.name, self.links)
        if len(self.lower) != 3 or len(self.upper) != 3:
            raise ConfigurationError(f"zone {self.name}: lower and upper are x, y, z [m] each")
        edges = zip("xyz", self.lower, self.upper, strict=True)
        lower, upper = zip(*(check_range(self.name, *edge) for edge in edges), strict=True)
        yaw = check_number(f"zone {self.name}: yaw", self.yaw, -2 * math.pi, 2 * math.pi, "rad")
        flag(f"zone {self.name}: keep_in", self.keep_in, error=ConfigurationError)
        replace_values(self, lower=lower, upper=upper, yaw=yaw)

    @property
    def shape(self) -> Prism:
        """The same as a shape in the base frame."""
        return Prism.between(self.lower, self.upper, self.yaw)


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder that stands upright.

    Attributes:
        name: Of the zone.
        x: Of its axis [m], base frame.
        y: [m].
        radius: [m].
        low: Height of its bottom [m].
        high: Height of its top [m].
        keep_in: Whether bodies must stay inside; else they must stay outside.
        links: Names of the links that it is for; empty for all that move.

    Raises:
        ConfigurationError: A value cannot be.
    """

    name: str
    x: float
    y: float
    radius: float
    low: float
    high: float
    keep_in: bool = False
    links: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        make_tuples(self, "links")
        check_name(self.name, self.links)
        low, high = check_range(self.name, "z", self.low, self.high)
        replace_values(
            self,
            x=check_number(f"zone {self.name}: x", self.x, -FAR, FAR),
            y=check_number(f"zone {self.name}: y", self.y, -FAR, FAR),
            radius=check_number(f"zone {self.name}: radius", self.radius, 1e-4, FAR),
            low=low,
            high=high,
        )
        flag(f"zone {self.name}: keep_in", self.keep_in, error=ConfigurationError)

    @property
    def shape(self) -> Prism:
        """The same as a shape in the base frame."""
        return Prism(self.x, self.y, 0.0, 0.0, self.low, self.high, self.radius)


Zone = Box | Cylinder


@dataclass(frozen=True, slots=True)
class Scene:
    """What stands around the arm.

    Attributes:
        zones: Named spaces to keep in or out of.
        table_height: Height of the table's top in the base frame [m]; None where there is none.
        margin: Distance to keep from everything [m], one of :data:`MARGINS` or between; the arm's
            own parts keep at most
            :data:`~bioscara.planning.collision.arm_pairs.OWN_MARGIN` from each other.
        mounted: Bodies that the wrist carries; the gripper, unless another tool is mounted.
        widths: Smallest and largest width that the gripper may have [m]; all that it can have,
            unless somebody knows better. A robot does: it plans with the width that its gripper
            was told.

    Raises:
        ConfigurationError: Two zones have the same name, or a value cannot be.
    """

    zones: tuple[Zone, ...] = ()
    table_height: float | None = None
    margin: float = 5e-3
    mounted: tuple[Body, ...] = GRIPPER
    widths: tuple[float, float] = WIDTHS

    def __post_init__(self) -> None:
        make_tuples(self, "zones", "mounted", "widths")
        for what, kind in ((self.zones, Zone), (self.mounted, Body)):
            for item in what:
                if not isinstance(item, kind):
                    raise ConfigurationError(f"{shown(item)} is no part of a scene")
        for width in self.widths:
            check_number("gripper width", width, 0.0, FAR)
        names = [zone.name for zone in self.zones]
        for name in names:
            if names.count(name) > 1:
                raise ConfigurationError(f"zone {name}: the name is taken by another zone")
        known = names if self.table_height is None else [*names, "table"]
        for body in self.mounted:
            for name in body.touches:
                if name not in known:
                    raise ConfigurationError(
                        f"{body.link} may touch {name!r}, which is not in the scene; there are "
                        f"{', '.join(known) or 'no zones and no table'}"
                    )
        replace_values(self, margin=check_number("margin", self.margin, *MARGINS))
        if self.table_height is not None:
            height = check_number("table_height", self.table_height, -FAR, FAR)
            replace_values(self, table_height=height)

    def carrying(self, load: Prism, touches: Sequence[str] = ()) -> Scene:
        """Return the scene of an arm whose tool holds something.

        Args:
            load: The shape of it in the frame of the wrist, like the tool.
            touches: What it is taken from or set down on: names of zones, or ``"table"``. The load
                alone may come that near to these, up to 0.9 mm inside, which is :data:`STAND`.

        Raises:
            ConfigurationError: The scene has no zone of such a name, or no table.
        """
        held = Body("load", WRIST, (load,), tuple(touches))
        return replace(self, mounted=(*self.mounted, held))

    def layout(self, arm: Scara) -> Layout:
        """Return the scene prepared for one arm and its tool."""
        zones = tuple((zone.name, zone.shape, zone.keep_in, zone.links) for zone in self.zones)
        _, lift, elbow, _ = ((limit.lower, limit.upper) for limit in arm.limits)
        stands = zones, self.table_height, self.mounted, self.widths
        return layout_of(*stands, arm.geometry, arm.tool, (lift, elbow), self.margin)

    def clearance(self, arm: Scara, joints: npt.ArrayLike) -> Array:
        """Return how far the arm is from everything that it must not touch; exact.

        Args:
            arm: The arm with its tool.
            joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).

        Returns:
            Distance of the nearest pair [m], shape (n,); below zero how deep one is in the other.
            The margin is not taken off. What may come nearer than that counts by as much farther:
            a load and what it may touch by the margin and
            :data:`~bioscara.planning.collision.goal_slack.STAND`, the arm's own parts by what the
            margin is above :data:`~bioscara.planning.collision.arm_pairs.OWN_MARGIN`.

        Raises:
            InvalidArgumentError: A joint is not a finite number.
        """
        rows = np.asarray(joints, dtype=np.float64)
        _check_finite(rows)
        return self.layout(arm).nearest(arm, rows)

    def check(
        self, arm: Scara, trajectory: Trajectory, elsewhere: Sequence[float] | None = None
    ) -> None:
        """Make sure that the arm keeps the margin all along a trajectory.

        Where it stands a little nearer to something than it was told to, it may still leave, and
        pushed by hand it may begin with its own parts nearer to each other, if the motion brings
        them apart.

        Between the instants that are looked at, the fastest points of the arm bound how near it
        can come; the steps are made smaller until nothing nearer than the margin is left out. What
        rounding leaves is below 0.4 mm, less than the smallest margin.

        Args:
            arm: The arm with its tool.
            trajectory: For some or all of the joints.
            elsewhere: Where the joints are that it does not name [rad, m, rad, rad].

        Raises:
            ZoneError: The arm comes too near; names zone, link, time, depth and margin.
            TrajectoryError: Joints are missing from the trajectory, or unknown, or go farther than
                any motion does.
            InvalidArgumentError: A joint elsewhere is not at a finite number.
        """
        names = [limit.name for limit in arm.limits]
        unknown = [name for name in trajectory.joint_names if name not in names]
        missing = [name for name in names if name not in trajectory.joint_names]
        if unknown:
            raise TrajectoryError(
                f"{unknown[0]} is not a joint of the arm; it has {', '.join(names)}"
            )
        if missing and elsewhere is None:
            raise TrajectoryError(
                f"zones cannot be checked: the trajectory does not say where {', '.join(missing)} "
                f"{'are' if len(missing) > 1 else 'is'}"
            )
        rest = np.array((0.0,) * len(names) if elsewhere is None else elsewhere)
        _check_finite(rest)
        layout, allowed = self.layout(arm), goal_slack(self.margin)
        ends = np.tile(rest, (2, 1))
        columns = [names.index(name) for name in trajectory.joint_names]
        ends[:, columns] = trajectory.positions[[0, -1]]
        start, end = np.hsplit(layout.clearances(arm, ends, self.margin), 2)
        pushed = layout.own[:, None] & (start < self.margin - allowed)
        floor = np.full(start.shape, self.margin)
        near = pushed | (start >= self.margin - allowed)
        floor[near] = np.minimum(self.margin, start[near] - _ROUNDING)
        sweep(layout, arm, trajectory, rest, self.margin, floor)
        # Resting a hair beside each goal it could else come nearer from motion to motion.
        floor[pushed] = np.minimum(start[pushed], self.margin - 2.0 * allowed) + allowed
        if (end < floor)[pushed].any():
            raise refusal(layout, trajectory.times[-1:], end, self.margin, floor)

    def check_standing(self, arm: Scara, joints: Sequence[float], before: Scene) -> None:
        """Make sure that an arm may stand in this scene as it stands in the one before.

        Args:
            arm: The arm with its tool.
            joints: j1 to j4 [rad, m, rad, rad].
            before: The same things, of other sizes: what is too near there may stay so.

        Raises:
            ZoneError: Something comes too near.
            InvalidArgumentError: A joint is not a finite number.
        """
        rows = np.array([joints], dtype=np.float64)
        _check_finite(rows)
        layout = self.layout(arm)
        pairs, stood = (
            each.clearances(arm, rows, self.margin) for each in (layout, before.layout(arm))
        )
        floor = np.minimum(self.margin - goal_slack(self.margin), stood - _ROUNDING)
        if (pairs < floor).any():
            raise refusal(layout, np.zeros(1), pairs, self.margin, floor)


def _check_finite(joints: Array) -> None:
    if not np.isfinite(joints).all():
        bad = joints[~np.isfinite(joints)][0]
        raise InvalidArgumentError(f"a joint is at {bad}: zones need finite positions")
