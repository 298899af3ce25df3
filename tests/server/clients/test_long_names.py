"""Names of any length in messages: neither the answer nor an event that is kept repeats them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings, strategies as st

from bioscara.api import framing, messages as m
from bioscara.api.failures import failure_of
from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point
from bioscara.errors import BioscaraError
from bioscara.printing import LONGEST
from bioscara.robot import tasks
from entries import entry
from served import RawClient, arm_served, eventually

LENGTH = 100_000
SENT = 2 * 4 * LONGEST
"""Longest answer that refuses a request, as sent [byte]: its text, and the data of the error.

A character has up to four bytes.
"""
_TRAJECTORY = JointTrajectory(("j1",), (Point(1.0, (0.0,)),))
TYPE = "joint_trajectory_controller/JointTrajectoryController"


def unchecked(task: tasks.Home, **values: Any) -> tasks.Home:
    """Return a task as a client of another language may send it."""
    for name, value in values.items():
        msgspec.structs.force_setattr(task, name, value)
    return task


COMMANDS: dict[str, Callable[[str], m.AnyCommand]] = {
    "load": lambda name: m.LoadController(name=name, type="a/B"),
    "type": lambda name: m.LoadController(name="a", type=name),
    "parameters": lambda name: m.LoadController(name="a", type=TYPE, parameters={name: 1}),
    "configure": m.ConfigureController,
    "cleanup": m.CleanupController,
    "unload": m.UnloadController,
    "activate": lambda name: m.SwitchControllers((name,)),
    "deactivate": lambda name: m.SwitchControllers((), (name,)),
    "component": lambda name: m.SetHardwareState(name, "active"),
    "state": lambda name: m.SetHardwareState("bioscara_arm", name),
    "follow": lambda name: m.FollowGoal(controller=name, goal=Goal(_TRAJECTORY)),
    "stream": lambda name: m.StreamTrajectory(controller=name, trajectory=_TRAJECTORY),
    "gripper": lambda name: m.SendGripperGoal(name, GripperGoal((0.05,), (1.0,))),
    "homing": lambda name: m.TriggerHoming(name, "j1", 1.0),
    "values": lambda name: m.CommandController(name, (0.0,)),
    "cancel": lambda name: m.CancelControllerGoal(name, 1),
    "scaling": lambda name: m.SetControllerScaling(name, 1.0),
    "changed parameters": lambda name: m.SetControllerParameters(name, {}),
    "query": lambda name: m.QueryController(name, 0.0),
    "overlay": lambda name: m.SetParameters(overlay=name, revision=1),
    "record": m.GetFlightRecord,
    "report": m.Report,
    "pose": lambda name: m.Start(task=tasks.MoveNamed(name=name)),
    "plan": lambda name: m.MakePlan(tasks.MoveNamed(name=name)),
    "tool": lambda name: m.Start(task=tasks.SetTool(name=name)),
    "joints": lambda name: m.Start(task=unchecked(tasks.Home(), joints=(name,))),
    "sensitivity": lambda name: m.Start(task=unchecked(tasks.Home(), sensitivity={name: 1})),
    "fault": lambda name: m.SimulateFault(name, "j1"),
    "joint": lambda name: m.SimulateFault("reset", name),
}
"""Requests that are refused because of a name."""
LONG_NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8).map(
    lambda text: (text * LENGTH)[: LENGTH // 4]
)


@pytest.fixture(scope="module")
def client() -> Iterator[RawClient]:
    with arm_served(), RawClient("long") as made:
        made.request(m.Subscribe(events_after=0))
        yield made


@pytest.fixture(scope="module")
def epoch(client: RawClient) -> int:
    return client.acquire()


def check(client: RawClient, command: m.AnyCommand, epoch: int) -> None:
    answer = client.answer(client.begin(command, epoch))
    if isinstance(answer, m.Response):
        # Accepted, and refused when it began or once it runs.
        assert isinstance(answer.result, m.Accepted)
        goal = answer.result.goal.goal
        eventually(lambda: client.event("goal_ended", goal=goal))
        value = client.request(m.GetGoal(goal)).goal
        assert value.failure is not None
        answer = m.RequestFailed(None, value.failure)
    assert len(answer.failure.text) <= LONGEST
    assert answer.failure.text.isprintable()
    assert len(framing.packed(answer)) <= SENT
    client.request(m.GetState())
    assert all(len(framing.packed(event)) <= 2 * SENT for event in client.events)
    client.events.clear()


def test_an_answer_does_not_repeat_a_long_name(client: RawClient, epoch: int) -> None:
    for what, command in COMMANDS.items():
        with entry(what):
            check(client, command("x" * LENGTH), epoch)


@settings(deadline=None)
@given(what=st.sampled_from(sorted(COMMANDS)), name=LONG_NAMES)
def test_an_answer_repeats_no_long_name_of_any_characters(
    client: RawClient, epoch: int, what: str, name: str
) -> None:
    check(client, COMMANDS[what](name), epoch)


def test_a_text_keeps_its_begin_and_its_end() -> None:
    failure = failure_of(BioscaraError("what: " + "x" * LENGTH + "; the remedy"))
    assert failure.text.startswith("what: xxx")
    assert failure.text.endswith("xxx; the remedy")
    assert len(failure.text) == LONGEST
    short = "x" * LONGEST
    assert str(BioscaraError(short)) == short
