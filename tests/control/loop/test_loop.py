"""The loop: its rate, its deadlines, its counters, and that nothing gets past the stop."""

from __future__ import annotations

import math
import sys
import tracemalloc
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, strategies as st

from bioscara import Robot
from bioscara.clock import Clock
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.joint_trajectory import (
    Goal,
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.control.faults.kinds import FaultKind
from bioscara.control.faults.supervisor import FaultState
from bioscara.control.limits.limiter import CommandSource, Limiter, joint_limiters
from bioscara.control.loop.loop import Loop
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.statistics import Histogram
from bioscara.errors import ConfigurationError, OverrunError
from bioscara.hardware import LifecycleState
from bioscara.hardware.command_modes import Mode
from bioscara.sim import FirmwareBus, SimulatedArm
from control.control_stack import LIMITS, NAMES, NEAR, PARAMETERS, World

AT = {"j1": -2.5, "j2": 0.30, "j3": 2.0, "j4": 2.0}
AWAY = [-1.5, 0.25, 1.0, 1.0]


def moving(folder: Path = Path("/nonexistent"), *, v1: bool = False) -> World:
    """An arm that moves from AT to AWAY."""
    world = World(at=AT, folder=folder, v1=v1)
    forward = world.load(
        "forward",
        "forward_command_controller/ForwardCommandController",
        joints=NAMES,
        interface_name="position",
    )
    world.switch("forward")
    forward.command(AWAY)
    world.run(0.5)
    assert world.supervisor.state is FaultState.CLEAR
    return world


def test_a_restart_just_before_a_cycle_begins_the_cycles_anew() -> None:
    world = World(home=False)
    world.run(0.1)
    overruns = world.loop.statistics.overruns

    def write_a_file() -> None:
        world.arm.run(0.5)
        world.loop.restart()

    report = world.loop.step(write_a_file)
    assert (report.period, report.timing.late) == (world.loop.period, 0.0)
    world.run(0.1)
    assert world.supervisor.faults == []
    assert world.loop.statistics.overruns == overruns


def late_inside(world: World, seconds: float) -> None:
    """Let a cycle be delayed between reading and writing."""
    controller = world.manager.controller("forward")
    update = controller.update

    def slow(time: float, period: float) -> None:
        world.arm.run(seconds)
        update(time, period)

    controller.update = slow
    world.loop.step()
    controller.update = update


def come_to_rest(world: World) -> None:
    world.run_until(lambda: world.supervisor.state is FaultState.LATCHED, 8.0)
    world.run(0.5)
    for name in NAMES:
        assert abs(world.arm.velocity(name)) < 0.02 * LIMITS[name].max_velocity + 1e-3


class LateClock:
    """Simulated time on which some waits end late."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.delays: list[float] = []

    def now(self) -> float:
        return self._clock.now()

    def sleep_until(self, deadline: float) -> None:
        self._clock.sleep_until(deadline)
        if self.delays:
            self._clock.sleep_until(deadline + self.delays.pop(0))


def late(world: World) -> LateClock:
    clock = LateClock(world.clock)
    world.loop = Loop(world.manager, world.supervisor, world.record, clock, world.rate)
    return clock


@pytest.mark.parametrize(
    ("rate", "why"),
    [
        *((rate, "outside 20 .. 10000 Hz") for rate in (0, -50, 19, 10_001, 1_000_000)),
        (33.3, "which is not a whole number"),
        *((rate, "which is not a finite number") for rate in (math.nan, math.inf)),
        *((rate, "give a number") for rate in (True, "50")),
    ],
)
def test_an_invalid_rate_is_refused_everywhere_with_the_same_text(rate: Any, why: str) -> None:
    world = World(home=False)
    hardware = (world.hardware,)
    arm = SimulatedArm()
    said = []
    for take in (
        lambda: Loop(world.manager, world.supervisor, world.record, world.clock, rate),
        lambda: ControllerManager(hardware, Limiter(joint_limiters(hardware)), rate),
        lambda: Robot(FirmwareBus(arm), arm.clock, PARAMETERS, "rates", rate=rate),
    ):
        with pytest.raises(ConfigurationError) as caught:
            take()
        said.append(str(caught.value))
    assert said[0].startswith(("rate ", "the rate in Hz "))
    assert why in said[0]
    assert len(set(said)) == 1


@pytest.mark.parametrize("v1", [False, True])
def test_a_rate_that_the_bus_cannot_carry_is_refused_with_the_one_that_it_can(v1: bool) -> None:
    def robot(rate: int | None) -> Robot:
        arm = SimulatedArm(v1=v1)
        return Robot(FirmwareBus(arm), arm.clock, PARAMETERS, "rates", rate=rate)

    with pytest.raises(ConfigurationError, match=r"can carry (\d+) Hz") as caught:
        robot(500).__enter__()
    carried = int(str(caught.value).split("can carry ")[1].split()[0])
    assert 90 <= carried <= 130
    with robot(carried) as at_most:
        assert at_most.period == pytest.approx(1.0 / carried)
    with robot(None) as usual:
        assert usual.period == (0.02 if v1 else 0.01)


def test_deadlines_are_absolute() -> None:
    world = World(home=False)
    world.loop.restart()
    cycles = world.run(0.5)
    first = cycles[0].time
    for number, cycle in enumerate(cycles):
        assert cycle.time == pytest.approx(first + number * world.loop.period, abs=1e-5)


def test_host1_a_late_cycle_is_counted_and_not_caught_up_with_a_burst() -> None:
    world = moving()
    clock = late(world)
    world.run(0.1)
    clock.delays = [1.5 * world.loop.period]
    cycles = world.run(0.2)
    begins = [cycle.time for cycle in cycles]
    gaps = [after - before for before, after in pairwise(begins)]
    assert min(gaps) > 0.45 * world.loop.period
    assert max(cycle.period for cycle in cycles) == pytest.approx(2.5 * world.loop.period, rel=0.01)
    assert world.loop.statistics.overruns == 1
    assert world.supervisor.state is FaultState.CLEAR
    assert world.loop.statistics.late.maximum == pytest.approx(1.5 * world.loop.period, rel=0.01)


def test_host1_a_setpoint_after_a_held_up_cycle_leads_by_no_more_than_a_period() -> None:
    world = moving()
    axis = world.axis("j1")
    speed = axis.velocity_command.value = 0.5
    axis.mode = Mode.TRACK
    for arrival in (0.004, 2.0):
        axis.arrival = arrival
        ahead = axis.setpoint(world.loop.period).position - axis.position_command.value
        assert ahead == pytest.approx(speed * min(arrival, world.loop.period))


def test_host2_three_late_cycles_in_a_row_slow_down_and_stop_only_if_that_does_not_help(
    tmp_path: Path,
) -> None:
    world = moving(tmp_path)
    clock = late(world)
    world.run(0.1)
    clock.delays = [1.2 * world.loop.period] * 2
    world.run(0.2)
    assert not world.supervisor.warnings
    clock.delays = [1.2 * world.loop.period] * 3
    world.run(0.1)
    assert world.supervisor.state is FaultState.CLEAR
    assert "3 cycles in a row" in world.supervisor.warnings[0]
    clock.delays = [1.2 * world.loop.period] * 20
    world.run(0.2)
    assert world.supervisor.state is FaultState.CLEAR
    clock.delays = [1.2 * world.loop.period]
    world.run(0.1)
    assert world.supervisor.faults[0].kind is FaultKind.OVERRUN
    assert "p99" in str(world.supervisor.faults[0])
    come_to_rest(world)


@pytest.mark.parametrize(
    ("cause", "where"),
    [
        ("late waking", "before a cycle"),
        ("the bus", "in a cycle"),
        ("the host's work", "in a cycle"),
        ("the host's work", "between cycles"),
    ],
)
def test_host2_a_late_loop_names_what_took_the_time(cause: str, where: str) -> None:
    world = moving()
    clock = late(world)
    world.run(0.1)
    slow = 1.2 * world.loop.period
    if cause == "the bus":
        world.arm.set_stretch(slow / 4.0)
    for _ in range(3):
        if cause == "late waking":
            clock.delays = [slow]
            world.loop.step()
        elif cause == "the bus":
            world.loop.step()
        elif where == "in a cycle":
            late_inside(world, slow)
        else:
            world.loop.step()
            world.arm.run(2.0 * slow)
    world.arm.set_stretch(0.0)
    world.run(0.05)
    assert f"mostly because of {cause}:" in world.supervisor.warnings[0]


def delays(share: int, period: float) -> list[float]:
    """One late cycle in so many, for two seconds."""
    return ([1.2 * period] + [0.0] * (share - 1)) * (200 // share)


def test_host2_more_than_a_twentieth_late_halves_the_speed_until_a_second_was_good() -> None:
    arm = SimulatedArm(seed=2, frequency=400e3, positions=NEAR)
    clock = LateClock(arm.clock)
    with Robot(FirmwareBus(arm), clock, PARAMETERS, "late") as robot:
        robot.home()
        stack = robot.runner.arm.stack
        slowest = [1.0]

        def observe(_: object) -> None:
            slowest.append(stack.trajectory.scaling)

        clock.delays = [0.0] * 60 + delays(12, robot.period)
        robot.move_joints([1.5, 0.1, -1.0, -1.0], velocity_scaling=0.2, on_cycle=observe)
        assert min(slowest) == pytest.approx(0.5)
        assert slowest[-1] == pytest.approx(1.0)
        assert any("LATE" in warning for warning in stack.supervisor.warnings)
        assert robot.faults == ()


def following(**values: object) -> tuple[World, JointTrajectoryController]:
    """An arm whose joint trajectory controller is active."""
    world = World(at=AT)
    made = world.load(
        "jtc",
        JointTrajectoryController.TYPE,
        joints=NAMES,
        command_interfaces=world.commanded,
        **values,
    )
    assert isinstance(made, JointTrajectoryController)
    world.switch("jtc")
    world.run(0.1)
    return world, made


def test_host2_a_good_second_is_no_fault_when_its_trajectory_controller_has_left() -> None:
    world, _ = following()
    world.run(1.1)
    for _ in range(12):
        world.run(0.1)
        world.arm.run(0.025)
    assert any("LATE" in text for text in world.supervisor.warnings)
    world.switch("hold", off=("jtc",))
    world.run(2.0)
    assert world.supervisor.faults == []


@pytest.mark.parametrize("meanwhile", [None, 0.2, 0.1])
def test_host2_half_of_the_speed_is_half_of_the_chosen_one_also_if_that_changes_later(
    meanwhile: float | None,
) -> None:
    world, controller = following()
    controller.set_scaling(0.2)
    world.run(0.05)
    late = OverrunError("late")
    for _ in range(2):
        world.supervisor.fault(late, "loop", world.clock.now(), FaultKind.LATE)
        world.run(0.6)
    chosen = 0.2 if meanwhile is None else meanwhile
    if meanwhile is not None:
        controller.set_scaling(meanwhile)
        world.run(0.6)
    assert controller.scaling == pytest.approx(0.5 * chosen)
    world.supervisor.full_speed()
    world.run(1.2)
    assert controller.scaling == pytest.approx(chosen)


def test_host2_a_trajectory_controller_that_comes_while_the_loop_is_late_is_slow_too() -> None:
    world, controller = following()
    world.switch(off=("jtc",))
    world.supervisor.fault(OverrunError("late"), "loop", world.clock.now(), FaultKind.LATE)
    world.switch("jtc")
    world.run(0.6)
    assert controller.scaling == pytest.approx(0.5)


def test_host2_more_than_a_fifth_late_stops_the_arm() -> None:
    world = moving()
    clock = late(world)
    clock.delays = delays(3, world.loop.period)
    world.run_until(lambda: bool(world.supervisor.faults), 3.0)
    assert world.supervisor.faults[0].kind is FaultKind.OVERRUN
    assert "last second" in str(world.supervisor.faults[0])
    come_to_rest(world)


def test_host4_a_controller_that_is_stuck_leaves_joints_at_rest_and_a_named_fault() -> None:
    world = moving()
    controller = world.manager.controller("forward")
    update = type(controller).update

    def stuck(time: float, period: float) -> None:
        begin = world.clock.now()
        world.clock.sleep_until(begin + 0.06 + 0.5)
        for name in NAMES:
            assert abs(world.arm.velocity(name)) < 0.02 * LIMITS[name].max_velocity + 1e-3
        world.clock.sleep_until(begin + 2.0)
        controller.update = update.__get__(controller)
        controller.update(time, period)

    controller.update = stuck  # the fault: code that blocks
    before = [world.arm.position(name) for name in NAMES]
    world.loop.step()
    after = [world.arm.position(name) for name in NAMES]
    assert world.supervisor.faults[0].kind is FaultKind.OVERRUN
    come_to_rest(world)
    way = [abs(b - a) for a, b in zip(before, after, strict=True)]
    for name, each in zip(NAMES, way, strict=True):
        limit = LIMITS[name]
        assert each < limit.max_velocity * 0.1 + limit.max_velocity**2 / limit.max_acceleration


@pytest.mark.parametrize("v1", [False, True])
@pytest.mark.parametrize("pause", [0.3, 1.0, 2.5])
def test_host4_the_displacement_missed_in_a_pause_is_not_made_up_for(
    pause: float, *, v1: bool
) -> None:
    world = World(v1=v1, at=AT)
    world.load(
        "trajectory",
        "joint_trajectory_controller/JointTrajectoryController",
        joints=NAMES,
        command_interfaces=world.commanded,
        fallback_controllers=("hold",),
    )
    world.switch("trajectory")
    world.run(0.1)
    controller = world.manager.controller("trajectory")
    assert isinstance(controller, JointTrajectoryController)
    here = tuple(AT.values())
    # j3 stands until 1.5 s, so it does not miss the setpoints of the pause and stays engaged.
    points = (Point(1.5, here), Point(4.5, (*here[:2], here[2] - 0.9, here[3])))
    controller.send_goal(Goal(JointTrajectory(NAMES, points)), world.clock.now())
    world.run(1.45)
    before = world.arm.position("j3")
    world.arm.run(pause)
    cycles = world.run(1.0)
    assert cycles[0].period > pause
    assert world.supervisor.faults[0].kind is FaultKind.OVERRUN
    assert world.arm.position("j3") == pytest.approx(before, abs=2e-3)


@pytest.mark.parametrize("where", ["between cycles", "in a cycle"])
@pytest.mark.parametrize("pause", [0.045, 0.055, 0.065, 0.075, 0.085])
def test_host4_joints_of_version_1_that_heard_nothing_are_no_loss_of_power(
    pause: float, where: str
) -> None:
    """They report that they are off, but not the reason."""
    world = moving(v1=True)
    forward = world.manager.controller("forward")
    assert isinstance(forward, ForwardCommandController)
    forward.command([1.5, 0.05, -1.5, -2.0])
    world.run(0.1)
    if where == "between cycles":
        world.arm.run(pause)
    else:
        late_inside(world, pause)
    world.run(0.1)
    kinds = [fault.kind for fault in world.supervisor.faults]
    assert not kinds or kinds[0] is FaultKind.OVERRUN
    assert FaultKind.POWER_LOST not in kinds
    assert world.hardware.state is LifecycleState.ACTIVE


@pytest.mark.parametrize("pause", [0.1, 0.3, 2.5])
def test_host4_no_command_steps_after_a_pause_by_more_than_a_period_at_full_speed(
    pause: float,
) -> None:
    world = moving()
    guards = world.manager.limiter.joints.values()
    world.arm.run(pause)
    for _ in range(10):
        before = [guard.reference for guard in guards]
        world.loop.step()
        for guard, last in zip(guards, before, strict=True):
            way = LIMITS[guard.name].max_velocity * world.loop.period
            assert abs(guard.reference - last) <= way * 1.01


def test_an_exception_of_a_cycle_ends_in_the_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    world = moving()
    apply = world.manager.limiter.apply
    calls = [0]

    def once(period: float, sources: Sequence[CommandSource]) -> None:
        calls[0] += 1
        if calls[0] == 1:
            raise ZeroDivisionError
        apply(period, sources)

    monkeypatch.setattr(world.manager.limiter, "apply", once)
    world.loop.step()
    assert world.supervisor.faults[0].kind is FaultKind.LOOP_FAILED
    come_to_rest(world)
    assert world.hardware.state is LifecycleState.INACTIVE


def test_cycles_that_keep_failing_release_the_arm(monkeypatch: pytest.MonkeyPatch) -> None:
    world = moving()

    def always(period: float, sources: Sequence[CommandSource]) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(world.manager.limiter, "apply", always)
    world.run(0.03)
    assert world.hardware.state is LifecycleState.INACTIVE
    for name in NAMES:
        assert not world.arm.has_torque(name) or name == "j2"


LINES = 40


@pytest.mark.parametrize("share", [number / LINES for number in range(LINES)])
def test_an_arm_comes_to_rest_after_an_interrupt_in_any_line_of_a_cycle(
    share: float, interrupted: World, lines: int
) -> None:
    world = interrupted
    left = [int(share * lines)]

    def trace(frame: object, event: str, _: object) -> object:
        if "bioscara" not in frame.f_code.co_filename:  # type: ignore[attr-defined]
            return None
        if event == "line" and frame.f_code.co_name != "step":  # type: ignore[attr-defined]
            left[0] -= 1
            if left[0] < 0:
                sys.settrace(None)
                raise KeyboardInterrupt
        return trace

    sys.settrace(trace)  # type: ignore[arg-type]
    try:
        with pytest.raises(KeyboardInterrupt):
            world.loop.step()
    finally:
        sys.settrace(None)
    now = world.clock.now()
    world.run_until(lambda: world.supervisor.stopper.at_rest(world.clock.now(), now), 6.0)
    assert world.supervisor.faults == []
    world.arm.run(0.5)
    for name in NAMES:
        assert abs(world.arm.velocity(name)) < 0.02 * LIMITS[name].max_velocity + 1e-3
    assert world.arm.position("j1") < AWAY[0] - 0.3, "it went on to its target"


def test_an_interrupted_cycle_is_no_fault_and_the_arm_stays_enabled() -> None:
    world = moving()
    transfer = world.bus.transfer

    def interrupted(transactions: object) -> None:
        world.bus.transfer = transfer  # type: ignore[method-assign]
        raise KeyboardInterrupt

    world.bus.transfer = interrupted  # type: ignore[assignment,method-assign]
    with pytest.raises(KeyboardInterrupt):
        world.loop.step()
    begin = world.clock.now()
    assert world.loop.step().time == pytest.approx(begin + world.loop.period)
    world.run(1.0)
    assert world.supervisor.faults == []
    assert world.hardware.state is LifecycleState.ACTIVE


@pytest.fixture
def interrupted() -> World:
    return moving()


@pytest.fixture(scope="module")
def lines() -> int:
    """Lines of Python in one cycle."""
    world, count = moving(), [0]

    def trace(frame: object, event: str, _: object) -> object:
        if "bioscara" not in frame.f_code.co_filename:  # type: ignore[attr-defined]
            return None
        count[0] += event == "line" and frame.f_code.co_name != "step"  # type: ignore[attr-defined]
        return trace

    sys.settrace(trace)  # type: ignore[arg-type]
    world.loop.step()
    sys.settrace(None)
    assert count[0] > 300
    return count[0]


def test_memory_is_flat() -> None:
    world = World(home=False)
    world.run(11.0)
    tracemalloc.start()
    world.run(1.0)
    before = tracemalloc.take_snapshot()
    world.run(20.0)
    grown = sum(each.size_diff for each in tracemalloc.take_snapshot().compare_to(before, "lineno"))
    tracemalloc.stop()
    # The record's ring replaces rows that were made before tracing began.
    record = 1000 * sys.getsizeof((0.0,) * 29) * 4
    assert grown < record


@given(st.lists(st.floats(2e-6, 10.0), min_size=1, max_size=200), st.floats(1.0, 100.0))
def test_percentiles_are_right_to_a_sixteenth(durations: list[float], percent: float) -> None:
    histogram = Histogram()
    for each in durations:
        histogram.add(each)
    exact = sorted(durations)[max(-(-len(durations) * percent // 100.0), 1).__int__() - 1]
    found = histogram.percentile(percent)
    assert exact * (1 - 1e-9) <= found <= exact * 1.07 or found == histogram.maximum


def test_durations_outside_the_bins_are_still_counted() -> None:
    histogram = Histogram()
    for each in (0.0, 1e-9, 1e3):
        histogram.add(each)
    assert histogram.percentile(66.0) <= 1.1e-6
    assert 15.0 < histogram.percentile(67.0) <= 1e3
    assert histogram.maximum == 1e3
