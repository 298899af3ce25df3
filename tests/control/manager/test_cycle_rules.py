"""The manager's cycle against the numbered rules of ros2_control, on the compiled firmware."""

from __future__ import annotations

import math

import pytest

from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.update_rate import Schedule
from bioscara.errors import (
    ConfigurationError,
    HardwareError,
    InvalidArgumentError,
    SwitchError,
)
from bioscara.hardware import LifecycleState, Mode
from control.control_stack import NAMES, World
from control.scripted_controller import Box, Wild, boom, boxed, release, wild

J1, J2 = "j1/position", "j2/position"


def test_rule_59_read_then_update_then_limit_then_write(world: World) -> None:
    a = wild(world, "a", J1, states=(J1,))
    seen: list[tuple[bool, float]] = []

    def look() -> None:
        fresh = world.hardware.states[J1].stamp
        seen.append((world.clock.now() - fresh < 0.011, a.command_handles[0].value))
        a.command_handles[0].value = 3.0

    a.hooks["update"] = look
    world.switch("a")
    start = world.axis("j1").previous
    world.run(0.02)
    assert seen[0][0]
    assert 0.0 < world.axis("j1").previous < 0.001
    assert math.isnan(start) or start < 0.001
    a.hooks.clear()
    world.switch(off=("a",))
    world.run(0.3)


def test_rule_59_active_hardware_alone_is_written_and_unconfigured_is_not_even_read() -> None:
    manager, box = boxed(a={"commands": ("g/position",)})
    controller = manager.controller("a")
    controller.hooks["update"] = lambda: box.steps.append("update")
    manager.switch(0.0, ("a",))
    for state, steps in (
        (LifecycleState.ACTIVE, ["read", "update", "write"]),
        (LifecycleState.INACTIVE, ["read"]),
        (LifecycleState.UNCONFIGURED, []),
    ):
        manager.set_hardware_state("box", state, 0.0)
        box.steps.clear()
        manager.cycle(0.01, 0.01)
        assert box.steps == steps
        assert not manager.failures


@pytest.mark.parametrize(
    ("asked", "got"), [(0, 100), (1000, 100), (50, 50), (33, 100 / 3), (70, 100), (60, 50)]
)
def test_rule_60_update_rates(world: World, asked: int, got: float) -> None:
    a = wild(world, "a", states=(J1,), update_rate=asked)
    world.switch("a")
    world.run(1.0)
    assert len(a.periods) == pytest.approx(got, abs=1)
    assert a.periods[0] == a.nominal_period == pytest.approx(1 / got)
    assert sum(a.periods[1:]) == pytest.approx(1.0, abs=2 / got)
    said = [each for each in world.manager.warnings if each.startswith(f"a: update_rate {asked} ")]
    assert bool(said) == (asked not in (0, 50))


def test_rule_60_a_late_cycle_brings_an_update_that_is_nearer_now_than_later() -> None:
    schedule = Schedule(100, 25)
    assert schedule.due(0.01) == 0.04
    assert [schedule.due(0.01), schedule.due(0.024)] == [0.0, 0.0]
    assert schedule.due(0.01) == pytest.approx(0.044)
    assert [schedule.due(0.01), schedule.due(0.025)] == [0.0, pytest.approx(0.035)]


@pytest.mark.parametrize("rate", [-1, 10_001])
def test_rates_that_no_cycle_has_are_refused(world: World, rate: int) -> None:
    with pytest.raises(ConfigurationError, match=f"rate {rate} Hz is outside 20 .. 10000 Hz"):
        ControllerManager((world.hardware,), Limiter(joint_limiters((world.hardware,))), rate)
    with pytest.raises(ConfigurationError, match="update_rate"):
        world.manager.load("x", "test/Wild", {"update_rate": rate})
    for period in (0.0, -0.01, math.nan):
        with pytest.raises(InvalidArgumentError, match=r"a cycle takes time|not a finite number"):
            world.manager.cycle(world.clock.now(), period)


def test_rule_61_an_arm_that_cannot_be_reached_deactivates_all_its_controllers() -> None:
    world = World(at={"j1": 0.0})
    commander, reader = wild(world, "a", J1), wild(world, "reader", states=(J1,))
    world.switch("a", "reader")
    for name in NAMES:
        world.arm.set_power(name, on=False)
    manager = world.manager
    for _ in range(20):
        world.clock.sleep_until(world.clock.now() + 0.01)
        manager.cycle(world.clock.now(), 0.01)
        if manager.failures:
            break
    failure = manager.failures[0]
    assert (failure.source, failure.deactivated) == ("bioscara_arm", ("a", "reader"))
    assert "no joint can be reached" in str(failure.cause)
    assert (commander.state, reader.state) == (LifecycleState.INACTIVE, LifecycleState.INACTIVE)
    assert not world.hardware.available
    assert all(each.owner is None for each in manager.claims.commands.values())


@pytest.mark.parametrize("step", ["read", "write"])
@pytest.mark.parametrize("error", [HardwareError, ZeroDivisionError])
@pytest.mark.parametrize(
    ("more", "after"), [((), LifecycleState.UNCONFIGURED), (("error",), LifecycleState.FINALIZED)]
)
def test_rule_61_62_hardware_that_fails_leaves_other_hardware_alone(
    step: str, error: type[Exception], more: tuple[str, ...], after: LifecycleState
) -> None:
    world = World(home=False)
    box = Box()
    box.error = error
    manager = ControllerManager(
        (world.hardware, box), Limiter(joint_limiters((world.hardware, box))), 100
    )
    for name, states, commands in (
        ("on arm", (J1,), ("j1/home",)),
        ("on box", (), ("g/position",)),
        ("reads both", (J1, "g/switch"), ()),
    ):
        manager.load(name, "test/Wild", {"commands": commands, "states": states})
        manager.configure(name)
    manager.switch(world.clock.now(), ("on arm", "on box", "reads both"))
    manager.cycle(world.clock.now(), 0.01)
    assert not manager.failures
    box.breaks.update((step, *more))
    world.clock.sleep_until(world.clock.now() + 0.01)
    manager.cycle(world.clock.now(), 0.01)
    failure = manager.failures[0]
    assert (failure.source, failure.deactivated) == ("box", ("on box", "reads both"))
    assert str(failure.cause) == f"{step} failed"
    if more:
        chained = manager.failures[1].cause
        assert (str(chained), chained.__context__) == ("error failed", failure.cause)
    assert box.state is after
    _, gone = manager.list_hardware_components()
    assert not any(each.is_available for each in gone.state_interfaces)
    assert math.isnan(box.states["g/position"].value)
    assert manager.controller("on arm").state is LifecycleState.ACTIVE
    world.clock.sleep_until(world.clock.now() + 0.01)
    manager.cycle(world.clock.now(), 0.01)
    assert not manager.failures
    assert box.state is after


def test_hardware_whose_modes_cannot_be_changed_is_given_up_and_reported() -> None:
    box = Box()
    manager = ControllerManager((box,), Limiter(joint_limiters((box,))), 100)
    manager.load("a", "test/Wild", {"commands": ("g/position",)})
    manager.configure("a")
    box.breaks.add("perform")
    with pytest.raises(SwitchError, match="box: perform failed"):
        manager.switch(0.0, ("a",))
    assert (box.state, manager.controller("a").state) == (
        LifecycleState.UNCONFIGURED,
        LifecycleState.INACTIVE,
    )
    manager.cycle(0.01, 0.01)
    assert [each.source for each in manager.failures] == ["box"]


@pytest.mark.parametrize("step", ["configure", "activate"])
def test_rule_63_hardware_that_cannot_be_activated_stays_in_its_state(step: str) -> None:
    box = Box()
    manager = ControllerManager((box,), Limiter(joint_limiters((box,))), 100)
    manager.set_hardware_state("box", LifecycleState.UNCONFIGURED, 0.0)
    if step == "activate":
        manager.set_hardware_state("box", LifecycleState.INACTIVE, 0.0)
        manager.cycle(0.01, 0.01)
        assert box.states["g/position"].value == 0.25
    box.breaks.add(step)
    with pytest.raises(HardwareError, match=f"{step} failed"):
        manager.set_hardware_state("box", LifecycleState.ACTIVE, 0.0)
    assert box.state is (
        LifecycleState.UNCONFIGURED if step == "configure" else LifecycleState.INACTIVE
    )
    assert math.isnan(box.states["g/position"].value)


def test_rule_64_a_controller_that_raises_is_replaced_by_its_fallback_in_the_same_cycle(
    world: World,
) -> None:
    a = wild(world, "a", J1, "j1/velocity", fallback_controllers=("hold",))
    b = wild(world, "b", J2, "j2/velocity")
    world.switch("a", "b")
    a.hooks["update"] = boom()
    cycle = world.loop.step()
    [failure] = world.manager.failures
    assert (failure.source, failure.deactivated, failure.activated) == (
        "a", ("a", "b"), ("hold",)
    )  # fmt: skip
    assert isinstance(failure.cause, ValueError)
    assert failure.time == cycle.time
    assert (a.state, b.state) == (LifecycleState.INACTIVE, LifecycleState.INACTIVE)
    assert b.periods == []  # It was due next, but is deactivated.
    assert world.manager.claims.commands[J1].owner == "hold"
    release(world)


def test_rule_64_several_fallbacks_take_over_together(world: World) -> None:
    a = wild(world, "a", J1, J2, fallback_controllers=("b", "c"))
    for name, interface in (("b", J2), ("c", J1)):
        wild(world, name, interface)
    world.switch("a")
    a.hooks["update"] = boom()
    world.loop.step()
    [failure] = world.manager.failures
    assert (failure.deactivated, failure.activated) == (("a",), ("b", "c"))
    release(world)


def test_rule_64_a_fallback_that_is_active_already_just_goes_on(world: World) -> None:
    a, b = wild(world, "a", J1, fallback_controllers=("b",)), wild(world, "b", J2)
    world.switch("b")
    world.switch("a")
    a.hooks["update"] = boom()
    updates = len(b.periods)
    world.loop.step()
    [failure] = world.manager.failures
    assert (failure.source, failure.deactivated, failure.activated) == ("a", ("a",), ())
    assert (a.state, len(b.periods)) == (LifecycleState.INACTIVE, updates + 1)
    release(world)


def test_rule_64_a_fallback_commands_in_the_cycle_in_which_the_other_failed() -> None:
    box = Box()
    manager = ControllerManager((box,), Limiter(joint_limiters((box,))), 100)
    for name, fallbacks in (("a", ("b",)), ("b", ())):
        manager.load(
            name, Wild.TYPE, {"commands": ("g/position",), "fallback_controllers": fallbacks}
        )
        manager.configure(name)
    manager.switch(0.0, ("a",))
    a, b = (manager.controller(name) for name in "ab")
    a.hooks["update"] = lambda: setattr(a.command_handles[0], "value", math.nan)
    manager.cycle(0.01, 0.01)
    assert b.periods == [0.01]
    assert box.commands["g/position"].value == 0.0
    b.hooks["update"] = a.hooks["update"] = boom()
    manager.cycle(0.02, 0.01)
    assert [each.source for each in manager.failures] == ["b"]
    assert box.commands["g/position"].owner is None


def test_rule_64_a_fallback_whose_hardware_went_down_is_reported_with_the_first_cause(
    world: World,
) -> None:
    box = Box()
    manager = ControllerManager(
        (world.hardware, box), Limiter(joint_limiters((world.hardware, box))), 100
    )
    for name, commands, fallbacks in (("a", (J1,), ("b",)), ("b", ("g/position",), ())):
        manager.load(name, Wild.TYPE, {"commands": commands, "fallback_controllers": fallbacks})
        manager.configure(name)
    manager.switch(world.clock.now(), ("a",))
    manager.set_hardware_state("box", LifecycleState.INACTIVE, world.clock.now())
    manager.controller("a").hooks["update"] = boom()
    world.clock.sleep_until(world.clock.now() + 0.01)
    manager.cycle(world.clock.now(), 0.01)
    first, second = manager.failures
    assert (first.source, second.source) == ("a", "b")
    assert (first.deactivated, first.activated) == (("a",), ())
    assert second.cause.__cause__ is first.cause
    assert "box is inactive" in str(second.cause)
    assert world.axis("j1").mode is Mode.NONE


def test_rule_64_a_fallback_that_cannot_take_over_leaves_the_joint_to_ramp_down(
    world: World,
) -> None:
    wild(world, "b", J1).hooks["activate"] = boom("b too")
    a = wild(world, "a", J1, fallback_controllers=("b",))
    world.switch("a")
    a.hooks["update"] = boom("a first")
    world.loop.step()
    first, second = world.manager.failures
    assert [str(first.cause), str(second.cause)] == ["a first", "b too"]
    assert (first.source, second.source, first.activated) == ("a", "b", ())
    assert world.manager.claims.commands[J1].owner is None
    release(world)


def test_rule_64_fallbacks_must_be_able_to_take_over(world: World) -> None:
    wild(world, "a", J1, fallback_controllers=("b",))
    with pytest.raises(SwitchError, match=r"a cannot be activated: fallback: no controller .* 'b'"):
        world.switch("a")
    world.manager.load("b", "test/Wild", {"commands": (J1,), "fallback_controllers": ("c",)})
    with pytest.raises(SwitchError, match="its fallback b is unconfigured; configure it first"):
        world.switch("a")
    world.manager.configure("b")
    wild(world, "c", J1, fallback_controllers=("a",))
    with pytest.raises(SwitchError, match="its fallbacks lead back to"):
        world.switch("a")
    world.manager.unload("c")
    wild(world, "c", J1, fallback_controllers=("b",))
    with pytest.raises(SwitchError, match="a cannot be activated: its fallbacks lead back to b"):
        world.switch("a")
    world.manager.unload("c")
    wild(world, "c", "j7/position")
    with pytest.raises(SwitchError, match="j7/position"):
        world.switch("a")


def test_rule_65_shutdown_ends_all_controllers_then_all_hardware() -> None:
    world = World(home=False)
    a = wild(world, "a", "j1/home")
    wild(world, "reader", states=(J1,))
    seen: list[LifecycleState] = []
    a.hooks["deactivate"] = lambda: seen.append(world.hardware.state)
    world.switch("a", "reader")
    assert world.manager.shutdown(world.clock.now()) == []
    assert seen == [LifecycleState.ACTIVE]
    assert {each.state for each in world.manager.controllers} == {LifecycleState.FINALIZED}
    assert world.hardware.state is LifecycleState.FINALIZED
    world.arm.run(1.0)
    assert not any(world.arm.has_torque(name) for name in NAMES)
    with pytest.raises(SwitchError, match="finalized"):
        world.manager.configure("a")


@pytest.mark.parametrize("error", [HardwareError, ZeroDivisionError])
def test_rule_65_shutdown_continues_after_any_failure(error: type[Exception]) -> None:
    world, box = World(home=False), Box("shutdown")
    box.error = error
    manager = ControllerManager(
        (box, world.hardware), Limiter(joint_limiters((box, world.hardware))), 100
    )
    states: list[tuple[LifecycleState, LifecycleState]] = []
    for name, values in (
        ("on box", {"commands": ("g/position",)}),
        ("on arm", {"commands": ("j1/home",)}),
        ("reader", {"states": (J1,)}),
        ("without interfaces", {}),
    ):
        manager.load(name, Wild.TYPE, values)
        manager.configure(name)
        manager.controller(name).hooks["deactivate"] = lambda: states.append(
            (box.state, world.hardware.state)
        )
    manager.switch(world.clock.now(), ("on box", "on arm", "reader", "without interfaces"))
    manager.controller("on box").hooks["deactivate"] = boom("sticky")
    assert [str(cause) for cause in manager.shutdown(world.clock.now())] == [
        "sticky", "shutdown failed"
    ]  # fmt: skip
    assert states == [(LifecycleState.ACTIVE, LifecycleState.ACTIVE)] * 3
    assert {each.state for each in manager.controllers} == {LifecycleState.FINALIZED}
    assert (box.state, world.hardware.state) == (LifecycleState.FINALIZED, LifecycleState.FINALIZED)
    assert all(each.owner is None for each in manager.claims.commands.values())
