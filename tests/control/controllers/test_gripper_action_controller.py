"""The gripper action controller, on jaws with commanded width, measured width or blocked motion."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from bioscara.clock import SimulatedClock
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.gripper_messages import GripperGoal, GripperGoalHandle
from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.manager.manager import ControllerManager
from bioscara.drivers import Gripper, Pwm, Quality
from bioscara.errors import ConfigurationError, GoalRejectedError, SwitchError
from bioscara.hardware import CommandInterface, HardwareComponent, LifecycleState, StateInterface
from bioscara.hardware.gripper import GripperHardware
from bioscara.model import JointParameters, load_parameters
from bioscara.sim.servo import SimulatedServo

KIND = "parallel_gripper_action_controller/GripperActionController"
RATE = 100
PERIOD = 1.0 / RATE
GRIPPER = load_parameters().gripper
LOWER, UPPER = GRIPPER.lower, GRIPPER.upper


class Jaws(HardwareComponent):
    """Jaws on a servo; ``speed`` is infinite for one that only repeats its command."""

    def __init__(self, speed: float, blocked: float = 0.0) -> None:
        super().__init__("jaws", "actuator")
        self.speed, self.blocked = speed, blocked
        self.tremble = 0.0
        self.width = self.target = 0.08
        self.extras = [CommandInterface("gripper", kind) for kind in ("max_velocity", "max_effort")]
        self.command = CommandInterface("gripper", "position")
        self.position = StateInterface("gripper", "position")
        self.velocity = StateInterface("gripper", "velocity")
        self.states = {state.name: state for state in (self.position, self.velocity)}
        self.commands = {handle.name: handle for handle in (self.command, *self.extras)}

    @property
    def limits(self) -> Mapping[str, JointParameters]:
        return {}

    def on_configure(self) -> None:
        """Nothing to do."""

    def on_activate(self) -> None:
        self.command.value = self.target = self.width
        self._publish(0.0)

    def on_deactivate(self) -> None:
        self._forget()

    def on_cleanup(self) -> None:
        """Nothing to do."""

    def on_shutdown(self, before: LifecycleState) -> None:
        """Nothing to do."""

    def on_error(self, before: LifecycleState) -> None:
        """Nothing to do."""

    def read(self, time: float, period: float) -> None:
        if self.state is not LifecycleState.ACTIVE:
            return
        before = self.width
        reach = self.speed * period
        self.width += min(max(self.target - self.width, -reach), reach)
        self.width = max(self.width, self.blocked)
        self._publish((self.width - before) / period + self.tremble)

    def write(self, time: float, period: float) -> None:
        if self.command.owner is not None:
            self.target = min(max(self.command.value, LOWER), UPPER)

    def _publish(self, velocity: float) -> None:
        self.position.value, self.velocity.value = self.width, velocity
        self.position.quality = self.velocity.quality = Quality.FRESH


class Bench:
    """A gripper under a manager, in virtual time."""

    def __init__(
        self,
        speed: float = math.inf,
        blocked: float = 0.0,
        hardware: HardwareComponent | None = None,
        **values: object,
    ) -> None:
        self.jaws = Jaws(speed, blocked)
        component = hardware or self.jaws
        component.set_state(LifecycleState.ACTIVE)
        self.manager = ControllerManager((component,), Limiter(joint_limiters((component,))), RATE)
        self.time = 0.0
        self.manager.load("gripper", KIND, {"joint": "gripper", **values})
        self.manager.configure("gripper")
        controller = self.manager.controller("gripper")
        assert isinstance(controller, GripperActionController)
        self.controller = controller
        self.manager.switch(0.0, ("gripper",))

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * RATE)):
            self.time += PERIOD
            self.manager.cycle(self.time, PERIOD)
            assert not self.manager.failures

    def finish(self, handle: GripperGoalHandle, seconds: float = 10.0) -> float:
        """Run until a goal ended; returns how long that took [s]."""
        start = self.time
        while not handle.done:
            self.run(PERIOD)
            assert self.time - start < seconds
        return self.time - start

    def go(self, width: float) -> GripperGoalHandle:
        return self.controller.send_goal(GripperGoal((width,)))


def test_rule_71_defaults_are_those_of_the_field() -> None:
    parameters = Bench().controller.parameters
    assert parameters.goal_tolerance == 0.01
    assert parameters.stall_velocity_threshold == 0.001
    assert parameters.stall_timeout == 1.0
    assert parameters.allow_stalling is False
    assert (parameters.max_effort, parameters.max_velocity) == (10.0, 0.1)
    assert parameters.action_monitor_rate == 20.0


@given(width=st.floats(LOWER, UPPER), speed=st.floats(0.02, 5.0))
def test_rule_71_succeeds_as_soon_as_the_position_is_within_tolerance(
    width: float, speed: float
) -> None:
    bench = Bench(speed)
    distance = abs(width - 0.08)
    took = bench.finish(bench.go(width))
    assert bench.controller.goal is not None
    result = bench.controller.goal.result
    assert bench.controller.goal.status is GoalStatus.SUCCEEDED
    assert result is not None
    assert (result.reached_goal, result.stalled) == (True, False)
    assert abs(result.position - width) < 0.01
    needed = max(distance - 0.01, 0.0) / min(speed, 1.0)
    assert needed - 1e-9 <= took <= needed + 4.0 * PERIOD


@given(width=st.floats(LOWER, UPPER))
def test_a_servo_without_feedback_takes_the_time_that_it_needs(width: float) -> None:
    bench = Bench(math.inf)
    handle = bench.go(width)
    took = bench.finish(handle)
    assert handle.status is GoalStatus.SUCCEEDED
    assert took >= (abs(width - 0.08) - 0.01) / 1.0
    assert took < 0.1


def test_the_assumed_speed_of_a_servo_without_feedback_is_a_parameter() -> None:
    bench = Bench(math.inf, velocity_limit=0.02)
    handle = bench.go(0.12)
    took = bench.finish(handle)
    assert handle.status is GoalStatus.SUCCEEDED
    # The whole stroke, which ends at 0.112 m, although its last centimetre is within the tolerance.
    assert took == pytest.approx(0.032 / 0.02, abs=0.05)


def test_rule_71_a_gripper_that_is_held_up_aborts_after_the_stall_timeout() -> None:
    bench = Bench(0.1, blocked=0.06)
    handle = bench.go(0.04)
    took = bench.finish(handle)
    assert handle.status is GoalStatus.ABORTED
    assert took == pytest.approx(0.2 + 1.0, abs=0.05)
    assert handle.result is not None
    assert (handle.result.reached_goal, handle.result.stalled) == (False, True)
    assert handle.result.position == pytest.approx(0.06)
    assert handle.text == (
        "gripper does not move at 0.06 m, before its goal of 0.04 m; check what blocks it"
    )
    bench.run(0.1)
    assert bench.jaws.command.value == 0.04  # It keeps pressing.


def test_rule_71_a_gripper_that_may_stall_has_gripped() -> None:
    bench = Bench(0.1, blocked=0.06, allow_stalling=True, stall_timeout=0.3)
    handle = bench.go(0.04)
    took = bench.finish(handle)
    assert handle.status is GoalStatus.SUCCEEDED
    assert took == pytest.approx(0.5, abs=0.05)
    assert handle.result is not None
    assert (handle.result.reached_goal, handle.result.stalled) == (False, True)


@pytest.mark.parametrize(
    ("speed", "ends"), [(0.0009, GoalStatus.ABORTED), (0.0011, GoalStatus.EXECUTING)]
)
def test_rule_71_below_the_velocity_threshold_is_no_motion(speed: float, ends: GoalStatus) -> None:
    bench = Bench(speed)
    handle = bench.go(0.12)
    bench.run(2.0)
    assert handle.status is ends


@pytest.mark.parametrize("tremble", [0.002, -0.002])
def test_rule_71_jaws_that_move_to_and_fro_are_not_stalled(tremble: float) -> None:
    bench = Bench(0.1, blocked=0.06)
    bench.jaws.tremble = tremble
    handle = bench.go(0.04)
    bench.run(3.0)
    assert handle.status is GoalStatus.EXECUTING


def test_rule_71_jaws_that_reach_their_goal_at_once_are_not_stalled() -> None:
    bench = Bench(math.inf, velocity_limit=0.02)
    handle = bench.go(0.12)
    assert bench.finish(handle) > 1.1
    assert handle.status is GoalStatus.SUCCEEDED


def test_rule_71_motion_starts_the_stall_timeout_anew() -> None:
    bench = Bench(0.01, blocked=0.08)
    handle = bench.go(0.04)
    for _ in range(4):
        bench.run(0.8)
        assert not handle.done
        bench.jaws.blocked -= 0.002
        bench.run(0.1)
    bench.run(1.2)
    assert handle.status is GoalStatus.ABORTED


def test_rule_71_a_new_goal_cancels_the_old_one() -> None:
    bench = Bench(0.1)
    first = bench.go(0.12)
    bench.run(0.1)
    second = bench.go(0.04)
    assert first.status is GoalStatus.CANCELED
    assert first.text == "a newer goal took its place"
    assert first.result is not None
    assert first.result.reached_goal is False
    assert first.result.position == pytest.approx(0.09, abs=0.002)
    bench.finish(second)
    assert second.status is GoalStatus.SUCCEEDED
    assert bench.jaws.width < 0.051


def test_rule_71_the_stall_timeout_of_a_new_goal_starts_anew() -> None:
    bench = Bench(0.1, blocked=0.08)
    bench.go(0.04)
    bench.run(0.9)
    second = bench.go(0.05)
    assert bench.finish(second) == pytest.approx(1.0, abs=0.05)
    assert second.status is GoalStatus.ABORTED


def test_rule_71_a_refused_goal_leaves_the_old_one_alone() -> None:
    bench = Bench(0.1)
    first = bench.go(0.12)
    bench.run(0.1)
    with pytest.raises(GoalRejectedError):
        bench.go(math.nan)
    bench.finish(first)
    assert first.status is GoalStatus.SUCCEEDED


@pytest.mark.parametrize("speed", [0.1, math.inf])
def test_rule_71_cancel_holds_where_the_gripper_is(speed: float) -> None:
    bench = Bench(speed, velocity_limit=0.1)
    handle = bench.go(0.12)
    bench.run(0.2)
    here = bench.controller.position
    assert here == pytest.approx(0.1, abs=0.003)
    bench.controller.cancel()
    assert handle.status is GoalStatus.CANCELED
    bench.run(1.0)
    assert bench.jaws.target == here
    assert bench.controller.position == pytest.approx(here, abs=0.002)
    bench.controller.cancel()
    assert handle.status is GoalStatus.CANCELED


@pytest.mark.parametrize("positions", [(), (0.05, 0.06)])
def test_rule_71_exactly_one_position_or_reject(positions: tuple[float, ...]) -> None:
    bench = Bench()
    with pytest.raises(GoalRejectedError, match=f"{len(positions)} positions.*exactly one"):
        bench.controller.send_goal(GripperGoal(positions))
    bench.run(0.1)
    assert bench.jaws.target == 0.08


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_position_that_is_not_finite_is_refused(value: float) -> None:
    bench = Bench()
    with pytest.raises(GoalRejectedError, match=f"gripper: position .* is {value}, which"):
        bench.go(value)
    bench.run(0.1)
    assert bench.jaws.target == 0.08


@pytest.mark.parametrize("value", [0.0399, 0.1121, -1.0])
def test_a_position_beyond_the_limits_is_refused_with_value_limits_and_remedy(
    value: float,
) -> None:
    bench = Bench(limits=(LOWER, UPPER))
    with pytest.raises(GoalRejectedError) as refusal:
        bench.go(value)
    assert str(refusal.value) == (
        f"gripper: position {value:g} m is outside 0.04 .. 0.112 m; "
        "give a width between these, in metres"
    )
    bench.run(0.1)
    assert bench.jaws.target == 0.08
    for width in (LOWER, UPPER):
        bench.finish(bench.go(width))


@pytest.mark.parametrize("what", ["velocity", "effort"])
@pytest.mark.parametrize("values", [(math.nan,), (math.inf,), (-1.0,), (0.0,), (1.0, 2.0)])
def test_unusable_speeds_and_efforts_are_refused(what: str, values: tuple[float, ...]) -> None:
    bench = Bench()
    with pytest.raises(GoalRejectedError, match=what):
        bench.controller.send_goal(GripperGoal((0.05,), **{what: values}))


def test_rule_71_speed_and_effort_go_only_where_interfaces_are_named() -> None:
    plain = Bench()
    plain.finish(plain.controller.send_goal(GripperGoal((0.1,), (0.5,), (3.0,))))
    assert plain.controller.command_interfaces == ("gripper/position",)
    bench = Bench(
        max_velocity_interface="gripper/max_velocity", max_effort_interface="gripper/max_effort"
    )
    bench.run(PERIOD)
    assert [handle.value for handle in bench.jaws.extras] == [0.1, 10.0]
    bench.finish(bench.controller.send_goal(GripperGoal((0.1,), (0.5,), (3.0,))))
    assert [handle.value for handle in bench.jaws.extras] == [0.5, 3.0]
    bench.finish(bench.go(0.05))
    assert [handle.value for handle in bench.jaws.extras] == [0.1, 10.0]
    bench.controller.send_goal(GripperGoal((0.1,), (0.5,), (3.0,)))
    bench.controller.cancel()
    bench.run(PERIOD)
    assert [handle.value for handle in bench.jaws.extras] == [0.1, 10.0]


def test_feedback_reports_the_position_while_the_goal_runs() -> None:
    bench = Bench(0.1)
    handle = bench.go(0.12)
    assert handle.feedback is None
    bench.run(0.2)
    assert handle.feedback is not None
    assert handle.feedback.time == pytest.approx(bench.time)
    assert handle.feedback.position == pytest.approx(bench.jaws.width)
    assert handle.feedback.velocity == pytest.approx(0.1)
    assert handle.feedback.quality is Quality.FRESH
    with pytest.raises(AttributeError):
        handle.feedback.position = 0.0  # type: ignore[misc]


def test_activation_moves_nothing_and_forgets_the_goal_of_before() -> None:
    bench = Bench(0.1)
    handle = bench.go(0.12)
    bench.run(0.1)
    bench.manager.switch(bench.time, (), ("gripper",))
    assert handle.status is GoalStatus.ABORTED
    assert handle.text == "the gripper controller was deactivated"
    with pytest.raises(GoalRejectedError, match="gripper is inactive: activate it first"):
        bench.go(0.05)
    bench.jaws.width = bench.jaws.target = 0.07
    bench.run(0.1)
    bench.manager.switch(bench.time, ("gripper",))
    bench.run(0.5)
    assert bench.jaws.width == 0.07


def test_a_gripper_of_unknown_width_is_not_commanded() -> None:
    bench = Bench()
    bench.manager.switch(bench.time, (), ("gripper",))
    bench.jaws.position.forget()
    with pytest.raises(SwitchError, match="gripper/position is nan; activate the gripper first"):
        bench.manager.switch(bench.time, ("gripper",))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "gripper: joint is missing"),
        ({"joint": ""}, "joint"),
        ({"joint": "gripper", "goal_tolerance": 0.0}, "goal_tolerance"),
        ({"joint": "gripper", "stall_timeout": math.nan}, "stall_timeout"),
        ({"joint": "gripper", "velocity_limit": -1.0}, "velocity_limit"),
        ({"joint": "gripper", "goal_tolerence": 0.1}, "did you mean goal_tolerance"),
        ({"joint": "gripper", "limits": (0.1,)}, r"limits\[1\] is missing"),
        ({"joint": "gripper", "limits": (0.1, 0.1)}, "the first must be below the second"),
    ],
)
def test_unusable_parameters_are_refused(values: dict[str, object], words: str) -> None:
    manager = ControllerManager((), Limiter(joint_limiters(())), RATE)
    with pytest.raises(ConfigurationError, match=words):
        _made(manager, values)


def _made(manager: ControllerManager, values: dict[str, object]) -> None:
    manager.load("gripper", KIND, values)
    manager.configure("gripper")


@pytest.fixture
def servo() -> Iterator[SimulatedServo]:
    with SimulatedServo(GRIPPER.outputs[0]) as simulated:
        yield simulated


def on(servo: SimulatedServo, folder: Path, **values: object) -> Bench:
    """Return a bench with the arm's own gripper."""
    clock = SimulatedClock(lambda: 0.0, lambda _: None)
    driver = Gripper(Pwm(GRIPPER.outputs, clock, servo.root), GRIPPER, folder / "width")
    return Bench(hardware=GripperHardware("gripper", "gripper", driver, clock), **values)


def test_the_servo_gets_the_goal_at_once_and_the_goal_ends_when_the_jaws_can_have_reached_it(
    servo: SimulatedServo, tmp_path: Path
) -> None:
    bench = on(servo, tmp_path)
    before = servo.pulse()
    handle = bench.go(0.04)
    bench.run(PERIOD)
    assert before is not None
    assert servo.pulse() == pytest.approx(0.0015 + 3333.3 * (0.04 - 0.058) * 0.0005 / 90, abs=2e-9)
    took = PERIOD + bench.finish(handle)
    assert took == pytest.approx((0.08 - 0.04 - 0.01) / 1.0, abs=3.0 * PERIOD)
    assert handle.status is GoalStatus.SUCCEEDED
    assert handle.result is not None
    assert handle.result.quality is Quality.ASSUMED


def test_a_goal_that_the_servo_cannot_quite_reach_is_reached_within_its_tolerance(
    servo: SimulatedServo, tmp_path: Path
) -> None:
    bench = on(servo, tmp_path)
    handle = bench.go(0.12)
    bench.finish(handle)
    assert handle.status is GoalStatus.SUCCEEDED
    assert servo.pulse() == pytest.approx(0.0025, abs=1e-7)
    strict = on(servo, tmp_path, goal_tolerance=0.001)
    refused = strict.go(0.12)
    strict.finish(refused)
    assert refused.status is GoalStatus.ABORTED
    assert "gripper does not move at 0.112 m, before its goal of 0.12 m" in refused.text


def test_cancel_stops_the_moving_servo(servo: SimulatedServo, tmp_path: Path) -> None:
    bench = on(servo, tmp_path, velocity_limit=0.1)
    handle = bench.go(0.11)
    bench.run(0.1)
    bench.controller.cancel()
    bench.run(0.1)
    assert handle.status is GoalStatus.CANCELED
    assert bench.controller.position == pytest.approx(0.089, abs=0.003)
    width = 0.058 + (servo.pulse() - 0.0015) * 90 / 0.0005 / 3333.3
    assert width == pytest.approx(bench.controller.position, abs=1e-5)
