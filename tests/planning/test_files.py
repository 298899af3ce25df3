"""Trajectory files: the arm's own, odd ones, and broken ones."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bioscara.errors import TrajectoryError
from bioscara.planning import Trajectory, check, fit, read, write_csv
from planning.limits import LIMITS, NAMES

DATA = Path(__file__).parents[1] / "data"
PILZ, OPTIMAL = DATA / "planned_pilz_ptp.yaml", DATA / "planned_time_optimal.yaml"

POINT = """
  - positions: [0.1, 0.1, 0.1, 0.1]
    velocities: []
    accelerations: []
    effort: []
    time_from_start: {sec: 0, nanosec: 0}
"""
PLAIN = "joint_names: [j1, j2, j3, j4]\npoints:" + POINT


def test_the_planned_motion_of_the_arm_is_read_and_accepted() -> None:
    trajectory, notes = read(PILZ)
    assert trajectory.joint_names == NAMES
    assert trajectory.duration == pytest.approx(1.8802, abs=1e-4)
    assert trajectory.accelerations is not None
    assert notes == ()
    assert check(trajectory, LIMITS) == []


def test_the_time_optimal_motion_is_refused_for_its_lift_and_fits_when_stretched() -> None:
    trajectory, _ = read(OPTIMAL)
    assert trajectory.duration == pytest.approx(0.7705, abs=1e-4)
    with pytest.raises(TrajectoryError, match=r"j2 at .* velocity 0\.034\d* m/s .* 0\.03 m/s"):
        check(trajectory, LIMITS)
    fitted, factor = fit(trajectory, LIMITS)
    assert factor == pytest.approx(0.0344 / 0.03, rel=0.01)
    assert fitted.duration == pytest.approx(0.7705 * factor, rel=1e-3)
    assert "start is not at rest" in check(fitted, LIMITS)[0]


@pytest.mark.parametrize("path", [PILZ, OPTIMAL])
def test_a_csv_gives_back_what_was_written(path: Path, tmp_path: Path) -> None:
    trajectory, _ = read(path)
    write_csv(tmp_path / "out.csv", trajectory)
    again, _ = read(tmp_path / "out.csv")
    assert again.joint_names == trajectory.joint_names
    for name in ("times", "positions", "velocities", "accelerations"):
        assert np.array_equal(getattr(again, name), getattr(trajectory, name))


def test_each_kind_of_message_is_read(tmp_path: Path) -> None:
    indented = "\n".join("  " + line for line in PLAIN.splitlines())
    robot = "joint_trajectory:\n" + indented
    display = "trajectory:\n- " + "\n  ".join(robot.splitlines())
    for index, text in enumerate((PLAIN, robot, display, "# note\n---\n" + PLAIN + "---\n")):
        path = tmp_path / f"{index}.yaml"
        path.write_text(text)
        assert read(path).trajectory.positions.tolist() == [[0.1] * 4]


def test_only_the_first_of_several_messages_is_used_and_that_is_said(tmp_path: Path) -> None:
    path = tmp_path / "two.yaml"
    path.write_text(PLAIN + "---\n" + PLAIN)
    assert "first of several messages" in read(path).notes[0]


def test_a_csv_without_suffixes_means_positions(tmp_path: Path) -> None:
    path = tmp_path / "plain.csv"
    path.write_text("# by hand\ntime,j1,j2\n0,0,0.1\n2,0.5,0.12\n")
    trajectory = read(path).trajectory
    assert trajectory.joint_names == ("j1", "j2")
    assert trajectory.sample(1.0).positions == pytest.approx((0.25, 0.11))


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("empty.yaml", "", "is empty"),
        ("blank.csv", "\n \n", "is empty"),
        ("list.yaml", "[1, 2]", "not a set of fields"),
        ("other.yaml", "a: 1", "holds no joint trajectory"),
        ("nothing.yaml", "trajectory: []", "nothing was planned"),
        ("no_points.yaml", "joint_names: [j1]\npoints: []", "nothing was planned"),
        ("bad.yaml", "a: [1", "not readable as YAML"),
        ("tag.yaml", "a: !!python/object/apply:os.system [ls]", "aliases and tags"),
        ("bomb.yaml", "a: &a [1]\nb: [*a, *a]", "aliases and tags"),
        ("double.yaml", "joint_names: [j1]\njoint_names: [j2]", "not readable as YAML"),
        ("size.yaml", PLAIN.replace("0.1, 0.1, 0.1, 0.1", "0.1"), "1 positions for 4 joints"),
        ("nan.yaml", PLAIN.replace("0.1, 0.1, 0.1, 0.1", ".nan, 0, 0, 0"), "position of j1 is nan"),
        ("word.yaml", PLAIN.replace("0.1, 0.1, 0.1, 0.1", "x, 0, 0, 0"), "'x' is not a number"),
        ("effort.yaml", PLAIN.replace("effort: []", "effort: [1, 1, 1, 1]"), "effort"),
        ("time.yaml", PLAIN.replace("nanosec", "ns"), "sec and nanosec"),
        ("twice.yaml", PLAIN + POINT.lstrip("\n"), "does not come after"),
        ("header.csv", "t,j1\n0,0\n", "first column must be 'time'"),
        ("odd.csv", "time,j1,j2_velocity\n0,0,0\n", "j1 has no position or no velocity"),
        ("same.csv", "time,j1,j1\n0,0,0\n", "stands twice"),
        ("short.csv", "time,j1\n0,0\n1\n", "line 3: 1 values"),
        ("word.csv", "time,j1\n0,fast\n", "line 2: 'fast' is not a number"),
        ("order.csv", "time,j1\n1,0\n0.5,0\n", "times must increase"),
        ("none.csv", "time,j1\n", "at least one point"),
    ],
)
def test_a_broken_file_is_named_with_what_is_wrong(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(TrajectoryError, match=words) as caught:
        read(path)
    assert str(path) in str(caught.value)


def test_what_is_no_text_file_is_refused(tmp_path: Path) -> None:
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(bytes(range(256)))
    huge = tmp_path / "huge.csv"
    with open(huge, "wb") as file:
        os.truncate(file.fileno(), 9 * 2**20)
    for path, words in (
        (binary, "is not text"),
        (huge, "larger than 8 MiB"),
        (tmp_path, "is a folder"),
        (tmp_path / "missing.yaml", "does not exist"),
    ):
        with pytest.raises(TrajectoryError, match=words):
            read(path)


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.sampled_from((PILZ, OPTIMAL)), st.floats(0.0, 1.0))
def test_a_file_cut_anywhere_is_refused_or_a_shorter_whole(
    tmp_path: Path, source: Path, share: float
) -> None:
    data = source.read_bytes()
    whole = read(source).trajectory
    path = tmp_path / "cut.yaml"
    path.write_bytes(data[: int(share * len(data))])
    try:
        trajectory: Trajectory = read(path).trajectory
    except TrajectoryError:
        return
    count = len(trajectory.times)
    assert np.array_equal(trajectory.positions[: count - 1], whole.positions[: count - 1])
