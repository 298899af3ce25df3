"""Rules 36 to 41: interfaces, the PID, parameters and the reported state."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import FrozenInstanceError, asdict, replace
from typing import Any

import pytest

from bioscara.control.controllers.joint_trajectory import ErrorCode, Gains, GoalStatus, Point
from bioscara.control.controllers.joint_trajectory.pid import Pid
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.errors import ConfigurationError, GoalRejectedError, LimitError
from bioscara.hardware import LifecycleState
from control.control_stack import BOTH, NAMES
from control.controllers.joint_trajectory.follower import NOTHING, TYPE, Follower, alone


def parameters(**values: Any) -> JointTrajectoryParameters:
    return JointTrajectoryParameters.read("jtc", {"joints": NAMES, **values})


@pytest.mark.parametrize("kinds", [("position",), ("velocity",), BOTH])
def test_rule_36_legal_interfaces_move_the_arm(
    follower: Callable[..., Follower], kinds: tuple[str, ...]
) -> None:
    gains = {name: {"p": 5.0, "ff_velocity_scale": 1.0} for name in NAMES}
    arm = follower(command_interfaces=kinds, gains=gains)
    handle = arm.world.hardware.axes[0].position_command
    goal = arm.move(0.0, 1.5)
    goal = goal._replace(
        positions=tuple(
            at + way for at, way in zip(arm.measured, (0.1, 0.005, 0.1, 0.1), strict=True)
        )
    )
    assert arm.finish(arm.send(goal)).status is GoalStatus.SUCCEEDED
    arm.run(0.5)
    assert arm.measured == pytest.approx(goal.positions, abs=3e-3)
    assert (handle.owner == "jtc") == ("position" in kinds)


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"command_interfaces": ("effort",)}, "command_interfaces[0]: 'effort'"),
        ({"command_interfaces": ("velocity", "position")}, "it is position, velocity, or"),
        ({"command_interfaces": ()}, "it is position, velocity, or"),
        ({"state_interfaces": ("velocity",)}, "it is position, or position and velocity"),
        (
            {"command_interfaces": ("velocity",), "state_interfaces": ("position",)},
            "position and velocity must be measured",
        ),
        ({"joints": ()}, "at least one joint"),
        ({"joints": ("j1", "j1")}, "none of them twice"),
        ({"gains": {"j7": {}}}, "gains.j7 is for no joint"),
        ({"constraints": {"j7": {"goal": 1.0}}}, "constraints.j7 is for no joint"),
        (
            {"constraints": {"goal_tim": 1.0}},
            "constraints.goal_tim is not a known parameter; did you mean goal_time?",
        ),
        (
            {"constraints": {"j1": 1.0}},
            "constraints.j1 is not a known parameter; known here: stopped_velocity_tolerance, "
            "stopped_time, "
            "goal_time, decelerate_on_cancel, least_time_on_cancel, a group for each joint",
        ),
        (
            {"constraints": {"j1": {"trajektory": 1.0}}},
            "constraints.j1.trajektory is not a known parameter; did you mean trajectory?",
        ),
        (
            {"speed_scaling": {"initial_scaling_facto": 1.0}},
            "speed_scaling.initial_scaling_facto is not a known parameter; did you mean "
            "initial_scaling_factor?",
        ),
        (
            {"positions_upsampling": {"rate": 1.0}},
            "positions_upsampling.rate is not a known parameter; known here: enable, "
            "policy_frequency",
        ),
        (
            {"gains": {"j1": {"ff_velocity_scal": 1.0}}},
            "gains.j1.ff_velocity_scal is not a known parameter; did you mean ff_velocity_scale?",
        ),
        ({"constraints": {"goal_time": math.inf}}, "constraints.goal_time: inf"),
        ({"constraints": {"j1": {"goal": -1.0}}}, "constraints.j1.goal: -1"),
        ({"gains": {"j1": {"p": math.nan}}}, "gains.j1.p: nan"),
        (
            {"gains": {"j1": {"u_clamp_min": 1.0, "u_clamp_max": 0.0}}},
            "gains.j1: u_clamp_min 1 must not",
        ),
        ({"speed_scaling": {"state_interface": "a/b"}}, "speed_scaling.state_interface: 'a/b'"),
        ({"joints": "j1"}, "joints: 'j1' is not a list"),
        ({"joints": ("j1", 2)}, "joints[1]: 2 is not a valid name"),
        ({"gains": 5.0}, "gains must be a mapping of names to values"),
        ({"gains": {"j1": 5.0}}, "gains.j1 must be a mapping of names to values"),
        ({"constraints": {5: {}}}, "constraints[5] is not a known parameter"),
        ({"cmd_timeout": "1.5"}, "cmd_timeout: '1.5' is not a number"),
        ({"allow_partial_joints_goal": 1}, "allow_partial_joints_goal: 1 is neither true nor"),
        ({"update_rate": 2.5}, "update_rate: 2.5 is not a whole number"),
        ({"joint": NAMES}, "joint is not a known parameter; did you mean joints"),
    ],
)
def test_rule_36_everything_else_is_refused(values: dict[str, Any], why: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        parameters(**values).check("jtc")
    assert why in str(caught.value)


def test_rule_36_a_configuration_without_joints_is_refused(arm: Follower) -> None:
    manager = arm.world.manager
    manager.load("bad", TYPE, {"joints": ()})
    with pytest.raises(ConfigurationError, match="bad: parameter joints must name at least one"):
        manager.configure("bad")
    assert manager.controller("bad").state is LifecycleState.UNCONFIGURED
    manager.unload("bad")


def test_rule_37_velocity_alone_is_feed_forward_and_pid(follower: Callable[..., Follower]) -> None:
    gains = {name: {"p": 2.0, "ff_velocity_scale": 0.8} for name in NAMES}
    arm = follower(command_interfaces=("velocity",), gains=gains)
    start = Point(0.0, arm.measured, NOTHING)
    end = start._replace(time=3.0, positions=(start.positions[0] + 0.3, *start.positions[1:]))
    arm.send(start, end)
    arm.run(1.0)
    for _ in range(20):
        seen = arm.step()
        told = arm.jtc.feedback
        assert told is not None
        next_velocity = arm.jtc.query_state(seen.time + 0.01).velocities[0]
        wanted = 0.8 * next_velocity + 2.0 * told.error.positions[0]
        assert seen.velocities[0] == pytest.approx(wanted, abs=1e-9)


def test_rule_37_the_pid_takes_both_errors_and_the_period() -> None:
    gains = {"a": {"p": 2.0, "i": 5.0, "d": 0.5}}
    jtc, positions, velocities = alone(("velocity",), gains=gains)
    for state in (*positions, *velocities):
        state.value = 0.0
    jtc.on_activate(0.0)
    positions[0].value, velocities[0].value = -1.0, 0.3
    for before in (0.0, 1.0, 2.0):
        jtc.update(0.01, 0.02)
        wanted = 2.0 * 1.0 + before * 5.0 * 1.0 * 0.02 + 0.5 * -0.3
        assert jtc.command_handles[0].value == pytest.approx(wanted)
    assert jtc.command_handles[1].value == 0.0


def test_rule_37_positions_are_forwarded_without_a_pid(follower: Callable[..., Follower]) -> None:
    gains = {name: {"p": 100.0, "ff_velocity_scale": 5.0} for name in NAMES}
    arm = follower(gains=gains)
    arm.send(arm.move(0.1, 2.0))
    arm.run(1.0)
    seen = arm.step()
    ahead = arm.jtc.query_state(seen.time + 0.01)
    assert seen.positions == pytest.approx(ahead.positions, abs=1e-12)
    assert seen.velocities == pytest.approx(ahead.velocities, abs=1e-12)


def test_rule_38_gains_are_zero_unless_given() -> None:
    assert asdict(Gains()) == {
        "p": 0.0,
        "i": 0.0,
        "d": 0.0,
        "ff_velocity_scale": 0.0,
        "u_clamp_max": math.inf,
        "u_clamp_min": -math.inf,
        "i_clamp_max": math.inf,
        "i_clamp_min": -math.inf,
        "antiwindup_strategy": "none",
        "tracking_time_constant": 0.0,
        "error_deadband": 0.0,
    }


def test_rule_38_gains_are_those_of_the_joint() -> None:
    jtc, positions, velocities = alone(("velocity",), gains={"b": {"p": 3.0}, "a": {"p": 2.0}})
    for state in (*positions, *velocities):
        state.value = 0.0
    jtc.on_activate(0.0)
    for state in positions:
        state.value = -1.0
    jtc.update(0.01, 0.01)
    assert [handle.value for handle in jtc.command_handles] == [2.0, 3.0]


def test_rule_38_gains_are_read_again_at_run_time(follower: Callable[..., Follower]) -> None:
    arm = follower(command_interfaces=("velocity",))
    start = arm.measured
    end = Point(2.0, (start[0] + 0.1, *start[1:]), NOTHING)
    arm.send(end)
    arm.run(0.5)
    assert arm.measured == pytest.approx(start, abs=1e-3)
    gains = {"p": 5.0, "ff_velocity_scale": 1.0}
    arm.jtc.change(arm.jtc.parameters.changed("jtc", {"gains": dict.fromkeys(NAMES, gains)}))
    arm.run(2.5)
    assert arm.measured[0] == pytest.approx(end.positions[0], abs=2e-3)
    with pytest.raises(ConfigurationError, match=r"jtc: gains.j9 .*it has j1, j2, j3, j4"):
        arm.jtc.parameters.changed("jtc", {"gains": {"j9": gains}})


def test_constraints_change_at_run_time_and_a_running_goal_keeps_its_own(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints={"goal_time": 0.5})
    away = Point(0.5, (arm.measured[0] + 0.1, *arm.measured[1:]), NOTHING)
    first = arm.send(away)
    arm.run(0.1)
    strict = {"goal_time": 0.1, "j1": {"trajectory": 1e-6}}
    arm.jtc.change(arm.jtc.parameters.changed("jtc", {"constraints": strict}))
    arm.run(1.0)
    assert first.status is GoalStatus.SUCCEEDED
    back = Point(0.5, (arm.measured[0] - 0.1, *arm.measured[1:]), NOTHING)
    second = arm.send(back)
    arm.run(1.0)
    assert second.error_code is ErrorCode.PATH_TOLERANCE_VIOLATED
    with pytest.raises(ConfigurationError, match="'joints' may not change"):
        arm.jtc.parameters.changed("jtc", {"joints": ["j1"]})


def test_rule_39_the_integral_acts_in_the_next_cycle() -> None:
    pid = Pid(Gains(p=2.0, i=10.0, d=0.5))
    assert pid.update(1.0, 4.0, 0.1) == 2.0 + 2.0
    assert pid.update(0.0, 0.0, 0.1) == pytest.approx(1.0)
    pid.reset()
    assert pid.update(0.0, 0.0, 0.1) == 0.0


def test_rule_39_the_output_is_clamped_and_then_the_integral() -> None:
    pid = Pid(Gains(i=10.0, u_clamp_max=1.5, i_clamp_max=2.0))
    outputs = [pid.update(1.0, 0.0, 0.1) for _ in range(4)]
    assert outputs == pytest.approx([0.0, 1.0, 1.5, 1.5])
    assert pid.update(-1.0, 0.0, 0.1) == 1.5
    assert pid.update(0.0, 0.0, 0.1) == pytest.approx(1.0)
    pid = Pid(Gains(i=10.0, u_clamp_min=-1.5, i_clamp_min=-2.0))
    outputs = [pid.update(-1.0, 0.0, 0.1) for _ in range(4)]
    assert outputs == pytest.approx([0.0, -1.0, -1.5, -1.5])
    assert pid.update(1.0, 0.0, 0.1) == -1.5
    assert pid.update(0.0, 0.0, 0.1) == pytest.approx(-1.0)


def test_rule_39_without_a_strategy_it_integrates_however_far_it_is_saturated() -> None:
    pid = Pid(Gains(p=1.0, i=1.0, u_clamp_max=0.5))
    assert pid.update(1.0, 0.0, 1.0) == 0.5
    assert pid.update(-0.8, 0.0, 1.0) == pytest.approx(1.0 - 0.8)


def test_rule_39_conditional_integration_stops_only_further_saturation() -> None:
    gains = Gains(p=1.0, i=1.0, u_clamp_max=0.5, antiwindup_strategy="conditional_integration")
    pid = Pid(gains)
    pid.update(1.0, 0.0, 1.0)
    assert pid.update(0.0, 0.0, 1.0) == 0.0
    pid = Pid(gains)
    pid.update(0.4, 0.0, 1.0)
    assert pid.update(0.0, 0.0, 1.0) == pytest.approx(0.4)
    pid.update(0.4, 0.0, 1.0)
    assert pid.update(-0.1, 0.0, 1.0) == pytest.approx(0.3)
    pid = Pid(replace(gains, d=10.0))
    assert pid.update(-0.2, 1.0, 1.0) == 0.5  # Saturated by its derivative, but brought back.
    assert pid.update(0.0, 0.0, 1.0) == pytest.approx(-0.2)


def test_rule_39_back_calculation_reduces_the_integral_by_the_clipped_part() -> None:
    pid = Pid(
        Gains(
            p=1.0,
            i=1.0,
            u_clamp_max=0.5,
            antiwindup_strategy="back_calculation",
            tracking_time_constant=2.0,
        )
    )
    pid.update(1.0, 0.0, 0.1)
    assert pid.update(0.0, 0.0, 0.1) == pytest.approx(0.1 * (1.0 + (0.5 - 1.0) / 2.0))


@pytest.mark.parametrize(
    ("gains", "time"),
    [
        ({"p": 1.0, "i": 0.25, "d": 4.0}, 4.0),
        ({"p": 1.0, "i": 0.25}, 4.0),
        ({"p": 1.0}, 1.0),
    ],
    ids=["root of d / i", "p / i", "no integral"],
)
def test_rule_39_a_tracking_time_of_0_follows_from_the_gains(
    gains: dict[str, float], time: float
) -> None:
    pid = Pid(Gains(u_clamp_max=0.5, antiwindup_strategy="back_calculation", **gains))
    pid.update(1.0, 0.0, 0.1)
    integral = 0.1 * (gains.get("i", 0.0) + (0.5 - 1.0) / time)
    assert pid.update(0.0, 0.0, 0.1) == pytest.approx(integral)


def test_rule_39_no_period_repeats_no_number_is_none_and_the_deadband_integrates_nothing() -> None:
    pid = Pid(Gains(p=1.0, i=1.0, error_deadband=0.1))
    assert pid.update(0.1, 0.0, 1.0) == 0.1
    assert pid.update(5.0, 5.0, 0.0) == 0.1
    assert pid.update(-0.1, 0.0, 1.0) == -0.1
    assert pid.update(0.0, 0.0, 1.0) == 0.0
    assert pid.update(-0.2, 0.0, 1.0) == -0.2
    assert pid.update(0.0, 0.0, 1.0) == -0.2
    assert math.isnan(pid.update(math.nan, 0.0, 1.0))
    assert math.isnan(pid.update(0.0, math.inf, 1.0))


def test_rule_40_defaults() -> None:
    given = asdict(parameters())
    for name in ("constraints", "gains", "joints"):
        del given[name]
    assert given == {
        "update_rate": 0,
        "fallback_controllers": (),
        "command_interfaces": ("position",),
        "state_interfaces": ("position", "velocity"),
        "action_monitor_rate": 20.0,
        "allow_partial_joints_goal": False,
        "allow_nonzero_velocity_at_trajectory_end": False,
        "allow_integration_in_goal_trajectories": False,
        "allow_trajectory_replacement": True,
        "interpolation_method": "splines",
        "interpolate_from_desired_state": False,
        "set_last_command_interface_value_as_state_on_activation": True,
        "cmd_timeout": 0.0,
        "speed_scaling": {
            "initial_scaling_factor": 1.0,
            "state_interface": "",
            "command_interface": "",
        },
        "positions_upsampling": {"enable": False, "policy_frequency": 0.0},
    }


@pytest.mark.parametrize(
    "name",
    [
        "joints",
        "command_interfaces",
        "state_interfaces",
        "action_monitor_rate",
        "interpolation_method",
        "interpolate_from_desired_state",
    ],
)
def test_rule_40_parameters_are_read_only(name: str) -> None:
    made = parameters()
    with pytest.raises(FrozenInstanceError):
        setattr(made, name, getattr(made, name))


def test_rule_41_the_state_is_reported_in_every_cycle_also_while_holding(arm: Follower) -> None:
    for holding in (True, False):
        if not holding:
            arm.send(arm.move(0.1, 1.0))
        for _ in range(10):
            seen = arm.step()
            state = arm.jtc.controller_state
            assert state is not None
            assert arm.jtc.holding is holding
            assert (state.time, state.joint_names) == (seen.time, NAMES)
            assert state.feedback.positions == seen.measured
            told = arm.jtc.feedback
            assert told is not None
            assert state.trajectory_time == told.trajectory_time < 1.0
            assert state.reference == told.desired
            assert state.error.positions == told.error.positions
            assert state.feedback.accelerations == state.error.accelerations == ()
            assert len(state.feedback.velocities) == len(state.error.velocities) == 4
            assert len(state.reference.accelerations) == 4
            assert state.output == {
                **{f"{n}/position": v for n, v in zip(NAMES, seen.positions, strict=True)},
                **{f"{n}/velocity": v for n, v in zip(NAMES, seen.velocities, strict=True)},
            }
            assert state.speed_scaling_factor == 1.0
    arm.world.switch(off=("jtc",))
    assert arm.jtc.controller_state is None


def test_rule_41_velocities_are_reported_only_where_they_are_measured(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(command_interfaces=("position",), state_interfaces=("position",))
    state = arm.jtc.controller_state
    assert state is not None
    assert state.feedback.velocities == state.error.velocities == ()
    assert set(state.output) == {f"{name}/position" for name in NAMES}


def test_rule_41_the_trajectory_answers_where_it_will_be(arm: Follower) -> None:
    with pytest.raises(GoalRejectedError, match="jtc holds"):
        arm.jtc.query_state(arm.now)
    start, end = Point(0.0, arm.commanded, NOTHING), arm.move(0.1, 1.0)
    arm.send(start, end)
    begin = arm.step().time
    middle = arm.jtc.query_state(begin + 0.5)
    assert middle.positions[0] == pytest.approx(start.positions[0] + 0.05)
    for time in (begin - 0.1, begin + 1.1):
        with pytest.raises(LimitError, match="time in the trajectory of jtc"):
            arm.jtc.query_state(time)
    arm.world.switch(off=("jtc",))
    with pytest.raises(GoalRejectedError, match="jtc is inactive"):
        arm.jtc.query_state(begin + 0.5)


def test_rule_41_the_trajectory_answers_at_the_scaled_speed(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(speed_scaling={"initial_scaling_factor": 0.5})
    start = arm.commanded
    arm.send(Point(0.0, start, NOTHING), arm.move(0.1, 1.0))
    begin = arm.step().time
    assert arm.jtc.query_state(begin + 1.0).positions[0] == pytest.approx(start[0] + 0.05)
    with pytest.raises(LimitError):
        arm.jtc.query_state(begin + 2.1)
