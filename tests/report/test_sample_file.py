"""samples.csv: every value is read back, and a file stays whole under any failure of the disk."""

from __future__ import annotations

import csv
import math
import resource
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from bioscara.report import CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.report.sample_file import ROW_BYTES, SampleWriter

numbers = st.floats(width=32) | st.just(math.nan)
times = st.floats(0, 1e5)
records = st.builds(
    JointRecord,
    time=times,
    reference=numbers,
    reference_velocity=numbers,
    position=numbers,
    velocity=numbers,
    flags=st.integers(0, 255),
    quality=st.sampled_from(SampleQuality),
    load=numbers,
)
cycles_of_two = st.builds(
    CycleRecord,
    phase=st.sampled_from(Phase),
    start=times,
    trajectory_time=numbers,
    bus_time=times,
    retries=st.integers(0, 99),
    late=times,
    joints=st.tuples(records, records),
)


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file, strict=True))


def same(cell: str, value: float) -> bool:
    if math.isnan(value):
        return cell == ""
    return float(cell) == pytest.approx(value, rel=1e-8, abs=1e-6)


@given(st.lists(cycles_of_two, max_size=5))
def test_every_value_can_be_read_back(cycles: list[CycleRecord]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "samples.csv"
        with SampleWriter(path, ("j1", "j2")) as writer:
            writer.write(cycles)
        read = rows(path)
    assert len(read) == len(cycles)
    for row, cycle in zip(read, cycles, strict=True):
        assert None not in row
        assert row["phase"] == cycle.phase.value
        assert same(row["trajectory_time"], cycle.trajectory_time)
        for name, joint in zip(("j1", "j2"), cycle.joints, strict=True):
            assert same(row[f"{name}_time"], joint.time)
            assert same(row[f"{name}_reference"], joint.reference)
            assert same(row[f"{name}_position"], joint.position)
            assert same(row[f"{name}_velocity"], joint.velocity)
            assert same(row[f"{name}_load"], joint.load)
            assert int(row[f"{name}_flags"]) == joint.flags
            assert row[f"{name}_quality"] == joint.quality.name.lower()


@contextmanager
def disk_of(size: int) -> Iterator[None]:
    """No file may grow beyond ``size`` bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("room", [2000, 2001, 5000, 5077])
def test_a_file_on_a_full_disk_ends_at_its_last_whole_row(
    tmp_path: Path, cycles: list[CycleRecord], room: int
) -> None:
    path = tmp_path / "samples.csv"
    writer = SampleWriter(path, ("j1", "j2"))
    with disk_of(room), pytest.raises(OSError, match="File too large"):
        writer.write(cycles)
    writer.close()
    text = path.read_text()
    assert text.endswith("\n")
    assert len(text) <= room
    read = rows(path)
    assert 0 < len(read) < len(cycles)
    assert all(None not in row and None not in row.values() for row in read)
    assert float(read[-1]["time"]) == pytest.approx(cycles[len(read) - 1].start)


def test_rows_are_in_the_file_as_soon_as_write_returns(
    tmp_path: Path, cycles: list[CycleRecord]
) -> None:
    writer = SampleWriter(tmp_path / "samples.csv", ("j1", "j2"))
    writer.write(cycles[:3])
    assert len(rows(tmp_path / "samples.csv")) == 3
    writer.close()
    writer.close()


def test_the_estimate_of_a_row_covers_four_joints(
    tmp_path: Path, cycles: list[CycleRecord]
) -> None:
    path = tmp_path / "samples.csv"
    names = ("j1", "j2", "j3", "j4")
    with SampleWriter(path, names) as writer:
        writer.write(cycle._replace(joints=cycle.joints * 2) for cycle in cycles)
    assert path.stat().st_size < ROW_BYTES * len(cycles)
