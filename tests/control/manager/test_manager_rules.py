"""The manager against the numbered rules of ros2_control, on the compiled firmware."""

from __future__ import annotations

import pytest

from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.switch_request import Strictness
from bioscara.errors import (
    ConfigurationError,
    LifecycleError,
    ModeSwitchError,
    SwitchError,
)
from bioscara.hardware import LifecycleState, Mode
from control.control_stack import NAMES, World
from control.scripted_controller import Box, boom, boxed, release, wild

J1, J2 = "j1/position", "j2/position"


def test_rule_44_load_refuses_a_taken_name_an_unknown_type_and_itself_as_fallback(
    world: World,
) -> None:
    manager = world.manager
    manager.load("a", "test/Wild")
    assert manager.controller("a").state is LifecycleState.UNCONFIGURED
    with pytest.raises(SwitchError, match="a controller named a is loaded already"):
        manager.load("a", "test/Wild")
    with pytest.raises(SwitchError, match="did you mean test/Wild"):
        manager.load("b", "test/Wilt")
    with pytest.raises(SwitchError, match="no controller type is named ''"):
        manager.load("b", "")
    with pytest.raises(SwitchError, match="b cannot be its own fallback"):
        manager.load("b", "test/Wild", {"fallback_controllers": ("b",)})
    with pytest.raises(ConfigurationError, match=r"update_rat\b.*did you mean update_rate"):
        manager.load("b", "test/Wild", {"update_rat": 1})
    assert [each.name for each in manager.controllers] == ["hold", "a"]


def test_rule_45_configure_also_from_inactive_but_not_while_active(world: World) -> None:
    controller = wild(world, "a")
    calls: list[str] = []
    for step in ("configure", "cleanup"):
        controller.hooks[step] = lambda step=step: calls.append(step)
    world.manager.configure("a")
    assert calls == ["cleanup", "configure"]
    assert controller.state is LifecycleState.INACTIVE
    world.switch("a")
    with pytest.raises(SwitchError, match="a is active: it cannot be configured"):
        world.manager.configure("a")
    for kind in ("commands", "states"):
        twice = world.manager.load(kind, "test/Wild", {kind: (J1, J1)})
        calls.clear()
        twice.hooks["cleanup"] = lambda: calls.append("cleanup")
        with pytest.raises(SwitchError, match=f"{kind} names j1/position twice"):
            world.manager.configure(kind)
        assert (twice.state, calls) == (LifecycleState.UNCONFIGURED, ["cleanup"])


def test_rule_46_cleanup_and_unload(world: World) -> None:
    manager, controller = world.manager, wild(world, "a")
    calls: list[str] = []
    controller.hooks["cleanup"] = lambda: calls.append("cleanup")
    manager.cleanup("a")
    manager.cleanup("a")
    assert calls == ["cleanup"]
    assert controller.state is LifecycleState.UNCONFIGURED
    manager.configure("a")
    world.switch("a")
    for refused in (manager.cleanup, manager.unload):
        with pytest.raises(SwitchError, match="a is active: deactivate it first"):
            refused("a")
        with pytest.raises(SwitchError, match="no controller is named 'nobody'"):
            refused("nobody")
    world.switch(off=("a",))
    manager.unload("a")
    assert controller.state is LifecycleState.FINALIZED
    with pytest.raises(SwitchError):
        manager.controller("a")


def test_rule_46_the_fallback_of_an_active_controller_stays_configured(world: World) -> None:
    wild(world, "a", J1, fallback_controllers=("b",))
    wild(world, "b", J1, fallback_controllers=("c",))
    wild(world, "c", J1)
    world.switch("a")
    for name in ("b", "c"):
        with pytest.raises(SwitchError, match=f"{name} is a fallback of a: deactivate a fir"):
            world.manager.cleanup(name)
    world.switch(off=("a",))
    world.manager.cleanup("b")
    assert world.manager.controller("b").state is LifecycleState.UNCONFIGURED


@pytest.mark.parametrize(("number", "strictness"), [(0, 2), (1, 1), (2, 2), (3, 1), (4, 1)])
def test_rule_47_strictness_by_number(number: int, strictness: int) -> None:
    assert Strictness(number) == strictness
    with pytest.raises(ValueError, match="5"):
        Strictness(5)


def test_rule_48_strict_changes_nothing_when_one_entry_is_wrong(world: World) -> None:
    a, b = wild(world, "a", J1), wild(world, "b", J2)
    world.manager.load("new", "test/Wild")
    world.switch("b")
    for activate, deactivate, text in (
        (("a", "nobody"), (), "nobody"),
        (("a",), ("b", "nobody"), "nobody"),
        (("a", "new"), (), "new cannot be activated: it is unconfigured, not inactive; configure"),
        (("a", "b"), (), "b cannot be activated: it is active, not inactive"),
        (("a",), ("hold",), "hold cannot be deactivated: it is inactive, not active"),
    ):
        with pytest.raises(SwitchError, match=text):
            world.switch(*activate, off=deactivate)
        assert a.state is LifecycleState.INACTIVE
        assert b.state is LifecycleState.ACTIVE


def test_rule_48_best_effort_leaves_wrong_entries_out(world: World) -> None:
    a = wild(world, "a", J1)
    manager, now, best = world.manager, world.clock.now(), Strictness.BEST_EFFORT
    switch = manager.switch(now, ("a", "nobody"), ("hold",), best)
    assert a.state is LifecycleState.ACTIVE
    assert switch.text == "Successfully switched controllers! Activated: [a]; deactivated: []"
    assert manager.switch(now, ("a",), (), best).text == (
        "After checking the controllers, no controllers need to be activated or deactivated."
    )
    for activate, deactivate in ((("nobody",), ("a",)), (("a",), ("nobody",))):
        with pytest.raises(SwitchError, match="nobody"):
            manager.switch(now, activate, deactivate, best)
        assert a.state is LifecycleState.ACTIVE


def test_rule_48_a_name_that_is_there_twice_counts_once(world: World) -> None:
    a, calls = wild(world, "a", states=(J1,)), []
    for step in ("activate", "deactivate"):
        a.hooks[step] = lambda step=step: calls.append(step)
    world.switch("a", "a")
    world.switch(off=("a", "a"))
    assert calls == ["activate", "deactivate"]


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


def test_rule_49_a_controller_that_is_not_active_is_not_restarted(world: World) -> None:
    new = world.manager.load("new", "test/Wild", {"states": (J1,)})
    now, both = world.clock.now(), ("new",)
    with pytest.raises(SwitchError, match="new cannot be deactivated"):
        world.switch("new", off=("new",))
    switch = world.manager.switch(now, both, both, Strictness.BEST_EFFORT)
    assert (switch.activate, switch.deactivate) == ((), ())
    assert new.state is LifecycleState.UNCONFIGURED


@pytest.mark.parametrize("strictness", list(Strictness))
def test_rule_50_claim_conflicts_are_refused_in_both_modes(
    world: World, strictness: Strictness
) -> None:
    a, b, c = wild(world, "a", J1), wild(world, "b", J1, J2), wild(world, "c", "j9/position")
    d = wild(world, "d", states=("j1/temperature",))
    manager, now = world.manager, world.clock.now()
    for names, text in (
        (("a", "b"), "b and a both claim j1/position"),
        (("c",), "c needs j9/position, which no hardware has; did you mean j"),
        (("d",), "d needs j1/temperature"),
    ):
        with pytest.raises(SwitchError, match=text):
            manager.switch(now, names, (), strictness)
    world.switch("a")
    with pytest.raises(SwitchError, match="b cannot claim j1/position: a has it; deactivate a"):
        manager.switch(now, ("b",), (), strictness)
    assert [each.state for each in (a, b, c, d)] == [LifecycleState.ACTIVE] + [
        LifecycleState.INACTIVE
    ] * 3


@pytest.mark.parametrize("strictness", list(Strictness))
def test_rule_50_one_controller_moves_a_joint(world: World, strictness: Strictness) -> None:
    position, velocity = wild(world, "position", J1), wild(world, "velocity", "j1/velocity")
    both, manager, now = wild(world, "both", J1, "j1/velocity"), world.manager, world.clock.now()
    with pytest.raises(SwitchError, match="velocity cannot claim j1/velocity: position has or"):
        manager.switch(now, ("position", "velocity"), (), strictness)
    assert world.axis("j1").mode is Mode.NONE
    for first, second in ((position, velocity), (velocity, position)):
        world.switch(first.name)
        with pytest.raises(SwitchError, match=f"{second.name} cannot claim .* {first.name} has"):
            manager.switch(now, (second.name,), (), strictness)
        assert (first.state, second.state) == (LifecycleState.ACTIVE, LifecycleState.INACTIVE)
        world.switch(second.name, off=(first.name,))
        world.switch("both", off=(second.name,))
        assert both.state is LifecycleState.ACTIVE
        world.switch(off=("both",))


@pytest.mark.parametrize("strictness", list(Strictness))
def test_rule_50_interfaces_of_unconfigured_hardware_are_not_there(
    strictness: Strictness,
) -> None:
    manager, box = boxed(a={"commands": ("g/position",)}, reader={"states": ("g/switch",)})
    manager.set_hardware_state("box", LifecycleState.UNCONFIGURED, 0.0)
    for name, interface in (("a", "g/position"), ("reader", "g/switch")):
        with pytest.raises(SwitchError, match=f"{name} needs {interface}: box is unconfigured"):
            manager.switch(0.0, (name,), (), strictness)
    assert "perform" not in box.steps


def test_rule_50_state_interfaces_are_shared(world: World) -> None:
    for name in ("a", "b"):
        wild(world, name, states=(J1,))
    world.switch("a", "b")


def test_rule_51_hardware_may_veto_and_nothing_changes(unhomed: World) -> None:
    a, other = wild(unhomed, "a", J1), wild(unhomed, "other", "j2/home")
    unhomed.switch("other")
    with pytest.raises(ModeSwitchError, match=r"prepare command mode switch was rejected: j1 is n"):
        unhomed.switch("a", off=("other",))
    assert (a.state, other.state) == (LifecycleState.INACTIVE, LifecycleState.ACTIVE)
    assert unhomed.manager.claims.commands["j2/home"].owner == "other"
    assert unhomed.axis("j2").mode is Mode.HOME


def test_rule_51_command_interfaces_of_inactive_hardware_are_refused(unhomed: World) -> None:
    wild(unhomed, "a", "j1/home")
    wild(unhomed, "reader", states=("j1/home",))
    unhomed.manager.set_hardware_state("bioscara_arm", LifecycleState.INACTIVE, unhomed.clock.now())
    with pytest.raises(SwitchError, match="bioscara_arm is inactive; activate it first"):
        unhomed.switch("a")
    unhomed.switch("reader")


@pytest.mark.parametrize("strictness", list(Strictness))
def test_rule_52_a_controller_that_does_not_become_active(
    world: World, strictness: Strictness
) -> None:
    a, bad = wild(world, "a", J1), wild(world, "bad", J2)
    gone, last = wild(world, "gone", states=(J1,)), wild(world, "last", "j3/position")
    bad.hooks["activate"] = boom("not today")
    world.switch("gone")
    with pytest.raises(SwitchError) as caught:
        world.manager.switch(world.clock.now(), ("a", "bad", "last"), ("gone",), strictness)
    strict = strictness is Strictness.STRICT
    now_active = "" if strict else "a, last"
    assert str(caught.value) == (
        "Failed switching controllers.... bad: not today. "
        f"Activated: [{now_active}]; deactivated: [gone]"
    )
    kept = LifecycleState.INACTIVE if strict else LifecycleState.ACTIVE
    assert [each.state for each in (a, bad, last, gone)] == [
        kept, LifecycleState.INACTIVE, kept, LifecycleState.INACTIVE
    ]  # fmt: skip
    owners = world.manager.claims.commands
    assert (owners[J1].owner, owners[J2].owner) == (None if strict else "a", None)
    mode = Mode.NONE if strict else Mode.POSITION
    assert [axis.mode for axis in world.hardware.axes[:3]] == [mode, Mode.NONE, mode]
    assert bad.command_handles == ()
    bad.hooks.clear()
    world.switch("bad")


def test_rule_52_the_text_of_a_success(world: World) -> None:
    wild(world, "a", J1)
    now, done = world.clock.now(), "Successfully switched controllers!"
    assert world.manager.switch(now, ("a",)).text == done
    switch = world.manager.switch(now, (), ("a",), Strictness.BEST_EFFORT)
    assert switch.text == f"{done} Activated: []; deactivated: [a]"


def test_rule_54_controllers_are_listed_in_the_order_of_their_updates(world: World) -> None:
    calls: list[str] = []
    for name in ("a", "b"):
        wild(world, name, f"j{len(calls) + 1}/position", states=(J1,), update_rate=50)
        world.manager.controller(name).hooks["update"] = lambda name=name: calls.append(name)
        calls.append(name)
    world.manager.load("new", "test/Wild", {"commands": (J1,), "states": (J1,)})
    hold, a, _, new = world.manager.list_controllers()
    assert (a.name, a.kind, a.state, a.update_rate) == (
        "a",
        "test/Wild",
        LifecycleState.INACTIVE,
        50.0,
    )
    assert (a.claimed_interfaces, a.required_command_interfaces) == ((), (J1,))
    assert a.required_state_interfaces == (J1,)
    assert (new.state, new.required_command_interfaces) == (LifecycleState.UNCONFIGURED, ())
    assert new.required_state_interfaces == ()
    assert (hold.update_rate, hold.required_command_interfaces[0]) == (100.0, J1)
    world.switch("b")
    world.switch("a")
    active = world.manager.list_controllers()[1]
    assert active.claimed_interfaces == active.required_command_interfaces == (J1,)
    assert active.required_state_interfaces == (J1,)
    calls.clear()
    world.run(0.05)
    assert calls[:2] == ["a", "b"]


def test_rule_55_components_and_interfaces_are_listed(world: World) -> None:
    wild(world, "a", J1)
    world.switch("a")
    [arm] = world.manager.list_hardware_components()
    assert (arm.name, arm.kind, arm.state, arm.rw_rate) == (
        "bioscara_arm", "system", LifecycleState.ACTIVE, 100
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
    assert sorted(arm.command_interfaces) == list(commands)
    assert sorted(arm.state_interfaces) == list(states)


def test_rule_55_components_differ_in_kind_and_lifecycle_state() -> None:
    box = Box()
    manager = ControllerManager((box,), Limiter(joint_limiters((box,))), 50)
    for state, available in ((LifecycleState.UNCONFIGURED, False), (LifecycleState.INACTIVE, True)):
        manager.set_hardware_state("box", state, 0.0)
        [entry] = manager.list_hardware_components()
        assert (entry.kind, entry.state, entry.rw_rate) == ("actuator", state, 50)
        assert entry.plugin_name == f"{Box.__module__}.Box"
        assert entry.command_interfaces == (("g/position", "double", available, False),)
        assert [each.name for each in entry.state_interfaces] == ["g/position", "g/switch"]
        assert manager.list_hardware_interfaces() == (
            entry.command_interfaces, entry.state_interfaces
        )  # fmt: skip


def test_rule_56_and_57_hardware_that_goes_down_loses_its_controllers_first(
    unhomed: World,
) -> None:
    manager, now = unhomed.manager, unhomed.clock.now
    a, reader = wild(unhomed, "a", "j1/home"), wild(unhomed, "reader", states=(J1,))
    order: list[LifecycleState] = []
    for each in (a, reader):
        each.hooks["deactivate"] = lambda: order.append(unhomed.hardware.state)
    unhomed.switch("a", "reader")
    assert (
        manager.set_hardware_state("bioscara_arm", LifecycleState.INACTIVE, now())
        is LifecycleState.INACTIVE
    )
    assert (a.state, reader.state) == (LifecycleState.INACTIVE, LifecycleState.ACTIVE)
    manager.set_hardware_state("bioscara_arm", LifecycleState.UNCONFIGURED, now())
    assert reader.state is LifecycleState.INACTIVE
    assert order == [LifecycleState.ACTIVE, LifecycleState.INACTIVE]
    assert not any(each.is_available for each in manager.list_hardware_interfaces()[1])
    with pytest.raises(SwitchError, match="reader needs j1/position: bioscara_arm is unconfigure"):
        unhomed.switch("reader")
    assert (
        manager.set_hardware_state("bioscara_arm", LifecycleState.ACTIVE, now())
        is LifecycleState.ACTIVE
    )
    unhomed.switch("a", "reader")
    order.clear()
    manager.set_hardware_state("bioscara_arm", LifecycleState.FINALIZED, now())
    assert (a.state, reader.state) == (LifecycleState.INACTIVE, LifecycleState.INACTIVE)
    assert order == [LifecycleState.ACTIVE, LifecycleState.ACTIVE]
    with pytest.raises(LifecycleError, match="finalized"):
        manager.set_hardware_state("bioscara_arm", LifecycleState.ACTIVE, now())
    with pytest.raises(SwitchError, match="did you mean bioscara_arm"):
        manager.set_hardware_state("bioscara_arms", LifecycleState.ACTIVE, now())


def test_a_controller_that_fails_to_deactivate_is_inactive_and_the_failure_is_reported(
    world: World,
) -> None:
    a = wild(world, "a", J1)
    world.switch("a")
    a.hooks["deactivate"] = boom("sticky")
    world.switch(off=("a",))
    assert a.state is LifecycleState.INACTIVE
    assert world.manager.claims.commands[J1].owner is None
    world.loop.step()
    assert [str(each.cause) for each in world.manager.failures] == ["sticky"]
    release(world)


def test_a_lock_refuses_controllers_that_command_but_not_those_that_read(world: World) -> None:
    wild(world, "a", J1)
    wild(world, "reader", states=(J1,))
    world.manager.lock = "because"
    with pytest.raises(SwitchError, match="a cannot be activated: because"):
        world.switch("reader", "a")
    world.switch("reader")
