"""A hardware component of an arm that is active, and its cycles."""

from __future__ import annotations

import pytest

from bioscara.hardware import ArmHardware, LifecycleState
from simulated import ARM, World

BOTH = pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
"""Joints of both versions."""
PERIOD = 0.01
"""Time of a cycle [s]."""


def unconfigured(*, v1: bool = False) -> tuple[World, ArmHardware]:
    """Return an arm that was just switched on, and its component."""
    world = World(v1=v1)
    return world, ArmHardware("arm", world.bus, world.arm.clock, ARM.joints)


def active(*, v1: bool = False, home: bool = False) -> tuple[World, ArmHardware]:
    """Return an arm, homed or not, and its component, active."""
    world, arm = unconfigured(v1=v1)
    if home:
        world.ready()
    arm.set_state(LifecycleState.ACTIVE)
    return world, arm


def switch(arm: ArmHardware, *start: str, stop: tuple[str, ...] = ()) -> None:
    """Claim interfaces, and give others up."""
    arm.prepare_command_mode_switch(start, stop)
    arm.perform_command_mode_switch(start, stop)


def cycles(
    world: World, arm: ArmHardware, count: int = 1, period: float = PERIOD
) -> list[Exception]:
    """Read and write in so many cycles; return the problems."""
    problems: list[Exception] = []
    for _ in range(count):
        start = world.arm.now()
        arm.read(start, period)
        arm.write(start, period)
        world.arm.clock.sleep_until(start + period)
        problems += arm.problems
    return problems
