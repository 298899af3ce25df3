"""The manager against the numbered rules of ros2_control, on the compiled firmware."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from bioscara.control.limiting import Limiter
from bioscara.control.manager import ControllerManager
from bioscara.control.schedule import Schedule
from bioscara.control.supervisor import FaultState
from bioscara.control.switching import Strictness
from bioscara.errors import (
    ConfigurationError,
    HardwareError,
    InvalidArgumentError,
    LifecycleError,
    ModeSwitchError,
    SwitchError,
)
from bioscara.hardware import Mode, State
from control.wild import Box, Wild, boom, wild
from control.world import NAMES, World

J1, J2 = "j1/position", "j2/position"


@pytest.fixture(scope="module")
def homed() -> World:
    return World(at={"j1": 0.0, "j2": 0.2, "j3": 0.0, "j4": 0.0})


@pytest.fixture
def world(homed: World) -> Iterator[World]:
    """The homed arm without controllers but the hold; a test leaves its hardware ACTIVE."""
    yield homed
    active = [each.name for each in homed.manager.controllers if each.state is State.ACTIVE]
    release(homed)
    homed.switch(off=tuple(active))
    for _ in range(2):
        for controller in homed.manager.controllers:
            if controller.name != "hold":
                homed.manager.unload(controller.name)
    homed.run(0.2)


@pytest.fixture
def unhomed() -> World:
    return World(home=False)


def test_rule_44_load_refuses_a_taken_name_an_unknown_type_and_itself_as_fallback(
    world: World,
) -> None:
    manager = world.manager
    wild(world, "a")
    with pytest.raises(SwitchError, match="a controller named a is loaded already"):
        manager.load("a", "test/Wild")
    with pytest.raises(SwitchError, match="did you mean test/Wild"):
        manager.load("b", "test/Wilt")
    with pytest.raises(SwitchError, match="b cannot be its own fallback"):
        manager.load("b", "test/Wild", {"fallback_controllers": ("b",)})
    with pytest.raises(ConfigurationError, match=r"update_rat\b.*did you mean update_rate"):
        manager.load("b", "test/Wild", {"update_rat": 1})
    assert [each.name for each in manager.controllers] == ["hold", "a"]


def test_rule_45_configure_also_from_inactive_but_not_while_active(world: World) -> None:
    controller = wild(world, "a")
    world.manager.configure("a")
    assert controller.state is State.INACTIVE
    world.switch("a")
    with pytest.raises(SwitchError, match="a is active: it cannot be configured"):
        world.manager.configure("a")
    world.manager.load("twice", "test/Wild", {"commands": (J1, J1)})
    with pytest.raises(SwitchError, match="twice names j1/position twice"):
        world.manager.configure("twice")
    assert world.manager.controller("twice").state is State.UNCONFIGURED


def test_rule_46_cleanup_and_unload(world: World) -> None:
    manager, controller = world.manager, wild(world, "a")
    manager.cleanup("a")
    manager.cleanup("a")
    assert controller.state is State.UNCONFIGURED
    manager.configure("a")
    world.switch("a")
    for refused in (manager.cleanup, manager.unload):
        with pytest.raises(SwitchError, match="a is active: deactivate it first"):
            refused("a")
        with pytest.raises(SwitchError, match="no controller is named 'nobody'"):
            refused("nobody")
    world.switch(off=("a",))
    manager.unload("a")
    assert controller.state is State.FINALIZED
    with pytest.raises(SwitchError):
        manager.controller("a")


def test_rule_46_what_an_active_controller_falls_back_on_stays_configured(world: World) -> None:
    wild(world, "a", J1, fallback_controllers=("hold",))
    world.switch("a")
    with pytest.raises(SwitchError, match="hold is what a falls back on: deactivate a first"):
        world.manager.cleanup("hold")


@pytest.mark.parametrize(("number", "strictness"), [(0, 2), (1, 1), (2, 2), (3, 1), (4, 1)])
def test_rule_47_strictness_by_number(number: int, strictness: int) -> None:
    assert Strictness(number) == strictness
    with pytest.raises(ValueError, match="5"):
        Strictness(5)


def test_rule_48_strict_changes_nothing_when_one_entry_is_wrong(world: World) -> None:
    a, b = wild(world, "a", J1), wild(world, "b", J2)
    world.switch("b")
    for activate, deactivate, text in (
        (("a", "nobody"), (), "nobody"),
        (("a", "b"), (), "b cannot be activated: it is active, not inactive"),
        (("a",), ("hold",), "hold cannot be deactivated: it is inactive, not active"),
    ):
        with pytest.raises(SwitchError, match=text):
            world.switch(*activate, off=deactivate)
        assert a.state is State.INACTIVE
        assert b.state is State.ACTIVE


def test_rule_48_best_effort_leaves_wrong_entries_out(world: World) -> None:
    a = wild(world, "a", J1)
    manager, now, best = world.manager, world.clock.now(), Strictness.BEST_EFFORT
    switch = manager.switch(now, ("a", "nobody"), ("hold",), best)
    assert a.state is State.ACTIVE
    assert switch.text == "Successfully switched controllers! Activated: [a]; deactivated: []"
    assert manager.switch(now, ("a",), (), best).text == (
        "After checking the controllers, no controllers need to be activated or deactivated."
    )
    with pytest.raises(SwitchError, match="nobody"):
        manager.switch(now, ("nobody",), ("a",), best)
    assert a.state is State.ACTIVE


def test_rule_49_a_name_in_both_lists_is_a_restart_and_owners_swap_in_one_call(
    world: World,
) -> None:
    a, b = wild(world, "a", J1), wild(world, "b", J1)
    calls: list[str] = []
    a.hooks = {"activate": lambda: calls.append("a on"), "deactivate": lambda: calls.append("a")}
    b.hooks = {"activate": lambda: calls.append("b on")}
    world.switch("a")
    world.switch("a", off=("a",))
    world.switch("b", off=("a",))
    assert calls == ["a on", "a", "a on", "a", "b on"]
    assert world.manager.claims.commands[J1].owner == "b"


@pytest.mark.parametrize("strictness", list(Strictness))
def test_rule_50_claim_conflicts_are_refused_in_both_modes(
    world: World, strictness: Strictness
) -> None:
    a, b, c = wild(world, "a", J1), wild(world, "b", J1, J2), wild(world, "c", "j9/position")
    d = wild(world, "d", states=("j1/temperature",))
    manager, now = world.manager, world.clock.now()
    for names, text in (
        (("a", "b"), "b and a both want j1/position"),
        (("c",), "c needs j9/position, which no hardware has; did you mean j"),
        (("d",), "d needs j1/temperature"),
    ):
        with pytest.raises(SwitchError, match=text):
            manager.switch(now, names, (), strictness)
    world.switch("a")
    with pytest.raises(SwitchError, match="b cannot claim j1/position: a has it; deactivate a"):
        manager.switch(now, ("b",), (), strictness)
    assert [each.state for each in (a, b, c, d)] == [State.ACTIVE] + [State.INACTIVE] * 3


def test_rule_50_state_interfaces_are_shared(world: World) -> None:
    for name in ("a", "b"):
        wild(world, name, states=(J1,))
    world.switch("a", "b")


def test_rule_51_hardware_may_veto_and_nothing_changes(unhomed: World) -> None:
    a, other = wild(unhomed, "a", J1), wild(unhomed, "other", states=(J1,))
    unhomed.switch("other")
    with pytest.raises(ModeSwitchError, match=r"prepare command mode switch was rejected: j1 is n"):
        unhomed.switch("a", off=("other",))
    assert (a.state, other.state) == (State.INACTIVE, State.ACTIVE)


def test_rule_51_command_interfaces_of_inactive_hardware_are_refused(unhomed: World) -> None:
    wild(unhomed, "a", "j1/home")
    wild(unhomed, "reader", states=("j1/home",))
    unhomed.manager.set_hardware_state("bioscara_arm", State.INACTIVE, unhomed.clock.now())
    with pytest.raises(SwitchError, match="bioscara_arm is inactive; activate it first"):
        unhomed.switch("a")
    unhomed.switch("reader")


@pytest.mark.parametrize("strictness", list(Strictness))
def test_rule_52_a_controller_that_does_not_become_active(
    world: World, strictness: Strictness
) -> None:
    a, bad = wild(world, "a", J1), wild(world, "bad", J2)
    gone = wild(world, "gone", states=(J1,))
    bad.hooks["activate"] = boom("not today")
    world.switch("gone")
    with pytest.raises(SwitchError, match=r"Failed switching controllers\.\.\.\. bad: not today"):
        world.manager.switch(world.clock.now(), ("a", "bad"), ("gone",), strictness)
    strict = strictness is Strictness.STRICT
    assert a.state is (State.INACTIVE if strict else State.ACTIVE)
    assert (bad.state, gone.state) == (State.INACTIVE, State.INACTIVE)
    owners = world.manager.claims.commands
    assert (owners[J1].owner, owners[J2].owner) == (None if strict else "a", None)
    bad.hooks.clear()
    world.switch("bad")


def test_rule_54_controllers_are_listed_in_the_order_of_their_updates(world: World) -> None:
    calls: list[str] = []
    for name in ("a", "b"):
        wild(world, name, f"j{len(calls) + 1}/position", states=(J1,), update_rate=50)
        world.manager.controller(name).hooks["update"] = lambda name=name: calls.append(name)
        calls.append(name)
    world.manager.load("new", "test/Wild", {"commands": (J1,)})
    hold, a, _, new = world.manager.list_controllers()
    assert (a.name, a.kind, a.state, a.update_rate) == ("a", "test/Wild", State.INACTIVE, 50.0)
    assert (a.claimed_interfaces, a.required_command_interfaces) == ((), (J1,))
    assert a.required_state_interfaces == (J1,)
    assert (new.state, new.required_command_interfaces) == (State.UNCONFIGURED, ())
    assert (hold.update_rate, hold.required_command_interfaces[0]) == (100.0, J1)
    world.switch("b")
    world.switch("a")
    assert world.manager.list_controllers()[1].claimed_interfaces == (J1,)
    calls.clear()
    world.run(0.05)
    assert calls[:2] == ["a", "b"]


def test_rule_55_components_and_interfaces_are_listed(world: World) -> None:
    wild(world, "a", J1)
    world.switch("a")
    [arm] = world.manager.list_hardware_components()
    assert (arm.name, arm.kind, arm.state, arm.rw_rate) == (
        "bioscara_arm", "system", State.ACTIVE, 100
    )  # fmt: skip
    assert arm.plugin_name == "bioscara.hardware.arm.ArmHardware"
    commands, states = world.manager.list_hardware_interfaces()
    kinds = ("home", "position", "velocity")
    assert [each.name for each in commands] == [f"{j}/{kind}" for j in NAMES for kind in kinds]
    assert [each.name for each in states] == [each.name for each in commands]
    assert {each.name for each in commands if each.is_claimed} == {J1}
    assert not any(each.is_claimed for each in states)
    assert {(each.data_type, each.is_available) for each in (*commands, *states)} == {
        ("double", True)
    }


def test_rule_56_and_57_hardware_that_goes_down_loses_its_controllers_first(
    unhomed: World,
) -> None:
    manager, now = unhomed.manager, unhomed.clock.now
    a, reader = wild(unhomed, "a", "j1/home"), wild(unhomed, "reader", states=(J1,))
    order: list[State] = []
    for each in (a, reader):
        each.hooks["deactivate"] = lambda: order.append(unhomed.hardware.state)
    unhomed.switch("a", "reader")
    assert manager.set_hardware_state("bioscara_arm", State.INACTIVE, now()) is State.INACTIVE
    assert (a.state, reader.state) == (State.INACTIVE, State.ACTIVE)
    manager.set_hardware_state("bioscara_arm", State.UNCONFIGURED, now())
    assert reader.state is State.INACTIVE
    assert order == [State.ACTIVE, State.INACTIVE]
    assert not any(each.is_available for each in manager.list_hardware_interfaces()[1])
    with pytest.raises(SwitchError, match="reader needs j1/position: bioscara_arm is unconfigure"):
        unhomed.switch("reader")
    assert manager.set_hardware_state("bioscara_arm", State.ACTIVE, now()) is State.ACTIVE
    manager.set_hardware_state("bioscara_arm", State.FINALIZED, now())
    with pytest.raises(LifecycleError, match="finalized"):
        manager.set_hardware_state("bioscara_arm", State.ACTIVE, now())
    with pytest.raises(SwitchError, match="did you mean bioscara_arm"):
        manager.set_hardware_state("bioscara_arms", State.ACTIVE, now())


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


@pytest.mark.parametrize(
    ("asked", "got"), [(0, 100), (1000, 100), (50, 50), (33, 100 / 3), (70, 100)]
)
def test_rule_60_update_rates(world: World, asked: int, got: float) -> None:
    a = wild(world, "a", states=(J1,), update_rate=asked)
    world.switch("a")
    world.run(1.0)
    assert len(a.periods) == pytest.approx(got, abs=1)
    assert a.periods[0] == pytest.approx(1 / got)
    assert sum(a.periods[1:]) == pytest.approx(1.0, abs=2 / got)
    said = [each for each in world.manager.warnings if each.startswith(f"a: update_rate {asked} ")]
    assert bool(said) == (asked not in (0, 50))


def test_rule_60_a_late_cycle_brings_an_update_that_is_nearer_now_than_later() -> None:
    schedule = Schedule(100, 25)
    assert schedule.due(0.01) == 0.04
    assert [schedule.due(0.01), schedule.due(0.03)] == [0.0, 0.04]


@pytest.mark.parametrize("rate", [-1, 10_001])
def test_rates_that_no_cycle_has_are_refused(world: World, rate: int) -> None:
    with pytest.raises(ConfigurationError, match=f"rate {rate} Hz is outside 20 .. 10000 Hz"):
        ControllerManager((world.hardware,), Limiter((world.hardware,)), rate)
    with pytest.raises(ConfigurationError, match="update_rate"):
        world.manager.load("x", "test/Wild", {"update_rate": rate})
    for period in (0.0, -0.01, math.nan):
        with pytest.raises(InvalidArgumentError, match="a cycle takes time"):
            world.manager.cycle(world.clock.now(), period)


def test_rule_61_an_arm_that_cannot_be_reached_takes_all_its_controllers_along() -> None:
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
    assert (commander.state, reader.state) == (State.INACTIVE, State.INACTIVE)
    assert not world.hardware.available
    assert all(each.owner is None for each in manager.claims.commands.values())


@pytest.mark.parametrize("step", ["read", "write"])
@pytest.mark.parametrize(
    ("more", "after"), [((), State.UNCONFIGURED), (("error",), State.FINALIZED)]
)
def test_rule_61_62_hardware_that_fails_leaves_other_hardware_alone(
    step: str, more: tuple[str, ...], after: State
) -> None:
    world = World(home=False)
    box = Box()
    manager = ControllerManager((world.hardware, box), Limiter((world.hardware, box)), 100)
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
    assert manager.controller("on arm").state is State.ACTIVE
    world.clock.sleep_until(world.clock.now() + 0.01)
    manager.cycle(world.clock.now(), 0.01)
    assert not manager.failures
    assert box.state is after


def test_hardware_whose_modes_cannot_be_changed_is_given_up_and_told_of() -> None:
    box = Box()
    manager = ControllerManager((box,), Limiter((box,)), 100)
    manager.load("a", "test/Wild", {"commands": ("g/position",)})
    manager.configure("a")
    box.breaks.add("perform")
    with pytest.raises(SwitchError, match="box: perform failed"):
        manager.switch(0.0, ("a",))
    assert (box.state, manager.controller("a").state) == (State.UNCONFIGURED, State.INACTIVE)
    manager.cycle(0.01, 0.01)
    assert [each.source for each in manager.failures] == ["box"]


@pytest.mark.parametrize("step", ["configure", "activate"])
def test_rule_63_hardware_that_cannot_go_up_stays_where_it_was(step: str) -> None:
    box = Box()
    manager = ControllerManager((box,), Limiter((box,)), 100)
    manager.set_hardware_state("box", State.UNCONFIGURED, 0.0)
    box.breaks.add(step)
    with pytest.raises(HardwareError, match=f"{step} failed"):
        manager.set_hardware_state("box", State.ACTIVE, 0.0)
    assert box.state is (State.UNCONFIGURED if step == "configure" else State.INACTIVE)


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
    assert (a.state, b.state) == (State.INACTIVE, State.INACTIVE)
    assert world.manager.claims.commands[J1].owner == "hold"
    release(world)


def test_rule_64_a_fallback_commands_in_the_cycle_in_which_the_other_failed() -> None:
    box = Box()
    manager = ControllerManager((box,), Limiter((box,)), 100)
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


def test_rule_64_a_fallback_whose_hardware_went_down_is_told_of_with_the_first_cause(
    world: World,
) -> None:
    box = Box()
    manager = ControllerManager((world.hardware, box), Limiter((world.hardware, box)), 100)
    for name, commands, fallbacks in (("a", (J1,), ("b",)), ("b", ("g/position",), ())):
        manager.load(name, Wild.TYPE, {"commands": commands, "fallback_controllers": fallbacks})
        manager.configure(name)
    manager.switch(world.clock.now(), ("a",))
    manager.set_hardware_state("box", State.INACTIVE, world.clock.now())
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
    wild(world, "c", "j7/position")
    with pytest.raises(SwitchError, match="j7/position"):
        world.switch("a")


def test_a_controller_that_fails_to_let_go_lets_go_all_the_same_and_is_told_of(
    world: World,
) -> None:
    a = wild(world, "a", J1)
    world.switch("a")
    a.hooks["deactivate"] = boom("sticky")
    world.switch(off=("a",))
    assert a.state is State.INACTIVE
    assert world.manager.claims.commands[J1].owner is None
    world.loop.step()
    assert [str(each.cause) for each in world.manager.failures] == ["sticky"]
    release(world)


def test_a_lock_refuses_whoever_commands_but_not_whoever_reads(world: World) -> None:
    wild(world, "a", J1)
    wild(world, "reader", states=(J1,))
    world.manager.lock = "because"
    with pytest.raises(SwitchError, match="a cannot be activated: because"):
        world.switch("reader", "a")
    world.switch("reader")


def test_rule_65_shutdown_ends_all_controllers_then_all_hardware() -> None:
    world = World(home=False)
    a = wild(world, "a", "j1/home")
    wild(world, "reader", states=(J1,))
    seen: list[State] = []
    a.hooks["deactivate"] = lambda: seen.append(world.hardware.state)
    world.switch("a", "reader")
    assert world.manager.shutdown(world.clock.now()) == []
    assert seen == [State.ACTIVE]
    assert {each.state for each in world.manager.controllers} == {State.FINALIZED}
    assert world.hardware.state is State.FINALIZED
    with pytest.raises(SwitchError, match="finalized"):
        world.manager.configure("a")


def release(world: World) -> None:
    """Let the supervisor forget what was meant to happen."""
    world.run(0.3)
    world.supervisor.faults.clear()
    world.supervisor.state = FaultState.CLEAR
    world.manager.lock = ""
