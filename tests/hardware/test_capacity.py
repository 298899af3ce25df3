"""Capacity of the bus: predicted, and a load beyond it refused before anything moves."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product

import pytest
from hypothesis import given, strategies as st

from bioscara import Robot
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.errors import ModeSwitchError
from bioscara.hardware import LifecycleState, Mode
from bioscara.hardware.bus_budget import Capacity, highest_rate
from bioscara.robot.connection.stack import HOLD
from bioscara.sim import FirmwareBus, SimulatedArm
from control.control_stack import NAMES, NEAR, PARAMETERS, World as Stack

AT = {"j1": -2.5, "j2": 0.30, "j3": 2.0, "j4": 2.0}
FORWARD = "forward_command_controller/ForwardCommandController"


@pytest.mark.parametrize("frequency", [100e3, 400e3])
@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_the_bus_time_of_a_cycle_is_predicted_within_five_percent(
    frequency: float, *, v1: bool
) -> None:
    world = Stack(v1=v1, frequency=frequency, at=AT)
    capacity = Capacity(world.hardware.joints, world.clock)
    for driven, others in product(range(5), (Mode.NONE, Mode.POSITION)):
        modes = [Mode.VELOCITY] * driven + [others] * (4 - driven)
        for axis, mode in zip(world.hardware.axes, modes, strict=True):
            axis.change(mode)
            axis.position_command.value, axis.velocity_command.value = axis.position.value, 0.0
        for _ in range(2):
            world.hardware.read(world.clock.now(), 0.01)
            world.hardware.write(world.clock.now(), 0.01)
        foretold = capacity.cycle_time(zip(world.hardware.joints, modes, strict=True))
        assert foretold == pytest.approx(world.hardware.bus_time, rel=0.05)


@given(st.floats(1e-6, 0.04))
def test_the_highest_rate_leaves_the_bus_room_for_a_repetition(bus_time: float) -> None:
    assert highest_rate(bus_time) * bus_time <= 0.85 * (1 + 1e-9)


@contextmanager
def homed(frequency: float, rate: int | None = None, *, v1: bool = False) -> Iterator[Robot]:
    arm = SimulatedArm(v1=v1, positions=NEAR, frequency=frequency)
    with Robot(FirmwareBus(arm), arm.clock, PARAMETERS, "capacity", rate=rate) as robot:
        robot.home()
        yield robot


def forward(robot: Robot, name: str, kind: str, *joints: str) -> ForwardCommandController:
    """Load a controller that passes commands on, for all joints unless some are named."""
    manager = robot.runner.arm.stack.manager
    values = {"joints": joints or NAMES, "interface_name": kind}
    made = manager.load(name, FORWARD, values)
    assert isinstance(made, ForwardCommandController)
    manager.configure(name)
    return made


@pytest.mark.parametrize(("v1", "rate", "remedy"), [(False, None, "and velocity"), (True, 100, "")])
def test_velocities_that_the_bus_cannot_carry_are_refused_before_anything_moves(
    rate: int | None, remedy: str, *, v1: bool
) -> None:
    with homed(100e3, rate, v1=v1) as robot:
        stack = robot.runner.arm.stack
        forward(robot, "velocities", "velocity")
        with pytest.raises(ModeSwitchError) as caught:
            stack.use("velocities", robot.clock.now())
        text = str(caught.value)
        assert "j1, j2, j3, j4 by velocity alone" in text
        assert "the loop runs at 100 Hz" in text
        assert f"claim position{' ' + remedy if remedy else ''}" in text
        taken = float(text.split("would take ")[1].split(maxsplit=1)[0])
        carried = int(text.split("could carry ")[1].split(maxsplit=1)[0])
        assert taken == pytest.approx(10.5 if v1 else 11.88, rel=0.02)
        assert carried == pytest.approx(850.0 / taken, abs=1.0)
        assert stack.manager.controller("velocities").state is LifecycleState.INACTIVE
        assert all(axis.mode is not Mode.VELOCITY for axis in stack.hardware.axes)
        robot.move_joints(tuple(AT.values()))
        assert robot.faults == ()


@pytest.mark.parametrize(
    ("v1", "frequency", "rate"),
    [(False, 400e3, None), (True, 400e3, 100), (True, 100e3, None), (False, 100e3, 70)],
)
def test_velocities_that_the_bus_can_carry_are_followed_without_an_overrun(
    frequency: float, rate: int | None, *, v1: bool
) -> None:
    with homed(frequency, rate, v1=v1) as robot:
        robot.move_joints(tuple(AT.values()))
        stack = robot.runner.arm.stack
        velocities = forward(robot, "velocities", "velocity")
        stack.use("velocities", robot.clock.now())
        velocities.command((0.1, 0.0, -0.1, 0.1))
        stack.loop.restart()
        before = stack.loop.statistics.overruns
        for _ in range(100):
            stack.loop.step()
        assert stack.loop.statistics.overruns == before
        assert robot.faults == ()
        assert robot.state.velocities[0] == pytest.approx(0.1, rel=0.2)


def test_fewer_velocities_fit_and_joints_that_join_them_are_counted_too() -> None:
    with homed(100e3) as robot:
        stack, now = robot.runner.arm.stack, robot.clock.now
        forward(robot, "one", "velocity", "j1")
        forward(robot, "others", "position", "j2", "j3", "j4")
        stack.use("one", now())
        with pytest.raises(ModeSwitchError, match="j1 by velocity alone"):
            stack.manager.switch(now(), ("others",))
        stack.manager.switch(now(), (), ("one",))
        stack.manager.switch(now(), ("others",))


def test_a_stop_is_never_refused_for_the_bus() -> None:
    with homed(100e3) as robot:
        stack, now = robot.runner.arm.stack, robot.clock.now
        forward(robot, "one", "velocity", "j1")
        stack.use("one", now())
        stack.supervisor.stop(now())
        assert stack.manager.controller(HOLD).state is LifecycleState.ACTIVE
        assert stack.hardware.state is LifecycleState.ACTIVE
