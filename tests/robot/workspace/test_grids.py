"""The places of grids are those of plates seen from above, by index and by name."""

from __future__ import annotations

import math
from itertools import product

import pytest
from hypothesis import assume, given, strategies as st

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.grids import Grid
from robot.workspace.test_frames import POSES, same

PLATE = Grid(Frame("plate", Pose(0.3, 0.1, 0.02)), 8, 12, 0.009, 0.009)
PITCHES = st.floats(0.03, 0.1)


def test_a_plate_of_96_wells_has_its_names_and_places() -> None:
    names = list(PLATE)
    assert len(PLATE) == len(names) == len(set(names)) == 96
    assert names[0] == "A1"
    assert names[12] == "B1"
    assert names[-1] == "H12"
    assert same(PLATE["A1"], Pose(0.3, 0.1, 0.02))
    # Seen from above, columns go to the right and rows downwards.
    assert same(PLATE["A12"], Pose(0.3 + 11 * 0.009, 0.1, 0.02))
    assert same(PLATE["H1"], Pose(0.3, 0.1 - 7 * 0.009, 0.02))
    assert same(PLATE.pose(7, 11, z=0.05), Pose(0.399, 0.037, 0.07))
    assert PLATE.pose("H12", z=0.05) == PLATE.pose("h12", z=0.05) == PLATE.pose(7, 11, z=0.05)
    assert PLATE["h12"] == PLATE["H12"]


@pytest.mark.parametrize(
    ("rows", "columns"), [(1, 1), (4, 6), (8, 12), (16, 24), (32, 48), (100, 100)]
)
def test_each_name_is_that_of_one_place(rows: int, columns: int) -> None:
    grid = Grid(PLATE.frame, rows, columns, 0.002, 0.003)
    indices = list(product(range(rows), range(columns)))
    assert [grid[name] for name in grid] == [grid.pose(*each) for each in indices]
    assert len(set(grid)) == rows * columns


def test_rows_after_z_have_two_letters() -> None:
    names = list(Grid(PLATE.frame, 32, 1, 0.00225, 0.00225))
    assert names[25:28] == ["Z1", "AA1", "AB1"]
    assert names[-1] == "AF1"


def corners_of(grid: Grid) -> list[Pose]:
    return [grid.pose(0, 0), grid.pose(0, grid.columns - 1), grid.pose(grid.rows - 1, 0)]


@given(
    POSES, st.integers(2, 9), st.integers(2, 13), st.booleans(), PITCHES, PITCHES, st.floats(-3, 3)
)
def test_a_grid_is_found_from_three_of_its_corners(
    pose: Pose, rows: int, columns: int, turned: bool, down: float, across: float, yaw: float
) -> None:
    # Both pitches negative: the plate is turned by half a turn.
    pitches = (-down, -across) if turned else (down, across)
    grid = Grid(Frame("rack", pose), rows, columns, *pitches, yaw)
    found = Grid.from_corners("rack", rows, columns, *corners_of(grid))
    for name in ("A1", f"A{columns}", f"B{columns}", f"{chr(64 + rows)}{columns}"):
        assert same(found[name], grid[name])


@given(POSES, st.integers(2, 9), st.integers(2, 13), PITCHES, PITCHES, st.permutations(range(3)))
def test_corners_that_were_exchanged_are_named(
    pose: Pose, rows: int, columns: int, down: float, across: float, order: list[int]
) -> None:
    corners = corners_of(Grid(Frame("rack", pose), rows, columns, down, across))
    names = ("first", "row_end", "column_end")
    wrong = [name for index, name in enumerate(names) if order[index] != index]
    assume(wrong)
    with pytest.raises(InvalidArgumentError, match=f"rack: {' and '.join(wrong)} look exchanged"):
        Grid.from_corners("rack", rows, columns, *(corners[index] for index in order))


def test_a_mirrored_grid_is_refused_with_the_one_that_has_its_places() -> None:
    mirrored = Grid(Frame("rack", Pose(0.3, 0.1, 0.02)), 8, 12, -0.009, 0.009)
    with pytest.raises(InvalidArgumentError, match=r"row_pitch -0\.009 m, column_pitch 0\.009 m"):
        Grid.from_corners("rack", 8, 12, *corners_of(mirrored))


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("I1", r"there is no place 'I1'; the grid has A1 \.\. H12"),
        ("A13", "no place"),
        ("A0", "no place"),
        ("A01", "no place"),
        ("AA1", "no place"),
        ("1A", "no place"),
        ("", "no place"),
        (3, "no place 3"),
        (None, "no place None"),
    ],
)
def test_unknown_names_are_refused(name: str, complaint: str) -> None:
    with pytest.raises(InvalidArgumentError, match=complaint):
        PLATE[name]
    if isinstance(name, str):
        with pytest.raises(InvalidArgumentError, match=complaint):
            PLATE.pose(name)


@pytest.mark.parametrize(
    ("row", "column", "z", "complaint"),
    [
        (8, 0, 0.0, r"row 8 is outside 0 \.\. 7; the first one is 0"),
        (-1, 0, 0.0, "row -1 is outside"),
        (0, 12, 0.0, r"column 12 is outside 0 \.\. 11"),
        (0.5, 0, 0.0, "not a whole number"),
        (math.nan, 0, 0.0, "not a finite number"),
        ("A", None, 0.0, "no place 'A'"),
        ("A1", 0.1, 0.0, r"'A1' has its column in its name, and 0\.1 is given .*: z=0\.1"),
        (0, None, 0.0, r"pose\(0\) has no column; give row and column, or a name"),
        (0, 0, math.nan, "z is nan"),
        (0, 0, 50.0, "are these millimetres"),
    ],
)
def test_unknown_indices_are_refused(
    row: int | str, column: int | None, z: float, complaint: str
) -> None:
    with pytest.raises(InvalidArgumentError, match=complaint):
        PLATE.pose(row, column, z)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ((0, 12, 0.009, 0.009), r"rows of a grid: 0 is outside 1 \.\. 100"),
        ((8, 101, 0.009, 0.009), "columns of a grid: 101"),
        ((8, 12, 9.0, 0.009), r"row_pitch of a grid: 9 m .* are these millimetres\?"),
        ((8, 12, 0.009, 0.0), "column_pitch of a grid: 0 m is below"),
        ((8, 12, 0.009, math.inf), "column_pitch of a grid is inf"),
        ((8, 12, 0.009, 0.009, 90.0), r"yaw of a grid: 90 rad .* degrees"),
    ],
)
def test_impossible_grids_are_refused(values: tuple[float, ...], complaint: str) -> None:
    with pytest.raises(InvalidArgumentError, match=complaint):
        Grid(PLATE.frame, *values)


def test_a_grid_is_in_a_frame() -> None:
    with pytest.raises(InvalidArgumentError, match="the frame of a grid is 'plate'; give Frame"):
        Grid("plate", 8, 12, 0.009, 0.009)


@pytest.mark.parametrize(
    ("corners", "complaint"),
    [
        (
            (Pose(0.3, 0.1, 0.0), Pose(0.4, 0.1, 0.0), Pose(0.31, 0.0, 0.0)),
            r"5\.71 degrees off a r",
        ),
        ((Pose(0.3, 0.1, 0.0), Pose(0.4, 0.1, 0.0), Pose(0.3, 0.0, 0.01)), "tilted by 5.71"),
        ((Pose(0.3, 0.1, 0.0), Pose(0.3, 0.1, 0.0), Pose(0.3, 0.0, 0.0)), "row_end is 0.0 mm"),
        ((Pose(0.3, 0.1, 0.0), Pose(0.4, 0.1, 0.0), Pose(0.5, 0.1, 0.0)), "column_end is 0.0 mm"),
        ((Pose(0.3, 0.1, 0.0), Pose(0.4, 0.1, 0.0), (0.3, 0.0, 0.0)), "give Pose"),
    ],
)
def test_corners_that_give_no_grid_are_refused(
    corners: tuple[Pose, Pose, Pose], complaint: str
) -> None:
    with pytest.raises(InvalidArgumentError, match=complaint):
        Grid.from_corners("rack", 8, 12, *corners)


def test_one_row_has_no_corners() -> None:
    with pytest.raises(InvalidArgumentError, match="rows: 1 cannot be taught by corners"):
        Grid.from_corners("rack", 1, 12, *[Pose(0.3, 0.1, 0.0)] * 3)
