"""Flight records are whole files that the commands for recordings read."""

from __future__ import annotations

import csv
import errno
import math
import os
import threading
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from bioscara.api import messages as m
from bioscara.cli import main
from bioscara.control.faults.flight_recorder import Evidence
from bioscara.control.faults.kinds import ArmFault, FaultKind
from bioscara.errors import RecordingError, StalledError
from bioscara.recording.reading.contents import Contents
from bioscara.recording.reading.joint_motion import read_motion
from bioscara.recording.reading.json_messages import message_of
from bioscara.recording.reading.replay import ReplayedArm
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.robot.connection.evidence_folder import EvidenceFolder
from bioscara.rosbag.topics import Topic
from control.control_stack import NAMES, World
from flight_records import read_record
from full_disk import full_after

CYCLES = 100
WRITTEN = 1_790_000_000 * 10**9
"""When the last cycle of :data:`EVIDENCE` was kept [ns since 1970]."""


def fault(text: str = "j1 stalled", time: float = 50.5) -> ArmFault:
    return ArmFault(FaultKind.STALL, "j1", StalledError(text, "j1"), time)


def row(cycle: int) -> tuple[float, ...]:
    joints = (
        value
        for joint in range(len(NAMES))
        for value in (
            0.1 * joint + 0.001 * cycle,
            0.2,
            0.1 * joint + 0.001 * cycle - 0.002,
            math.nan if joint == 3 else 0.19,
            50.0 + 0.01 * cycle - 0.003,
            16 + joint,
        )
    )
    return (50.0 + 0.01 * cycle, 1e-4, 2e-3, 3e-3, 4e-3, *joints)


EVIDENCE = Evidence(NAMES, tuple(row(cycle) for cycle in range(CYCLES)), WRITTEN)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("evidence") / "new"
    return EvidenceFolder(folder).write(EVIDENCE, "record", (fault(), fault("a\nb", 20.0)))


def test_each_cycle_is_read_as_it_was(path: Path) -> None:
    table = read_record(path).table
    for cycle, (time, *timing) in enumerate(each[:5] for each in EVIDENCE.rows):
        assert table["arm_time"][cycle] == pytest.approx(time, abs=1e-6)
        for name, value in zip(("late", "read", "update", "write"), timing, strict=True):
            assert table[f"arm_{name}"][cycle] == pytest.approx(value, abs=1e-6)
        # The newest cycle is placed at the wall clock's time, and the others before it.
        since = WRITTEN * 1e-9 - 0.01 * (CYCLES - 1 - cycle)
        assert table["time"][cycle] == pytest.approx(since, abs=1e-5)
    fields = ("command", "velocity_command", "position", "velocity", "stamp", "flags")
    for joint, name in enumerate(NAMES):
        for field, column in enumerate(fields):
            expected = [each[5 + 6 * joint + field] for each in EVIDENCE.rows]
            found = table[f"{name}_{column}"].tolist()
            assert found == pytest.approx(expected, abs=1e-6, nan_ok=True)


def test_other_programs_read_it_as_messages_of_ros2(path: Path) -> None:
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        found: dict[str, list[object]] = {}
        for _, channel, _, message in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append(message)
    assert {topic: len(each) for topic, each in found.items()} == {
        "/joint_states": CYCLES,
        "/joint_commands": CYCLES,
        "/dynamic_joint_states": CYCLES,
        "/events": 2,
        "/rosout": 2,
    }
    last = found["/joint_states"][-1]
    assert tuple(last.name) == NAMES
    assert list(last.velocity) == pytest.approx([0.19, 0.19, 0.19, math.nan], nan_ok=True)
    assert last.header.stamp.sec * 10**9 + last.header.stamp.nanosec == WRITTEN
    entry = found["/rosout"][1]
    assert (entry.level, entry.name, entry.file) == (40, "j1", "fault")
    assert entry.msg == "STALL: j1 stalled; remove the obstacle"


def test_the_faults_are_events_as_of_an_owner(path: Path) -> None:
    stored = list(messages(path, FileScan(), {Topic.EVENTS}))
    events = [message_of(each.data, m.Event) for each in stored]
    assert [(event.number, event.what, event.time) for event in events] == [
        (1, "fault", 50.5),
        (2, "fault", 20.0),
    ]
    assert "a b" in events[1].text
    # One from before the record is placed at its begin.
    begin = WRITTEN - 10**7 * (CYCLES - 1)
    assert [each.log_time - begin for each in stored] == pytest.approx([5e8, 0], abs=1e3)


def test_the_commands_for_recordings_take_it(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["record", "info", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("flight record of the time before a fault") for line in lines)
    assert "fault 1: STALL: j1 stalled; remove the obstacle" in lines
    assert "complete" in lines
    assert main(["record", "export", str(path), "--csv", str(tmp_path)]) == 0
    with (tmp_path / "samples.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == CYCLES
    assert float(rows[7]["j2_velocity_command"]) == pytest.approx(0.2, abs=1e-8)
    assert rows[7]["j2_flags"] == "17"
    with (tmp_path / "events.csv").open(newline="") as file:
        assert [each["what"] for each in csv.DictReader(file)] == ["fault", "fault"]
    assert main(["record", "recover", str(path)]) == 0
    assert f"{path} is complete" in capsys.readouterr().out
    motion = read_motion(path, NAMES)
    assert motion.positions.shape == (CYCLES, len(NAMES))
    assert motion.positions[9].tolist() == pytest.approx(EVIDENCE.rows[9][7::6], abs=1e-7)
    with pytest.raises(RecordingError, match="of a flight record"):
        ReplayedArm(path, "replay")


def test_a_record_of_the_loop_is_written_with_all_its_cycles(tmp_path: Path) -> None:
    world = World(home=False)
    world.run(0.5)
    frozen = world.record.freeze()
    found = EvidenceFolder(tmp_path).write(frozen, "record", (fault(),))
    assert read_record(found).times == pytest.approx([each[0] for each in frozen.rows], abs=1e-6)
    assert Contents(found).duration == pytest.approx(0.5, abs=0.02)


def test_a_fault_with_characters_that_no_file_can_hold_is_written(tmp_path: Path) -> None:
    found = EvidenceFolder(tmp_path).write(EVIDENCE, "record", (fault("caf\udce9 \x1b[2J \0"),))
    assert "caf\\udce9" in read_record(found).faults[0]


def test_a_name_that_is_taken_gets_a_number(tmp_path: Path) -> None:
    paths = [EvidenceFolder(tmp_path).write(EVIDENCE, "record", ()) for _ in range(3)]
    assert [path.name for path in paths] == ["record.mcap", "record-2.mcap", "record-3.mcap"]
    assert sorted(tmp_path.iterdir()) == sorted(paths)


def test_programs_that_request_the_same_file_name_at_once_keep_their_own_evidence(
    tmp_path: Path,
) -> None:
    paths: list[Path] = []

    def write(program: int) -> None:
        for number in range(5):
            faults = (fault(f"{program} {number}"),)
            paths.append(EvidenceFolder(tmp_path).write(EVIDENCE, "record", faults))

    threads = [threading.Thread(target=write, args=(program,)) for program in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    found = {read_record(path).faults[0] for path in paths}
    assert found == {
        f"STALL: {program} {number}; remove the obstacle"
        for program in range(4)
        for number in range(5)
    }
    assert sorted(tmp_path.iterdir()) == sorted(paths)


def test_a_record_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[int, list[Path]]] = []
    sync = os.fsync

    def fsync(file: int) -> None:
        synced.append((os.fstat(file).st_size, list(tmp_path.glob("*.mcap"))))
        sync(file)

    monkeypatch.setattr(os, "fsync", fsync)
    path = EvidenceFolder(tmp_path).write(EVIDENCE, "record", (fault(),))
    assert synced == [(path.stat().st_size, [])]


@pytest.mark.parametrize("size", [0, 100, 5000, 10_000])
def test_a_full_disk_leaves_nothing(tmp_path: Path, size: int) -> None:
    with full_after(size), pytest.raises(OSError, match="too large"):
        EvidenceFolder(tmp_path).write(EVIDENCE, "record", (fault(),))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("interruption", [KeyboardInterrupt(), OSError(errno.EIO, "broken")])
def test_a_record_that_is_interrupted_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, interruption: BaseException
) -> None:
    def interrupt(_: int) -> None:
        raise interruption

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(type(interruption)):
        EvidenceFolder(tmp_path).write(EVIDENCE, "record", (fault(),))
    assert list(tmp_path.iterdir()) == []
