"""Homing through the control stack, on the compiled firmware."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings, strategies as st

from bioscara.bus.injection import Direction, When
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.homing_controller import HomingController, HomingGoal
from bioscara.control.faults.kinds import FaultKind
from bioscara.control.faults.supervisor import FaultState
from bioscara.drivers import Quality
from bioscara.errors import (
    ConfigurationError,
    ControllerError,
    GoalRejectedError,
    ModeSwitchError,
    SwitchError,
)
from bioscara.hardware import LifecycleState
from bioscara.protocol import Register
from control.control_stack import LIMITS, NAMES, PARAMETERS, World

KIND = "single_trigger_controller/SingleTriggerController"
ORDER = PARAMETERS.homing_order
DIRECTIONS = {joint.name: joint.homing.velocity for joint in PARAMETERS.joints}


def start(world: World, **values: object) -> HomingController:
    """Activate a homing controller."""
    homing = world.load("homing", KIND, **{"joints": ORDER, **values})
    world.switch("homing")
    assert isinstance(homing, HomingController)
    return homing


def finish(world: World, goal: HomingGoal, seconds: float = 300.0) -> HomingGoal:
    """Run until a goal ended, and a little longer."""
    world.run_until(lambda: goal.done, seconds)
    world.run(0.1)
    return goal


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_the_sequence_homes_the_lift_first_and_one_joint_at_a_time(v1: bool) -> None:
    world = World(v1=v1, home=False)
    homing = start(world)
    goal = homing.send_goal(DIRECTIONS)
    seen: list[str] = []
    for _ in range(40 * world.rate):
        world.loop.step()
        running = [axis.name for axis in world.hardware.axes if axis.homing.running]
        assert len(running) <= 1
        seen += [name for name in running if name not in seen]
        if goal.done:
            break
    assert (goal.status, goal.text, goal.current) == (GoalStatus.SUCCEEDED, "", None)
    assert tuple(seen) == tuple(goal.done_joints) == ("j2", "j1", "j4", "j3")
    for joint in PARAMETERS.joints:
        assert world.axis(joint.name).position.value == pytest.approx(joint.home_position, abs=0.02)
        assert world.hardware.commands[f"{joint.name}/home"].value == 0.0
    assert not world.supervisor.faults


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
@pytest.mark.parametrize("command", [1.0, -1.0, 0.2, -250.0])
def test_the_sign_of_a_trigger_is_the_direction_and_its_size_says_nothing(
    v1: bool, command: float
) -> None:
    sign = math.copysign(1.0, command)
    stop = LIMITS["j4"].upper if command > 0.0 else LIMITS["j4"].lower
    world = World(v1=v1, home=False, near={"j4": stop - sign * 0.1})
    goal = start(world).trigger("j4", command)
    assert goal is not None
    finish(world, goal)
    assert goal.status is GoalStatus.SUCCEEDED
    assert world.axis("j4").position.value == pytest.approx(stop, abs=0.02)
    assert [axis.name for axis in world.hardware.axes if axis.homed] == ["j4"]


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
@pytest.mark.parametrize("name", ORDER)
def test_trigger_zero_stops_the_joint_unhomed_and_it_can_be_homed_again(
    v1: bool, name: str
) -> None:
    world = World(v1=v1, home=False)
    homing = start(world)
    goal = homing.trigger(name, DIRECTIONS[name])
    assert goal is not None
    world.run(1.0)
    assert goal.current == name
    homing.trigger(name, 0.0)
    assert goal.status is GoalStatus.CANCELED
    world.run(1.0)
    assert abs(world.arm.velocity(name)) < 1e-3 * LIMITS[name].max_velocity
    assert not world.axis(name).homed
    assert world.supervisor.faults == []
    again = homing.trigger(name, DIRECTIONS[name])
    assert again is not None
    assert finish(world, again).status is GoalStatus.SUCCEEDED


@settings(max_examples=12, deadline=None)
@given(
    seconds=st.floats(0.0, 11.5), v1=st.booleans(), pause=st.integers(0, 3), forward=st.booleans()
)
def test_a_sequence_cancelled_at_any_time_leaves_the_arm_at_rest_and_can_be_repeated(
    seconds: float, v1: bool, pause: int, forward: bool
) -> None:
    world = World(v1=v1, home=False)
    homing = start(world)
    goal = homing.send_goal(DIRECTIONS)
    world.run(seconds)
    done = list(goal.done_joints)
    homing.cancel()
    assert goal.status is GoalStatus.CANCELED
    assert goal.text == "homing was cancelled"
    for _ in range(pause):
        world.loop.step()
    # A goal sent at once, also in the other direction, is a new homing, not the rest of the old.
    joint = ORDER[min(len(done), 3)]
    sign = math.copysign(1.0, DIRECTIONS[joint]) * (1.0 if forward else -1.0)
    before = world.arm.position(joint)
    other = homing.send_goal({joint: sign})
    world.run(0.8)
    assert world.axis(joint).homing.running
    if v1 and not forward:
        # Original firmware waits for half a second first, and its host until that is over.
        world.run(1.4)
    # At its end stop a joint that goes on forwards backs off first.
    assert forward or (world.arm.position(joint) - before) * sign > 0.0
    homing.cancel()
    world.run(1.0)
    assert other.status is GoalStatus.CANCELED
    for axis in world.hardware.axes:
        assert abs(world.arm.velocity(axis.name)) < 1e-3 * axis.velocity_limit
        assert axis.homed == (axis.name in done and axis.name != joint)
    assert world.supervisor.faults == []


def test_progress_reports_joint_time_and_travel() -> None:
    world = World(home=False, near={"j3": 1.6})
    goal = start(world).trigger("j3", 1.0)
    assert goal is not None
    assert goal.progress is None
    before = world.arm.position("j3")
    world.run(5.0)
    assert goal.progress is not None
    assert goal.progress.joint == "j3"
    assert goal.progress.elapsed == pytest.approx(5.0, abs=0.03)
    assert goal.progress.travel == pytest.approx(world.arm.position("j3") - before, abs=0.03)
    assert goal.progress.travel > 0.2


def test_travel_towards_the_lower_end_counts_up_as_well() -> None:
    world = World(home=False, near={"j3": -1.6})
    goal = start(world).trigger("j3", -1.0)
    assert goal is not None
    world.run(5.0)
    assert goal.progress is not None
    assert goal.progress.travel > 0.2


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_a_joint_without_an_end_stop_is_stopped_at_the_travel_limit(v1: bool) -> None:
    world = World(v1=v1, home=False)
    world.arm.remove_stops("j4")
    begin = world.arm.position("j4")
    homing = start(world, joints=("j4",), max_travel=(0.5,))
    goal = finish(world, homing.send_goal({"j4": 1.0}))
    assert goal.status is GoalStatus.ABORTED
    for word in ("j4 went 0.5", "max_travel is 0.5", "end stop"):
        assert word in goal.text
    world.run(1.0)
    assert 0.48 < world.arm.position("j4") - begin < 0.6
    assert not world.axis("j4").homed
    assert abs(world.arm.velocity("j4")) < 1e-3


def test_mec5_without_an_end_stop_the_joint_reports_why_it_ended() -> None:
    world = World(home=False)
    world.arm.remove_stops("j4")
    goal = finish(world, start(world).send_goal({"j4": 1.0, "j3": 1.0}))
    assert goal.status is GoalStatus.ABORTED
    assert "HOMING_TRAVEL" in goal.text
    assert goal.done_joints == []
    assert [fault.kind for fault in world.supervisor.faults] == [FaultKind.HOMING_FAILED]
    world.run(1.0)
    assert not any(axis.homed for axis in world.hardware.axes)
    assert not world.hardware.axes[2].homing.running


def test_mec4_an_obstacle_is_not_taken_for_the_end_stop() -> None:
    world = World(home=False, near={"j4": 2.9})
    homing = start(world)
    finish(world, homing.send_goal({"j4": 1.0}))
    world.joint("j4").move_steps(round(-0.6 * 12.0 / (2.0 * math.pi) * 200 * 256))
    world.loop.restart()
    world.arm.add_obstacle("j4", 2.7)
    goal = finish(world, homing.send_goal({"j4": 1.0}))
    assert goal.status is GoalStatus.ABORTED
    assert "HOMING" in goal.text
    assert not world.axis("j4").homed
    assert world.supervisor.faults[0].kind is FaultKind.HOMING_FAILED


def test_a_timeout_stops_the_joint_and_the_sequence() -> None:
    world = World(home=False)
    goal = finish(world, start(world, timeout=2.0).send_goal(DIRECTIONS))
    assert goal.status is GoalStatus.ABORTED
    assert goal.text.startswith("j2 was not homed within the timeout of 2 s")
    world.run(1.0)
    assert all(not axis.homed and not axis.homing.running for axis in world.hardware.axes)
    assert all(abs(world.arm.velocity(name)) < 1e-4 for name in NAMES)


def test_a_joint_that_is_lost_while_homing_ends_the_goal_with_the_cause() -> None:
    world = World(home=False)
    goal = start(world).send_goal(DIRECTIONS)
    world.run(1.0)
    world.arm.set_power("j2", False)
    finish(world, goal)
    assert goal.status is GoalStatus.ABORTED
    assert "j2" in goal.text
    assert "acknowledge" in goal.text or "lost" in goal.text
    assert world.supervisor.faults


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_a_joint_that_restarts_while_homing_ends_the_goal_with_the_cause(v1: bool) -> None:
    world = World(v1=v1, home=False)
    goal = start(world).send_goal(DIRECTIONS)
    world.run(1.0)
    world.arm.reset("j2")
    finish(world, goal)
    assert goal.status is GoalStatus.ABORTED
    # While it starts up, one with its original firmware holds the clock when it is read from.
    assert "the first, with j2" in goal.text if v1 else goal.text.startswith("j2")
    assert world.hardware.commands["j2/home"].value == 0.0
    if v1:
        # Only its own power frees the line.
        assert [fault.kind for fault in world.supervisor.faults] == [FaultKind.BUS_STUCK]
        for on in (False, True):
            world.arm.set_power("j2", on)
    # A joint with its original firmware could be seeking its end stop still: it is stopped, after
    # the second for which it is left alone.
    world.run(2.5 if v1 else 0.5)
    assert not world.axis("j2").homing.running
    assert abs(world.arm.velocity("j2")) < 1e-4


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
@pytest.mark.parametrize("lost", [5, 9, 16, 17, 18, 19, 30])
def test_a_joint_that_is_silent_for_a_while_is_stopped_all_the_same(v1: bool, lost: int) -> None:
    world = World(v1=v1, home=False, near={"j3": 1.0})
    goal = start(world).trigger("j3", 1.0)
    assert goal is not None
    world.run(1.0)
    world.bus.off(When(address=LIMITS["j3"].address, count=lost))
    # With original firmware it is left alone for a second once it acknowledges again.
    world.run(3.0 if v1 else 1.5)
    assert goal.done == bool(world.supervisor.faults)
    assert world.axis("j3").homing.running == (not goal.done)
    assert (abs(world.arm.velocity("j3")) < 1e-4) == goal.done


def test_a_joint_that_no_longer_reports_its_state_ends_the_goal_with_the_cause() -> None:
    world = World(home=False, near={"j3": 1.0})
    goal = start(world).trigger("j3", 1.0)
    assert goal is not None
    world.run(1.0)
    world.bus.off(When(address=LIMITS["j3"].address, first=Register.STATE))
    finish(world, goal)
    assert goal.status is GoalStatus.ABORTED
    assert goal.text.startswith("j3 (0x13) is lost: 3 bad cycles in a row")
    world.run(0.5)
    assert abs(world.arm.velocity("j3")) < 1e-4


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_a_joint_whose_answer_to_the_start_is_lost_is_stopped_all_the_same(v1: bool) -> None:
    world = World(v1=v1, home=False, near={"j3": 1.0})
    homing = start(world)
    world.bus.lose(Direction.BACK, When(address=LIMITS["j3"].address, first=Register.HOME, count=3))
    goal = homing.trigger("j3", 1.0)
    assert goal is not None
    world.run(2.0)
    if goal.done:
        assert not world.axis("j3").homing.running
        assert abs(world.arm.velocity("j3")) < 1e-4
    else:
        assert finish(world, goal).status is GoalStatus.SUCCEEDED


def test_a_controller_that_fails_while_homing_leaves_the_joint_stopped() -> None:
    world = World(home=False)
    homing = start(world)
    goal = homing.send_goal(DIRECTIONS)
    world.run(1.0)
    world.hardware.commands["j2/home"].value = math.nan
    world.loop.step()
    assert homing.state is LifecycleState.INACTIVE
    assert goal.status is GoalStatus.ABORTED
    assert not world.axis("j2").homing.running
    assert world.supervisor.faults[0].kind is FaultKind.CONTROLLER_FAILED


def test_a_fault_of_another_joint_ends_the_homing() -> None:
    world = World(home=False)
    goal = start(world).send_goal(DIRECTIONS)
    world.run(1.0)
    world.arm.set_power("j4", False)
    finish(world, goal)
    assert goal.status is GoalStatus.ABORTED
    assert goal.text == "the homing controller was deactivated"
    assert not world.axis("j2").homing.running
    world.run(1.0)
    assert abs(world.arm.velocity("j2")) < 1e-4


@pytest.mark.parametrize("cycles", [0, 1, 30])
def test_a_fault_ends_the_homing_at_any_time_and_no_other_begins_while_it_is_latched(
    cycles: int,
) -> None:
    world = World(home=False)
    homing = start(world)
    world.run(0.1)
    before = world.arm.position("j2")
    goal = homing.send_goal({"j2": 1.0})
    for _ in range(cycles):
        world.loop.step()
    world.supervisor.fault(ControllerError("broken", "any"), "any", world.clock.now())
    assert goal.status is GoalStatus.ABORTED
    world.run(0.5)
    assert world.supervisor.state is FaultState.LATCHED
    assert cycles > 1 or world.arm.position("j2") == pytest.approx(before, abs=1e-4)
    before = world.arm.position("j2")
    with pytest.raises(GoalRejectedError, match="inactive"):
        homing.send_goal({"j2": 1.0})
    with pytest.raises(SwitchError, match="broken"):
        world.switch("homing")
    world.run(1.0)
    assert world.arm.position("j2") == pytest.approx(before, abs=1e-4)


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_a_joint_that_missed_the_stop_of_a_fault_is_sent_it_until_it_answers(v1: bool) -> None:
    world = World(v1=v1, home=False)
    start(world).send_goal({"j3": -1.0})
    world.run(1.0)
    world.bus.lose(Direction.OUT, When(address=0x13, first=Register.STOP, count=3))
    world.supervisor.fault(ControllerError("broken", "any"), "any", world.clock.now())
    assert world.axis("j3").homing.running
    world.run(0.5)
    assert not world.axis("j3").homing.running
    assert abs(world.arm.velocity("j3")) < 0.005
    assert world.arm.has_torque("j3")


def test_switching_is_refused_while_homing_and_changes_nothing() -> None:
    world = World(home=False)
    homing = start(world)
    goal = homing.send_goal(DIRECTIONS)
    world.run(1.0)
    with pytest.raises(ModeSwitchError, match="j2 is homing: command 0 to j2/home first"):
        world.switch(off=("homing",))
    world.load("other", KIND, joints=ORDER)
    with pytest.raises(SwitchError, match="homing has it"):
        world.switch("other")
    assert homing.state is LifecycleState.ACTIVE
    assert finish(world, goal).status is GoalStatus.SUCCEEDED
    world.switch(off=("homing",))


def test_hardware_that_is_deactivated_ends_the_homing() -> None:
    world = World(home=False)
    homing = start(world)
    goal = homing.send_goal(DIRECTIONS)
    world.run(1.0)
    world.manager.set_hardware_state("bioscara_arm", LifecycleState.INACTIVE, world.clock.now())
    assert homing.state is LifecycleState.INACTIVE
    assert goal.status is GoalStatus.ABORTED
    assert goal.text == "the homing controller was deactivated"
    assert abs(world.arm.velocity("j2")) < 1e-4


def test_a_second_goal_and_a_trigger_are_refused_while_a_joint_homes() -> None:
    world = World(home=False)
    homing = start(world)
    goal = homing.send_goal(DIRECTIONS)
    for again in (lambda: homing.send_goal({"j4": 1.0}), lambda: homing.trigger("j4", 1.0)):
        with pytest.raises(GoalRejectedError, match="j2 is homing; cancel that first"):
            again()
        world.run(0.5)
        assert goal.current == "j2"
    homing.trigger("j4", 0.0)
    assert goal.status is GoalStatus.CANCELED


def test_zero_for_a_joint_that_does_not_home_changes_nothing() -> None:
    world = World(home=False)
    homing = start(world)
    assert homing.trigger("j1", 0.0) is None
    goal = homing.send_goal({"j4": 1.0})
    world.run(0.5)
    homing.trigger("j1", 0.0)
    assert goal.current == "j4"
    homing.cancel()
    homing.cancel()
    assert goal.status is GoalStatus.CANCELED


@pytest.mark.parametrize("command", [math.nan, math.inf, -math.inf])
def test_a_command_without_a_direction_is_refused(command: float) -> None:
    world = World(home=False)
    homing = start(world)
    with pytest.raises(GoalRejectedError, match=r"j1: home command .*(no direction|not a finite)"):
        homing.trigger("j1", command)
    with pytest.raises(GoalRejectedError, match=r"has no direction|not a finite"):
        homing.send_goal({"j2": 1.0, "j1": command})
    assert homing.goal is None


def test_unusable_goals_are_refused() -> None:
    world = World(home=False)
    homing = start(world)
    for joint, command in (("j5", 1.0), ("j5", 0.0)):
        with pytest.raises(GoalRejectedError, match="j5 is not a joint of homing; it has j2, j1"):
            homing.trigger(joint, command)
    with pytest.raises(GoalRejectedError, match="names no joint"):
        homing.send_goal({})
    with pytest.raises(GoalRejectedError, match="j1: home command 0"):
        homing.send_goal({"j1": 0.0})
    world.switch(off=("homing",))
    with pytest.raises(GoalRejectedError, match="homing is inactive: activate it first"):
        homing.trigger("j1", 1.0)


def test_a_refused_start_is_reported_with_its_cause() -> None:
    world = World(home=False)
    homing = start(world, joints=("j4",))
    other = world.load("other", KIND, joints=("j1",))
    world.switch("other")
    assert isinstance(other, HomingController)
    running = other.trigger("j1", -1.0)
    world.run(0.3)
    goal = homing.trigger("j4", 1.0)
    assert goal is not None
    world.run(0.1)
    assert goal.status is GoalStatus.ABORTED
    assert "j4 cannot start homing while j1 is homing" in goal.text
    assert running is not None
    assert finish(world, running).status is GoalStatus.SUCCEEDED
    again = homing.trigger("j4", 1.0)
    assert again is not None
    assert finish(world, again).status is GoalStatus.SUCCEEDED


def test_one_broken_answer_at_the_end_of_a_homing_does_not_fail_it() -> None:
    world = World(home=False)
    goal = start(world).trigger("j4", 1.0)
    assert goal is not None
    handle = world.hardware.commands["j4/home"]
    world.run_until(lambda: handle.value == 1.0)
    world.run_until(lambda: handle.value == 0.0)
    broken = world.bus.off(When(address=LIMITS["j4"].address))
    world.loop.step()
    broken.cancel()
    assert world.axis("j4").home.quality is Quality.STALE
    assert not goal.done
    finish(world, goal)
    assert goal.status is GoalStatus.SUCCEEDED


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"joints": ()}, "joints names none"),
        ({"joints": ("j1", "j2"), "max_travel": (1.0,)}, "1 max_travel for 2 joints"),
        ({"joints": ("j1",), "max_travel": (-1.0,)}, "must be above 0"),
        ({"joints": ("j1",), "timeout": 0.0}, "must be above 0"),
        ({"joints": ("j1",), "timeout": math.inf}, "timeout: inf"),
    ],
)
def test_unusable_parameters_are_refused(values: dict[str, object], words: str) -> None:
    world = World(home=False)
    with pytest.raises(ConfigurationError, match=words):
        world.load("homing", KIND, **values)
