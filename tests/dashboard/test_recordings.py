"""The list of recordings, and samples for plots."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bioscara import Robot
from bioscara.dashboard.recordings import recorded_samples, recording_of, recordings
from bioscara.errors import InvalidArgumentError, RecordingError
from bioscara.recording.reading.contents import Contents
from bioscara.recording.reading.extent import Extent, extent_of
from bioscara.recording.reading.sample_table import TIME, sample_tables
from bioscara.recording.reading.scan import FileScan
from recording.served_arm import NAME, recording, served
from served import runtime_folder


@pytest.fixture(scope="module")
def made(near_the_stops: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Record an arm that is homed."""
    folder = tmp_path_factory.mktemp("made")
    with runtime_folder(), served(folder, 20.0), recording(folder) as recorder:
        with Robot.connect(f"arm:{NAME}") as robot:
            robot.home()
        (path,) = recorder.end()
        yield path


def test_the_index_of_a_file_has_its_times(made: Path) -> None:
    contents, extent = Contents(made), extent_of(made)
    assert extent.complete
    assert extent.size == made.stat().st_size
    assert extent.begin == pytest.approx(contents.begin * 1e-9, abs=1e-6)
    assert extent.end == pytest.approx(contents.end * 1e-9, abs=1e-6)


def test_the_times_of_an_unfinished_or_damaged_file_are_unknown(made: Path, tmp_path: Path) -> None:
    data = made.read_bytes()
    for size in (0, 8, 100, len(data) // 2, len(data) - 1):
        path = tmp_path / "cut.mcap"
        path.write_bytes(data[:size])
        assert extent_of(path) == Extent(size, None, None, complete=False)
    # Each byte of the end inverted: no index is taken for another one.
    for back in range(1, 60):
        broken = bytearray(data)
        broken[-back] ^= 0xFF
        path.write_bytes(broken)
        assert extent_of(path).size == len(data)


def test_the_newest_is_listed_first_and_other_files_are_left_out(
    made: Path, tmp_path: Path
) -> None:
    names = ["left-20260101T000000Z.mcap", "left-20260101T000000Z-2.mcap"]
    for name in (*names, "right-20260101T000000Z.mcap", "left-notes.mcap", "left.yaml"):
        (tmp_path / name).write_bytes(made.read_bytes())
    assert [entry.name for entry in recordings(tmp_path, "left")] == names[::-1]
    assert recording_of(tmp_path, "left", names[0]) == tmp_path / names[0]
    for name in ("left.yaml", "right-20260101T000000Z.mcap", f"../{tmp_path.name}/{names[0]}"):
        assert recording_of(tmp_path, "left", name) is None
    assert recordings(tmp_path / "absent", "left") == []


@pytest.mark.parametrize("count", [2, 100, 20_000])
def test_samples_are_evenly_chosen(made: Path, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    tables = list(sample_tables(made, FileScan()))
    times = np.concatenate([table[TIME] for table in tables])
    lift = np.concatenate([table["j2_position"] for table in tables])
    found = recorded_samples(made, count)
    assert found.total == len(times)
    step = next(2**k for k in range(40) if math.ceil(len(times) / 2**k) <= count)
    assert found.begin + np.array(found.times) == pytest.approx(times[::step], abs=1e-6)
    np.testing.assert_allclose([row[1] for row in found.positions], lift[::step])
    assert found.joint_names == ("j1", "j2", "j3", "j4")
    assert len(found.velocities) == len(found.commands) == len(found.widths) == len(found.times)


@pytest.mark.parametrize("count", [-1, 0, 1, 20_001])
def test_a_number_outside_its_range_is_refused(made: Path, count: int) -> None:
    with pytest.raises(InvalidArgumentError, match=f"count: {count} is outside 2 .. 20000"):
        recorded_samples(made, count)


def test_a_file_without_samples_is_refused(made: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(made.read_bytes()[:100])
    with pytest.raises(RecordingError, match=r"cut\.mcap has no samples"):
        recorded_samples(path, 100)


def test_a_link_that_took_the_place_of_a_recording_is_not_followed(
    made: Path, tmp_path: Path
) -> None:
    path = tmp_path / "left-20260101T000000Z.mcap"
    path.write_bytes(made.read_bytes())
    found = recording_of(tmp_path, "left", path.name)
    assert found is not None
    assert recorded_samples(found, 2).total
    path.unlink()
    path.symlink_to(made)
    with pytest.raises(RecordingError, match="cannot be read"):
        recorded_samples(found, 2)
    with pytest.raises(OSError, match=r"symbolic links"):
        found.open()
    assert recordings(tmp_path, "left") == []
