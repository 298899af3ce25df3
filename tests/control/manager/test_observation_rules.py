"""The data that a node needs to publish as ros2_control does: rules 66 to 68, without ROS."""

from __future__ import annotations

import math
import statistics
import tracemalloc
from collections.abc import Callable

import pytest
from hypothesis import given, strategies as st

from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.manager.diagnostics import (
    Level,
    Thresholds,
    default_thresholds,
    diagnose,
)
from bioscara.control.manager.introspection import introspect
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.statistics import READ, Spread, SpreadSummary
from bioscara.errors import InvalidArgumentError, SwitchError
from bioscara.hardware import LifecycleState
from control.control_stack import NAMES, World
from control.scripted_controller import Box, Wild, boom, wild

J1 = "j1/position"
POSITION = "g/position"


def boxed() -> tuple[ControllerManager, Box]:
    box = Box()
    return ControllerManager((box,), Limiter(joint_limiters((box,))), 100), box


class RealTime:
    """The clock of the computer, which passes with the cycles."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 0.0
        monkeypatch.setattr("bioscara.control.manager.statistics.perf_counter", lambda: self.now)

    def cycle(self, manager: ControllerManager, *periods: float) -> None:
        """Run a cycle after each period of real time [s]; the arm's own is 10 ms."""
        for period in periods:
            self.now += period
            manager.cycle(0.0, 0.01)


@pytest.fixture
def real_time(monkeypatch: pytest.MonkeyPatch) -> RealTime:
    return RealTime(monkeypatch)


def load(manager: ControllerManager, name: str, **values: object) -> Wild:
    manager.load(name, Wild.TYPE, {"commands": (POSITION,), **values})
    manager.configure(name)
    controller = manager.controller(name)
    assert isinstance(controller, Wild)
    return controller


def test_rule_66_every_change_of_a_controller_or_of_hardware_is_an_activity() -> None:
    manager, box = boxed()
    seen = manager.activity

    def differs(step: Callable[[], object]) -> None:
        nonlocal seen
        step()
        assert manager.activity > seen
        seen = manager.activity

    differs(lambda: manager.load("a", Wild.TYPE, {"commands": (POSITION,)}))
    differs(lambda: manager.configure("a"))
    differs(lambda: manager.configure("a"))
    differs(lambda: manager.switch(0.0, ("a",)))
    differs(lambda: manager.switch(0.0, ("a",), ("a",)))
    for state in (LifecycleState.INACTIVE, LifecycleState.UNCONFIGURED, LifecycleState.ACTIVE):
        differs(lambda state=state: manager.set_hardware_state("box", state, 0.0))
    differs(box.deactivate)
    differs(box.activate)
    differs(lambda: manager.cleanup("a"))
    differs(lambda: manager.unload("a"))
    controller = load(manager, "b")
    manager.switch(0.0, ("b",))
    seen = manager.activity
    controller.hooks["update"] = boom()
    differs(lambda: manager.cycle(0.01, 0.01))
    assert controller.state is LifecycleState.INACTIVE
    box.breaks.add("read")
    differs(lambda: manager.cycle(0.02, 0.01))
    assert box.state is LifecycleState.UNCONFIGURED
    differs(lambda: manager.shutdown(0.03))


def test_rule_66_a_request_without_effect_is_no_activity() -> None:
    manager, _ = boxed()
    load(manager, "a")
    load(manager, "b")
    manager.switch(0.0, ("a",))
    before = manager.activity
    with pytest.raises(SwitchError):
        manager.switch(0.0, ("b",))
    for refused in (manager.configure, manager.cleanup, manager.unload):
        with pytest.raises(SwitchError):
            refused("a")
    with pytest.raises(SwitchError):
        manager.load("a", Wild.TYPE)
    manager.set_hardware_state("box", LifecycleState.ACTIVE, 0.0)
    for _ in range(10):
        manager.cycle(0.0, 0.01)
    assert manager.activity == before


@given(st.lists(st.floats(-1e6, 1e6).map(lambda each: round(each, 6)), min_size=1, max_size=200))
def test_rule_67_a_spread_is_that_of_all_values(values: list[float]) -> None:
    spread = Spread()
    for number, value in enumerate(values):
        spread.add(value)
        if number % 7 == 0:
            spread.summary()
    found = spread.summary()
    scale = max(map(abs, values)) or 1.0
    assert found.average == pytest.approx(statistics.fmean(values), abs=1e-12 * scale)
    deviation = statistics.pstdev(values)
    assert found.standard_deviation == pytest.approx(deviation, abs=1e-7 * scale)
    assert (found.min, found.max) == (min(values), max(values))
    assert (found.sample_count, found.current_value) == (len(values), values[-1])


def test_rule_67_a_small_deviation_from_a_large_average_is_exact() -> None:
    spread = Spread()
    for number in range(100_000):
        spread.add(1e6 + (-1) ** number * 1e-3)
    assert spread.summary().standard_deviation == pytest.approx(1e-3, rel=1e-3)


def test_rule_67_a_spread_of_nothing_is_unknown_and_memory_does_not_grow() -> None:
    spread = Spread()
    empty = spread.summary()
    assert empty.sample_count == 0
    assert all(math.isnan(each) for each in (*empty[:4], empty.current_value))
    for number in range(100):
        spread.add(float(number))
    tracemalloc.start()
    for number in range(10_000):
        spread.add(number * 0.1)
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert size < 3000


def test_rule_67_each_controller_is_timed_from_its_activation_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    world = World(home=False)
    monkeypatch.setattr("bioscara.control.manager.statistics.perf_counter", world.clock.now)
    a = wild(world, "a", states=(J1,))
    half = wild(world, "half", states=(J1,), update_rate=50)
    begin = world.manager.statistics.read["bioscara_arm"].summary().sample_count
    world.switch("a", "half")
    world.run(0.5)
    ours = a.statistics.periodicity.summary()
    assert (ours.sample_count, ours.average) == (49, pytest.approx(100.0, rel=0.01))
    assert half.statistics.periodicity.summary().average == pytest.approx(50.0, rel=0.01)
    assert half.statistics.execution_time.summary().sample_count == pytest.approx(25, abs=1)
    cycles = world.manager.statistics.periodicity.summary()
    assert cycles.sample_count == begin + 48, "of all cycles but the first two"
    assert a.statistics.execution_time.summary().sample_count == 50
    for spreads in (world.manager.statistics.read, world.manager.statistics.write):
        assert spreads["bioscara_arm"].summary().sample_count == begin + 50
    world.switch("a", off=("a",))
    assert a.statistics.periodicity.summary().sample_count == 0


def test_rule_67_a_jitter_of_the_cycle_is_seen_in_real_time(real_time: RealTime) -> None:
    manager, _ = boxed()
    a = load(manager, "a")
    manager.switch(0.0, ("a",))
    real_time.cycle(manager, 0.01, *(0.01, 0.02) * 50)
    assert a.statistics.periodicity.summary().standard_deviation == pytest.approx(25.0)
    manager.statistics.restart()
    real_time.cycle(manager, 5.0)
    summary = manager.statistics.periodicity.summary()
    assert a.statistics.periodicity.summary().min == pytest.approx(50.0), "no pause is a period"
    assert (summary.min, summary.max, summary.average) == pytest.approx((50.0, 100.0, 75.0))
    assert summary.standard_deviation == pytest.approx(25.0)
    _, _, cycles = diagnose(manager)
    assert (cycles.name, cycles.level) == ("Controller Manager Activity", Level.ERROR)
    assert cycles.values["periodicity.standard_deviation"] == "25.000"
    assert cycles.values["update_rate"] == "100"
    manager.statistics.forget()
    assert manager.statistics.periodicity.summary().sample_count == 0


def rated(name: str, average: float, deviation: float, **given: float) -> Level:
    """Return the severity of a statistic, in Hz from the rate of 100 Hz or in us."""
    thresholds = Thresholds(100, {f"{name}.{each}": value for each, value in given.items()})
    whose, _, kind = name.partition(".")
    if kind == "periodicity":
        summary = SpreadSummary(100.0 + average, 0.0, 0.0, deviation, 9, 0.0)
        return thresholds.rate_periodicity(whose, summary, 100.0)
    summary = SpreadSummary(1e-6 * average, 0.0, 0.0, 1e-6 * deviation, 9, 0.0)
    return thresholds.rate_duration(whose, summary)


@pytest.mark.parametrize(
    "name",
    [
        "controller_manager.periodicity",
        "controllers.periodicity",
        "controllers.execution_time",
        "hardware_components.execution_time",
    ],
)
def test_rule_67_thresholds_are_shares_of_the_cycle_unless_they_are_given(name: str) -> None:
    known = default_thresholds(100)
    mean, deviation = (
        [known[f"{name}.{kind}.{word}"] for word in ("warn", "error")]
        for kind in ("mean_error", "standard_deviation")
    )
    for average, spread, level in (
        (0.9 * mean[0], 0.9 * deviation[0], Level.OK),
        (1.1 * mean[0], 0.0, Level.WARN),
        (0.0, 1.1 * deviation[0], Level.WARN),
        (1.1 * mean[1], 0.0, Level.ERROR),
        (0.0, 1.1 * deviation[1], Level.ERROR),
        (math.nan, math.nan, Level.OK),
    ):
        assert rated(name, average, spread) is level
    assert rated(name, 2.0, 0.0, **{"mean_error.warn": 1.0}) is Level.WARN
    assert default_thresholds(50)[f"{name}.mean_error.warn"] in (mean[0] / 2, mean[0] * 2)
    assert [int(level) for level in Level] == [0, 1, 2]


def test_rule_67_thresholds_that_cannot_be_used_are_named() -> None:
    with pytest.raises(InvalidArgumentError, match=r"'controllers.periodicity.mean_eror.warn'"):
        Thresholds(100, {"controllers.periodicity.mean_eror.warn": 1.0})
    for value in (0.0, -1.0, math.nan):
        with pytest.raises(InvalidArgumentError, match=r"controllers.periodicity.mean_error.warn"):
            Thresholds(100, {"controllers.periodicity.mean_error.warn": value})


def test_rule_67_a_simulation_that_is_faster_is_expected_to_be() -> None:
    summary = SpreadSummary(2000.0, 0.0, 0.0, 20.0, 9, 0.0)
    for pace, level in ((20.0, Level.OK), (1.0, Level.ERROR)):
        thresholds = Thresholds(100, {}, pace)
        assert thresholds.rate_periodicity("controllers", summary, 100.0) is level


def test_rule_67_diagnostics_are_rated_and_worded(real_time: RealTime) -> None:
    manager, box = boxed()
    controllers, hardware, cycles = diagnose(manager)
    assert (controllers.name, controllers.level) == ("Controllers Activity", Level.WARN)
    assert controllers.message == "no controllers are loaded"
    assert (hardware.name, hardware.level) == ("Hardware Components Activity", Level.OK)
    assert cycles.level is Level.OK
    a = load(manager, "a")
    load(manager, "idle")
    manager.switch(0.0, ("a",))
    real_time.cycle(manager, *(0.01,) * 50)
    controllers, hardware, _ = diagnose(manager)
    assert list(controllers.values) == [
        "a.state",
        "a.execution_time",
        "a.periodicity",
        "idle.state",
    ]
    assert (controllers.values["a.state"], controllers.values["idle.state"]) == (
        "active", "inactive"
    )  # fmt: skip
    assert controllers.values["a.periodicity"] == "Avg: 100.00 [100.00 - 100.00] Hz, StdDev: 0.00"
    assert controllers.values["a.execution_time"].startswith("Avg: ")
    assert "box.read_cycle.execution_time" in hardware.values
    for _ in range(50):
        a.statistics.execution_time.add(10e-3)
    controllers, _, _ = diagnose(manager)
    assert (controllers.level, controllers.message) == (Level.ERROR, "a.execution_time")
    box.deactivate()
    _, hardware, _ = diagnose(manager)
    assert hardware.level is Level.ERROR
    assert hardware.message == "no hardware component is active"


def test_rule_68_every_interface_and_statistic_has_its_name_and_value() -> None:
    world = World(home=False)
    wild(world, "a", "j1/home")
    world.switch("a")
    world.run(0.3)
    world.hardware.commands["j1/home"].value = 0.0
    told = introspect(world.manager)
    for name in NAMES:
        assert math.isnan(told[f"state_interface.{name}/position"])
        assert told[f"state_interface.{name}/home"] == 0.0
        assert f"command_interface.{name}/velocity" in told
    assert told["command_interface.j1/home"] == 0.0
    kinds = "average", "min", "max", "standard_deviation", "sample_count", "current_value"
    for owner in (
        "a.stats/execution_time",
        "a.stats/periodicity",
        "bioscara_arm.stats/read_cycle/execution_time",
        "bioscara_arm.stats/write_cycle/execution_time",
        "controller_manager.periodicity",
    ):
        assert [f"{owner}/{kind}" in told for kind in kinds] == [True] * 6
    assert told["a.stats/execution_time/sample_count"] == 30
    assert told["a.stats/periodicity/sample_count"] == 29
    # Microseconds, as in ROS; the host's own time.
    read = world.manager.statistics.timing[READ]
    assert told["controller_manager.read_time"] == pytest.approx(1e6 * read)
    # The only component: its share of the reading is nearly all of it.
    own = told["bioscara_arm.stats/read_cycle/execution_time/current_value"]
    assert 0.5e6 * read < own <= 1e6 * read
    parts = sum(told[f"controller_manager.{each}_time"] for each in ("read", "update", "write"))
    assert told["controller_manager.total_time"] == pytest.approx(parts)
    assert told["controller_manager.switch_time"] > 0.0
    assert list(told) == list(introspect(world.manager)), "names keep their order"
    assert all(isinstance(value, float | int) for value in told.values())
