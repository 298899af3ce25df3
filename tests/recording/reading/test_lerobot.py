"""Datasets of LeRobot, read as LeRobot does: by pandas and JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bioscara.api.messages import StateSample
from bioscara.cli import main
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import ConfigurationError, InvalidArgumentError, RecordingError
from bioscara.recording.reading import lerobot
from bioscara.recording.reading.lerobot import export_lerobot
from bioscara.recording.writing.sample_messages import SampleMessages
from bioscara.rosbag.recording_file import RecordingFile
from bioscara.rosbag.texts import text_message
from bioscara.rosbag.topics import Topic
from full_disk import full_after

NAMES = ("j1", "j2", "j3", "j4")
LABELS = [*(f"{name}.pos" for name in NAMES), "gripper.pos"]
BEGIN = 50.0
"""Time of the first sample on the arm's clock [s]."""
Goal = tuple[int, str, str, float, float]
GOALS: tuple[Goal, ...] = (
    (1, "home()", "succeeded", 51.0, 52.0),
    (2, "move_to()", "succeeded", 53.0, 54.0),
    (3, "move_joints()", "cancelled", 54.5, 55.0),
    (4, "gripper.move()", "succeeded", 55.5, 57.5),
    (5, "move_to()", "succeeded", 57.6, 58.6),
    (6, "enable()", "succeeded", 59.0, 59.02),
    (7, "move_to()", "succeeded", 60.2, 62.5),
)


def positions(time: float) -> tuple[float, ...]:
    """Return where the joints are; unknown until they are homed."""
    return tuple([0.1 * time + index if time > 52.0 else math.nan for index in range(4)])


def recorded(
    path: Path, goals: Sequence[Goal] = GOALS, width: float = 0.06, seconds: float = 13.0
) -> Path:
    """Record 100 samples a second, without those of the 61st to 61.5th second."""
    file, encode = RecordingFile(path), SampleMessages(NAMES, None).encode
    for cycle in range(int(100 * seconds)):
        time = BEGIN + 0.01 * cycle
        if 61.0 < time < 61.5:
            continue
        here = positions(time)
        sample = StateSample(
            cycle=cycle, time=time, names=NAMES, positions=here, velocities=(0.1,) * 4,
            qualities=(0,) * 4, stamps=(time,) * 4, flags=(0,) * 4,
            commands=tuple([each + 0.01 for each in here]), pose=None, width=width, enabled=True,
            fault=FaultState.CLEAR, paused=False, speed_override=1.0, moving=(), late=0.0,
            bus_time=0.0, stale=False,
        )  # fmt: skip
        stamp = round(1e9 * (1.7e9 + time))
        for topic, data in encode(sample, stamp):
            file.add(topic, data, stamp)
    for number, name, status, begin, end in goals:
        for what, at, now in (("goal_accepted", begin, "waiting"), ("goal_ended", end, status)):
            goal = {"goal": number, "name": name, "status": now}
            event = json.dumps({"number": number, "what": what, "time": at, "goal": goal})
            file.add(Topic.EVENTS, text_message(event), round(1e9 * (1.7e9 + at)))
    file.finish()
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("recorded") / "pick.mcap")


@pytest.fixture(scope="module")
def out(path: Path) -> Path:
    """The dataset of it, at 30 frames a second."""
    folder = path.parent / "deep" / "dataset"
    export_lerobot(path, folder, 30)
    return folder


def stacked(column: Any) -> np.ndarray:
    return np.array(column.tolist())


def test_each_goal_that_succeeded_is_an_episode_with_its_motion_as_task(out: Path) -> None:
    episodes = pd.read_parquet(out / "meta/episodes/chunk-000/file-000.parquet")
    assert [list(each) for each in episodes["tasks"]] == [
        ["move_to"],
        ["gripper.move"],
        ["move_to"],
    ]
    assert episodes["length"].tolist() == [30, 60, 30]
    assert episodes["dataset_from_index"].tolist() == [0, 30, 90]
    assert episodes["dataset_to_index"].tolist() == [30, 90, 120]
    tasks = pd.read_parquet(out / "meta/tasks.parquet")
    assert tasks.index.name == "task"
    assert tasks["task_index"].to_dict() == {"move_to": 0, "gripper.move": 1}


def test_frames_are_interpolated_states_and_commands_in_si_units(out: Path) -> None:
    data = pd.read_parquet(out / "data/chunk-000/file-000.parquet")
    assert data["index"].tolist() == list(range(120))
    assert data["frame_index"].tolist() == [*range(30), *range(60), *range(30)]
    assert data["episode_index"].tolist() == [0] * 30 + [1] * 60 + [2] * 30
    assert data["task_index"].tolist() == [0] * 30 + [1] * 60 + [0] * 30
    assert data["timestamp"].to_numpy() == pytest.approx(data["frame_index"] / 30, abs=1e-6)
    begin = np.array([53.0, 55.5, 57.6])[data["episode_index"]]
    times = begin + data["frame_index"].to_numpy() / 30
    state, action = stacked(data["observation.state"]), stacked(data["action"])
    assert state.dtype == np.float32
    # The first sample of an episode is up to a cycle later than its goal.
    assert state[:, 0] == pytest.approx(0.1 * times, abs=0.1 * 0.011)
    assert state[:, 3] - state[:, 0] == pytest.approx(3.0, abs=1e-5)
    assert action[:, :4] - state[:, :4] == pytest.approx(0.01, abs=1e-5)
    assert state[:, 4] == pytest.approx(0.06)
    assert np.diff(state[:30, 0]) == pytest.approx(0.1 / 30, rel=1e-2)


def test_info_and_statistics_describe_the_frames(out: Path) -> None:
    info = json.loads((out / "meta/info.json").read_text())
    data = pd.read_parquet(out / "data/chunk-000/file-000.parquet")
    assert (info["codebase_version"], info["fps"]) == ("v3.0", 30)
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (3, 120, 2)
    assert info["splits"] == {"train": "0:3"}
    assert info["features"].keys() == set(data.columns)
    for name in ("observation.state", "action"):
        feature = {"dtype": "float32", "shape": [5], "names": LABELS}
        assert info["features"][name] == feature
    assert info["features"]["index"] == {"dtype": "int64", "shape": [1], "names": None}
    where = info["data_path"].format(chunk_index=0, file_index=0)
    assert (out / where).exists()
    statistics = json.loads((out / "meta/stats.json").read_text())
    episodes = pd.read_parquet(out / "meta/episodes/chunk-000/file-000.parquet")
    for name in data.columns:
        table = stacked(data[name]).reshape(120, -1)
        assert statistics[name]["mean"] == pytest.approx(table.mean(axis=0).tolist(), rel=1e-5)
        assert statistics[name]["max"] == pytest.approx(table.max(axis=0).tolist())
        assert statistics[name]["count"] == [120]
        assert episodes[f"stats/{name}/min"][1].tolist() == pytest.approx(table[30:90].min(axis=0))
    card = (out / "README.md").read_text()
    assert "j1, j3 and j4 in rad, j2 in m, the width of the jaws (gripper) in m" in card


def test_what_is_left_out_is_said(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["record", "export", str(path), "--lerobot", str(tmp_path / "a"), "--fps", "10"]
    assert main(command) == 0
    assert capsys.readouterr().out.splitlines() == [
        "note: left out, as position or command of j1 was unknown: 1 home()",
        "note: left out, as they are shorter than two frames: 6 enable()",
        "note: left out, as samples of more than 0.1 s are missing: 7 move_to()",
        f"wrote {tmp_path}/a: 3 episodes, 40 frames",
    ]


def test_jaws_that_were_never_commanded_are_no_part_of_it(tmp_path: Path) -> None:
    made = export_lerobot(
        recorded(tmp_path / "a.mcap", GOALS[1:2], math.nan, 5.0), tmp_path / "a", 30
    )
    assert (made.episodes, made.notes) == (
        1,
        ("without the gripper: its width was never commanded",),
    )
    info = json.loads((tmp_path / "a/meta/info.json").read_text())
    assert info["features"]["action"]["names"] == LABELS[:4]


@pytest.mark.parametrize("fps", [0, -30, 101])
def test_a_rate_that_cannot_be_is_refused(fps: int, path: Path, tmp_path: Path) -> None:
    with pytest.raises(InvalidArgumentError, match=rf"--fps {fps} is outside 1 \.\. 100"):
        export_lerobot(path, tmp_path / "a", fps)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_with_files_is_kept(path: Path, tmp_path: Path) -> None:
    (tmp_path / "other").write_text("kept")
    for given in (tmp_path, tmp_path / "other"):
        with pytest.raises(InvalidArgumentError, match="is not an empty folder; name another"):
            export_lerobot(path, given, 30)
    assert (tmp_path / "other").read_text() == "kept"
    assert export_lerobot(path, tmp_path / "new", 30).frames == 120


def test_a_recording_without_goals_or_that_is_damaged_is_refused(
    path: Path, tmp_path: Path
) -> None:
    for goals, message in (
        ((), "has no goal that succeeded"),
        (GOALS[2:3], "has no goal that succeeded"),
        (GOALS[:1], "no goal that can be an episode: left out, as position or command of j1"),
    ):
        with pytest.raises(RecordingError, match=message):
            export_lerobot(recorded(tmp_path / "a.mcap", goals), tmp_path / "a", 30)
        (tmp_path / "a.mcap").unlink()
    content = bytearray(path.read_bytes())
    content[len(content) // 3 : len(content) // 3 + 1000] = bytes(1000)
    (tmp_path / "b.mcap").write_bytes(content)
    with pytest.raises(RecordingError, match=r"is damaged: .* record recover .* --out FILE"):
        export_lerobot(tmp_path / "b.mcap", tmp_path / "a", 30)
    assert not (tmp_path / "a").exists()


def test_a_full_disk_leaves_no_part_of_a_dataset(path: Path, tmp_path: Path) -> None:
    with full_after(3000), pytest.raises(RecordingError, match="cannot be written"):
        export_lerobot(path, tmp_path / "a", 30)
    assert list(tmp_path.iterdir()) == []


def test_without_pyarrow_the_message_has_the_command_that_installs_it(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lerobot, "find_spec", lambda _: None)
    with pytest.raises(ConfigurationError, match=r"pyarrow.*pip install 'bioscara\[export\]'"):
        export_lerobot(path, tmp_path / "a", 30)
