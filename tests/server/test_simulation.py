"""Simulated faults and speed by the messages of an owner."""

from __future__ import annotations

import math
import time
from typing import Any

import pytest

from bioscara.api import messages as m
from bioscara.errors import (
    BioscaraError,
    InvalidArgumentError,
    LeaseError,
    LimitError,
    NotSupportedError,
)
from bioscara.remote import RemoteRobot
from bioscara.robot import tasks
from bioscara.robot.arm_methods import ArmMethods
from bioscara.server.serve import Served, ServeSettings, serving
from bioscara.sim import FirmwareBus
from served import (
    HALF,
    NAME,
    RawClient,
    arm_served,
    events_since,
    eventually,
    own_robot,
    runtime_folder,
)


def apply(client: RawClient, fault: str, value: float | None = None, joint: str = "") -> None:
    """Let the arm fail."""
    assert client.request(m.SimulateFault(fault, joint, value)) == m.Done()


def faults(client: RawClient) -> list[str]:
    """Return the names of the simulated faults that last."""
    return [each.fault for each in client.request(m.GetSimulation()).faults]


@pytest.mark.parametrize(
    ("fault", "value"),
    [("bus_stuck", 1.0), ("bus_loss", 0.9), ("bus_flips", 0.01), ("brown_out", 1.0)],
)
def test_the_arm_fails_and_recovers_once_the_fault_is_over(fault: str, value: float) -> None:
    with arm_served(speed=20.0) as served, RawClient() as client:
        epoch = client.acquire()
        client.request(m.Start(task=tasks.Enable()), epoch)
        eventually(lambda: served.owner.sample.enabled)
        apply(client, fault, value)
        eventually(lambda: served.robot.faults)
        apply(client, "clear")
        assert faults(client) == []
        with RemoteRobot(NAME) as robot:
            robot.acquire_lease(force=True)
            recovered(robot)
            if not math.isnan(sum(robot.state.positions)):
                robot.move_relative(z=0.002)


def test_a_power_cut_is_one_fault_with_one_cause() -> None:
    with arm_served(speed=20.0) as served, RawClient() as client:
        client.request(m.Start(task=tasks.Enable()), client.acquire())
        eventually(lambda: served.owner.sample.enabled)
        before = served.owner.events.last
        apply(client, "supply", 0.0)
        eventually(lambda: served.owner.sample.fault == "latched")
        (fault,) = client.request(m.GetFaults()).faults
        assert fault.fault == "POWER_LOST"
        assert "the joints do not acknowledge any more, j1 first; release" in fault.text
        told = [each.text for each in events_since(served, before) if each.what == "fault"]
        assert [text.split(":")[0] for text in told] == ["POWER_LOST"]
        apply(client, "clear")
        with RemoteRobot(NAME) as robot:
            robot.acquire_lease(force=True)
            recovered(robot)
        assert client.request(m.GetFaults()).faults == ()


def recovered(robot: ArmMethods) -> None:
    """Recover the arm: joints whose boot was disturbed may need a second attempt."""
    for attempt in range(5):
        try:
            robot.acknowledge()
            robot.recover()
        except BioscaraError:
            if attempt == 4:
                raise
        else:
            return


def test_a_client_that_connects_later_sees_the_simulated_faults() -> None:
    with arm_served(speed=20.0) as served, RawClient() as client:
        client.request(m.Subscribe(events_after=client.welcome.last_event))
        begin = served.owner.sample.time
        apply(client, "freeze_encoder", joint="j3")
        apply(client, "obstacle", 0.9, "j3")
        assert client.event("simulation").text == "raw simulates: j3 freeze_encoder 1"
        with RawClient(name="later") as other:
            state = other.request(m.GetSimulation())
        assert (state.available, state.real_time_factor) == (True, 20.0)
        assert [(each.fault, each.joint, each.value) for each in state.faults] == [
            ("freeze_encoder", "j3", 1.0),
            ("obstacle", "j3", 0.9),
        ]
        assert begin <= state.faults[0].since <= served.owner.sample.time
        apply(client, "clear_obstacles", joint="j3")
        assert faults(client) == ["freeze_encoder"]


def test_a_second_client_lets_the_arm_fail_while_the_first_one_moves_it() -> None:
    with arm_served(speed=20.0) as served, RawClient("one") as one, RawClient("two") as two:
        task = tasks.MoveJoints(positions=(0.9, *HALF[1:]), velocity_scaling=0.05)
        begun = one.request(m.Start(task=task), one.acquire())
        eventually(lambda: served.robot.is_moving)
        apply(two, "hang", joint="j3")
        eventually(lambda: served.robot.faults)
        eventually(lambda: one.request(m.GetGoal(begun.goal.goal)).goal.failure)
        assert served.owner.lease.client == "one"


def test_a_fault_that_is_not_possible_is_refused_and_named() -> None:
    with arm_served(), RawClient() as client:
        for task, text in (
            (m.SimulateFault("hung", "j3"), "did you mean hang"),
            (m.SimulateFault("hang"), "hang is a fault of one joint; there are j1, j2, j3, j4"),
            (m.SimulateFault("obstacle", "j3"), r"obstacle needs a value: .* \[rad or m\]"),
        ):
            with pytest.raises(InvalidArgumentError, match=text):
                client.request(task)


def pace(served: Served) -> float:
    """Return the time of the arm that passes in a second."""
    begin, first = time.monotonic(), served.owner.sample.time
    time.sleep(0.5)
    return (served.owner.sample.time - first) / (time.monotonic() - begin)


@pytest.mark.realtime
def test_the_speed_of_time_can_be_chosen_while_the_arm_moves() -> None:
    with arm_served(speed=1.0) as served, RawClient() as client:
        epoch = client.acquire()
        goal = tuple(here + 0.4 for here in HALF[:1]) + HALF[1:]
        client.request(m.Start(task=tasks.MoveJoints(positions=goal, velocity_scaling=0.05)), epoch)
        for speed in (5.0, 0.5, 1.0):
            client.request(m.SetRealTimeFactor(speed), epoch)
            assert client.request(m.GetSimulation()).real_time_factor == speed
            assert pace(served) == pytest.approx(speed, rel=0.25)
        client.request(m.SetRealTimeFactor(20.0), epoch)
        eventually(lambda: not served.owner.sample.moving)
        assert served.owner.sample.positions[0] == pytest.approx(goal[0], abs=1e-3)


def test_a_speed_that_cannot_be_is_refused() -> None:
    with arm_served() as served, RawClient() as client:
        with pytest.raises(LeaseError):
            client.request(m.SetRealTimeFactor(2.0))
        epoch = client.acquire()
        for speed in (0.0, 0.05, 21.0, -1.0):
            with pytest.raises(LimitError, match="real_time_factor"):
                client.request(m.SetRealTimeFactor(speed), epoch)
        with pytest.raises(InvalidArgumentError):
            client.request(m.SetRealTimeFactor(math.nan), epoch)
        assert served.robot.runner.arm.session.clock.real_time_factor == 50.0  # type: ignore[attr-defined]


def test_a_program_chooses_faults_and_speed() -> None:
    with arm_served() as served, RemoteRobot(NAME) as robot:
        robot.simulate_fault("push", "j1", 1.0)
        robot.set_real_time_factor(20.0)
        state = robot.simulation
        clock: Any = served.robot.runner.arm.session.clock
        assert state.real_time_factor == clock.real_time_factor == 20.0
        assert [(each.fault, each.joint) for each in state.faults] == [("push", "j1")]
        robot.simulate_fault("clear")
        assert robot.simulation.faults == ()


def test_an_arm_that_is_simulated_elsewhere_refuses() -> None:
    with runtime_folder() as folder, own_robot(folder / "faults") as robot:
        # As the owner sees every arm that it does not simulate.
        bus = robot.runner.arm.session.bus
        assert isinstance(bus, FirmwareBus)
        robot.runner.arm.session.bus = FirmwareBus(bus.arm)
        with serving(robot, ServeSettings(NAME, "sim:x", evidence=folder)), RawClient() as client:
            epoch = client.acquire()
            state = client.request(m.GetSimulation())
            assert (state.available, state.faults) == (False, ())
            assert math.isnan(state.real_time_factor)
            with pytest.raises(NotSupportedError, match="real, or simulated by another process"):
                client.request(m.SetRealTimeFactor(2.0), epoch)
