"""Encoded messages have their original values, as the decoder of mcap-ros2-support reads them."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, strategies as st
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from bioscara.api.messages import Event, StateSample, TrajectoryValue
from bioscara.kinematics import Pose
from bioscara.recording.writing.rare_messages import event_message, trajectory_message
from bioscara.recording.writing.sample_messages import SampleMessages
from bioscara.rosbag.cdr import CdrReader
from bioscara.rosbag.texts import text_message
from bioscara.rosbag.topics import Topic, definition

NAMES = ("j1", "j2", "j3", "j4")
numbers = st.floats(-10.0, 10.0) | st.just(math.nan)
times = st.floats(0.0, 1e6)


def four(values: st.SearchStrategy[Any]) -> st.SearchStrategy[tuple[Any, ...]]:
    return st.tuples(values, values, values, values)


samples = st.builds(
    StateSample,
    cycle=st.integers(0, 2**40),
    time=times,
    names=st.just(NAMES),
    positions=four(numbers),
    velocities=four(numbers),
    qualities=four(st.integers(0, 3)),
    stamps=four(times | st.sampled_from((math.nan, -math.inf))),
    flags=four(st.integers(0, 2**16 - 1)),
    commands=four(numbers),
    pose=st.none()
    | st.builds(
        Pose,
        st.floats(-1.0, 1.0),
        st.floats(-1.0, 1.0),
        st.floats(-1.0, 1.0),
        st.floats(-math.pi, math.pi),
    ),
    width=numbers,
    enabled=st.booleans(),
    fault=st.just("clear"),
    paused=st.booleans(),
    speed_override=st.floats(0.0, 1.0),
    moving=st.just(()),
    late=st.floats(0.0, 1.0),
    bus_time=st.floats(0.0, 1.0),
    stale=st.booleans(),
    loads=st.none() | four(st.integers(0, 255) | st.just(math.nan)),
)


def decoded(topic: Topic, data: bytes) -> Any:
    """Return a message as another program reads it."""
    text = definition(topic.type_name).encode()
    schema = Schema(id=1, name=topic.type_name, encoding="ros2msg", data=text)
    decode = DecoderFactory().decoder_for("cdr", schema)
    assert decode is not None
    return decode(data)


def same(found: Any, given: Any) -> bool:
    return list(found) == pytest.approx(list(given), abs=1e-8, rel=0.0, nan_ok=True)


@given(samples, st.integers(0, 2**31 * 10**9 - 1))
def test_a_sample_is_read_as_it_was(sample: StateSample, stamp: int) -> None:
    made = SampleMessages(NAMES, None)
    made.encode(sample, 1)
    found = {topic: decoded(topic, data) for topic, data in made.encode(sample, stamp)}
    for message in found.values():
        assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
    states = found[Topic.JOINT_STATES]
    assert tuple(states.name) == NAMES
    assert same(states.position, sample.positions)
    assert same(states.velocity, sample.velocities)
    commands = found[Topic.JOINT_COMMANDS]
    assert list(commands.name) == [*NAMES, "gripper"]
    assert same(commands.position, [*sample.commands, sample.width])
    dynamic = found[Topic.DYNAMIC_JOINT_STATES]
    *joints, gripper, arm = dynamic.interface_values
    for index, joint in enumerate(joints):
        position, velocity, quality, flags, measured, load = joint.values
        assert same((position, velocity), (sample.positions[index], sample.velocities[index]))
        assert (quality, flags) == (sample.qualities[index], sample.flags[index])
        assert measured == pytest.approx(sample.stamps[index], abs=1e-6, nan_ok=True)
        assert same([load], [math.nan if sample.loads is None else sample.loads[index]])
    assert same(gripper.values, [sample.width])
    values = dict(zip(arm.interface_names, arm.values, strict=True))
    assert values.pop("time") == pytest.approx(sample.time, abs=1e-6)
    assert {name: getattr(sample, name) for name in values} == pytest.approx(values, abs=1e-6)
    if sample.pose is None:
        assert Topic.TOOL_POSE not in found
    else:
        pose = found[Topic.TOOL_POSE].pose
        place = pose.position
        assert same((place.x, place.y, place.z), sample.pose[:3])
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        assert yaw == pytest.approx(sample.pose.yaw, abs=1e-7)


@given(st.text().filter(lambda text: "\0" not in text))
def test_a_text_is_read_as_it_was(text: str) -> None:
    data = text_message(text)
    assert decoded(Topic.EVENTS, data).data == text
    assert CdrReader(data).string() == text


@given(st.integers(0, 5), st.booleans(), st.booleans())
def test_a_trajectory_is_read_as_it_was(count: int, fast: bool, smooth: bool) -> None:
    rows = tuple((0.1 * each, 0.2, -0.3, 0.4) for each in range(count))
    given = TrajectoryValue(
        NAMES,
        tuple(0.25 * each for each in range(count)),
        rows,
        rows if fast else None,
        rows if fast and smooth else None,
    )
    found = decoded(Topic.TRAJECTORIES, trajectory_message(given, "goal 3, part 1", 17))
    assert (found.header.frame_id, found.header.stamp.nanosec) == ("goal 3, part 1", 17)
    assert tuple(found.joint_names) == NAMES
    assert len(found.points) == count
    for point, row, time in zip(found.points, rows, given.times, strict=True):
        assert same(point.positions, row)
        assert same(point.velocities, row if fast else ())
        assert same(point.accelerations, row if fast and smooth else ())
        assert point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec == time


def test_an_event_is_an_entry_of_the_log() -> None:
    event = Event(number=7, time=1.0, wall=2.0, what="fault", text="j1: STALL", client="jog[12]")
    found = decoded(Topic.LOG, event_message(event, "left", 5 * 10**9 + 6))
    assert (found.stamp.sec, found.stamp.nanosec) == (5, 6)
    assert (found.level, found.name, found.msg) == (40, "left", "j1: STALL")
    assert (found.file, found.function, found.line) == ("fault", "jog[12]", 7)
