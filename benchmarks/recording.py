"""Recording a served arm: the recorder's load, size, loss when killed, and export."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.reader import read_ros2_messages

from benchmarks.measure import Row, at_most, medians
from bioscara import Robot
from bioscara.api.messages import StateSample
from bioscara.api.runtime import VARIABLE
from bioscara.hardware import Urdf
from bioscara.hardware.link_frames import LinkFrames
from bioscara.kinematics import Pose
from bioscara.model import load_parameters
from bioscara.model.urdf import urdf_of
from bioscara.recording.reading.export import export_csv, export_parquet
from bioscara.recording.reading.sample_table import sample_tables
from bioscara.recording.reading.scan import FileScan
from bioscara.recording.writing.sample_messages import SampleMessages
from bioscara.robot import kinematics_of
from bioscara.rosbag.recording_file import RecordingFile
from bioscara.rosbag.topics import Topic, definition
from bioscara.server.serve import ServeSettings, serving

_SHARE, _HOUR, _LOST, _FASTER = 0.10, 100e6, 1.0, 50.0
"""Limits: share of a core, bytes an hour, seconds lost, and export against real time."""
_WATCHED, _KILLS, _RATE = 20.0, 5, 100
_EXPORTED = 600.0
"""Length of the recording that is exported [s]."""
_NAMES = ("j1", "j2", "j3", "j4")
_PLACES = ((0.5, 0.1, -1.0, 0.5), (-0.6, 0.3, 1.2, -0.6))


@contextmanager
def _moving_arm(folder: Path) -> Iterator[None]:
    """Serve a simulated arm in real time, which moves until the end."""
    ended = threading.Event()
    robot = Robot.simulated(evidence=folder / "faults")
    robot.open()
    robot.home()
    robot.unfold()

    def move() -> None:
        with Robot.connect("arm:bench") as client:
            while not ended.is_set():
                for place in _PLACES:
                    client.move_joints(place)
                client.gripper.open()

    with serving(robot, ServeSettings("bench", "sim", evidence=folder / "faults")):
        mover = threading.Thread(target=move)
        mover.start()
        try:
            yield
        finally:
            ended.set()
            mover.join()


def _recorder(out: Path) -> tuple[subprocess.Popen[str], Path]:
    """Start a recorder; return it and its file."""
    words = (sys.executable, "-m", "bioscara", "record", "--arm", "bench", "--out", str(out))
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout
    return process, Path(process.stdout.readline().removeprefix("recording ").strip())


def _used(pid: int) -> float:
    """Return the time that a process has used [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _load(folder: Path) -> list[Row]:
    """Measure a recorder of an arm that moves all the time."""
    process, path = _recorder(folder)
    # The description and the definitions come once in a file.
    once = path.stat().st_size
    time.sleep(2.0)
    used, begun = _used(process.pid), time.monotonic()
    time.sleep(_WATCHED)
    passed = time.monotonic() - begun
    used = _used(process.pid) - used
    process.terminate()
    process.communicate()
    samples = sum(1 for _ in read_ros2_messages(os.fspath(path), topics=[Topic.JOINT_STATES]))
    # A busy computer lets the arm have fewer cycles: all is counted for the full rate.
    rate = samples / (passed + 2.0)
    share, hour = (
        used / passed * _RATE / rate,
        (path.stat().st_size - once) / samples * _RATE * 3600,
    )
    return [
        Row(
            f"recorder of an arm that moves all the time at {_RATE} Hz",
            f"{share:.1%} of a core",
            f"{rate:.0f} samples a second were recorded",
            f"at most {_SHARE:.0%} of a core",
            share <= _SHARE,
        ),
        Row(
            "its file",
            f"{hour / 1e6:.0f} MB an hour",
            f"{len(Topic)} topics",
            f"at most {_HOUR / 1e6:.0f} MB",
            hour <= _HOUR,
        ),
    ]


def _loss(folder: Path) -> Row:
    """Measure how much recorders lose that are killed."""
    lost = []
    for number in range(_KILLS):
        process, path = _recorder(folder / str(number))
        time.sleep(1.5 + 0.137 * number)
        process.kill()
        killed = time.time()
        process.communicate()
        last = 0.0
        for table in sample_tables(path, FileScan()):
            last = float(table["time"][-1])
        lost.append(killed - last)
    return Row(
        f"{_KILLS} recorders, killed: time lost at most",
        f"{max(lost):.2f} s",
        "chunks end after 0.6 s",
        f"at most {_LOST:g} s",
        max(lost) <= _LOST,
    )


def _samples(count: int) -> Iterator[StateSample]:
    """Yield samples of a motion, with noise as encoders have it."""
    arm = kinematics_of(load_parameters())
    for cycle in range(count):
        moment = 0.01 * cycle
        positions = tuple([0.3 * math.sin(0.4 * moment + each) + 0.1 for each in range(4)])
        x, y, z, yaw = arm.forward(positions)
        yield StateSample(
            cycle=cycle,
            time=moment,
            names=_NAMES,
            positions=positions,
            velocities=tuple([0.12 * math.cos(0.4 * moment + each) for each in range(4)]),
            qualities=(0,) * 4,
            stamps=tuple([moment - 0.00175 * each for each in range(4)]),
            flags=(36,) * 4,
            commands=tuple([position + 1e-4 for position in positions]),
            pose=Pose(x, y, z, math.remainder(yaw, math.tau)),
            width=0.04,
            enabled=True,
            fault="clear",
            paused=False,
            speed_override=1.0,
            moving=(),
            late=1e-5,
            bus_time=8e-3,
        )


def _export(folder: Path) -> list[Row]:
    """Measure the export of a long recording."""
    file, messages = RecordingFile(folder / "long.mcap"), SampleMessages(_NAMES, None)
    for sample in _samples(int(_EXPORTED * _RATE)):
        stamp = round(1e9 * sample.time) + 10**18
        for topic, data in messages.encode(sample, stamp):
            file.add(topic, data, stamp)
    file.finish()
    rows = []
    for kind, export in (("CSV", export_csv), ("Parquet", export_parquet)):
        (taken,) = medians(lambda export=export: export(file.path, folder / "out"), rounds=3)
        faster = _EXPORTED / taken
        rows.append(
            Row(
                f"export of {_EXPORTED:g} s to {kind}",
                f"{faster:.0f} times real time",
                "real time",
                f"at least {_FASTER:g} times",
                faster >= _FASTER,
            )
        )
    return rows


def _encoding() -> Row:
    """Measure the encoding of a sample against the decoder of mcap-ros2-support."""
    urdf = urdf_of(load_parameters())
    messages = SampleMessages(_NAMES, LinkFrames(Urdf(urdf, "robot_description")))
    samples = list(_samples(400))
    encoded = [pair for sample in samples for pair in messages.encode(sample, 1)]
    decode = _decoders()

    def encode_all() -> None:
        made = SampleMessages(_NAMES, LinkFrames(Urdf(urdf, "robot_description")))
        for sample in samples:
            made.encode(sample, 1)

    def decode_all() -> None:
        for topic, data in encoded:
            decode[topic](data)

    own, peer = medians(encode_all, decode_all, rounds=5)
    return at_most(
        "a sample as messages", own / 400, 0.2, peer / 400, "mcap-ros2-support reads them"
    )


def _decoders() -> dict[Topic, Callable[[bytes], Any]]:
    """Return what reads the messages of each topic."""
    decoders = {}
    for number, topic in enumerate(Topic, 1):
        text = definition(topic.type_name).encode()
        schema = Schema(id=number, name=topic.type_name, encoding="ros2msg", data=text)
        decode = DecoderFactory().decoder_for("cdr", schema)
        assert decode is not None
        decoders[topic] = decode
    return decoders


def rows() -> list[Row]:
    """Measure a recorder of a moving arm, killed ones, and the export."""
    before = os.environ.get(VARIABLE)
    with tempfile.TemporaryDirectory(prefix="b") as name:
        folder = Path(name)
        os.environ[VARIABLE] = name
        try:
            with _moving_arm(folder):
                measured = [*_load(folder / "load"), _loss(folder / "killed")]
        finally:
            os.environ.pop(VARIABLE)
            if before is not None:
                os.environ[VARIABLE] = before
        return [*measured, _encoding(), *_export(folder)]
