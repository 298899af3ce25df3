"""Tables of a recording have the numbers that mcap's own reader finds."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pandas
import pyarrow
import pyarrow.parquet
import pytest

from bioscara import Trajectory
from bioscara.api.values import trajectory_value
from bioscara.errors import ConfigurationError, RecordingError
from bioscara.model import load_parameters
from bioscara.planning import check, read as read_trajectory
from bioscara.recording.reading import export
from bioscara.recording.reading.export import export_csv, export_parquet
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.recording.writing.rare_messages import trajectory_message
from bioscara.rosbag.cdr import CdrMessage
from bioscara.rosbag.recording_file import MEDIA_TYPE, RecordingFile
from bioscara.rosbag.texts import text_message
from bioscara.rosbag.topics import Topic
from full_disk import full_after
from programs import LIMIT, environment, running
from recording.conftest import Made
from recording.served_arm import read, recorded_fault

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def tables(made: Made, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tables")
    assert [path.name for path in export_csv(made.path, folder)] == [
        "samples.csv",
        "events.csv",
        "trajectories.csv",
    ]
    assert len(export_parquet(made.path, folder)) == 3
    return folder


def test_each_sample_is_a_row_with_its_numbers(made: Made, tables: Path) -> None:
    with (tables / "samples.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    states = read(made.path, Topic.JOINT_STATES)
    poses = {each.log_time: each.message.pose for each in read(made.path, Topic.TOOL_POSE)}
    commands = read(made.path, Topic.JOINT_COMMANDS)
    assert len(rows) == len(states)
    assert rows[0]["j1_position"] == rows[0]["tool_x"] == ""  # not homed: unknown
    for row, state, command in list(zip(rows, states, commands, strict=True))[::17]:
        assert float(row["time"]) == pytest.approx(state.log_time * 1e-9, abs=2e-6)
        for name, position in zip(state.message.name, state.message.position, strict=True):
            written = row[f"{name}_position"]
            known = float(written) if written else math.nan
            assert known == pytest.approx(position, abs=1e-9, nan_ok=True)
        if (pose := poses.get(state.log_time)) is not None:
            assert float(row["tool_x"]) == pytest.approx(pose.position.x, abs=1e-9)
            half = math.atan2(pose.orientation.z, pose.orientation.w)
            assert float(row["tool_yaw"]) == pytest.approx(2.0 * half, abs=1e-9)
        if row["j1_command"]:
            assert float(row["j1_command"]) == pytest.approx(command.message.position[0])
    assert {row["arm_enabled"] for row in rows} == {"0", "1"}


def test_events_and_trajectories_are_rows(made: Made, tables: Path) -> None:
    with (tables / "events.csv").open(newline="") as file:
        events = list(csv.DictReader(file))
    assert [row["text"] for row in events] == [each.text for each in made.events][: len(events)]
    ended = [row for row in events if row["what"] == "goal_ended"]
    assert {row["status"] for row in ended} == {"succeeded"}
    with (tables / "trajectories.csv").open(newline="") as file:
        points = list(csv.DictReader(file))
    assert float(points[-1]["j3_position"]) == pytest.approx(1.0, abs=1e-8)
    assert float(points[-1]["from_start"]) > 0.5


@pytest.fixture(scope="module")
def followed(made: Made, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of an arm with trajectories of different joints."""
    path = tmp_path_factory.mktemp("followed") / "followed.mcap"
    first = Trajectory(["j3"], [0.0, 2.0], [[0.5], [0.4]], [[0.0]] * 2, [[0.0]] * 2)
    ends = [[-0.3, 0.2], [-0.29, 0.21]]
    second = Trajectory(["j4", "j1"], [0.0, 2.0], ends, [[0.0] * 2] * 2)
    file = RecordingFile(path)
    state = next(messages(made.path, FileScan(), {Topic.JOINT_STATES}))
    file.add(Topic.JOINT_STATES, state.data, 0)
    for goal, trajectory in enumerate((first, second), 1):
        value = trajectory_value(trajectory)
        data = trajectory_message(value, f"goal {goal}, part 1", goal)
        file.add(Topic.TRAJECTORIES, data, goal)
    file.finish()
    return path


def test_the_values_of_a_trajectory_are_in_the_columns_of_its_joints(
    followed: Path, tmp_path: Path
) -> None:
    export_csv(followed, tmp_path)
    with (tmp_path / "trajectories.csv").open(newline="") as file:
        points = list(csv.DictReader(file))
    goals = list(dict.fromkeys(point["part"].partition(",")[0] for point in points))
    joints = ("j1", "j3", "j4")  # in the order of the arm; j2 is in no trajectory
    columns = [f"{j}_{kind}" for kind in ("position", "velocity", "acceleration") for j in joints]
    assert list(points[0]) == ["time", "part", "from_start", *columns]
    # One of them runs again, with the points that were not recorded too close to one another.
    again = tmp_path / "one.csv"
    lines = (tmp_path / "trajectories.csv").read_text().splitlines(keepends=True)
    again.write_text("".join([lines[0], *(line for line in lines if f'"{goals[1]},' in line)]))
    trajectory, _ = read_trajectory(again)
    assert trajectory.joint_names == ("j1", "j4")
    assert check(trajectory, load_parameters().joints) == []
    assert trajectory.positions[-1, 0] == pytest.approx(float(points[-1]["j1_position"]), abs=1e-6)
    trajectories = [each.message for each in read(followed, Topic.TRAJECTORIES)]
    assert [each.joint_names for each in trajectories] == [["j3"], ["j4", "j1"]]
    planned = [(each.joint_names, point) for each in trajectories for point in each.points]
    for row, (names, point) in zip(points, planned, strict=True):
        positions = dict(zip(names, point.positions, strict=True))
        for joint in joints:
            written = row[f"{joint}_position"]
            assert (float(written) if written else None) == positions.get(joint)


def test_a_joint_that_a_trajectory_does_not_have_is_null_in_parquet(
    followed: Path, tmp_path: Path
) -> None:
    export_parquet(followed, tmp_path)
    table = pyarrow.parquet.read_table(tmp_path / "trajectories.parquet")
    first, second = read(followed, Topic.TRAJECTORIES)
    counts = len(first.message.points), len(second.message.points)
    for joint, absent in (("j1", counts[0]), ("j3", counts[1]), ("j4", counts[0])):
        assert table[f"{joint}_position"].null_count == absent
        assert table[f"{joint}_position"].type == pyarrow.float64()
    j1, j4 = (table[f"{joint}_position"].to_pylist()[-1] for joint in ("j1", "j4"))
    assert [j4, j1] == list(second.message.points[-1].positions)


def test_an_unknown_number_of_a_trajectory_is_an_empty_cell(followed: Path, tmp_path: Path) -> None:
    export_csv(followed, tmp_path)
    export_parquet(followed, tmp_path)
    with (tmp_path / "trajectories.csv").open(newline="") as file:
        last = list(csv.DictReader(file))[-1]
    # The second trajectory was planned without accelerations.
    assert last["j1_acceleration"] == last["j4_acceleration"] == ""
    assert float(last["j1_velocity"]) == 0.0
    table = pyarrow.parquet.read_table(tmp_path / "trajectories.parquet")
    assert math.isnan(table["j1_acceleration"].to_pylist()[-1])  # as in the samples


def test_parquet_has_the_same_numbers(tables: Path) -> None:
    for name in ("samples", "events", "trajectories"):
        text = pandas.read_csv(tables / f"{name}.csv")
        table = pandas.read_parquet(tables / f"{name}.parquet")
        assert list(table.columns) == list(text.columns)
        assert len(table) == len(text)
    samples = pandas.read_parquet(tables / "samples.parquet")
    text = pandas.read_csv(tables / "samples.csv")
    pandas.testing.assert_frame_equal(samples, text, check_dtype=False, rtol=1e-9, atol=1e-6)


def test_more_rows_than_a_table_takes_are_all_written(
    made: Made, tmp_path: Path, tables: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bioscara.recording.reading.sample_table.BATCH", 7)
    export_csv(made.path, tmp_path)
    for name in ("samples.csv", "events.csv", "trajectories.csv"):
        assert (tmp_path / name).read_text() == (tables / name).read_text()


def test_a_table_without_rows_is_no_file(tmp_path: Path) -> None:
    file = RecordingFile(tmp_path / "a.mcap")
    file.finish()
    assert export_csv(file.path, tmp_path) == []
    assert export_parquet(file.path, tmp_path) == []


def test_a_recording_that_cannot_be_a_table_is_refused(tmp_path: Path) -> None:
    file = RecordingFile(tmp_path / "a.mcap")
    file.add(Topic.EVENTS, text_message("no JSON"), 1)
    file.finish()
    with pytest.raises(RecordingError, match="an event cannot be read"):
        export_csv(file.path, tmp_path)
    with pytest.raises(RecordingError, match="is no recording"):
        export_csv(Path(__file__), tmp_path)
    assert list(tmp_path.iterdir()) == [file.path]


def test_a_trajectory_without_a_value_for_each_joint_is_refused(tmp_path: Path) -> None:
    message = CdrMessage()
    message.header("goal 1, part 1")
    message.strings(("j1", "j2"))
    message.uint32(1)
    for values in ((0.1, 0.2), (0.0,), (), ()):
        message.double_sequence(values)
    message.stamp(0)
    file = RecordingFile(tmp_path / "a.mcap")
    file.add(Topic.TRAJECTORIES, bytes(message.data), 1)
    file.finish()
    with pytest.raises(RecordingError, match="has not as many values as joints"):
        export_csv(file.path, tmp_path)


def recorded(path: Path, *attached: tuple[str, bytes]) -> Path:
    """Write a recording with an event and these attachments."""
    file = RecordingFile(path)
    file.add(Topic.EVENTS, text_message('{"number": 1, "text": "a"}'), 1)
    for name, data in attached:
        file.attach(name, MEDIA_TYPE, data, 1)
    file.finish()
    return path


def test_a_fault_is_exported_with_the_recording_of_its_arm(tmp_path: Path) -> None:
    path, evidence = recorded_fault(tmp_path)
    command = ("-m", "bioscara", "record", "export", str(path), "--csv", str(tmp_path / "out"))
    with running(*command, env=environment()) as exporting:
        said, _ = exporting.communicate(timeout=LIMIT)
    assert exporting.returncode == 0
    unpacked = tmp_path / "out" / evidence.name
    assert f"wrote {unpacked}\n" in said
    assert unpacked.read_bytes() == evidence.read_bytes()
    # It is a recording itself, of the time before the fault.
    assert [each.name for each in export_csv(unpacked, tmp_path / "fault")] == [
        "samples.csv",
        "events.csv",
    ]


def test_what_is_no_flight_record_is_not_unpacked(tmp_path: Path, made: Made) -> None:
    out = tmp_path / "out"
    texts = (("overlay.yaml", b"j1: {}"), ("../parameters.json", b"{}"), ("a.mcap", b"no MCAP"))
    flight = made.path.read_bytes()
    path = recorded(tmp_path / "a.mcap", *texts, ("b.mcap", flight))
    files = [out / "events.csv", out / "b.mcap"]
    assert export_csv(path, out) == files
    assert sorted(out.iterdir()) == sorted(files)
    assert files[1].read_bytes() == flight
    # Once more: the tables are replaced, the flight record is there.
    files[0].write_text("")
    assert export_csv(path, out) == files
    assert files[0].read_text() != ""


@pytest.mark.parametrize(
    "name",
    ["../b.mcap", "/tmp/b.mcap", "c/b.mcap", "..", "", ".mcap", "b\n.mcap", "b\0.mcap", "b.csv"],
)
def test_no_attachment_leaves_the_folder(tmp_path: Path, made: Made, name: str) -> None:
    path = recorded(tmp_path / "a.mcap", (name, made.path.read_bytes()))
    with pytest.raises(RecordingError, match="which is no name of a file"):
        export_csv(path, tmp_path / "out")
    assert list(tmp_path.rglob("*")) == [path]


@pytest.mark.parametrize("link", [False, True])
def test_a_flight_record_replaces_no_other_file(tmp_path: Path, made: Made, link: bool) -> None:
    path, out = recorded(tmp_path / "a.mcap", ("b.mcap", made.path.read_bytes())), tmp_path / "out"
    other = tmp_path / "other"
    out.mkdir()
    if link:
        (out / "b.mcap").symlink_to(other)
    else:
        (out / "b.mcap").write_text("evidence")
    with pytest.raises(RecordingError, match="is not the flight record of this name; give another"):
        export_csv(path, out)
    assert (out / "b.mcap").is_symlink() == link
    assert not other.exists()
    assert link or (out / "b.mcap").read_text() == "evidence"


def test_where_a_flight_record_is_refused_former_tables_are_kept(
    tmp_path: Path, made: Made
) -> None:
    flight, out = made.path.read_bytes(), tmp_path / "out"
    path = recorded(tmp_path / "a.mcap", ("b.mcap", flight))
    export_csv(path, out)
    (out / "events.csv").write_text("former")
    (out / "b.mcap").write_text("evidence")
    with pytest.raises(RecordingError, match="is not the flight record of this name"):
        export_csv(path, out)
    assert (out / "events.csv").read_text() == "former"
    twice = recorded(tmp_path / "c.mcap", ("d.mcap", flight), ("d.mcap", flight + b"other"))
    with pytest.raises(RecordingError, match=r"two attached flight records have the name d\.mcap"):
        export_csv(twice, out)
    assert (out / "events.csv").read_text() == "former"
    assert not (out / "d.mcap").exists()


def test_a_full_disk_leaves_no_part_of_a_table(made: Made, tmp_path: Path) -> None:
    with full_after(10_000), pytest.raises(RecordingError, match="cannot be written"):
        export_csv(made.path, tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == []


def test_without_pyarrow_the_message_has_the_command_that_installs_it(
    made: Made, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "find_spec", lambda _: None)
    with pytest.raises(ConfigurationError, match=r"pyarrow.*pip install 'bioscara\[export\]'"):
        export.export_parquet(made.path, tmp_path)
