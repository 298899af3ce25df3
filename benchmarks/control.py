"""The control loop: cost of a cycle on the host, whether 1000 Hz are held, and memory growth."""

from __future__ import annotations

import itertools
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import NamedTuple

import numpy as np

from benchmarks.arm import NEAR
from benchmarks.floors import cycle as bare_cycle
from benchmarks.measure import Row, duration, timed
from bioscara import Robot
from bioscara.clock import Clock, MonotonicClock
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point
from bioscara.control.loop.realtime import realtime
from bioscara.errors import RealtimeError
from bioscara.hardware import ArmHardware, GripperHardware
from bioscara.model import load_parameters
from bioscara.robot.connection.devices import simulated_devices
from bioscara.robot.connection.stack import TRAJECTORY, Stack
from bioscara.robot.workspace.workspace import Workspace
from bioscara.sim import FirmwareBus, SimulatedArm

CYCLES = 3000
HELD_RATE, HELD_SECONDS, HELD_TURNS = 1000, 10.0, 6
MEMORY_CYCLES = 1_000_000
_WARM = 20_000
PUNCTUAL_RATE, PUNCTUAL_SECONDS = 100, 60.0
_PUNCTUAL_MOST = 2
_BARE = 20
"""Bare cycles timed together after each cycle: they take longer, and are interrupted as often. All
but the first find their code and data in the processor's caches."""
_PAUSE = 5e-3
"""Time for which the simulated arm runs before a bare cycle as before a cycle: it evicts both from
the processor's caches [s]."""
_MEDIAN, _REPEATED, _P99 = 10, 18, 40
"""Limits: of the median, in bare cycles after a pause and in repeated ones, and of the 99th
percentile, in that of repeated ones."""
_START, _SWING = (-2.5, 0.30, 2.2, 2.5), (0.5, 0.03, 0.5, 0.5)
_PARAMETERS = load_parameters()
_WORKSPACE = Workspace.of(_PARAMETERS, reduced_speed=False)


class _Marked:
    """A clock that records the end of its last wait: there the host's work begins."""

    def __init__(self, clock: Clock) -> None:
        self._clock, self.now = clock, clock.now
        self.begin = 0.0

    def sleep_until(self, deadline: float) -> None:
        self._clock.sleep_until(deadline)
        self.begin = perf_counter()


class _Live:
    """Real time that the simulated arm follows."""

    def __init__(self, arm: SimulatedArm) -> None:
        self._arm, self._wall = arm, MonotonicClock()
        self.now = self._wall.now
        self._lead = self._wall.now() - arm.now()
        self.woke = self.late = 0.0

    def sleep_until(self, deadline: float) -> None:
        self._wall.sleep_until(deadline)
        self.woke = self._wall.now()
        self.late = self.woke - deadline
        self._arm.run(max(self._wall.now() - self._lead - self._arm.now(), 0.0))


def homed_stack(
    rate: int,
    clock_of: Callable[[SimulatedArm], Clock],
    workspace: Workspace = _WORKSPACE,
) -> tuple[Stack, Clock]:
    """Return a homed arm on a bus that takes no time, under the trajectory controller."""
    arm = SimulatedArm(frequency=None, positions=NEAR)
    hardware = ArmHardware("arm", FirmwareBus(arm), arm.clock, _PARAMETERS.joints)
    hardware.configure()
    hardware.activate()
    for joint in hardware.joints:
        joint.home()
        joint.enable()
    hardware.deactivate()
    hardware.cleanup()
    clock = clock_of(arm)
    hardware = ArmHardware("arm", FirmwareBus(arm), clock, _PARAMETERS.joints)
    hardware.configure()
    jaws = GripperHardware(
        "gripper", "gripper", simulated_devices(_PARAMETERS, v1=False, seed=0).gripper, clock
    )
    stack = Stack(hardware, jaws, workspace, clock, rate, Path(os.devnull))
    stack.broadcast(clock.now())
    hardware.activate()
    stack.loop.step()
    stack.use(TRAJECTORY, clock.now())
    return stack, clock


def _swing(stack: Stack, clock: Clock, seconds: float) -> None:
    """Let all joints swing to and fro for a while."""
    stack.loop.restart()
    here = tuple(axis.position.value for axis in stack.hardware.axes)
    points = [Point(3.0, _START)]
    signs = itertools.cycle((1.0, 0.0))
    zero = (0.0,) * len(here)
    while points[-1].time < seconds:
        sign = next(signs)
        place = tuple(a - sign * b for a, b in zip(_START, _SWING, strict=True))
        points.append(Point(points[-1].time + 3.0, place, zero))
    points[0] = Point(3.0, _START, zero)
    trajectory = JointTrajectory(tuple(axis.name for axis in stack.hardware.axes), tuple(points))
    stack.trajectory.send_goal(Goal(trajectory, collision_checked=True), clock.now())


def _timed(owner: object, name: str, spent: dict[str, list[float]], label: str) -> None:
    """Wrap a method so that it records its duration."""
    method, notes = getattr(owner, name), spent.setdefault(label, [])

    def timed(*arguments: object) -> None:
        begin = perf_counter()
        method(*arguments)
        notes.append(perf_counter() - begin)

    setattr(owner, name, timed)


def _costs() -> tuple[list[float], list[float], list[float], dict[str, float]]:
    """Return costs of the cycles of a moving arm, of bare ones and bunches, and of stages [s]."""
    stack, clock = homed_stack(100, lambda arm: _Marked(arm.clock))
    assert isinstance(clock, _Marked)
    _swing(stack, clock, 2 * CYCLES / 100)
    costs, bare, bunches, run = [], [], [], bare_cycle()
    for _ in range(CYCLES):
        stack.loop.step()
        costs.append(perf_counter() - clock.begin)
        clock.sleep_until(clock.now() + _PAUSE)
        bare.append(timed(run))
        bunches.append(timed(run, _BARE))
    if stack.supervisor.faults:
        raise RuntimeError(str(stack.supervisor.faults[0]))
    spent: dict[str, list[float]] = {}
    for component in stack.manager.components:
        _timed(component, "read", spent, "read")
    _timed(stack.broadcaster, "update", spent, "joint states")
    _timed(stack.trajectory, "update", spent, "trajectory")
    _timed(stack.manager.limiter, "apply", spent, "limits")
    for component in stack.manager.components:
        _timed(component, "write", spent, "write")
    _timed(stack.supervisor, "check", spent, "supervision")
    for _ in range(CYCLES // 2):
        stack.loop.step()
    return costs, bare, bunches, {label: statistics.median(notes) for label, notes in spent.items()}


@contextmanager
def busy_process() -> Iterator[None]:
    """Another Python process that keeps a processor busy."""
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as process:
        try:
            yield
        finally:
            process.kill()


def hold(seconds: float) -> tuple[int, int, float, str]:
    """Run the loop at 1000 Hz in real time next to a busy process.

    Returns:
        Cycles, overruns, median time that a cycle takes [s], and how late cycles began.
    """
    stack, clock = homed_stack(HELD_RATE, _Live)
    assert isinstance(clock, _Live)
    taken = []
    with ExitStack() as contexts:
        contexts.enter_context(busy_process())
        how = "SCHED_FIFO"
        try:
            contexts.enter_context(realtime())
        except RealtimeError:
            how = "SCHED_FIFO not permitted"
        _swing(stack, clock, 2.0 * seconds)
        before = stack.loop.statistics.cycles, stack.loop.statistics.overruns
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            stack.loop.step()
            taken.append(clock.now() - clock.woke)
    after = stack.loop.statistics
    cycles, overruns = after.cycles - before[0], after.overruns - before[1]
    return cycles, overruns, statistics.median(taken), f"{how}; late {after.late}"


def _held_in_turns() -> tuple[int, int, int, str]:
    """Run the loop, then as long one that sleeps and counts: cycles, overruns of both, lateness.

    The other one is as busy in each cycle: it counts until a cycle's median time has passed.
    """
    cycles, overruns, taken, how = hold(HELD_SECONDS)
    with ExitStack() as contexts:
        contexts.enter_context(busy_process())
        with suppress(RealtimeError):
            contexts.enter_context(realtime())
        clock, period, bare_overruns = MonotonicClock(), 1.0 / HELD_RATE, 0
        due = clock.now()
        for _ in range(round(HELD_SECONDS * HELD_RATE)):
            due += period
            clock.sleep_until(due)
            woke = clock.now()
            while (now := clock.now()) < woke + taken:
                pass
            if now > due + period:
                bare_overruns += 1
                due = now
    return cycles, overruns, bare_overruns, how


_SLEEPER = r"""
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <time.h>
int main(int count, char **words) {
  long cycles = atol(words[1]), period = 1000000000L / atol(words[2]);
  struct timespec due, now;
  prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);
  clock_gettime(CLOCK_MONOTONIC, &due);
  while (cycles > 0) {
    due.tv_nsec += period;
    if (due.tv_nsec >= 1000000000L) { due.tv_nsec -= 1000000000L; due.tv_sec++; }
    cycles--;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
    clock_gettime(CLOCK_MONOTONIC, &now);
    long late = (now.tv_sec - due.tv_sec) * 1000000000L + now.tv_nsec - due.tv_nsec;
    printf("%ld\n", late);
    long passed = late / period, next = due.tv_nsec + passed * period;
    cycles -= passed;
    due.tv_sec += next / 1000000000L;
    due.tv_nsec = next % 1000000000L;
  }
  return 0;
}
"""
"""A bare loop with absolute deadlines: prints how late each sleep ended [ns].

It skips the deadlines that have passed, as the control loop does."""


class _Punctuality(NamedTuple):
    """Lateness of one loop.

    Attributes:
        p99: Its 99th percentile [s].
        missed: Cycles that began too late to end before the next deadline.
        cycles: All cycles.
    """

    p99: float
    missed: int
    cycles: int


def _punctuality(late: Sequence[float], most: float) -> _Punctuality:
    """Return the lateness of a loop, in which more than ``most`` [s] misses a deadline."""
    times = np.asarray(late)
    return _Punctuality(np.percentile(times, 99).item(), int((times > most).sum()), len(times))


def _punctual() -> tuple[_Punctuality, _Punctuality]:
    """Run an arm at rest and the bare loop at once; return the lateness of both.

    Both miss a deadline when they begin so late that the median cycle of the arm would not end
    before the next one.
    """
    late, taken = [], []
    with TemporaryDirectory() as folder:
        program = Path(folder) / "sleeper"
        subprocess.run(
            ["cc", "-O2", "-x", "c", "-o", program, "-"], input=_SLEEPER, text=True, check=True
        )
        words = [program, str(round(PUNCTUAL_RATE * PUNCTUAL_SECONDS)), str(PUNCTUAL_RATE)]
        simulated = SimulatedArm(frequency=None, positions=NEAR)
        clock = _Live(simulated)
        bus = FirmwareBus(simulated)
        with (
            Robot(bus, clock, _PARAMETERS, "a benchmark", rate=PUNCTUAL_RATE) as robot,
            (Path(folder) / "late").open("w+") as output,
            subprocess.Popen(words, stdout=output) as bare,
        ):
            end = clock.now() + PUNCTUAL_SECONDS

            def ended() -> bool:
                late.append(clock.late)
                taken.append(clock.now() - clock.woke)
                return clock.now() >= end

            # The public calls run the loop only while something moves.
            robot.runner.arm.run(ended)
            if bare.wait():
                raise RuntimeError(f"the bare loop ended with {bare.returncode}")
            output.seek(0)
            bare_late = [1e-9 * int(line) for line in output]
    most = 1.0 / PUNCTUAL_RATE - statistics.median(taken)
    return _punctuality(late, most), _punctuality(bare_late, most)


def _grown(cycles: int) -> int:
    """Return the growth of this process's memory over cycles of a moving arm [bytes]."""
    stack, clock = homed_stack(HELD_RATE, lambda arm: arm.clock)
    loop, seconds = stack.loop, (_WARM + cycles) / HELD_RATE + 10.0
    _swing(stack, clock, seconds)
    for _ in range(_WARM):
        loop.step()
    before = _resident()
    for _ in range(cycles):
        loop.step()
    if stack.supervisor.faults:
        raise RuntimeError(str(stack.supervisor.faults[0]))
    return _resident() - before


def _resident() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()


def rows() -> list[Row]:
    """Measure the host's cost, the rate that is held, and the growth of memory."""
    costs, bares, bunches, stages = _costs()
    median, p99 = np.percentile(costs, (50, 99)).tolist()
    bare = np.percentile(bares, 50).item()
    repeated, repeated_p99 = np.percentile(bunches, (50, 99)).tolist()
    shares = ", ".join(f"{label} {1e6 * each:.1f}" for label, each in stages.items())
    counts = [_held_in_turns() for _ in range(HELD_TURNS)]
    cycles, overruns, bare_overruns = np.sum([each[:3] for each in counts], axis=0).tolist()
    punctual, bare_punctual = _punctual()
    grown = _grown(MEMORY_CYCLES)
    return [
        Row(
            "host's share of a cycle: read, joint states, trajectory, limits, write, supervision",
            f"{duration(median)} median ({median / bare:.1f} times, {median / repeated:.1f} times "
            f"the repeated one), {duration(p99)} p99 ({p99 / repeated_p99:.1f} times); {shares}",
            f"bare read, sample, clip, write: {duration(bare)} median after the same pause; "
            f"{_BARE} in a row {duration(repeated)} median, {duration(repeated_p99)} p99",
            f"at most {_MEDIAN} times the median, {_REPEATED} times the repeated one, "
            f"{_P99} times the p99",
            median <= _MEDIAN * bare
            and median <= _REPEATED * repeated
            and p99 <= _P99 * repeated_p99,
        ),
        Row(
            f"{HELD_RATE} Hz for {HELD_TURNS * HELD_SECONDS:.0f} s with a busy process",
            f"{overruns} overruns in {cycles} cycles; {counts[-1][3]}",
            f"a loop as busy, in turns with it: {bare_overruns} overruns",
            "at most 0.1 % of the cycles more",
            overruns - bare_overruns <= 1e-3 * cycles,
        ),
        Row(
            f"`Arm.run` at {PUNCTUAL_RATE} Hz for {PUNCTUAL_SECONDS:.0f} s: lateness p99",
            f"{duration(punctual.p99)} ({punctual.p99 / bare_punctual.p99:.2g} times); "
            f"{punctual.missed} of {punctual.cycles} deadlines missed",
            f"bare loop in C with `clock_nanosleep`, at once: {duration(bare_punctual.p99)}; "
            f"{bare_punctual.missed} of {bare_punctual.cycles} missed",
            f"at most {_PUNCTUAL_MOST} times, no more missed deadlines",
            punctual.p99 <= _PUNCTUAL_MOST * bare_punctual.p99
            and punctual.missed <= bare_punctual.missed,
        ),
        Row(
            f"memory over {MEMORY_CYCLES} cycles",
            f"{grown / 1024:.0f} KiB more",
            f"after {_WARM} cycles",
            "at most 1 MiB more",
            grown <= 1 << 20,
        ),
    ]
