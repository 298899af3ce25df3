"""The motion of a recording, for the viewer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bioscara.cli.parser import parse
from bioscara.cli.view_source import viewed_from
from bioscara.errors import RecordingError
from bioscara.model import load_parameters
from bioscara.recording.reading.joint_motion import read_motion
from bioscara.rosbag.topics import Topic
from recording.conftest import Made
from recording.served_arm import read

NAMES = ("j1", "j2", "j3", "j4")


def test_it_has_the_positions_from_the_moment_all_are_known(made: Made) -> None:
    motion = read_motion(made.path, NAMES)
    states = read(made.path, Topic.JOINT_STATES)
    known = [each for each in states if not np.isnan(each.message.position).any()]
    assert len(known) < len(states)
    assert motion.positions.tolist() == [list(each.message.position) for each in known]
    after = (known[0].log_time - states[0].log_time) * 1e-9
    assert motion.skipped == pytest.approx(after, abs=1e-5)
    assert motion.times[0] == 0.0
    length = (known[-1].log_time - known[0].log_time) * 1e-9
    assert motion.times[-1] == pytest.approx(length, abs=1e-5)
    assert {"unfold()", "move_joints()", ""} <= set(motion.moving)


def test_long_recordings_are_thinned(made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = read_motion(made.path, NAMES)
    monkeypatch.setattr("bioscara.recording.reading.joint_motion.ROWS_MAX", 50)
    thinned = read_motion(made.path, NAMES)
    step = -(-len(whole.times) // 50)
    assert 25 <= len(thinned.times) <= 50
    assert thinned.positions.tolist() == whole.positions[::step].tolist()


def test_the_viewer_shows_a_recording(made: Made) -> None:
    shown = viewed_from(parse(["view", str(made.path)]), load_parameters())
    assert shown.motion is not None
    assert shown.motion.positions[-1] == pytest.approx((0.3, 0.2, 1.0, -0.4), abs=2e-3)
    assert "until all joints were homed" in shown.notes[0]
    assert {"unfold()", "move_joints()", ""} <= {name for _, name in shown.phases}


def test_a_recording_of_another_arm_or_without_motion_is_refused(
    made: Made, tmp_path: Path
) -> None:
    with pytest.raises(RecordingError, match="has no j7_position"):
        read_motion(made.path, ("j7",))
    part = tmp_path / "part.mcap"
    part.write_bytes(made.path.read_bytes()[:60_000])
    with pytest.raises(RecordingError, match="before the position of every joint was known"):
        read_motion(part, NAMES)
