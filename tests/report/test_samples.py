"""A recording has every cycle of a motion, as arrays and as a frame, also while it runs."""

from __future__ import annotations

import csv
import math
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from bioscara import NotSupportedError, Samples
from bioscara.kinematics import Joints
from bioscara.report import CycleRecord, JointRecord, Phase, SampleQuality
from bioscara.report.sample_file import SampleWriter
from simulated import homed_robot

START, GOAL = (0.0, 0.2, 0.0, 0.0), (0.3, 0.25, 0.5, -0.5)
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
recorded_cycles = st.builds(
    CycleRecord,
    phase=st.sampled_from(Phase),
    start=times,
    trajectory_time=numbers,
    bus_time=times,
    retries=st.integers(0, 99),
    late=times,
    joints=st.tuples(*[records] * 4),
)


def record(cycles: list[CycleRecord]) -> Samples:
    recording = Samples()
    for cycle in cycles:
        recording(cycle)
    return recording


@given(st.lists(recorded_cycles, max_size=4))
def test_the_arrays_have_every_value_of_every_cycle(cycles: list[CycleRecord]) -> None:
    recording = record(cycles)
    assert len(recording) == len(cycles)
    assert recording.phases == tuple(cycle.phase for cycle in cycles)
    np.testing.assert_array_equal(recording.times, [cycle.start for cycle in cycles])
    for array, name in (
        (recording.positions, "position"),
        (recording.velocities, "velocity"),
        (recording.references, "reference"),
    ):
        values = [[getattr(joint, name) for joint in cycle.joints] for cycle in cycles]
        np.testing.assert_array_equal(array, np.reshape(values, (len(cycles), 4)))


@given(st.lists(recorded_cycles, min_size=1, max_size=4))
def test_the_frame_has_the_columns_and_values_of_the_samples_file(
    cycles: list[CycleRecord],
) -> None:
    pytest.importorskip("pandas")
    frame = record(cycles).to_pandas()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "samples.csv"
        with SampleWriter(path, Joints._fields) as writer:
            writer.write(cycles)
        with path.open(newline="") as file:
            rows = list(csv.reader(file))
    assert list(frame.columns) == rows[0]
    for cells, values in zip(rows[1:], frame.itertuples(index=False), strict=True):
        for cell, value in zip(cells, values, strict=True):
            if isinstance(value, str):
                assert cell == value
            elif math.isnan(value):
                assert cell == ""
            else:
                assert float(cell) == pytest.approx(value, rel=1e-8, abs=1e-6)


def test_without_pandas_the_message_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "path", [])
    monkeypatch.setattr(sys, "path_importer_cache", {})
    monkeypatch.delitem(sys.modules, "pandas", raising=False)
    with pytest.raises(NotSupportedError, match=r"not installed: .* -m pip install pandas$"):
        Samples().to_pandas()


def test_a_motion_is_recorded_from_its_begin_to_rest(tmp_path: Path) -> None:
    samples = Samples()
    with homed_robot(tmp_path, START) as made:
        assert repr(samples) == "<Samples, empty>"
        made.robot.move_joints(GOAL, on_cycle=samples)
        period = made.robot.period
    assert samples.positions.shape == samples.references.shape == (len(samples), 4)
    assert samples.positions[0] == pytest.approx(START, abs=0.01)
    assert samples.positions[-1] == pytest.approx(GOAL, abs=0.01)
    assert np.abs(samples.velocities[-1]).max() < 0.01 < np.abs(samples.velocities).max()
    assert np.abs(samples.positions - samples.references).max() < 5e-3
    assert np.diff(samples.times) == pytest.approx(period, rel=0.1)
    assert f"{len(samples)} cycles" in repr(samples)


def test_motions_one_after_the_other_are_recorded_in_one(tmp_path: Path) -> None:
    samples = Samples()
    with homed_robot(tmp_path, START) as made:
        made.robot.move_joints(GOAL, on_cycle=samples)
        cycles = len(samples)
        made.robot.move_joints(START, on_cycle=samples)
    assert len(samples) > cycles
    assert (np.diff(samples.times) > 0.0).all()
    assert samples.positions[-1] == pytest.approx(START, abs=0.01)


def test_arrays_may_be_read_while_the_motion_runs(tmp_path: Path) -> None:
    samples, begun, ended = Samples(), threading.Event(), threading.Event()
    problems: list[BaseException] = []

    def read() -> None:
        begun.set()
        try:
            while not ended.is_set():
                positions = samples.positions
                assert np.isfinite(positions).all()
                positions[:] = 0.0  # a copy: recorded values do not change
        except BaseException as problem:  # noqa: BLE001  reported in the thread of the test
            problems.append(problem)

    thread = threading.Thread(target=read)
    thread.start()
    try:
        with homed_robot(tmp_path, START) as made:
            assert begun.wait(10.0)
            made.robot.move_joints(GOAL, on_cycle=samples)
    finally:
        ended.set()
        thread.join()
    assert problems == []
    assert samples.positions[-1] == pytest.approx(GOAL, abs=0.01)
