"""Named zones, the table and the arm itself, from which the arm keeps a margin.

All coordinates are in the frame of the arm's base, wherever the base is mounted. No body may enter
a keep-out zone, no body may leave a keep-in zone. All parts of the arm that can collide are checked
against each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.arguments import flag, items, number, shown
from bioscara.errors import ConfigurationError, InvalidArgumentError, TrajectoryError
from bioscara.kinematics import Pose, Scara
from bioscara.planning.arrays import Array
from bioscara.planning.collision.arm_bodies import GRIPPER, WIDTHS, WRIST, Body
from bioscara.planning.collision.margins import MARGINS, goal_slack
from bioscara.planning.collision.nearest_points import Point, nearest_points
from bioscara.planning.collision.scene_pairs import LINKS, Layout, layout_of
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.collision.swept import refusal, sweep
from bioscara.planning.trajectory.trajectory import Trajectory

LOAD = "load"
"""Link of the load that the tool carries."""
_LONGEST = 100
"""Largest length of a zone's name [characters]."""
FAR = 10.0
"""Largest coordinate of a scene [m]: a larger one is taken for millimetres."""
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box.

    Attributes:
        name: Of the zone.
        lower: Smallest x, y, z [m], base frame.
        upper: Largest x, y, z [m].
        yaw: Rotation about its centre [rad].
        keep_in: Whether bodies must stay inside; else they must stay outside.
        links: Names of the links that it applies to; empty for all that move.

    Raises:
        ConfigurationError: A value is invalid.
    """

    name: str
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    yaw: float = 0.0
    keep_in: bool = False
    links: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _make_tuples(self, "lower", "upper", "links")
        _check_name(self.name, self.links)
        if len(self.lower) != 3 or len(self.upper) != 3:
            raise ConfigurationError(f"zone {self.name}: lower and upper are x, y, z [m] each")
        edges = zip("xyz", self.lower, self.upper, strict=True)
        lower, upper = zip(*(_check_range(self.name, *edge) for edge in edges), strict=True)
        yaw = _check_number(f"zone {self.name}: yaw", self.yaw, -2 * math.pi, 2 * math.pi, "rad")
        flag(f"zone {self.name}: keep_in", self.keep_in, error=ConfigurationError)
        _replace_values(self, lower=lower, upper=upper, yaw=yaw)

    @property
    def shape(self) -> Prism:
        """The zone as a shape in the base frame."""
        return Prism.between(self.lower, self.upper, self.yaw)


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder.

    Attributes:
        name: Of the zone.
        x: Of its axis [m], base frame.
        y: [m].
        radius: [m].
        low: Height of its bottom [m].
        high: Height of its top [m].
        keep_in: Whether bodies must stay inside; else they must stay outside.
        links: Names of the links that it applies to; empty for all that move.

    Raises:
        ConfigurationError: A value is invalid.
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
        _make_tuples(self, "links")
        _check_name(self.name, self.links)
        low, high = _check_range(self.name, "z", self.low, self.high)
        _replace_values(
            self,
            x=_check_number(f"zone {self.name}: x", self.x, -FAR, FAR),
            y=_check_number(f"zone {self.name}: y", self.y, -FAR, FAR),
            radius=_check_number(f"zone {self.name}: radius", self.radius, 1e-4, FAR),
            low=low,
            high=high,
        )
        flag(f"zone {self.name}: keep_in", self.keep_in, error=ConfigurationError)

    @property
    def shape(self) -> Prism:
        """The zone as a shape in the base frame."""
        return Prism(self.x, self.y, 0.0, 0.0, self.low, self.high, self.radius)


Zone = Box | Cylinder


class NearestPair(NamedTuple):
    """The two bodies with the least clearance.

    Attributes:
        link: Name of the link.
        other: Name of its counterpart: a zone, the table or a link.
        distance: Distance of the two [m]; a negative value is a penetration depth.
        margin: Smallest distance that a motion may leave between them [m].
    """

    link: str
    other: str
    distance: float
    margin: float


@dataclass(frozen=True, slots=True)
class Scene:
    """The surroundings of the arm.

    Attributes:
        zones: Named spaces to keep in or out of.
        table_height: Height of the table's top in the base frame [m]; None if there is no table.
        margin: Distance to keep from everything [m], within
            :data:`~bioscara.planning.collision.margins.MARGINS`; the arm's own parts
            keep at most
            :data:`~bioscara.planning.collision.margins.OWN_MARGIN` from each other.
        mounted: Bodies that the wrist carries; the gripper, unless another tool is mounted.
        widths: Smallest and largest width that the gripper may have [m]; its full range unless
            given. A robot plans with the commanded width of its gripper.

    Raises:
        ConfigurationError: Two zones have the same name, or a value is invalid.
    """

    zones: tuple[Zone, ...] = ()
    table_height: float | None = None
    margin: float = 5e-3
    mounted: tuple[Body, ...] = GRIPPER
    widths: tuple[float, float] = WIDTHS

    def __post_init__(self) -> None:
        _make_tuples(self, "zones", "mounted", "widths")
        for what, kind in ((self.zones, Zone), (self.mounted, Body)):
            for item in what:
                if not isinstance(item, kind):
                    raise ConfigurationError(f"{shown(item)} is no part of a scene")
        for width in self.widths:
            _check_number("gripper width", width, 0.0, FAR)
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
        _replace_values(self, margin=_check_number("margin", self.margin, *MARGINS))
        if self.table_height is not None:
            height = _check_number("table_height", self.table_height, -FAR, FAR)
            _replace_values(self, table_height=height)

    def __repr__(self) -> str:
        names = ", ".join(zone.name for zone in self.zones) or "no zones"
        height = self.table_height
        table = "no table" if height is None else f"table at z = {height:g} m"
        low, high = (1e3 * width for width in self.widths)
        return (
            f"<Scene {names}; {table}; margin {1e3 * self.margin:g} mm; jaws {low:g} to "
            f"{high:g} mm>"
        )

    def carrying(self, load: Prism, touches: Sequence[str] = ()) -> Scene:
        """Return the scene of an arm whose tool holds a load.

        Args:
            load: Its shape in the frame of the wrist, like the tool.
            touches: Names of the zones, or ``"table"``, that it is taken from or set down on. Only
                the load may touch these, and be up to 0.9 mm inside, which is
                :data:`~bioscara.planning.collision.margins.GOAL_SLACK`.

        Raises:
            ConfigurationError: The scene has no zone of such a name, or no table.
        """
        held = Body(LOAD, WRIST, (load,), tuple(touches))
        return replace(self, mounted=(*self.mounted, held))

    def overhang(self, tool: Pose) -> float:
        """Return the horizontal distance from the tool's point to the load's farthest point [m].

        Args:
            tool: Pose of the tool in the wrist.

        Returns:
            0.0 without a load.
        """
        loads = [shape for body in self.mounted if body.link == LOAD for shape in body.shapes]
        return max((shape.reach(tool.x, tool.y) for shape in loads), default=0.0)

    def layout(self, kinematics: Scara) -> Layout:
        """Return the scene prepared for one arm and its tool."""
        zones = tuple((zone.name, zone.shape, zone.keep_in, zone.links) for zone in self.zones)
        _, lift, elbow, _ = ((limit.lower, limit.upper) for limit in kinematics.limits)
        scene = zones, self.table_height, self.mounted, self.widths
        return layout_of(*scene, kinematics.geometry, kinematics.tool, (lift, elbow), self.margin)

    def clearance(self, kinematics: Scara, joints: npt.ArrayLike) -> Array:
        """Return the exact clearance of the arm.

        Args:
            kinematics: The arm with its tool.
            joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).

        Returns:
            Distance of the nearest pair [m], shape (n,); negative values are penetration depths.
            The margin is not subtracted. For pairs that may come nearer than the margin, that
            allowance is added: for a load and bodies that it may touch, the margin and
            :data:`~bioscara.planning.collision.margins.GOAL_SLACK`; for the arm's own parts, the
            excess of the margin over :data:`~bioscara.planning.collision.margins.OWN_MARGIN`.

        Raises:
            InvalidArgumentError: A joint is not a finite number.
        """
        rows = np.asarray(joints, dtype=np.float64)
        _check_finite(rows)
        return self.layout(kinematics).nearest(kinematics, rows)

    def nearest_pair(self, kinematics: Scara, joints: Sequence[float]) -> NearestPair | None:
        """Return the pair that :meth:`clearance` is the clearance of; None without any pair.

        Args:
            kinematics: The arm with its tool.
            joints: j1 to j4 [rad, m, rad, rad].

        Raises:
            InvalidArgumentError: A joint is not a finite number.
        """
        found = self._nearest(kinematics, joints)
        return None if found is None else found[1]

    def nearest_points(
        self, kinematics: Scara, joints: Sequence[float]
    ) -> tuple[NearestPair, tuple[Point, Point] | None] | None:
        """Return :meth:`nearest_pair`, and a point of each of the two that is nearest to the other.

        Args:
            kinematics: The arm with its tool.
            joints: j1 to j4 [rad, m, rad, rad].

        Returns:
            Pair and points x, y, z [m] in the base frame, without points for a keep-in zone; None
            without any pair.

        Raises:
            InvalidArgumentError: A joint is not a finite number.
        """
        found = self._nearest(kinematics, joints)
        if found is None:
            return None
        row, nearest = found
        layout = self.layout(kinematics)
        if layout.pairs[row].keep_in:
            return nearest, None
        one, other = layout.nearest_parts(kinematics, np.array(joints, dtype=np.float64), row)
        if other is None:
            # The table has no borders: its nearest point is below the link.
            height = self.table_height or 0.0
            return nearest, ((one.x, one.y, one.low), (one.x, one.y, height))
        return nearest, nearest_points(one, other)

    def _nearest(
        self, kinematics: Scara, joints: Sequence[float]
    ) -> tuple[int, NearestPair] | None:
        """Return the number and description of the pair with the least clearance."""
        rows = np.array([joints], dtype=np.float64)
        _check_finite(rows)
        layout = self.layout(kinematics)
        if not layout.pairs:
            return None
        clearances = layout.clearances(kinematics, rows)[:, 0]
        row = int(clearances.argmin())
        pair = layout.pairs[row]
        distance = float(clearances[row]) - pair.allowed
        return row, NearestPair(pair.link, pair.zone, distance, self.margin - pair.allowed)

    def check(
        self, kinematics: Scara, trajectory: Trajectory, elsewhere: Sequence[float] | None = None
    ) -> None:
        """Make sure that the arm keeps the margin throughout a trajectory.

        A motion may start nearer to a body than the margin, by the slack of a goal. After the arm
        was pushed by hand, its own parts may also be nearer to each other at the start, if the
        motion moves them apart.

        Between samples, the speed of the fastest points of the arm bounds how near it can come;
        steps are subdivided until no clearance below the margin can be missed. The remaining error
        is below 0.4 mm, less than the smallest margin.

        Args:
            kinematics: The arm with its tool.
            trajectory: For some or all of the joints.
            elsewhere: Positions of the joints that it does not name [rad, m, rad, rad].

        Raises:
            ZoneError: The arm comes too near; names zone, link, time, depth and margin.
            TrajectoryError: Joints are missing from the trajectory, or unknown, or move farther
                than any motion does.
            InvalidArgumentError: A position in ``elsewhere`` is not a finite number.
        """
        names = [limit.name for limit in kinematics.limits]
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
        layout, allowed = self.layout(kinematics), goal_slack(self.margin)
        ends = np.tile(rest, (2, 1))
        columns = [names.index(name) for name in trajectory.joint_names]
        ends[:, columns] = trajectory.positions[[0, -1]]
        start, end = np.hsplit(layout.clearances(kinematics, ends, self.margin), 2)
        pushed = layout.own[:, None] & (start < self.margin - allowed)
        floor = np.full(start.shape, self.margin)
        near = pushed | (start >= self.margin - allowed)
        floor[near] = np.minimum(self.margin, start[near] - _ROUNDING)
        sweep(layout, kinematics, trajectory, rest, self.margin, floor)
        # Otherwise small errors at each goal could reduce the clearance from motion to motion.
        floor[pushed] = np.minimum(start[pushed], self.margin - 2.0 * allowed) + allowed
        if (end < floor)[pushed].any():
            raise refusal(layout, trajectory.times[-1:], end, self.margin, floor)

    def check_standing(self, kinematics: Scara, joints: Sequence[float], before: Scene) -> None:
        """Make sure that an arm at rest in another scene may be at rest in this one too.

        Args:
            kinematics: The arm with its tool.
            joints: j1 to j4 [rad, m, rad, rad].
            before: The scene before: the same bodies, of other sizes. Pairs that are too near
                there may stay so.

        Raises:
            ZoneError: A pair comes too near.
            InvalidArgumentError: A joint is not a finite number.
        """
        rows = np.array([joints], dtype=np.float64)
        _check_finite(rows)
        layout = self.layout(kinematics)
        pairs, stood = (
            each.clearances(kinematics, rows, self.margin)
            for each in (layout, before.layout(kinematics))
        )
        floor = np.minimum(self.margin - goal_slack(self.margin), stood - _ROUNDING)
        if (pairs < floor).any():
            raise refusal(layout, np.zeros(1), pairs, self.margin, floor)

    def check_load(self, kinematics: Scara, joints: Sequence[float]) -> None:
        """Make sure that the load of an arm at rest keeps clear, so that the arm can leave.

        Args:
            kinematics: The arm with its tool.
            joints: j1 to j4 [rad, m, rad, rad].

        Raises:
            ZoneError: The load is too near to a body that it may not touch.
            InvalidArgumentError: A joint is not a finite number.
        """
        rows = np.array([joints], dtype=np.float64)
        _check_finite(rows)
        layout = self.layout(kinematics)
        clearances = layout.clearances(kinematics, rows, self.margin)
        floor = np.full(clearances.shape, -math.inf)
        floor[[LOAD in (pair.link, pair.zone) for pair in layout.pairs]] = self.margin
        if (clearances < floor - goal_slack(self.margin)).any():
            raise refusal(layout, np.zeros(1), clearances, self.margin, floor)


def _check_finite(joints: Array) -> None:
    if not np.isfinite(joints).all():
        bad = joints[~np.isfinite(joints)][0]
        raise InvalidArgumentError(f"a joint is at {bad}: zones need finite positions")


def _make_tuples(owner: object, *sequences: str) -> None:
    """Convert attributes that may be lists to tuples: layouts are cached by value."""
    for name in sequences:
        what = f"the {name} of a zone or scene"
        values = items(what, getattr(owner, name), error=ConfigurationError)
        object.__setattr__(owner, name, values)


def _replace_values(owner: object, **values: object) -> None:
    """Set checked values in a frozen dataclass that is being constructed."""
    for name, value in values.items():
        object.__setattr__(owner, name, value)


def _check_name(name: str, links: tuple[str, ...]) -> None:
    """Make sure that the name of a zone is valid and that its links exist.

    Raises:
        ConfigurationError: The name is invalid, or a link does not exist.
    """
    if not isinstance(name, str) or not name.strip():
        raise ConfigurationError(f"zone {shown(name)}: it needs a name")
    if len(name) > _LONGEST or not name.isprintable():
        raise ConfigurationError(
            f"zone {shown(name)}: a name is one printable line of at most {_LONGEST} characters"
        )
    if name in (*LINKS, "base_link", "table"):
        raise ConfigurationError(f"zone {name}: the name is taken by the table or a link")
    for link in links:
        if not isinstance(link, str) or link not in LINKS:
            raise ConfigurationError(
                f"zone {name}: {shown(link)} is not a link that moves; those are {', '.join(LINKS)}"
            )


def _check_range(name: str, axis: str, low: float, high: float) -> tuple[float, float]:
    """Check a range of coordinates [m] and return it.

    Raises:
        ConfigurationError: A coordinate is too large, or the first is not the smaller.
    """
    low, high = (_check_number(f"zone {name}: {axis}", value, -FAR, FAR) for value in (low, high))
    if not low < high:
        raise ConfigurationError(
            f"zone {name}: {axis} goes from {low:g} m to {high:g} m; the first must be the smaller"
        )
    return low, high


def _check_number(what: str, value: float, lower: float, upper: float, unit: str = "m") -> float:
    """Check that a number is between two bounds and return it.

    Raises:
        ConfigurationError: It is not; the message names ``what`` and the bounds.
    """
    value = number(what, value, error=ConfigurationError)
    if not lower <= value <= upper:
        hint = "; are these millimetres? lengths are metres" if unit == "m" else ""
        if abs(value) <= FAR:
            hint = ""
        raise ConfigurationError(
            f"{what}: {value:g} {unit} is outside {lower:g} .. {upper:g} {unit}{hint}"
        )
    return value
