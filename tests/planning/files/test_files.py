"""Trajectory files: valid, unusual and broken ones."""

from __future__ import annotations

import json
import os
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from bioscara.errors import TrajectoryError
from bioscara.planning import Trajectory, check, fit, point_to_point, read, write_csv
from bioscara.planning.files import trajectory_file
from bioscara.planning.files.ros_message_parser import ITEMS_MAX
from bioscara.planning.files.ros_yaml import trajectory_of_message
from entries import entry
from planning.limits import LIMITS, NAMES

DATA = Path(__file__).parents[2] / "data"
PILZ, OPTIMAL = DATA / "planned_pilz_ptp.yaml", DATA / "planned_time_optimal.yaml"

POINT = """
  - positions: [0.1, 0.1, 0.1, 0.1]
    velocities: []
    accelerations: []
    effort: []
    time_from_start: {sec: 0, nanosec: 0}
"""
PLAIN = "joint_names: [j1, j2, j3, j4]\npoints:" + POINT + "---\n"


def test_the_planned_motion_of_the_arm_is_read_and_accepted() -> None:
    trajectory, notes = read(PILZ)
    assert trajectory.joint_names == NAMES
    assert trajectory.duration == pytest.approx(1.8802, abs=1e-4)
    assert trajectory.accelerations is not None
    assert notes == ()
    assert check(trajectory, LIMITS) == []


POINTS = (
    "[{positions: [0.1, 0.2], effort: [0, 0.0], time_from_start: {sec: 1}},"
    " {positions: [0.2, 0.2], time_from_start: {nanosec: 500000000, sec: 2}}]"
)
MESSAGE = f"{{joint_names: [j1, j2], points: {POINTS}}}"
NOTHING = "{joint_names: [], points: []}"
INDENTED = (
    "- positions: [0.1, 0.2]\n    time_from_start: {sec: 1, nanosec: 0}\n"
    "  - positions: [0.2, 0.2]\n    time_from_start: {sec: 2, nanosec: 500000000}"
)
SHAPES = {
    "JointTrajectory": MESSAGE,
    "in lines": f"header: {{frame_id: ''}}\njoint_names: [j1, j2]\npoints: {POINTS}",
    "without an end": "joint_names: [j1, j2]\npoints:\n"
    "- positions: [0.1, 0.2]\n  time_from_start: {sec: 1}\n"
    "- positions: [0.2, 0.2]\n  time_from_start: {sec: 2, nanosec: 500000000}",
    "RobotTrajectory": f"{{joint_trajectory: {MESSAGE}, multi_dof_joint_trajectory: {NOTHING}}}",
    "DisplayTrajectory": f"{{model_id: scene, trajectory: [{{joint_trajectory: {MESSAGE}}}]}}",
    "FollowJointTrajectory goal": f"trajectory: {MESSAGE}\ngoal_time_tolerance: {{sec: 1}}",
    "as an action has it": f"goal_id: {{uuid: [1, 2]}}\ngoal: {{trajectory: {MESSAGE}}}",
    "ExecuteTrajectory goal": f"{{trajectory: {{joint_trajectory: {MESSAGE}}},"
    " controller_names: [a]}",
    "MoveGroup result": f"{{error_code: {{val: 1}}, planned_trajectory: {{joint_trajectory:"
    f" {MESSAGE}}}, executed_trajectory: {{joint_trajectory: {NOTHING}}}}}",
    "GetMotionPlan response": "motion_plan_response:"
    f" {{trajectory: {{joint_trajectory: {MESSAGE}}}}}",
    "GetCartesianPath response": f"{{solution: {{joint_trajectory: {MESSAGE}}}, fraction: 1.0}}",
    "argument of a command": f"'{{trajectory: {MESSAGE}}}'",
    "command": '$ ros2 action send_goal /c/follow_joint_trajectory control_msgs/action/Follow "'
    f'{{trajectory: {MESSAGE}}}" --feedback',
    "what send_goal prints": "Waiting for an action server to become available...\nSending goal:"
    f"\n     trajectory:\n  joint_names:\n  - j1\n  - j2\n  points:\n  {INDENTED}\n"
    "goal_time_tolerance:\n  sec: 0\n  nanosec: 0\n\nGoal accepted with ID: 3f\n\nResult:\n"
    "    error_code: 0\nerror_string: ''\n\nGoal finished with status: SUCCEEDED",
    "JSON": json.dumps(
        {
            "trajectory": {
                "joint_names": ["j1", "j2"],
                "points": [
                    {"positions": [0.1, 0.2], "velocities": [], "time_from_start": {"sec": 1}},
                    {"positions": [0.2, 0.2], "time_from_start": {"sec": 2, "nanosec": 5e8}},
                ],
            },
            "goal_tolerance": [],
        },
        indent=1,
    ),
}


def test_a_trajectory_is_read_out_of_the_messages_that_people_paste() -> None:
    for shape, text in SHAPES.items():
        with entry(shape):
            trajectory, notes = trajectory_of_message(text + "\n")
            assert notes == ()
            assert trajectory.joint_names == ("j1", "j2")
            assert trajectory.times.tolist() == [1.0, 2.5]
            assert trajectory.positions.tolist() == [[0.1, 0.2], [0.2, 0.2]]


def test_tolerances_of_a_goal_are_said_to_have_no_effect() -> None:
    text = f"trajectory: {MESSAGE}\ngoal_tolerance: [{{name: j1, position: 0.1}}]\n"
    _, (note,) = trajectory_of_message(text)
    assert note == "the tolerances of the goal are ignored: those of the arm apply"


@pytest.mark.parametrize(
    ("name", "data", "why"),
    [
        ("r/samples.csv", b"time,phase,trajectory_time\n", "'bioscara run r/trajectory.csv'"),
        ("t/samples.csv", b"time,j1_position,arm_cycle\n", "'bioscara run t/trajectories.csv'"),
        ("t/events.csv", b"number,wall,time,what\n", "'bioscara run t/trajectories.csv'"),
        ("a.mcap", b"\x89MCAP0\r\n\x01", "'bioscara record export a.mcap --csv DIR'"),
        ("a.parquet", b"PAR1\x15", "'bioscara record export RECORDING --csv DIR'"),
        ("bag_0.db3", b"SQLite format 3\0\x10", "is a recording of 'ros2 bag'; .*--full-length"),
        ("words.yaml", b"msg.JointTrajectory(points=1)", "holds words and no message"),
        (
            "t/trajectories.csv",
            b'time,part,from_start,j1_position\n1,"goal 2, part 1",0,0\n'
            b'2,"goal 3, part 1",0,0\n',
            r"""2 motions \(goal 2, goal 3\); .* grep -e \^time -e '"goal 3,' t/traj""",
        ),
    ],
)  # fmt: skip
def test_own_files_are_named_with_the_command_that_fits(name: str, data: bytes, why: str) -> None:
    with pytest.raises(TrajectoryError, match=why):
        trajectory_file.read_content(name, data)


def test_the_time_optimal_motion_is_refused_for_its_lift_and_fits_when_stretched() -> None:
    trajectory, _ = read(OPTIMAL)
    assert trajectory.duration == pytest.approx(0.7705, abs=1e-4)
    with pytest.raises(TrajectoryError, match=r"j2 at .* velocity 0\.034\d* m/s .* 0\.02 m/s"):
        check(trajectory, LIMITS)
    fitted, factor = fit(trajectory, LIMITS)
    assert factor == pytest.approx(0.0344 / 0.02, rel=0.01)
    assert fitted.duration == pytest.approx(0.7705 * factor, rel=1e-3)
    assert "start is not at rest" in check(fitted, LIMITS)[0]


@pytest.mark.parametrize("path", [PILZ, OPTIMAL])
def test_a_csv_is_read_as_it_was_written(path: Path, tmp_path: Path) -> None:
    trajectory, _ = read(path)
    write_csv(tmp_path / "out.csv", trajectory)
    again, _ = read(tmp_path / "out.csv")
    assert again.joint_names == trajectory.joint_names
    for name in ("times", "positions", "velocities", "accelerations"):
        assert np.array_equal(getattr(again, name), getattr(trajectory, name))


def test_a_trajectory_that_could_not_be_read_again_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As many digits as a number can have.
    values = -1.1234567890123457e-05 * (1.0 + np.arange(4 * 30_000).reshape(-1, 4) / 1e7)
    times = np.arange(ITEMS_MAX + 1) * 1.1234567890123457e-03
    path = tmp_path / "long.csv"
    whole = Trajectory(NAMES, times[:30_000], values, values, values)
    write_csv(path, whole)
    assert path.stat().st_size > 8 * 2**20
    assert path.stat().st_size / 30_000 * ITEMS_MAX < trajectory_file.CSV_MAX
    assert np.array_equal(read(path).trajectory.accelerations, whole.accelerations)
    path = tmp_path / "never.csv"
    with pytest.raises(TrajectoryError, match=r"takes 100001 points .* a file holds 100000 and"):
        write_csv(path, Trajectory(["j1"], times, times[:, None]))
    monkeypatch.setattr(trajectory_file, "CSV_MAX", 2**20)
    with pytest.raises(TrajectoryError, match=r"never\.csv: .* and 8\.\d MiB, .* and 1; split it"):
        write_csv(path, whole)
    assert not path.exists()


def test_a_plan_that_is_written_as_csv_can_be_read_again(tmp_path: Path) -> None:
    """Two joints change their jerk 0.05 us apart; in a file, points are 1 us apart."""
    start = (-0.15402283030787567, 0.15226613102176714, -0.2521493761253315, -1.0959225604347294)
    goal = (-0.3824816665468913, 0.15226613102176714, 1.8089621839557128, -1.8064242274080027)
    planned = [replace(limit, max_acceleration=0.8 * limit.max_acceleration) for limit in LIMITS]
    path = tmp_path / "plan.csv"
    trajectory = point_to_point(NAMES, start, goal, planned)
    assert np.diff(trajectory.times).min() < 1e-6
    write_csv(path, trajectory)
    again = read(path).trajectory
    check(again, LIMITS)
    times = np.linspace(0.0, trajectory.duration, 1000)
    for one, other in zip(again.sample_many(times), trajectory.sample_many(times), strict=True):
        assert np.abs(one - other).max() < 1e-4


def test_each_kind_of_message_is_read(tmp_path: Path) -> None:
    plain = PLAIN.removesuffix("---\n")
    indented = "\n".join("  " + line for line in plain.splitlines())
    robot = "joint_trajectory:\n" + indented
    display = "trajectory:\n- " + "\n  ".join(robot.splitlines())
    for index, text in enumerate((plain, robot, display, "# note\n---\n" + plain)):
        path = tmp_path / f"{index}.yaml"
        path.write_text(text.rstrip("\n") + "\n---\n")
        assert read(path).trajectory.positions.tolist() == [[0.1] * 4]


def test_only_the_first_of_several_messages_is_used_with_a_note(tmp_path: Path) -> None:
    path = tmp_path / "two.yaml"
    path.write_text(PLAIN + PLAIN)
    assert "first of several messages" in read(path).notes[0]


def test_a_csv_without_suffixes_means_positions(tmp_path: Path) -> None:
    path = tmp_path / "plain.csv"
    path.write_text("# by hand\ntime,j1,j2\n0,0,0.1\n2,0.5,0.12\n")
    trajectory = read(path).trajectory
    assert trajectory.joint_names == ("j1", "j2")
    assert trajectory.sample(1.0).positions == pytest.approx((0.25, 0.11))


def test_a_broken_file_is_named_with_its_error(tmp_path: Path) -> None:
    for name, text, words in (
        ("empty.yaml", "", "is empty"),
        ("blank.csv", "\n \n", "is empty"),
        ("list.yaml", "[1, 2]", "not a set of fields"),
        ("other.yaml", "a: 1", "holds no joint trajectory"),
        ("nothing.yaml", "trajectory: []", "nothing was planned"),
        ("no_points.yaml", "joint_names: [j1]\npoints: []", "nothing was planned"),
        ("bad.yaml", "a: [1", "not readable"),
        ("tag.yaml", "a: !!python/object/apply:os.system [ls]", "aliases and tags"),
        ("bomb.yaml", "a: &a [1]\nb: [*a, *a]", "aliases and tags"),
        ("double.yaml", "joint_names: [j1]\njoint_names: [j2]", "line 2: .*stands twice"),
        ("size.yaml", PLAIN.replace("0.1, 0.1, 0.1, 0.1", "0.1"), "1 positions for 4 joints"),
        (
            "nan.yaml",
            PLAIN.replace("0.1, 0.1, 0.1, 0.1", ".nan, 0, 0, 0"),
            "'.nan' is not a number",
        ),
        ("word.yaml", PLAIN.replace("0.1, 0.1, 0.1, 0.1", "x, 0, 0, 0"), "'x' is not a number"),
        ("effort.yaml", PLAIN.replace("effort: []", "effort: [1, 1, 1, 1]"), "effort"),
        ("time.yaml", PLAIN.replace("nanosec", "ns"), "unknown field 'ns'; it has sec"),
        ("secs.yaml", PLAIN.replace("sec: 0, nanosec: 0", ""), "write it as"),
        ("number.yaml", PLAIN.replace("{sec: 0, nanosec: 0}", "2.5"), "is 2.5; write it as {sec"),
        ("twice.json", '{"points": [], "points": []}', "'points' stands twice"),
        ("cut.json", '{"joint_names": ["j1"],\n "points": [', "line 2: .*JSON.*truncated"),
        ("nan.json", '{"points": [{"positions": [NaN]}]}', "NaN is not a number"),
        ("goal.yaml", "goal: {order: 5}\n", "holds no joint trajectory; .* FollowJointTrajectory"),
        ("none.yaml", "trajectory: []\n", "trajectory is empty: nothing was planned"),
        (
            "digits.yaml",
            PLAIN.replace("0.1, 0.1, 0.1, 0.1", "1_0.0, 0, 0, 0"),
            "'1_0.0' is not a n",
        ),
        (
            "key.yaml",
            PLAIN.replace("velocities", "velocites"),
            "point 0: .*'velocites'.*velocities",
        ),
        ("cut.yaml", PLAIN.removesuffix("\n---\n"), "nothing follows the points, .*truncated"),
        ("short.yaml", PLAIN.replace("---", "  - '...'\n---"), "point 1: .*--full-length"),
        ("names.yaml", PLAIN.replace("j4]", "'...']"), "joint_names: .*--full-length"),
        ("dots.yaml", PLAIN.replace("---", "...\n---"), "line 8: .*--full-length"),
        ("twice.yaml", PLAIN.replace("---", POINT.strip("\n") + "\n---"), "does not come after"),
        ("header.csv", "t,j1\n0,0\n", "first column must be 'time'"),
        ("odd.csv", "time,j1,j2_velocity\n0,0,0\n", "j1 has no position or no velocity"),
        ("same.csv", "time,j1,j1\n0,0,0\n", "stands twice"),
        ("short.csv", "time,j1\n0,0\n1\n", "line 3: 1 values"),
        ("word.csv", "time,j1\n0,fast\n", "line 2: 'fast' is not a number"),
        ("digits.csv", "time,j1\n0,1_0.0\n", "line 2: '1_0.0' is not a number"),
        ("cut.csv", "time,j1\n0,0\n1,0.12", "last line has no line end"),
        ("order.csv", "time,j1\n1,0\n0.5,0\n", "times must increase"),
        ("none.csv", "time,j1\n", "at least one point"),
    ):
        with entry(name):
            path = tmp_path / name
            path.write_text(text)
            with pytest.raises(TrajectoryError, match=words) as caught:
                read(path)
            assert str(path) in str(caught.value)


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(bytes(range(256)))
    huge, table = tmp_path / "huge.yaml", tmp_path / "huge.csv"
    for path, size in ((huge, 8), (table, 32)):
        with open(path, "wb") as file:
            os.truncate(file.fileno(), size * 2**20 + 1)
    for path, words in (
        (binary, "is not text"),
        (huge, "larger than 8 MiB"),
        (table, "larger than 32 MiB"),
        (tmp_path, "is a folder"),
        (tmp_path / "missing.yaml", "does not exist"),
    ):
        with pytest.raises(TrajectoryError, match=words):
            read(path)
    (tmp_path / "trajectory.csv").touch()
    with pytest.raises(TrajectoryError, match=r"'bioscara run .*/trajectory\.csv'"):
        read(tmp_path)


def _points(count: int, quantities: dict[str, int]) -> str:
    """Return a message of ``count`` points, each quantity left out at one of them (-1: at none)."""
    lines = ["joint_names: [j1]", "points:"]
    for index in range(count):
        lines.append(f"- time_from_start: {{sec: {index}, nanosec: 0}}")
        lines += [f"  {name}: [0]" for name, without in quantities.items() if index != without]
    return "\n".join([*lines, "---", ""])


@given(st.data())
def test_velocities_or_accelerations_at_some_points_only_are_refused(data: st.DataObject) -> None:
    count = data.draw(st.integers(2, 6))
    name = data.draw(st.sampled_from(("velocities", "accelerations")))
    without = data.draw(st.integers(0, count - 1))
    whole = {"positions": -1, "velocities": -1, "accelerations": -1}
    trajectory, _ = trajectory_of_message(_points(count, whole))
    assert trajectory.accelerations is not None
    with pytest.raises(TrajectoryError, match=f"point {without}: no {name}, and point"):
        trajectory_of_message(_points(count, whole | {name: without}))


def test_accelerations_without_velocities_are_refused_not_dropped() -> None:
    with pytest.raises(TrajectoryError, match="without velocities"):
        trajectory_of_message(_points(2, {"positions": -1, "accelerations": -1}))


def _same(one: Trajectory, other: Trajectory) -> bool:
    return one.joint_names == other.joint_names and all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("times", "positions", "velocities", "accelerations")
    )


def _cuts(text: str) -> list[int]:
    ends = [index + 1 for index, character in enumerate(text) if character == "\n"]
    return ends + random.Random(1).sample(range(len(text)), 150)


@pytest.mark.parametrize("path", [PILZ, OPTIMAL])
def test_a_message_cut_anywhere_is_refused_or_the_same_motion(path: Path) -> None:
    text = path.read_text()
    whole, _ = trajectory_of_message(text)
    outcomes = set()
    for cut in _cuts(text):
        try:
            trajectory, _ = trajectory_of_message(text[:cut])
        except TrajectoryError:
            outcomes.add("refused")
            continue
        outcomes.add("read")
        assert _same(trajectory, whole), f"cut at {cut}"
    assert outcomes == {"refused", "read"}


def test_a_joint_trajectory_cut_anywhere_is_refused() -> None:
    text = "\n".join(
        line.removeprefix("    ")
        for line in PILZ.read_text().splitlines()
        if line.startswith("    ")
    )
    text = text[: text.index("header", 1)] + "---\n"
    whole, _ = trajectory_of_message(text)
    assert len(whole.times) == 20
    for cut in _cuts(text):
        if cut < len(text) - 1:
            with pytest.raises(TrajectoryError):
                trajectory_of_message(text[:cut])


def test_a_csv_cut_within_a_line_is_refused(tmp_path: Path) -> None:
    trajectory, _ = read(OPTIMAL)
    write_csv(tmp_path / "whole.csv", trajectory)
    data = (tmp_path / "whole.csv").read_bytes()
    path = tmp_path / "cut.csv"
    for cut in random.Random(1).sample(range(1, len(data)), 150):
        if data[cut - 1] not in b"\r\n":
            path.write_bytes(data[:cut])
            with pytest.raises(TrajectoryError, match=r"truncated|first column"):
                read(path)


def test_too_many_points_are_refused_before_they_are_checked(tmp_path: Path) -> None:
    path = tmp_path / "many.yaml"
    path.write_text("joint_names: [j1]\npoints:\n" + "- x\n" * (ITEMS_MAX + 1))
    with pytest.raises(TrajectoryError, match=f"line {ITEMS_MAX + 3}: .*more than {ITEMS_MAX}"):
        read(path)
    path = tmp_path / "many.csv"
    path.write_text("time,j1\n" + "0,0\n" * (ITEMS_MAX + 1))
    with pytest.raises(TrajectoryError, match=f"more than {ITEMS_MAX} points"):
        read(path)
