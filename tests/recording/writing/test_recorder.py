"""A recording has the owner's data, as other programs read it, and goes on through trouble."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

import bioscara.recording.writing.folder as recording_folder
from bioscara import Robot
from bioscara.api import messages as m
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import RecordingError
from bioscara.model import load_parameters
from bioscara.model.urdf import urdf_of
from bioscara.recording.reading.recovery import recover
from bioscara.recording.writing.owner_recorder import FileLimits
from bioscara.robot import kinematics_of
from bioscara.rosbag.topics import Topic
from full_disk import full_after
from programs import wait_until
from recording.conftest import Made
from recording.served_arm import (
    NAME,
    Read,
    attached,
    read,
    recorded_fault,
    recording,
    served,
)


def _events(stored: list[Read]) -> list[dict[str, object]]:
    return [json.loads(each.message.data) for each in stored if each.topic == Topic.EVENTS]


def test_each_event_of_the_owner_is_in_the_recording_once(made: Made) -> None:
    found = _events(read(made.path, Topic.EVENTS))
    numbers = [event["number"] for event in found]
    assert numbers == list(range(1, len(numbers) + 1))
    # The recorder left after the last one that it has.
    assert len(numbers) >= len(made.events) - 1
    for event, own in zip(found, made.events, strict=False):
        assert (event["what"], event["text"], event["wall"]) == (own.what, own.text, own.wall)
    log = read(made.path, Topic.LOG)
    assert [entry.message.msg for entry in log] == [event["text"] for event in found]


def test_every_topic_has_messages_of_its_type(made: Made) -> None:
    types = {each.topic: each.type_name for each in read(made.path)}
    of_a_world = {Topic.BODIES, Topic.BODY_LIST, Topic.WORLD, Topic.IMAGE}
    assert types == {topic.value: topic.type_name for topic in set(Topic) - of_a_world}


def test_the_tool_is_where_the_joints_and_the_transforms_put_it(made: Made) -> None:
    stored = read(made.path)
    arm = kinematics_of(load_parameters())
    joints = {e.log_time: e.message for e in stored if e.topic == Topic.JOINT_STATES}
    poses = {e.log_time: e.message.pose for e in stored if e.topic == Topic.TOOL_POSE}
    fixed = [e.message for e in stored if e.topic == Topic.TF_STATIC]
    moving = {e.log_time: e.message for e in stored if e.topic == Topic.TF}
    assert len(moving) > 20
    assert set(moving) < set(poses) < set(joints)
    for time, message in moving.items():
        pose = arm.forward(joints[time].position)
        place = poses[time].position
        assert (place.x, place.y, place.z) == pytest.approx(pose[:3], abs=1e-7)
        placed = _placed([*fixed[0].transforms, *message.transforms])
        assert placed["tool"][:3, 3] == pytest.approx(pose[:3], abs=2e-7)
        assert placed["tool"][:3, 0] == pytest.approx(
            [math.cos(pose.yaw), math.sin(pose.yaw), 0.0], abs=2e-7
        )


def _placed(transforms: list[Any]) -> dict[str, Any]:
    """Return the pose of each link in the world."""
    placed, rest = {"world": np.eye(4)}, list(transforms)
    while rest:
        each = next(one for one in rest if one.header.frame_id in placed)
        rest.remove(each)
        q, place = each.transform.rotation, each.transform.translation
        x, y, z, w = q.x, q.y, q.z, q.w
        matrix = np.eye(4)
        matrix[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        matrix[:3, 3] = place.x, place.y, place.z
        placed[each.child_frame_id] = placed[each.header.frame_id] @ matrix
    return placed


def test_qualities_flags_loads_and_the_state_of_the_arm_are_in_the_dynamic_states(
    made: Made,
) -> None:
    samples = [each.message for each in read(made.path, Topic.DYNAMIC_JOINT_STATES)]
    values = [
        {
            (joint, name): value
            for joint, interfaces in zip(each.joint_names, each.interface_values, strict=True)
            for name, value in zip(interfaces.interface_names, interfaces.values, strict=True)
        }
        for each in samples
    ]
    assert {each["j1", "quality"] for each in values} >= {0.0, 3.0}  # before and after homing
    assert {each["arm", "enabled"] for each in values} == {0.0, 1.0}
    assert any(each["j4", "flags"] for each in values)
    loads = [each["j4", "load"] for each in values if each["arm", "enabled"]]
    assert 0.0 <= min(loads) < max(loads) <= 255.0
    assert values[-1]["gripper", "position"] > 0.0
    assert all(a["arm", "cycle"] < b["arm", "cycle"] for a, b in pairwise(values))


def test_each_trajectory_is_recorded_when_it_begins(made: Made) -> None:
    stored = read(made.path)
    planned = [each for each in stored if each.topic == Topic.TRAJECTORIES]
    assert len(planned) == 2
    last = planned[-1].message
    assert tuple(last.points[-1].positions) == pytest.approx((0.3, 0.2, 1.0, -0.4), abs=1e-8)
    assert last.header.frame_id.startswith("goal ")
    assert last.points[0].velocities == pytest.approx([0.0] * 4)


def test_a_file_has_the_description_as_topic_and_as_attachment(made: Made) -> None:
    urdf = urdf_of(load_parameters())
    with made.path.open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros2"
        attached = {each.name: each.data.decode() for each in reader.iter_attachments()}
        (metadata,) = reader.iter_metadata()
        summary = reader.get_summary()
    assert summary is not None
    channels = {each.topic: each for each in summary.channels.values()}
    assert attached["robot_description.urdf"] == urdf
    assert json.loads(attached["parameters.json"])["name"] == NAME
    assert metadata.metadata["owner"] == NAME
    (description,) = read(made.path, Topic.ROBOT_DESCRIPTION)
    assert description.message.data == urdf
    offered = channels[Topic.ROBOT_DESCRIPTION].metadata["offered_qos_profiles"]
    assert "durability: transient_local" in offered


def test_the_status_changes_where_the_arm_does(made: Made) -> None:
    found = [json.loads(each.message.data) for each in read(made.path, Topic.STATUS)]
    assert ["home()"] in [each["moving"] for each in found]
    assert {each["enabled"] for each in found} == {True, False}
    assert all(a != b for a, b in pairwise(found))


@pytest.mark.parametrize("limits", [FileLimits(200_000, 3600.0), FileLimits(10**9, 10.0)])
def test_the_next_file_begins_by_size_and_by_time_and_nothing_is_between(
    limits: FileLimits, tmp_path: Path
) -> None:
    with served(tmp_path) as owner, recording(tmp_path, limits) as recorder:
        wait_until(lambda: len(recorder.folder.files()) >= 3, "three files")
        owner.owner.announce("report", "the last event")
        files = recorder.end()
    parts = [read(path) for path in files]
    for each in parts:
        latched = {message.topic for message in each[:10]}
        assert {Topic.ROBOT_DESCRIPTION, Topic.TF_STATIC, Topic.STATUS, Topic.FAULTS} <= latched
    events = [event["number"] for each in parts for event in _events(each)]
    assert events == list(range(1, len(events) + 1))
    assert "the last event" in [event["text"] for each in parts for event in _events(each)]
    times = [each.log_time for part in parts for each in part if each.topic == "/joint_states"]
    assert times == sorted(set(times))
    limit = limits.duration + 15.0  # less than a second of this computer
    assert all(part[-1].log_time - part[0].log_time < limit * 1e9 for part in parts)
    assert all(path.stat().st_size < limits.size + 150_000 for path in files)


def test_the_oldest_files_of_this_arm_are_deleted_by_their_total_size(tmp_path: Path) -> None:
    kept = tmp_path / f"{NAME}-notes.mcap"
    other = tmp_path / f"{NAME}2-20200101T000000Z.mcap"
    old = [tmp_path / f"{NAME}-20200101T00000{index}Z.mcap" for index in range(3)]
    for path in (kept, other, *old):
        path.write_bytes(bytes(100_000))
    with served(tmp_path), recording(tmp_path, FileLimits(100_000, 3600.0), 300_000) as recorder:
        assert [path.exists() for path in old] == [True, True, True]
        wait_until(lambda: not old[2].exists(), "all three are deleted")
        files = recorder.end()
    assert sum(path.stat().st_size for path in files) < 500_000
    assert recorder.heard("--keep")
    assert kept.exists()
    assert other.exists()


def test_it_waits_for_the_owner_and_begins_another_file_after_its_restart(tmp_path: Path) -> None:
    with recording(tmp_path) as recorder:
        assert recorder.heard("no owner of arm left runs")
        for count in (1, 2):
            with served(tmp_path):
                wait_until(lambda n=count: len(recorder.folder.files()) == n, f"file {count}")  # type: ignore[misc]
        files = recorder.end()
    assert recorder.error is None
    instances = set()
    for path in files:
        with path.open("rb") as file:
            (metadata,) = make_reader(file).iter_metadata()
        instances.add(metadata.metadata["instance"])
    assert len(instances) == len(files) == 2


def test_a_full_disk_stops_the_recording_with_an_event_and_not_the_arm(tmp_path: Path) -> None:
    with served(tmp_path) as owner, recording(tmp_path) as recorder:
        events = owner.owner.events
        with full_after(100_000):
            wait_until(lambda: not recorder.running, "the recorder ends")
        assert isinstance(recorder.error, RecordingError)
        (path,) = recorder.folder.files()
        assert str(path) in str(recorder.error)
        assert path.stat().st_size <= 100_000
        said = [event.text for event in map(events.after, range(events.last)) if event]
        assert any("the recording has stopped" in text for text in said)
        with Robot.connect(f"arm:{NAME}") as robot:
            robot.enable()
            assert robot.faults == ()
    found = recover(path)
    assert found.messages > 100
    assert found.lost == 0
    assert len(read(path)) > 100


def test_a_recording_leaves_room_to_others_and_is_then_complete(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with served(tmp_path), recording(tmp_path) as recorder:
        wait_until(lambda: recorder.folder.files()[0].stat().st_size > 50_000, "samples")
        monkeypatch.setattr(recording_folder, "RESERVE", 2**60)
        wait_until(lambda: not recorder.running, "the recorder ends")
        assert "the disk is full" in str(recorder.error)
        (path,) = recorder.folder.files()
        assert len(read(path)) > 100
        with recording(tmp_path) as second:
            wait_until(lambda: not second.running, "none is begun")
        assert "no file is begun" in str(second.error)


def test_the_evidence_of_a_fault_isattached(tmp_path: Path) -> None:
    path, _ = recorded_fault(tmp_path)
    states = [json.loads(each.message.data)["state"] for each in read(path, Topic.FAULTS)]
    assert states[0] == "clear"
    assert states[-1] == "acknowledged"
    levels = [each.message.level for each in read(path, Topic.LOG) if each.message.file == "fault"]
    assert levels == [40]


def test_the_evidence_of_a_fault_that_is_over_when_asked_for_isattached(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with served(tmp_path) as owner, recording(tmp_path) as recorder:
        # As when a program recovers before the recorder has asked for the faults.
        clear: Any = {m.GetFaults: lambda *_: m.FaultList(FaultState.CLEAR, (), ())}
        monkeypatch.setattr(owner.owner, "_handlers", {**owner.owner._handlers, **clear})
        with Robot.connect(f"arm:{NAME}") as robot:
            robot.enable()
            owner.robot.simulate_fault("reset", "j3")
            wait_until(lambda: owner.robot.faults != (), "the fault")
            robot.acknowledge()
            (fault,) = owner.robot.faults
            robot.recover()
        assert fault.evidence is not None
        wait_until(lambda: attached(recorder) != {}, "the evidence")
        (path,) = recorder.end()
    assert list(attached(recorder)) == [fault.evidence.name]
    said = [json.loads(each.message.data) for each in read(path, Topic.EVENTS)]
    (event,) = [each for each in said if each["what"] == "acknowledged"]
    assert fault.evidence.name in event["text"]
    assert event["fault"]["evidence"] == fault.evidence.name
