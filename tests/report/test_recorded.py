"""A run is read from its folder as it was written, or refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bioscara.errors import ConfigurationError
from bioscara.report import CycleRecord, Phase, SampleQuality
from bioscara.report.recorded import read_run
from bioscara.report.sample_file import SampleWriter

NAMES = ("j1", "j2")


def written(folder: Path, cycles: list[CycleRecord]) -> Path:
    with SampleWriter(folder / "samples.csv", NAMES) as writer:
        writer.write(cycles)
    return folder / "samples.csv"


def unknown(cycle: CycleRecord, joints: int) -> CycleRecord:
    """Return a cycle of homing in which the first joints have no position yet."""
    lost = {"position": math.nan, "quality": SampleQuality.UNKNOWN}
    changed = tuple(
        joint._replace(**lost) if index < joints else joint
        for index, joint in enumerate(cycle.joints)
    )
    return cycle._replace(
        phase=Phase.HOMING, start=cycle.start - 10.0, trajectory_time=math.nan, joints=changed
    )


def test_a_run_is_read_as_it_was_written(tmp_path: Path, cycles: list[CycleRecord]) -> None:
    written(tmp_path, cycles)
    motion = read_run(tmp_path, NAMES)
    assert motion.times == pytest.approx([cycle.trajectory_time for cycle in cycles], abs=2e-6)
    assert motion.phases == tuple(cycle.phase for cycle in cycles)
    expected = [[joint.position for joint in cycle.joints] for cycle in cycles]
    assert np.allclose(motion.positions, expected, rtol=1e-8)
    assert motion.skipped == 0.0


def test_cycles_with_an_unknown_position_are_left_out(
    tmp_path: Path, cycles: list[CycleRecord]
) -> None:
    homing = [unknown(cycle, 1 + index % 2) for index, cycle in enumerate(cycles[:20])]
    written(tmp_path, homing + cycles)
    motion = read_run(tmp_path, NAMES)
    assert len(motion.times) == len(cycles)
    assert motion.skipped == pytest.approx(10.0)


@pytest.mark.parametrize("count", [0, 20])
def test_a_run_that_ended_while_homing_has_no_motion(
    tmp_path: Path, cycles: list[CycleRecord], count: int
) -> None:
    written(tmp_path, [unknown(cycle, 1) for cycle in cycles[:count]])
    with pytest.raises(ConfigurationError, match=r"ended before the position .* report\.txt"):
        read_run(tmp_path, NAMES)


def test_a_run_that_ended_in_the_approach_begins_at_zero(
    tmp_path: Path, cycles: list[CycleRecord]
) -> None:
    written(tmp_path, cycles[:20])
    assert read_run(tmp_path, NAMES).times[0] == 0.0


def test_samples_that_end_anywhere_within_a_line_are_refused(
    tmp_path: Path, cycles: list[CycleRecord]
) -> None:
    path = written(tmp_path, cycles[:3])
    data = path.read_bytes()
    for end in range(len(data)):
        path.write_bytes(data[:end])
        if data[:end].endswith(b"\n") and end > data.index(b"\n") + 1:
            assert len(read_run(tmp_path, NAMES).times) == data[:end].count(b"\n") - 1
        else:
            with pytest.raises(ConfigurationError, match=r"truncated|ended before"):
                read_run(tmp_path, NAMES)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (b"j2_position", b"j7_position", "no column j2_position"),
        (b"approach", b"standing", "line 2: not a line of samples"),
        (b"0.000000,", b"nan,", "line 2: not a line of samples"),
        (b"0.000000,", b"99,", "line 3: not a line of samples"),
        (b"good", b"good,good", "line 2: not a line of samples"),
        (b"good", b"\xff", "is not text"),
    ],
)
def test_changed_samples_are_refused_with_the_line(
    tmp_path: Path, cycles: list[CycleRecord], old: bytes, new: bytes, complaint: str
) -> None:
    path = written(tmp_path, cycles[:3])
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new, 1))
    with pytest.raises(ConfigurationError, match=rf"samples\.csv.*{complaint}"):
        read_run(tmp_path, NAMES)


def test_a_folder_without_samples_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"has no samples\.csv"):
        read_run(tmp_path, NAMES)
