"""Under any controller, the tool keeps to its speed limit."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.limits.tool_speed import ToolSpeedCap
from bioscara.robot import kinematics_of
from control.control_stack import NAMES, PARAMETERS, World

MIDDLE = {"j1": 0.0, "j2": 0.2, "j3": 0.3, "j4": 0.0}
FAR = (1.5, 0.25, 1.5, -1.0)


def capped(limit: float) -> tuple[World, ToolSpeedCap]:
    world = World(at=MIDDLE)
    guards = tuple(world.manager.limiter.joints.values())
    cap = ToolSpeedCap(guards, kinematics_of(PARAMETERS).tool_speed, limit)
    world.manager.limiter.stages = (cap,)
    return world, cap


def tool_speeds(
    world: World, interface: str, values: tuple[float, ...], cycles: int
) -> list[float]:
    """Command ``values`` and return the speed of the commanded tool in each cycle [m/s]."""
    forward = world.load(
        "forward", ForwardCommandController.TYPE, joints=NAMES, interface_name=interface
    )
    assert isinstance(forward, ForwardCommandController)
    world.switch("forward")
    forward.command(values)
    guards, kinematics = world.manager.limiter.joints, kinematics_of(PARAMETERS)
    places, times = [], []
    for _ in range(cycles):
        cycle = world.loop.step()
        places.append(kinematics.forward([guard.reference for guard in guards.values()]))
        times.append(cycle.time)
    return [
        math.dist(one[:3], two[:3]) / (later - sooner)
        for (one, two), (sooner, later) in zip(pairwise(places), pairwise(times), strict=True)
    ]


@pytest.mark.parametrize("limit", [0.05, 0.25])
def test_a_step_of_positions_is_covered_at_the_speed_of_the_tool(limit: float) -> None:
    world, cap = capped(limit)
    speeds = tool_speeds(world, "position", FAR, 2500)
    assert max(speeds) <= limit * 1.01
    assert max(speeds) > 0.9 * limit
    assert cap.interventions > 10
    for axis, goal in zip(world.hardware.axes, FAR, strict=True):
        assert axis.position.value == pytest.approx(goal, abs=5e-3)
    assert not world.supervisor.faults


def test_velocities_are_slowed_down_together() -> None:
    world, _ = capped(0.1)
    kinematics, guards = kinematics_of(PARAMETERS), world.manager.limiter.joints
    tool_speeds(world, "velocity", (0.5, 0.0, 0.5, 0.5), 30)
    for _ in range(70):
        world.loop.step()
        commands = world.hardware.commands
        speeds = [commands[f"{name}/velocity"].value for name in NAMES]
        assert kinematics.tool_speed([guard.here for guard in guards.values()], speeds) <= 0.101
        assert speeds[0] == pytest.approx(speeds[2], rel=0.05)


def test_full_speed_is_not_touched() -> None:
    world, cap = capped(math.inf)
    assert max(tool_speeds(world, "position", FAR, 300)) > 0.3
    assert cap.interventions == 0


@pytest.mark.parametrize("interface", ["position", "velocity"])
def test_nothing_passes_while_the_speed_of_the_tool_is_unknown(interface: str) -> None:
    world, cap = capped(0.25)
    tool_speeds(world, interface, FAR if interface == "position" else (0.5, 0.01, 0.5, 0.5), 30)
    guards, commands = world.manager.limiter.joints, world.hardware.commands
    before = {name: guard.reference for name, guard in guards.items()}
    asked = {name: commands[f"{name}/{interface}"].value for name in NAMES}
    assert any(guard.speed for guard in guards.values())
    cap.speed_of = lambda *_: math.nan
    interventions = cap.interventions
    world.manager.limiter.apply(world.loop.period, world.manager.driving)
    assert cap.interventions == interventions + 1
    for name, guard in guards.items():
        still = before[name] if interface == "position" else 0.0
        assert commands[f"{name}/{interface}"].value == pytest.approx(still, abs=1e-9), asked
        assert guard.speed == 0.0
