"""The operation in which clients' controllers move a served arm."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from bioscara.api import messages as m
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.joint_trajectory import (
    ErrorCode,
    Goal,
    GoalHandle,
    GoalStatus,
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.control.loop.loop import CycleReport
from bioscara.control.manager.switch_request import Strictness
from bioscara.errors import (
    BusyError,
    ConfigurationError,
    ControllerError,
    GoalRejectedError,
    LeaseError,
    LimitError,
    ModeSwitchError,
    MotionCancelledError,
    SwitchError,
)
from bioscara.hardware import LifecycleState
from bioscara.planning.collision.scene import Box, Scene
from bioscara.robot.operations.controllers.run_controllers import RunControllers
from bioscara.robot.planner import planned_here
from bioscara.robot.workspace.workspace import Workspace
from bioscara.sim import SimulatedArm
from client_controllers import (
    FORWARD,
    JOINTS,
    POSITION_JTC,
    STEP,
    VELOCITY_JTC,
    Site,
    parameter_file,
    site,
    values_of,
)
from served import HALF, RawClient, eventually, own_robot
from simulated import simulated_bus


def fast_bus() -> SimulatedArm:
    """Return an arm on a bus that carries velocities alone at the usual rate."""
    return simulated_bus(seed=2, frequency=400e3, homed=True, at=HALF).arm


@pytest.fixture
def left() -> Iterator[Site]:
    with site() as made:
        yield made


def test_the_first_switch_begins_an_operation_and_the_last_ends_it(left: Site) -> None:
    left.activated(POSITION_JTC)
    assert left.robot.is_moving
    with pytest.raises(BusyError, match="controllers"):
        left.robot.move_relative(z=0.005)
    with pytest.raises(BusyError, match="controllers"):
        left.robot.gripper.open()
    left.robot.controllers.switch((), [POSITION_JTC])
    left.at_rest()
    left.robot.move_relative(z=0.005)
    assert left.states()[POSITION_JTC] == "inactive"


def test_a_goal_is_followed_to_its_end(left: Site) -> None:
    left.activated(POSITION_JTC)
    before = left.positions
    ended = left.ended(left.follow(POSITION_JTC))
    assert (ended.status, ended.error_code) == ("succeeded", 0)
    assert ended.text == "Goal successfully reached!"
    left.passed(0.5)
    moved = [a - b for a, b in zip(left.positions, before, strict=True)]
    assert moved == pytest.approx(STEP, abs=2e-3)


def test_a_trajectory_of_a_topic_is_followed_without_a_goal(left: Site) -> None:
    left.activated(POSITION_JTC)
    before = left.positions
    left.robot.controllers.stream(POSITION_JTC, left.trajectory())
    left.moving()
    start = left.newest.time
    sample = left.robot.controllers.query(POSITION_JTC, start + 0.5)
    assert len(sample.positions) == len(JOINTS)
    with pytest.raises(LimitError):
        left.robot.controllers.query(POSITION_JTC, start + 100.0)
    left.passed(4.0)
    assert left.positions[0] - before[0] == pytest.approx(STEP[0], abs=2e-3)
    assert left.newest.ended == ()


def test_a_stop_leaves_the_controllers_inactive_and_the_next_switch_works(left: Site) -> None:
    left.activated(POSITION_JTC)
    goal = left.follow(POSITION_JTC, time=6.0)
    left.moving()
    left.robot.stop()
    ended = left.ended(goal)
    assert (ended.status, ended.error_code) == ("aborted", ErrorCode.INVALID_GOAL)
    assert "stop" in ended.text
    left.at_rest()
    assert left.states()[POSITION_JTC] == "inactive"
    with pytest.raises(GoalRejectedError, match="activate it first"):
        left.follow(POSITION_JTC)
    left.robot.controllers.switch([POSITION_JTC])
    assert left.ended(left.follow(POSITION_JTC, (0.05, 0.0, 0.0, 0.0))).status == "succeeded"


def test_a_stop_of_another_program_ends_the_lease_too(left: Site) -> None:
    left.activated(POSITION_JTC)
    goal = left.follow(POSITION_JTC, time=6.0)
    left.moving()
    with RawClient() as other:
        other.request(m.StopAll())
    assert left.ended(goal).status == "aborted"
    left.at_rest()
    with pytest.raises(LeaseError):
        left.robot.controllers.switch([POSITION_JTC])
    left.robot.acquire_lease()
    left.robot.controllers.switch([POSITION_JTC])


def test_the_arm_comes_to_rest_when_the_lease_of_a_vanished_client_lapses() -> None:
    with site(speed=2.0) as left:
        begin = left.plant.position("j1")
        section = parameter_file()[POSITION_JTC]
        load = m.LoadController(
            name=POSITION_JTC, type=section["kind"], parameters=section["parameters"]
        )
        with RawClient() as client:
            epoch = client.acquire(time_to_live=2.0)
            client.request(load, epoch)
            client.request(m.ConfigureController(POSITION_JTC), epoch)
            client.request(m.SwitchControllers(activate=(POSITION_JTC,)), epoch)
            goal = Goal(left.trajectory((1.0, 0.0, 0.0, 0.0), time=10.0))
            command = m.FollowGoal(controller=POSITION_JTC, goal=goal)
            number = client.request(command, epoch).goal
            left.moving()
        # The client ends without a release: the lease lapses.
        assert left.ended(number).status == "aborted"
        left.at_rest()
        assert left.plant.position("j1") < begin + 0.6
        assert left.states()[POSITION_JTC] == "inactive"
        left.robot.controllers.unload(POSITION_JTC)


def test_the_end_of_the_lease_stops_the_controllers(left: Site) -> None:
    left.activated(POSITION_JTC)
    goal = left.follow(POSITION_JTC, time=6.0)
    left.moving()
    left.robot.release_lease()
    assert left.ended(goal).status == "aborted"
    left.at_rest()


def test_cancelling_the_operation_stops_the_controllers(left: Site) -> None:
    left.activated(POSITION_JTC)
    goal = left.follow(POSITION_JTC, time=6.0)
    left.moving()
    (operation,) = [
        each for each in left.served.owner.goals.running if each.operation.name == "controllers"
    ]
    operation.operation.cancel()
    assert left.ended(goal).status == "aborted"
    left.at_rest()
    assert left.states()[POSITION_JTC] == "inactive"


@pytest.mark.parametrize("fault", ["obstacle", "reset"])
def test_a_fault_ends_the_goal_with_its_reason(left: Site, fault: str) -> None:
    left.activated(POSITION_JTC)
    goal = left.follow(POSITION_JTC, (0.6, 0.0, 0.0, 0.0), time=3.0)
    left.moving()
    if fault == "obstacle":
        left.plant.add_obstacle("j1", left.plant.position("j1") + 0.05)
    else:
        left.plant.reset("j1")
    ended = left.ended(goal)
    assert ended.status == "aborted"
    eventually(lambda: left.robot.faults)
    assert str(left.robot.faults[0]) in ended.text
    # A joint that restarted has no torque: it coasts for some 40 ms after the operation.
    eventually(lambda: left.speed < 0.01, what="the end of the coasting")
    left.at_rest()
    assert left.states()[POSITION_JTC] == "inactive"
    left.plant.clear_obstacles("j1")
    left.robot.acknowledge()
    left.robot.recover()
    left.robot.controllers.set_hardware_state("bioscara_arm", "active")
    if fault == "obstacle":
        left.robot.controllers.switch([POSITION_JTC])
        assert left.ended(left.follow(POSITION_JTC, (-0.1, 0, 0, 0))).status == "succeeded"
    else:
        with pytest.raises(ModeSwitchError, match="j1 is not homed"):
            left.robot.controllers.switch([POSITION_JTC])


def test_a_pause_holds_the_arm_on_its_trajectory(left: Site) -> None:
    left.activated(POSITION_JTC)
    before = left.positions
    goal = left.follow(POSITION_JTC)
    left.moving()
    left.robot.pause()
    eventually(lambda: left.speed < 1e-3)
    left.passed(1.0)
    held = left.positions
    left.passed(2.0)
    assert left.positions == pytest.approx(held, abs=1e-3)
    assert left.newest.ended == ()
    left.robot.resume()
    assert left.ended(goal).status == "succeeded"
    left.passed(0.5)
    assert left.positions[0] - before[0] == pytest.approx(STEP[0], abs=2e-3)


def test_the_speed_override_and_the_scaling_of_a_controller_multiply(left: Site) -> None:
    left.activated(POSITION_JTC)
    left.robot.speed_override = 0.5
    left.robot.controllers.set_scaling(POSITION_JTC, 0.5)
    begin = left.newest.time
    goal = left.follow(POSITION_JTC, time=1.0)
    left.moving()
    # And with the share by which the speed limit slows the goal down.
    eventually(lambda: 0.1 < left.newest.controllers[0].scaling < 0.25)  # type: ignore[union-attr]
    assert left.ended(goal).status == "succeeded"
    assert left.newest.time - begin > 7.0
    with pytest.raises(GoalRejectedError, match="negative"):
        left.robot.controllers.set_scaling(POSITION_JTC, -1.0)
    # Activated anew it has the scaling of its parameters.
    left.robot.controllers.switch([POSITION_JTC], [POSITION_JTC])
    left.robot.speed_override = 1.0
    begin = left.newest.time
    assert left.ended(left.follow(POSITION_JTC, (-0.05, 0, 0, 0), time=2.0)).status == "succeeded"
    assert left.newest.time - begin < 5.0


@pytest.mark.parametrize("wait", [0.0, 0.5], ids=["planned", "with a stamp"])
def test_a_client_cannot_declare_its_path_clear(left: Site, wait: float) -> None:
    here = left.robot.state.positions
    x, y, z, _ = left.robot.kinematics.forward((here[0] + 0.6, *here[1:]))
    low, high = (x - 0.03, y - 0.03, z - 0.1), (x + 0.03, y + 0.03, z + 0.1)
    left.robot.scene = Scene((Box("rack", low, high),))
    left.activated(POSITION_JTC)
    trajectory = left.trajectory((0.6, 0.0, 0.0, 0.0), time=6.0)
    stamp = left.newest.time + wait if wait else 0.0
    goal = Goal(replace(trajectory, stamp=stamp), collision_checked=True)
    ended = left.ended(left.robot.controllers.follow(POSITION_JTC, goal))
    assert ended.status == "aborted"
    assert "rack" in ended.text
    eventually(lambda: left.speed < 1e-3)
    # A planned one has not begun.
    assert left.positions[0] < here[0] + (0.55 if wait else 1e-3)
    assert left.robot.faults == ()


def test_a_goal_is_planned_anew_if_the_jaws_begin_to_move_meanwhile(
    left: Site, monkeypatch: pytest.MonkeyPatch
) -> None:
    left.robot.controllers.set_hardware_state("bioscara_gripper_128", "active")
    left.activated(POSITION_JTC)
    arm, widths = left.served.robot.runner.arm, []

    def planned(make: Any, workspace: Workspace, *given: Any) -> Any:
        widths.append(workspace.widths)
        if len(widths) == 1:
            arm.jaws.announce(0.112)
        return planned_here(make, workspace, *given)

    monkeypatch.setattr(arm, "planning", planned)
    assert left.ended(left.follow(POSITION_JTC)).status == "succeeded"
    assert [high for _, high in widths] == [pytest.approx(0.08), 0.112]
    arm.jaws.withdraw()


def test_a_goal_that_is_cancelled_while_it_is_planned_does_not_begin(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # So slow that the goal is planned before it has ended, a tenth of a second later.
    with site(speed=0.5) as left:
        left.activated(POSITION_JTC)
        before = left.positions

        def planned(*given: Any) -> Any:
            left.robot.controllers.cancel(POSITION_JTC, 1)
            return planned_here(*given)

        monkeypatch.setattr(left.served.robot.runner.arm, "planning", planned)
        assert left.ended(left.follow(POSITION_JTC)).status == "canceled"
        left.passed(0.3)
        assert left.positions == pytest.approx(before, abs=1e-3)


def test_a_stream_beyond_the_speed_limit_keeps_its_path(left: Site) -> None:
    left.activated(POSITION_JTC)
    here, begin = left.robot.state.positions, len(left.samples)
    left.robot.controllers.stream(POSITION_JTC, left.trajectory(time=1.0))
    left.moving()
    eventually(lambda: left.speed < 1e-3)
    off, scalings = 0.0, set()
    for sample in left.samples[begin:]:
        values = values_of(sample)
        ways = zip(JOINTS, here, STEP, strict=True)
        share = [(values[f"{joint}/position"] - start) / way for joint, start, way in ways]
        off = max(off, *(abs(each - share[0]) * STEP[0] for each in share))
        scalings |= {each.scaling for each in sample.controllers}  # type: ignore[union-attr]
    # 78 mrad where each joint is bounded alone.
    assert off < 0.02
    assert min(scalings) < 0.7


def test_velocities_with_gains_follow_a_goal() -> None:
    with site(arm=fast_bus()) as left:
        left.activated(VELOCITY_JTC)
        before = left.positions
        ended = left.ended(left.follow(VELOCITY_JTC))
        assert ended.status == "succeeded"
        gains = {"p": 2.0, "ff_velocity_scale": 1.0}
        set_parameters = partial(left.robot.controllers.set_parameters, VELOCITY_JTC)
        set_parameters({"gains": dict.fromkeys(JOINTS, gains)})
        left.passed(2.0)
        assert left.positions[0] - before[0] == pytest.approx(STEP[0], abs=5e-3)
        for refused, why in (
            ({"gains": {"j9": gains}}, r"gains\.j9"),
            ({"joints": ["j1"]}, "'joints' may not change"),
        ):
            with pytest.raises(ConfigurationError, match=why):
                set_parameters(refused)
        goal = left.follow(VELOCITY_JTC, (-0.3, 0, 0, 0), time=3.0)
        left.moving()
        # Under velocities alone j4 keeps more room to its limits than the tolerance is.
        end = left.served.robot.parameters.joints[3].upper - left.robot.state.positions[3]
        refused = left.ended(left.follow(VELOCITY_JTC, (0.0, 0.0, 0.0, end)))
        assert (refused.status, "j4 ends at" in refused.text) == ("aborted", True)
        goal = left.follow(VELOCITY_JTC, (-0.3, 0, 0, 0), time=3.0)
        left.moving()
        controller = left.served.robot.runner.arm.stack.manager.controller(VELOCITY_JTC)
        assert (controller.smooth, controller.collision_checked) == (True, False)
        left.robot.stop()
        assert left.ended(goal).status == "aborted"
        left.at_rest()


def test_velocities_that_the_bus_cannot_carry_are_refused_with_the_remedy(left: Site) -> None:
    with pytest.raises(ModeSwitchError, match="take a lower rate"):
        left.activated(VELOCITY_JTC)
    left.at_rest()


@pytest.mark.parametrize("interface", ["position", "velocity"])
def test_commands_are_streamed_and_a_pause_holds_them(interface: str) -> None:
    with site(arm=fast_bus()) as left:
        controllers = left.robot.controllers
        left.load("forward", FORWARD, {"joints": list(JOINTS), "interface_name": interface})
        controllers.switch(["forward"])
        first, *others = left.robot.state.positions

        def stream(target: float) -> None:
            if interface == "velocity":
                controllers.command("forward", (0.1, 0.0, 0.0, 0.0))
            else:
                controllers.command("forward", (first + target, *others))

        for count in range(1, 41):
            stream(0.01 * count)
            left.passed(0.02)
        assert left.positions[0] > first + 0.03
        seen: list[float] = []
        runner = left.served.robot.runner
        runner.observers = (*runner.observers, lambda _: seen.append(left.positions[0]))
        left.robot.pause()
        left.passed(1.0)
        held = left.positions
        assert left.speed < 1e-2
        assert held[0] > max(seen) - 1e-3, "it turned back"
        stream(0.6)
        left.passed(1.0)
        assert left.positions == pytest.approx(held, abs=1e-3)
        left.robot.resume()
        left.moving()
        left.robot.stop()
        left.at_rest()
        with pytest.raises(GoalRejectedError, match="not active"):
            stream(0.0)


def test_a_deactivated_stream_does_not_go_on_when_it_is_activated_anew() -> None:
    with site(arm=fast_bus()) as left:
        controllers = left.robot.controllers
        left.load("forward", FORWARD, {"joints": list(JOINTS), "interface_name": "velocity"})
        controllers.switch(["forward"])
        controllers.command("forward", (0.2, 0.0, 0.0, 0.0))
        left.moving()
        controllers.switch((), ["forward"])
        left.at_rest()
        controllers.switch(["forward"])
        before = left.positions
        left.passed(0.5)
        assert left.positions == pytest.approx(before, abs=1e-3)


def test_controllers_change_hands_in_one_switch_while_the_operation_goes_on(left: Site) -> None:
    controllers = left.robot.controllers
    left.activated(POSITION_JTC)
    left.load("forward", FORWARD, {"joints": list(JOINTS), "interface_name": "position"})
    with pytest.raises(SwitchError, match="has it; deactivate"):
        controllers.switch(["forward"])
    goal = left.follow(POSITION_JTC, time=6.0)
    left.moving()
    controllers.switch(["forward"], [POSITION_JTC])
    assert left.ended(goal).status == "aborted"
    eventually(lambda: left.speed < 1e-3)
    assert left.robot.is_moving
    controllers.switch((), ["forward"])
    left.at_rest()


def test_a_deactivation_in_motion_brings_the_joints_to_rest_together(left: Site) -> None:
    left.activated(POSITION_JTC)
    before = left.positions
    goal = left.follow(POSITION_JTC, (0.6, 0.0, -0.4, 0.5), time=3.0)
    left.moving()
    left.passed(0.5)
    at = left.plant.position("j1")
    left.robot.controllers.switch((), [POSITION_JTC])
    assert left.ended(goal).text == "Current goal cancelled during deactivate transition."
    left.at_rest()
    moved = [a - b for a, b in zip(left.positions, before, strict=True)]
    assert left.plant.position("j1") > at - 1e-3
    # On the line that they followed: each alone would have left it.
    assert moved == pytest.approx([moved[0] * part / 0.6 for part in (0.6, 0, -0.4, 0.5)], abs=2e-3)
    assert left.robot.faults == ()


def test_ctrl_c_brings_the_arm_to_rest_and_ends_the_goal(tmp_path: Path) -> None:
    with own_robot(tmp_path, arm=simulated_bus(seed=2, homed=True, at=HALF).arm) as robot:
        robot.enable()
        stack, plant = robot.runner.arm.stack, robot.bus.arm  # type: ignore[attr-defined]
        controller = stack.manager.load(POSITION_JTC, **_loaded(POSITION_JTC))
        assert isinstance(controller, JointTrajectoryController)
        stack.manager.configure(POSITION_JTC)
        target = Point(4.0, (HALF[0] + 0.5, *HALF[1:]))
        goals: list[GoalHandle] = []

        def observe(cycle: CycleReport) -> None:
            if not goals and controller.state is LifecycleState.ACTIVE:
                goal = Goal(JointTrajectory(JOINTS, (target,)))
                goals.append(controller.send_goal(goal, cycle.time))
            if plant.velocity("j1") > 0.1:
                robot.runner.observers = ()
                raise KeyboardInterrupt

        robot.runner.observers = (observe,)
        with pytest.raises(KeyboardInterrupt):
            robot.runner.execute(RunControllers([POSITION_JTC], [], Strictness.STRICT))
        assert goals[0].status is GoalStatus.ABORTED
        assert goals[0].text.startswith("The controllers were stopped")
        assert controller.state is LifecycleState.INACTIVE
        plant.run(0.3)
        before = plant.position("j1")
        plant.run(0.5)
        assert plant.position("j1") == pytest.approx(before, abs=1e-3)
        assert before < HALF[0] + 0.5
        robot.move_joints(HALF)


class Failing(ForwardCommandController):
    """A controller that cannot be activated."""

    def on_activate(self, time: float) -> None:
        raise ControllerError("it fails", self.name)


def test_controllers_that_best_effort_activates_before_an_error_are_in_the_operation(
    tmp_path: Path,
) -> None:
    with own_robot(tmp_path, arm=simulated_bus(seed=2, homed=True).arm) as robot:
        robot.enable()
        manager = robot.runner.arm.stack.manager
        one = {"joints": ["j1"], "interface_name": "position"}
        good = manager.load("good", FORWARD, one)
        values = {**one, "joints": ["j2"]}
        manager.add(Failing("bad", ForwardCommandController.PARAMETERS.read("bad", values)))
        for name in ("good", "bad"):
            manager.configure(name)
        strict = RunControllers(["good", "bad"], [], Strictness.STRICT)
        with pytest.raises(SwitchError, match="it fails"):
            robot.runner.execute(strict)
        operation = RunControllers(["good", "bad"], [], Strictness.BEST_EFFORT)
        cycles = 0

        def observe(_: CycleReport) -> None:
            nonlocal cycles
            cycles += good.state is LifecycleState.ACTIVE
            if cycles == 20:
                operation.cancel()

        robot.runner.observers = (observe,)
        with pytest.raises(MotionCancelledError):
            robot.runner.execute(operation)
        assert isinstance(operation.switched.exception(), SwitchError)
        assert cycles >= 20
        assert good.state is LifecycleState.INACTIVE


def _loaded(name: str) -> dict[str, Any]:
    given = parameter_file()[name]
    return {"kind": given["kind"], "values": given["parameters"]}
