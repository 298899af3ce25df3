"""Output of the limiter, for any stream of commands; no bus is needed for it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import example, given, settings, strategies as st

from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.hardware import CommandInterface, StateInterface
from bioscara.model import JointParameters, load_parameters

JOINT = load_parameters().joints[0]
MORE = 1.0 + 1e-6


class Bench:
    """One joint's limits between a stream of commands and their executor."""

    def __init__(
        self, start: float, *kinds: str, limits: JointParameters = JOINT, period: float = 0.01
    ) -> None:
        self.limits, self.period = limits, period
        self.position = CommandInterface("j1", "position")
        self.velocity = CommandInterface("j1", "velocity")
        self.measured = StateInterface("j1", "position")
        self.speed = StateInterface("j1", "velocity")
        self.measured.value, self.speed.value = start, 0.0
        self.position.value, self.velocity.value = start, 0.0
        for command in (self.position, self.velocity):
            command.owner = "test" if command.kind in kinds else None
        self.guard = JointLimiter(limits, self.position, self.velocity, self.measured, self.speed)
        self.guard.begin()

    def send(self, position: float, velocity: float = 0.0, period: float | None = None) -> float:
        """Command once and return the limited position."""
        self.position.value, self.velocity.value = position, velocity
        self.guard.apply(self.period if period is None else period)
        return self.position.value

    def drive(self, velocity: float) -> float:
        """Command a velocity, let a joint that obeys at once follow, return the velocity."""
        self.velocity.value = velocity
        self.guard.apply(self.period)
        self.measured.value += self.velocity.value * self.period
        return self.velocity.value


numbers = st.one_of(
    st.floats(-4.0, 4.0),
    st.sampled_from([math.nan, math.inf, -math.inf, JOINT.lower, JOINT.upper, 1e300]),
)
periods = st.floats(0.008, 0.012)


@st.composite
def streams(draw: st.DrawFn) -> list[float]:
    """Steps, ramps, sines and noise one after the other, with NaN and infinities in between."""
    stream: list[float] = []
    at = 0.0
    for _ in range(draw(st.integers(1, 6))):
        kind = draw(st.sampled_from(["step", "ramp", "sine", "noise", "odd"]))
        count = draw(st.integers(1, 60))
        to = draw(st.floats(-4.0, 4.0))
        if kind == "step":
            stream += [to] * count
            at = to
        elif kind == "ramp":
            stream += [at + (to - at) * (index + 1) / count for index in range(count)]
            at = to
        elif kind == "sine":
            rate = draw(st.floats(0.01, 1.0))
            stream += [at + to * math.sin(rate * index) for index in range(count)]
        elif kind == "noise":
            stream += draw(st.lists(st.floats(-4.0, 4.0), min_size=1, max_size=20))
        else:
            stream += draw(st.lists(numbers, min_size=1, max_size=5))
    return stream


@settings(max_examples=150, deadline=None)
@given(
    start=st.floats(JOINT.lower, JOINT.upper),
    stream=streams(),
    both=st.booleans(),
    data=st.data(),
    jitter=st.booleans(),
)
def test_position_speed_and_acceleration_stay_within_the_limits_for_any_commands(
    start: float, stream: list[float], both: bool, data: st.DataObject, jitter: bool
) -> None:
    bench = Bench(start, *(("position", "velocity") if both else ("position",)))
    last, speed, before = start, 0.0, None
    for wanted in [*stream, *[stream[-1]] * 50]:
        period = data.draw(periods) if jitter else 0.01
        got = bench.send(wanted, data.draw(numbers) if both else 0.0, period)
        now, mean = (got - last) / period, (period + (before or period)) / 2.0
        assert JOINT.lower <= got <= JOINT.upper
        assert abs(now) <= JOINT.max_velocity * MORE
        assert abs(now - speed) <= JOINT.max_acceleration * mean * MORE
        if both:
            sent = bench.velocity.value
            assert abs(sent) <= JOINT.max_velocity
            assert abs(sent - now) <= JOINT.max_acceleration * period * MORE
        last, speed, before = got, now, period


@settings(max_examples=60, deadline=None)
@given(
    start=st.floats(JOINT.lower, JOINT.upper),
    target=st.floats(JOINT.lower, JOINT.upper),
    period=st.floats(0.001, 0.02),
)
@example(start=0.0, target=2.4375, period=0.001)
def test_a_step_is_reached_exactly_in_the_shortest_time_and_without_overshoot(
    start: float, target: float, period: float
) -> None:
    bench = Bench(start, "position", period=period)
    way, sign = abs(target - start), math.copysign(1.0, target - start)
    v, a = JOINT.max_velocity, JOINT.max_acceleration
    # A speed that exceeds its bound by a millionth of its change in a cycle passes unchanged.
    rounding = 1e-6 * v * period
    shortest = way / v + v / a if way > v * v / a else 2.0 * math.sqrt(way / a)
    last = start
    for _ in range(math.ceil(shortest / period) + 4):
        got = bench.send(target)
        assert (got - last) * sign >= -rounding
        assert (target - got) * sign >= -rounding
        last = got
    assert last == target
    bench.guard.interventions = 0
    bench.send(target)
    assert bench.guard.interventions == 0


@settings(max_examples=60, deadline=None)
@given(
    start=st.floats(JOINT.lower, JOINT.upper),
    target=st.floats(JOINT.lower, JOINT.upper),
    share=st.floats(0.05, 1.0),
    strength=st.floats(0.05, 1.0),
    both=st.booleans(),
    jitter=st.lists(st.floats(0.8, 1.2), min_size=1, max_size=40),
)
def test_a_trajectory_within_the_limits_passes_bit_for_bit_also_when_the_loop_jitters(
    start: float, target: float, share: float, strength: float, both: bool, jitter: list[float]
) -> None:
    bench = Bench(start, *(("position", "velocity") if both else ("position",)))
    v, a = JOINT.max_velocity * share, JOINT.max_acceleration * strength
    way, sign = abs(target - start), math.copysign(1.0, target - start)
    v = min(v, math.sqrt(way * a))
    ramp = v / a
    end = way / v + ramp if v else 0.0

    def at(time: float) -> tuple[float, float]:
        time = min(max(time, 0.0), end)
        if time < ramp:
            return start + sign * a * time * time / 2.0, sign * a * time
        if end - time < ramp:
            left = end - time
            return target - sign * a * left * left / 2.0, sign * a * left
        return start + sign * v * (time - ramp / 2.0), sign * v

    time, index = -0.01, 0
    while time < end + 0.02:
        period = 0.01 * jitter[index % len(jitter)]
        time, index = time + period, index + 1
        position, velocity = at(time)
        position = min(max(position, JOINT.lower), JOINT.upper)
        assert bench.send(position, velocity, period) == position
        assert bench.velocity.value == velocity
    assert bench.guard.interventions == 0


@settings(max_examples=100, deadline=None)
@given(
    start=st.floats(JOINT.lower, JOINT.upper),
    stream=st.lists(st.tuples(numbers, st.integers(1, 80)), min_size=1, max_size=12),
)
def test_velocities_change_gradually_and_end_before_the_limits(
    start: float, stream: list[tuple[float, int]]
) -> None:
    bench = Bench(start, "velocity")
    last = 0.0
    for wanted, count in stream:
        for _ in range(count):
            got = bench.drive(wanted)
            assert abs(got) <= JOINT.max_velocity
            assert abs(got - last) <= JOINT.max_acceleration * bench.period * MORE
            assert JOINT.lower <= bench.measured.value <= JOINT.upper
            last = got


def test_a_velocity_within_the_limits_passes_unchanged() -> None:
    bench = Bench(0.0, "velocity")
    for index in range(100):
        wanted = 0.8 * math.sin(index / 50.0)
        assert bench.drive(wanted) == wanted
    assert bench.guard.interventions == 0


def test_without_a_known_position_a_velocity_ramps_down_and_a_position_is_not_sent() -> None:
    bench = Bench(0.0, "velocity")
    for _ in range(60):
        bench.drive(1.0)
    bench.measured.value = math.nan
    for _ in range(60):
        bench.velocity.value = 1.0
        bench.guard.apply(bench.period)
    assert bench.velocity.value == 0.0
    unknown = Bench(math.nan, "position")
    assert math.isnan(unknown.send(1.0))


@pytest.mark.parametrize("wanted", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_no_number_changes_nothing(wanted: float) -> None:
    bench = Bench(0.0, "position")
    bench.send(0.5)
    for _ in range(200):
        bench.send(wanted)
    assert bench.position.value == 0.5


def test_a_joint_found_outside_its_limits_is_held_there_and_may_only_return() -> None:
    pushed = JOINT.upper + 0.01
    bench = Bench(pushed, "position")
    assert bench.send(pushed) == pushed
    assert bench.send(pushed + 0.1) == pushed
    sent = [bench.send(JOINT.upper - 0.1) for _ in range(300)]
    assert sent == sorted(sent, reverse=True)
    assert sent[-1] == pytest.approx(JOINT.upper - 0.1)
    assert bench.send(pushed) <= JOINT.upper


def test_a_moving_target_is_caught_up_with_and_then_followed_unchanged() -> None:
    limits = replace(JOINT, lower=-10.0, upper=10.0)
    bench = Bench(0.0, "position", limits=limits)
    for index in range(300):
        bench.send(0.5 + 0.6 * index * bench.period)
    bench.guard.interventions = 0
    for index in range(300, 400):
        wanted = 0.5 + 0.6 * index * bench.period
        assert bench.send(wanted) == wanted
