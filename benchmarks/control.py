"""The control loop: cost of a cycle on the host, whether 1000 Hz are held, and memory growth."""

from __future__ import annotations

import itertools
import math
import os
import resource
import statistics
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import perf_counter

from benchmarks.arm import NEAR
from benchmarks.measure import Row, timings
from bioscara.bus import Bus, Transaction
from bioscara.clock import Clock, MonotonicClock
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point
from bioscara.control.loop.realtime import realtime
from bioscara.errors import RealtimeError
from bioscara.hardware import ArmHardware, GripperHardware
from bioscara.kinematics import Scara
from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Scene
from bioscara.robot import kinematics_of
from bioscara.robot.connection.devices import simulated_devices
from bioscara.robot.connection.stack import TRAJECTORY, Stack
from bioscara.sim import FirmwareBus, SimulatedArm

CYCLES = 3000
HELD_RATE, HELD_SECONDS = 1000, 60.0
MEMORY_CYCLES = 1_000_000
_WARM = 20_000
_MEDIAN, _P99 = 120e-6, 300e-6
_START, _SWING = (-2.5, 0.30, 2.2, 2.5), (0.5, 0.03, 0.5, 0.5)
_PARAMETERS = load_parameters()
_SURROUNDINGS = kinematics_of(_PARAMETERS), Scene()


class _Marked:
    """A clock that records the end of its last wait: there the host's work begins."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.begin = 0.0

    def now(self) -> float:
        return self._clock.now()

    def sleep_until(self, deadline: float) -> None:
        self._clock.sleep_until(deadline)
        self.begin = perf_counter()


class _Live:
    """Real time that the simulated arm follows."""

    def __init__(self, arm: SimulatedArm) -> None:
        self._arm, self._wall = arm, MonotonicClock()
        self._lead = self._wall.now() - arm.now()

    def now(self) -> float:
        return self._wall.now()

    def sleep_until(self, deadline: float) -> None:
        self._wall.sleep_until(deadline)
        self._arm.run(max(self._wall.now() - self._lead - self._arm.now(), 0.0))


def homed_stack(
    rate: int,
    clock_of: Callable[[SimulatedArm], Clock],
    surroundings: Callable[[], tuple[Scara, Scene]] = lambda: _SURROUNDINGS,
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
    stack = Stack(hardware, jaws, surroundings, clock, _PARAMETERS, rate, Path(os.devnull))
    # The speed of the tool is computed but not bounded: the swing is as fast as the joints.
    stack.tool_speed.limit = math.inf
    stack.broadcast(clock.now())
    hardware.activate()
    stack.loop.step()
    stack.use(TRAJECTORY, clock.now())
    return stack, clock


def _swing(stack: Stack, clock: Clock, seconds: float) -> None:
    """Let all joints swing to and fro for a while."""
    stack.loop.restart()
    here = tuple(axis.position.value for axis in stack.arm.axes)
    points = [Point(3.0, _START)]
    signs = itertools.cycle((1.0, 0.0))
    zero = (0.0,) * len(here)
    while points[-1].time < seconds:
        sign = next(signs)
        place = tuple(a - sign * b for a, b in zip(_START, _SWING, strict=True))
        points.append(Point(points[-1].time + 3.0, place, zero))
    points[0] = Point(3.0, _START, zero)
    trajectory = JointTrajectory(tuple(axis.name for axis in stack.arm.axes), tuple(points))
    stack.trajectory.send_goal(Goal(trajectory, collision_checked=True), clock.now())


def _timed(owner: object, name: str, spent: dict[str, list[float]], label: str) -> None:
    """Wrap a method so that it records its duration."""
    method, notes = getattr(owner, name), spent.setdefault(label, [])

    def timed(*arguments: object) -> None:
        begin = perf_counter()
        method(*arguments)
        notes.append(perf_counter() - begin)

    setattr(owner, name, timed)


def _costs() -> tuple[list[float], dict[str, float]]:
    """Return the host's cost of each cycle of a moving arm, and the medians of its stages [s]."""
    stack, clock = homed_stack(100, lambda arm: _Marked(arm.clock))
    assert isinstance(clock, _Marked)
    _swing(stack, clock, 2 * CYCLES / 100)
    costs = []
    for _ in range(CYCLES):
        stack.loop.step()
        costs.append(perf_counter() - clock.begin)
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
    return costs, {label: statistics.median(notes) for label, notes in spent.items()}


class _Echo(Bus):
    """A minimal bus within this process."""

    def transfer(self, transactions):  # type: ignore[no-untyped-def]
        return [bytes(item.read) for item in transactions]

    def close(self) -> None:
        pass


def _bare() -> float:
    """Return the time to read, sample, clip and write four joints in plain floats [s]."""
    out, back, bus = struct.Struct("<Bfh"), struct.Struct("<fhB"), _Echo()
    scales = ((35.0, 0.1), (-1570.8, 0.02), (24.0, 0.3), (12.0, 0.4))
    pieces = ((0.1, 0.2, 0.3, -0.1),) * 4
    limits = ((-3.0, 3.0), (0.0, 0.33), (-2.6, 2.6), (-3.0, 3.0))

    def cycle(t: float = 0.3) -> None:
        frames = []
        for (a, b, c, d), (lower, upper), (scale, offset) in zip(
            pieces, limits, scales, strict=True
        ):
            position = min(max(a + t * (b + t * (c + t * d)), lower), upper)
            velocity = b + t * (2.0 * c + t * 3.0 * d)
            data = out.pack(0xD5, position * scale + offset, int(velocity))
            frames.append(Transaction(0x11, data, 7))
        for data, (scale, offset) in zip(bus.transfer(frames), scales, strict=True):
            angle, speed, _ = back.unpack(data)
            (angle - offset) / scale, speed / scale

    return statistics.median(timings(cycle, CYCLES))


@contextmanager
def busy_process() -> Iterator[None]:
    """Another Python process that keeps a processor busy."""
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as process:
        try:
            yield
        finally:
            process.kill()


def hold(seconds: float) -> tuple[int, int, str]:
    """Run the loop at 1000 Hz in real time next to a busy process.

    Returns:
        Cycles, overruns, and how late cycles began.
    """
    stack, clock = homed_stack(HELD_RATE, _Live)
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
    after = stack.loop.statistics
    return after.cycles - before[0], after.overruns - before[1], f"{how}; late {after.late}"


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
    bare = _bare()
    costs, stages = _costs()
    costs.sort()
    median, p99 = costs[len(costs) // 2], costs[len(costs) * 99 // 100]
    shares = ", ".join(f"{label} {1e6 * each:.1f}" for label, each in stages.items())
    cycles, overruns, how = hold(HELD_SECONDS)
    grown = _grown(MEMORY_CYCLES)
    return [
        Row(
            "host's share of a cycle: read, joint states, trajectory, limits, write, supervision",
            f"{1e6 * median:.0f} us median, {1e6 * p99:.0f} us p99 ({shares})",
            f"bare read, sample, clip, write: {1e6 * bare:.1f} us ({median / bare:.1f} times)",
            "at most 120 us median, 300 us p99",
            median <= _MEDIAN and p99 <= _P99,
        ),
        Row(
            f"{HELD_RATE} Hz for {HELD_SECONDS:.0f} s beside a busy process",
            f"{overruns} overruns in {cycles} cycles",
            how,
            "fewer than 0.1 %",
            overruns < 1e-3 * cycles,
        ),
        Row(
            f"memory over {MEMORY_CYCLES} cycles",
            f"{grown / 1024:.0f} KiB more",
            f"after {_WARM} cycles",
            "at most 1 MiB more",
            grown <= 1 << 20,
        ),
    ]
