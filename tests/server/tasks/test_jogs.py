"""Jogs of clients: the first velocity applies at once, and one that expires stays at rest."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise

import pytest
from hypothesis import given, strategies as st

from bioscara.api import messages as m
from bioscara.errors import InvalidArgumentError, JogExpiredError, LimitError
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.server.serve import Served
from bioscara.server.tasks.jog_stream import LONGEST, SHORTEST, JogStream
from programs import LIMIT
from served import RawClient, arm_served, eventually

TURN, RAISE = JointVelocity(0.3), ToolVelocity(z=0.02)


def until(condition: Callable[[], bool]) -> None:
    """Wait for a condition, and see it a millisecond later at most."""
    deadline = time.monotonic() + LIMIT
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(1e-3)


class FakeTime:
    """The time of a stream."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@given(
    st.floats(SHORTEST, LONGEST),
    st.lists(st.tuples(st.sampled_from(["beat", "look"]), st.floats(0.0, 0.7)), max_size=20),
)
def test_a_jog_moves_until_the_first_gap_and_never_after(
    expiry: float, acts: list[tuple[str, float]]
) -> None:
    clock = FakeTime()
    stream, beat, dead = JogStream(expiry, TURN, clock), clock.now, False
    for act, pause in acts:
        clock.now += pause
        # Even if nothing has read the stream within the gap.
        dead = dead or clock.now - beat > expiry
        if dead:
            with pytest.raises(JogExpiredError):
                stream.set(RAISE) if act == "beat" else stream()
        elif act == "beat":
            stream.set(RAISE)
            beat = clock.now
        else:
            assert stream() in {TURN, RAISE}


def test_without_an_expiry_the_arm_rests_and_moves_on() -> None:
    clock = FakeTime()
    stream = JogStream(clock=clock)
    assert stream() == JointVelocity()
    stream.set(TURN)
    assert stream() == TURN
    clock.now += 0.16
    assert stream() == JointVelocity()
    stream.set(RAISE)
    assert stream() == RAISE
    stream.end()
    assert stream() is None


def test_an_ended_jog_takes_no_velocity_and_does_not_expire() -> None:
    clock = FakeTime()
    stream = JogStream(0.25, TURN, clock)
    stream.end()
    clock.now += 1.0
    assert stream() is None
    with pytest.raises(InvalidArgumentError, match="begin another one"):
        stream.set(TURN)


def begun(client: RawClient, epoch: int, task: m.Jog) -> int:
    """Begin a jog; return its number."""
    accepted = client.request(m.Start(task=task), epoch)
    return int(accepted.goal.goal)


def rests(served: Served) -> bool:
    """Return whether the commands stand and no operation runs."""
    before = served.owner.sample
    eventually(lambda: served.owner.sample.cycle >= before.cycle + 10)
    after = served.owner.sample
    return after.commands == before.commands and not after.moving


def test_an_expired_jog_rests_says_so_and_refuses_late_velocities() -> None:
    with arm_served(speed=5.0) as served, RawClient() as client:
        epoch = client.acquire()
        client.request(m.Subscribe(events_after=client.welcome.last_event))
        before = served.owner.sample.commands
        goal = begun(client, epoch, m.Jog(expiry=0.1, joints=TURN))
        ended = client.event("goal_ended", goal=goal).goal
        assert ended is not None
        assert ended.failure is not None
        assert (ended.status, ended.failure.error) == ("cancelled", "JogExpiredError")
        assert "no velocity arrived for 0.1 s" in ended.failure.text
        assert served.owner.sample.commands[0] > before[0]
        assert rests(served)
        for _ in range(3):
            with pytest.raises(JogExpiredError, match="begin another jog") as caught:
                client.request(m.SetJogVelocity(goal=goal, joints=TURN), epoch)
            assert caught.value.expiry == 0.1
        assert rests(served)
        # Only another press moves the arm.
        before = served.owner.sample.commands
        other = begun(client, epoch, m.Jog(expiry=0.5, tool=RAISE))
        until(lambda: served.owner.sample.commands[1] > before[1])
        client.request(m.EndJog(other), epoch)
        assert client.event("goal_ended", goal=other).goal.status == "succeeded"  # type: ignore[union-attr]


def test_velocities_keep_a_jog_alive_beyond_its_expiry() -> None:
    with arm_served(speed=1.0) as served, RawClient() as client:
        epoch = client.acquire()
        goal = begun(client, epoch, m.Jog(expiry=0.5, joints=TURN))
        until = time.monotonic() + 1.0
        while time.monotonic() < until:
            client.request(m.SetJogVelocity(goal=goal, joints=TURN), epoch)
        assert served.owner.sample.moving == ("jog()",)
        assert served.owner.sample.velocities[0] > 0.1
        client.request(m.EndJog(goal), epoch)
        eventually(lambda: not served.owner.sample.moving)


@pytest.mark.realtime
def test_the_first_velocity_commands_the_joints_within_forty_milliseconds() -> None:
    with arm_served(speed=1.0) as served, RawClient() as client:
        epoch = client.acquire()
        taken = []
        for turn in range(12):
            before, begin = served.owner.sample.commands, time.monotonic()
            velocity = JointVelocity(0.3 if turn % 2 else -0.3)
            number = client.begin(m.Start(task=m.Jog(expiry=0.3, joints=velocity)), epoch)
            until(lambda: served.owner.sample.commands != before)  # noqa: B023  called in this turn
            taken.append(time.monotonic() - begin)
            answer = client.answer(number)
            assert isinstance(answer, m.Response)
            assert isinstance(answer.result, m.Accepted)
            client.request(m.EndJog(answer.result.goal.goal), epoch)
            until(lambda: not served.owner.sample.moving)
        assert sorted(taken)[-2] < 0.040


@pytest.mark.realtime
def test_the_end_of_a_jog_slows_the_joints_in_the_next_cycles() -> None:
    with arm_served(speed=1.0) as served, RawClient() as client:
        epoch = client.acquire()
        goal = begun(client, epoch, m.Jog(expiry=0.5, joints=TURN))
        for _ in range(8):
            time.sleep(0.1)
            client.request(m.SetJogVelocity(goal=goal, joints=TURN), epoch)
        commands: list[tuple[int, float]] = []

        def observe(_: object) -> None:
            sample = served.owner.sample
            commands.append((sample.cycle, sample.commands[0]))

        served.robot.runner.observers = (*served.robot.runner.observers, observe)
        until(lambda: len(commands) > 5)
        client.request(m.EndJog(goal), epoch)
        ended = served.owner.sample.cycle
        until(lambda: not served.owner.sample.moving)
    steps = [(cycle, after - before) for (_, before), (cycle, after) in pairwise(commands)]
    assert steps[0][1] > 0.25 * 0.01
    slower = next(cycle for cycle, step in steps if step < 0.999 * steps[0][1])
    assert slower - ended <= 6, "more than 60 ms at 100 Hz"


@pytest.mark.parametrize("expiry", [0.0, 0.01, 0.6, -1.0])
def test_an_expiry_out_of_range_is_refused(expiry: float) -> None:
    with pytest.raises(LimitError, match="expiry of the jog"):
        JogStream(expiry, TURN)


def test_a_jog_that_cannot_be_is_refused_before_anything_moves() -> None:
    with arm_served() as served, RawClient() as client:
        epoch = client.acquire()
        for task in (
            m.Jog(expiry=0.25),
            m.Jog(expiry=0.25, joints=TURN, tool=RAISE),
            m.Jog(expiry=3.0, joints=TURN),
        ):
            with pytest.raises(InvalidArgumentError):
                client.request(m.Start(task=task), epoch)
        assert rests(served)
