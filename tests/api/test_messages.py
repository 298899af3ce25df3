"""Every message as bytes and back."""

from __future__ import annotations

import functools
import math
import struct
from collections.abc import Callable
from enum import Enum
from fractions import Fraction
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
import pytest
from hypothesis import Phase as Phases, given, settings, strategies as st

from bioscara.api import framing, messages as m
from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory import (
    Goal,
    JointTrajectory,
    Point,
    Tolerance,
)
from bioscara.errors import ProtocolError
from bioscara.kinematics import Joints, Pose
from bioscara.model import ArmParameters, load_parameters
from bioscara.planning import Motion, Sample, Waypoint
from bioscara.planning.collision.arm_bodies import Body
from bioscara.planning.collision.scene import Box, Cylinder
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.planning.motions.jog_limitation import JogLimit, JogLimitation
from bioscara.report import CycleRecord, JointRecord, Phase
from bioscara.robot import tasks
from bioscara.robot.operations.running import Status
from bioscara.robot.tasks.task import Task
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.poses import NamedPose, TeachTable
from bioscara.robot.workspace.tools import Tool
from simulated import NAMES

ARM = load_parameters()
NAME = st.text("abc_-", max_size=6).map("n".__add__)
NUMBER = st.floats(-3.0, 3.0, allow_nan=False)
LENGTH = st.floats(0.001, 0.5, allow_nan=False)
SHAPE = Prism.between((-0.06, -0.04, -0.01), (0.06, 0.04, 0.004))
PART = st.floats(-0.9, 0.9)
POSE = st.builds(Pose, PART, PART, PART, PART)
JOINTS = st.builds(Joints, *[st.floats(-0.1, 0.1)] * 4)
TOOL = st.builds(Tool, NAME, POSE, st.just(0.1))
# Without a limit it has an infinite speed, which JSON leaves out.
LOAD = st.builds(Load, NAME, st.just(SHAPE), max_speed=st.sampled_from([None, 0.1]))
WAYPOINT = st.builds(Waypoint, POSE, st.just(Motion.LIN))
NUMBERS = st.lists(NUMBER, max_size=3).map(tuple)
POINT = st.builds(Point, NUMBER, *[NUMBERS] * 4)
NAMED = st.lists(NAME, max_size=3).map(tuple)
TRAJECTORY = st.builds(JointTrajectory, NAMED, st.lists(POINT, max_size=2).map(tuple), NUMBER)
TOLERANCES = st.lists(st.builds(Tolerance, NAME, *[NUMBER] * 3), max_size=2).map(tuple)
QUALITY = st.sampled_from(get_type_hints(JointRecord)["quality"])
VALUES: dict[Any, st.SearchStrategy[Any]] = {
    Pose: POSE,
    Load: LOAD,
    Pose | str: POSE | NAME,
    tasks.Home: st.builds(
        tasks.Home,
        st.none() | st.sampled_from([("j1",), ("j4", "j3")]),
        st.none() | st.integers(1, 255) | st.just({"j2": 9}),
        st.none() | st.integers(1, 100) | st.just({"j2": 9}),
    ),
    Tool: TOOL,
    Waypoint: WAYPOINT,
    JointVelocity: st.builds(JointVelocity, *[NUMBER] * 4),
    ToolVelocity: st.builds(ToolVelocity, *[NUMBER] * 4),
    JogLimitation: st.builds(
        JogLimitation, st.sampled_from(JogLimit), st.booleans(), NAME, NUMBER, NAME, NAME
    ),
    Box: st.builds(Box, NAME, st.just((0.0, 0.1, 0.2)), st.just((1.0, 1.1, 1.2)), NUMBER),
    Cylinder: st.builds(Cylinder, NAME, NUMBER, NUMBER, LENGTH, st.just(0.0), LENGTH),
    Body: st.builds(Body, st.just("gripper"), st.integers(0, 4), st.just((SHAPE,))),
    TeachTable: st.builds(
        TeachTable,
        st.just(Tool("fingers", Pose(0.0, 0.0, -0.1, 0.0), 0.1)),
        st.just(()),
        st.tuples(st.builds(NamedPose, NAME, JOINTS)),
        st.tuples(st.builds(Frame, NAME, POSE)),
    ),
    ArmParameters: st.just(ARM),
    Point: POINT,
    JointTrajectory: TRAJECTORY,
    Goal: st.builds(Goal, TRAJECTORY, TOLERANCES, TOLERANCES, NUMBER, st.booleans()),
    GripperGoal: st.builds(GripperGoal, *[NUMBERS] * 3),
    Sample: st.builds(Sample, *[NUMBERS] * 3),
    CycleRecord: st.builds(
        CycleRecord,
        st.sampled_from(Phase),
        NUMBER,
        NUMBER,
        NUMBER,
        st.integers(0, 9),
        NUMBER,
        st.tuples(st.builds(JointRecord, *[NUMBER] * 5, st.integers(0, 255), QUALITY, NUMBER)),
        progress=NUMBER,
    ),
    dict[str, Any]: st.dictionaries(NAME, NUMBER | NAME | st.booleans() | st.none(), max_size=3),
    float: NUMBER,
    int: st.integers(0, 1 << 40),
    str: st.text(st.characters(codec="utf-8"), max_size=20),
    bool: st.booleans(),
    bytes: st.binary(max_size=20),
}


@functools.cache
def strategy(kind: Any) -> st.SearchStrategy[Any]:  # noqa: PLR0912  a type each
    """Return values of the type of a field."""
    origin, inner = get_origin(kind), get_args(kind)
    if kind in VALUES:
        found = VALUES[kind]
    elif origin is Annotated:
        limits = kind.__metadata__[0].extra_json_schema or {}
        if "minimum" in limits:
            found = st.floats(limits["minimum"], limits["maximum"])
        elif "enum" in limits:
            found = st.sampled_from(limits["enum"])
        else:
            found = NAME if inner[0] is str else strategy(inner[0])
    elif kind is type(None):
        found = st.none()
    elif isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        fields = {field.name: strategy(field.type) for field in msgspec.structs.fields(kind)}
        found = st.builds(kind, **fields)
    elif isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields"):
        found = st.builds(kind, *map(strategy, get_type_hints(kind).values()))
    elif origin is tuple and inner[1:] == (Ellipsis,):
        found = st.lists(strategy(inner[0]), max_size=2).map(tuple)
    elif origin is tuple:
        found = st.tuples(*map(strategy, inner))
    elif origin is dict:
        found = st.dictionaries(*map(strategy, inner), max_size=2)
    elif isinstance(kind, type) and issubclass(kind, Enum):
        found = st.sampled_from(kind)
    elif origin is Literal:
        found = st.sampled_from(inner)
    else:
        # Of the largest unions a few: each of their types is a test of its own.
        assert inner, f"no values of {kind}"
        found = st.one_of(*map(strategy, inner[:8]))
    return found


def leaves(base: type[Any]) -> set[type[Any]]:
    """Return the classes of the package below a base that have none below."""
    below = base.__subclasses__()
    if not below:
        return {base} if base.__module__.startswith("bioscara.") else set()
    return set().union(*map(leaves, below))


CLASSES = sorted({*leaves(m.ApiMessage), *leaves(Task)}, key=lambda kind: kind.__name__)


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
@settings(max_examples=10, phases=[Phases.generate])
@given(data=st.data())
def test_a_message_comes_back_as_it_was_sent(kind: type[Any], data: st.DataObject) -> None:
    message = data.draw(strategy(kind))  # type: ignore[arg-type]
    for encode, decoder in (
        (framing.encode_packed, msgspec.msgpack.Decoder),
        (framing.encode_json, msgspec.json.Decoder),
    ):
        back = decoder(kind).decode(encode(message))
        assert type(back) is kind
        assert back == message


def test_every_command_and_result_is_one_that_can_be_sent() -> None:
    for base, union in ((m.Command, m.AnyCommand), (Task, m.AnyTask), (m.Result, m.AnyResult)):
        assert leaves(base) == set(get_args(union))
    assert set(tasks.TASKS) == set(get_args(tasks.ArmTask)) < set(get_args(m.AnyTask))


def test_queries_stop_pause_and_resume_need_no_lease() -> None:
    for kind in CLASSES:
        if issubclass(kind, m.Query):
            assert not kind.needs_lease
    assert m.Start.needs_lease
    assert not m.StopAll.needs_lease
    assert not m.Pause.needs_lease
    assert not m.Resume.needs_lease


@pytest.mark.parametrize(
    "value",
    [0.5, np.float64(0.5), np.float32(0.5), np.array(0.5), Fraction(1, 2)],
    ids=lambda value: type(value).__name__,
)
def test_numbers_of_any_kind_are_sent(value: Any) -> None:
    request = m.ClientRequest(id=1, command=m.SetSpeedOverride(value))
    back = framing.from_client.decode(framing.encode_packed(request))
    assert back.command.share == 0.5
    assert framing.json_from_client.decode(framing.encode_json(request)).command.share == 0.5


@pytest.mark.parametrize("encode", [framing.encode_packed, framing.encode_json])
def test_names_of_files_that_are_not_utf8_cost_no_message(
    encode: Callable[[object], bytes],
) -> None:
    def answer(name: str) -> m.Response:
        return m.Response(1, m.FlightRecordFile(name, b"\xff\x00"))

    assert encode(answer("caf\udce9.mcap")) == encode(answer("caf\\udce9.mcap"))


def test_whole_numbers_of_numpy_stay_whole() -> None:
    request = m.ClientRequest(id=1, command=m.Cancel(np.int64(7)))  # type: ignore[arg-type]
    assert framing.from_client.decode(framing.encode_packed(request)).command.goal == 7
    with pytest.raises(TypeError, match="cannot be sent"):
        framing.encode_packed(object())


def test_an_unknown_number_is_nan_and_null() -> None:
    goal = m.GoalValue(1, "home()", "me", Status.RUNNING, math.nan)
    packed = msgspec.msgpack.decode(framing.encode_packed(goal), type=m.GoalValue)
    assert math.isnan(packed.progress)
    assert b'"progress":null' in framing.encode_json(goal)


NUMBERED = st.builds(m.GetGoal, st.integers(0, 1 << 40)) | st.builds(m.GetFlightRecord, NAME)


@given(commands=st.lists(NUMBERED, max_size=6), data=st.data())
def test_messages_in_pieces_of_any_size_come_whole(
    commands: list[m.AnyCommand], data: st.DataObject
) -> None:
    requests = [m.ClientRequest(id=n, command=each) for n, each in enumerate(commands)]
    stream = b"".join(map(framing.packed, requests))
    frames = framing.MessageSplitter(framing.REQUEST_MAX)
    found: list[Any] = []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        found += [framing.from_client.decode(each) for each in frames.feed(stream[:size])]
        stream = stream[size:]
    assert found == requests


def test_messages_that_were_not_taken_are_left_for_the_next_call() -> None:
    frames = framing.MessageSplitter(100)
    three = b"".join(framing.framed(bytes([each])) for each in (1, 2, 3))
    assert next(frames.feed(three)) == b"\x01"
    assert list(frames.feed(b"")) == [b"\x02", b"\x03"]


def test_a_message_that_is_too_long_is_refused_before_it_comes() -> None:
    frames = framing.MessageSplitter(100)
    assert list(frames.feed(struct.pack(">I", 100) + bytes(100))) == [bytes(100)]
    with pytest.raises(ProtocolError, match="101 bytes is announced, and at most 100"):
        list(frames.feed(struct.pack(">I", 101)))
    assert NAMES
