"""Grids of places: plates, racks and pallets."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

from bioscara.arguments import shown, whole
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.kinematics.pose import ANGLE_MAX, require_near, wrapped
from bioscara.robot.workspace.frames import Frame, level
from bioscara.robot.workspace.tools import OFFSET_MAX, check_name, check_number

MOST = 100
"""Largest number of rows and of columns; a plate of 1536 wells has 32 and 48."""
PITCH_MIN = 1e-4
"""Smallest distance of two rows or columns [m]."""
SKEW_MAX = math.radians(1.0)
"""Largest deviation of taught rows and columns from a right angle [rad]."""
_NAME = re.compile(r"([A-Z]{1,2})([0-9]{1,3})")


@dataclass(frozen=True, slots=True)
class Grid:
    """Places in rows and columns in a frame; immutable.

    As on a plate seen from above, the first place A1 is the origin of the frame, columns follow
    each other along x and rows against y; a negative pitch reverses that. Rows are named A to Z,
    then AA and so on, and columns from 1 on, as in the standards of microplates (ANSI SLAS 4).

    Iterating gives the names, row by row.

    Attributes:
        frame: The frame.
        rows: Number of rows.
        columns: Number of columns.
        row_pitch: Distance of two rows [m].
        column_pitch: Distance of two columns [m].
        yaw: Rotation of the tool in the frame at each place [rad].

    Raises:
        InvalidArgumentError: A number is not finite or not possible.
    """

    frame: Frame
    rows: int
    columns: int
    row_pitch: float
    column_pitch: float
    yaw: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.frame, Frame):
            raise InvalidArgumentError(
                f"the frame of a grid is {shown(self.frame)}; give Frame(name, pose), or one of "
                "robot.frames"
            )
        for field in ("rows", "columns"):
            count = whole(f"{field} of a grid", getattr(self, field))
            if not 1 <= count <= MOST:
                raise InvalidArgumentError(f"{field} of a grid: {count} is outside 1 .. {MOST}")
            object.__setattr__(self, field, count)
        for field in ("row_pitch", "column_pitch"):
            what = f"{field} of a grid"
            pitch = check_number(what, getattr(self, field), OFFSET_MAX, "m")
            if abs(pitch) < PITCH_MIN:
                raise InvalidArgumentError(f"{what}: {pitch:g} m is below {PITCH_MIN:g} m")
            object.__setattr__(self, field, pitch)
        yaw = check_number("yaw of a grid", self.yaw, ANGLE_MAX, "rad")
        object.__setattr__(self, "yaw", yaw)

    @classmethod
    def from_corners(
        cls, name: str, rows: int, columns: int, first: Pose, row_end: Pose, column_end: Pose
    ) -> Grid:
        """Return the grid that was taught by three of its places, each the tool's pose in the base.

        Args:
            name: Of its frame.
            rows: Number of rows, 2 or more.
            columns: Number of columns, 2 or more.
            first: At the first place, A1; the yaw of the tool at all places.
            row_end: At the last place of the first row, as A12.
            column_end: At the last place of the first column, as H1.

        Raises:
            InvalidArgumentError: Places coincide, rows and columns are not at a right angle, the
                grid is tilted, or mirrored: it names the corners that look exchanged.
        """
        for what, count in (("rows", whole("rows", rows)), ("columns", whole("columns", columns))):
            if count < 2:
                raise InvalidArgumentError(
                    f"{what}: {count} cannot be taught by corners; give Grid(...) its frame"
                )
        check_name("frame", name)
        what = f"grid {name}"
        first = require_near(f"{what}, first", first)
        corners = {"row_end": row_end, "column_end": column_end}
        direction, along, aside = level(what, first, corners)
        width = math.hypot(row_end.x - first.x, row_end.y - first.y)
        pitches = math.hypot(along, aside) / (rows - 1), width / (columns - 1)
        if exchanged := _exchanged(first, row_end, column_end):
            raise InvalidArgumentError(
                f"{what}: {' and '.join(exchanged)} look exchanged, as seen from above rows follow "
                "to the right of the first row; first is at A1, row_end at the end of its row, "
                "column_end at the end of its column. A grid that is mirrored indeed is Grid(...) "
                f"with row_pitch {-pitches[0]:.4g} m, column_pitch {pitches[1]:.4g} m"
            )
        skew = math.atan2(abs(along), abs(aside))
        if skew > SKEW_MAX:
            raise InvalidArgumentError(
                f"{what}: rows and columns are {math.degrees(skew):.2f} degrees off a right angle, "
                f"which is more than {math.degrees(SKEW_MAX):g}; teach the corners again"
            )
        frame = Frame(name, Pose(first.x, first.y, first.z, direction))
        yaw = wrapped(first.yaw - direction)
        return cls(frame, rows, columns, *pitches, yaw)

    def pose(self, row: int | str, column: int | None = None, z: float = 0.0) -> Pose:
        """Return the pose in the base of a place: ``pose("B7", z=0.1)``, ``pose(1, 6, z=0.1)``.

        Args:
            row: From 0 on; or the name of the place, in capital or small letters.
            column: From 0 on; None with a name.
            z: Height above the place [m].

        Raises:
            InvalidArgumentError: There is no such place, or the height is not finite or too large.
        """
        if isinstance(row, str):
            if column is not None:
                raise InvalidArgumentError(
                    f"the place {shown(row)} has its column in its name, and {shown(column)} is "
                    "given as well; name a height: z=0.1"
                )
            row, column = self._place(row)
        if column is None:
            raise InvalidArgumentError(
                f"pose({shown(row)}) has no column; give row and column, or a name such as 'A1'"
            )
        row, column = (
            self._index("row", row, self.rows),
            self._index("column", column, self.columns),
        )
        return self.frame.pose(column * self.column_pitch, -row * self.row_pitch, z, self.yaw)

    def __getitem__(self, name: str) -> Pose:
        """Return the pose in the base of a place by its name, such as ``"B7"`` or ``"b7"``.

        Raises:
            InvalidArgumentError: No place has that name.
        """
        return self.pose(*self._place(name))

    def _place(self, name: str) -> tuple[int, int]:
        """Return row and column of a place, from 0 on."""
        capital = name.upper() if isinstance(name, str) else ""
        found = _NAME.fullmatch(capital)
        if found is not None:
            row, column = _row_number(found[1]), int(found[2]) - 1
            if row < self.rows and 0 <= column < self.columns and capital == _named(row, column):
                return row, column
        raise InvalidArgumentError(
            f"there is no place {shown(name)}; the grid has A1 .. "
            f"{_named(self.rows - 1, self.columns - 1)}"
        )

    def __iter__(self) -> Iterator[str]:
        for row in range(self.rows):
            for column in range(self.columns):
                yield _named(row, column)

    def __len__(self) -> int:
        return self.rows * self.columns

    @staticmethod
    def _index(what: str, index: int, count: int) -> int:
        index = whole(f"{what} of a grid", index)
        if not 0 <= index < count:
            raise InvalidArgumentError(
                f"{what} {index} is outside 0 .. {count - 1}; the first one is 0"
            )
        return index


def _exchanged(*corners: Pose) -> list[str]:
    """Return which of three corners to give in another order; none if no order makes a grid."""
    for order in permutations(range(3)):
        first, row_end, column_end = (corners[index] for index in order)
        ax, ay = row_end.x - first.x, row_end.y - first.y
        bx, by = column_end.x - first.x, column_end.y - first.y
        left = ax * by - ay * bx
        if math.atan2(abs(ax * bx + ay * by), -left) <= SKEW_MAX:
            names = ("first", "row_end", "column_end")
            return [name for index, name in enumerate(names) if order[index] != index]
    return []


def _named(row: int, column: int) -> str:
    letters = chr(ord("A") + row % 26)
    return f"{chr(ord('A') + row // 26 - 1) if row >= 26 else ''}{letters}{column + 1}"


def _row_number(letters: str) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number - 1
