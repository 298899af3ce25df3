"""The simulated motors against measurements on the arm; docs/simulation.md has the tables."""

from __future__ import annotations

import math
import random
import statistics
from collections.abc import Iterator

from benchmarks.measure import Row
from bioscara.bus import Transaction
from bioscara.drivers import Joint
from bioscara.model import JointParameters, load_parameters
from bioscara.protocol import READ, WRITE, Flags, Register
from bioscara.sim import FirmwareBus, SimulatedArm

EDGES = (3, 5, 8, 10, 14, 16, 18, 20, 22, 25, 30, 35, 40, 60, 70, 80, 90, 100, 110, 118)
"""Bounds of the speeds that the arm's position errors were sorted by [rad/s of the motor]."""

ON_THE_ARM = {
    3: (14.5, 14.5),
    5: (14.5, 14.5),
    8: (14.5, 14.5),
    10: (14.5, 14.5),
    14: (21, 21),
    16: (38, 73),
    18: (63, 67),
    20: (50, 50),
    22: (28, 28),
    25: (18, 18),
    30: (14, 68),
    35: (16, 52),
    40: (15, 15),
    60: (24, 24),
    80: (32, 32),
    100: (42, 42),
    110: (45.5, 45.5),
}
"""Mean error [microsteps] by the speed's lower bound, speeding up and slowing down; the free motor
of J4 at 20 % current. Of 3 .. 14 rad/s the arm has one range, 12 .. 17."""

PULL_OUTS = {
    "j2": ({"speed": 0.2, "acceleration": 0.2, "percent": 50, "position": 0.1}, 78.0),
    "j3": ({"speed": 14.0, "acceleration": 15.0}, 145.0),
}
"""Of the lift upwards and of the elbow: arguments of :func:`pull_out`, and where the arm loses
synchronism [rad/s of the motor]. That of the elbow is not a measurement: the model before the fit
was reported to be about 20 % too strong."""

ARMS = 40
"""Seeds of the rows about many arms."""
RAMP = 7.0
"""Acceleration of the ramp [rad/s^2 of the motor]; that of the arm was not recorded."""
_TOP = 120.0
_FASTEST = 400.0
_RPM = 30.0 / math.pi
_STEPS_PER_RADIAN = 51200.0 / (2.0 * math.pi)
_SAMPLE = 0.01


class Motor:
    """One joint's motor, enabled and without end stops, in rad/s of the motor."""

    def __init__(
        self,
        joint: str,
        *,
        v1: bool = False,
        seed: int = 0,
        position: float = 0.0,
        percent: int = 20,
    ) -> None:
        self.arm = SimulatedArm(seed=seed, v1=v1, frequency=None, positions={joint: position})
        self.arm.remove_stops(joint)
        self.joint, self._address = joint, 0x10 + int(joint[1])
        self._bus = FirmwareBus(self.arm)
        self.send(Register.SETUP, percent, percent)
        for _ in range(100):
            self.arm.run(0.02)
            self.send(Register.PING)
        self.send(Register.SETMAXVELOCITY, math.degrees(_FASTEST))

    def send(self, register: Register, *values: float) -> None:
        """Write to a register with a version 1 frame; read it where there is nothing to write."""
        message = WRITE[register] if values else READ[register]
        self._bus.transfer(
            [Transaction(self._address, message.encode_v1(values), message.answer_size)]
        )

    def accelerate(self, acceleration: float) -> None:
        """Set the acceleration [rad/s^2]."""
        self.send(Register.SETMAXACCELERATION, math.degrees(acceleration))

    def run(self, speed: float, seconds: float, step: float = _SAMPLE) -> Iterator[float]:
        """Run at ``speed`` [rad/s]; yield the field's speed [rad/s] every ``step`` [s]."""
        end = self.arm.now() + seconds
        while self.arm.now() < end:
            self.send(Register.SETRPM, speed * _RPM)
            before, since = self.arm.field(self.joint), self.arm.now()
            self.arm.run(step)
            moved = self.arm.field(self.joint) - before
            yield moved / (self.arm.now() - since) / _STEPS_PER_RADIAN


def errors(*, seed: int = 0, ramp: float = RAMP) -> tuple[dict[int, list[float]], ...]:
    """Return the errors of the free motor by lower bound of the speed, up and down a ramp."""
    motor = Motor("j4", v1=True, seed=seed)
    motor.arm.take_off_belt("j4")
    motor.accelerate(ramp)
    result = []
    for goal in (_TOP, 1.0):
        found: dict[int, list[float]] = {edge: [] for edge in EDGES[:-1]}
        for speed in motor.run(goal, _TOP / ramp + 0.5, 0.0048):
            at = [edge for edge in EDGES if edge <= speed]
            if at and at[-1] in found:
                found[at[-1]].append(abs(motor.arm.position_error("j4")))
        result.append(found)
    return tuple(result)


def pull_out(
    speed: float,
    *,
    joint: str = "j1",
    acceleration: float = 3.0,
    percent: int = 20,
    seed: int = 0,
    position: float = 0.0,
) -> float | None:
    """Return where a joint loses synchronism while accelerating to ``speed``, or None.

    Args:
        speed: Of the joint [rad/s or m/s], signed.
        joint: Its name.
        acceleration: Of the joint [rad/s^2 or m/s^2].
        percent: Of the driver's full current.
        seed: Of the arm.
        position: Where the joint starts [rad or m].

    Returns:
        The field's speed there [rad/s of the motor].
    """
    ratio = load_parameters().joints[int(joint[1]) - 1].reduction
    motor = Motor(joint, seed=seed, position=position, percent=percent)
    motor.accelerate(abs(acceleration * ratio))
    start = motor.arm.load_angle(joint)
    for now in motor.run(speed * ratio, abs(speed) / acceleration + 0.7, 0.0016):
        if abs(motor.arm.load_angle(joint) - start) > 0.75 * 1024.0:
            return abs(now)
    return None


def home(parameters: JointParameters, seed: int) -> tuple[list[float], float]:
    """Home a joint that stands up to 30 rad of its motor before its end stop.

    Args:
        parameters: Of the joint.
        seed: Of the arm and of the place where the joint starts.

    Returns:
        The time from each contact of the load to the field's turning back [s], and the distance of
        the home from the end stop [rad or m].
    """
    name, reduction = parameters.name, abs(parameters.reduction)
    side = math.copysign(1.0, parameters.homing.velocity)
    stop = parameters.upper if side > 0.0 else parameters.lower
    start = stop - side * random.Random(seed).uniform(8.0, 30.0) / reduction
    arm = SimulatedArm(seed=seed, positions={name: start})
    joint = Joint(FirmwareBus(arm), arm.clock, parameters)
    joint.init()
    joint.start_homing()
    direction = side * math.copysign(1.0, parameters.reduction)
    times: list[float] = []
    since, furthest, fed = math.inf, -math.inf, 0.0
    while arm.now() - fed < 0.02 or Flags.BUSY in joint.keep_alive():
        if arm.now() - fed >= 0.02:
            fed = arm.now()
        arm.run(0.001)
        depth = (arm.position(name) - stop) * side * reduction
        field = arm.field(name) * direction
        furthest = max(furthest, field)
        if depth > 0.002:
            since = min(since, arm.now())
        if field < furthest - 10.0:
            if since < math.inf:
                times.append(arm.now() - since)
            since, furthest = math.inf, field
    joint.post_homing()
    return times, joint.get_position() - arm.position(name)


def rows() -> list[Row]:
    """Measure the errors of the free motor, J1's pull-out and the homing of many arms."""
    up, down = errors()
    made = []
    for edge, expected in ON_THE_ARM.items():
        high = EDGES[EDGES.index(edge) + 1]
        found = [statistics.mean(part[edge]) for part in (up, down)]
        p95 = [statistics.quantiles(part[edge], n=20)[-1] for part in (up, down)]
        near = all(
            abs(math.log(a / b)) < math.log(2.0) for a, b in zip(found, expected, strict=True)
        )
        made.append(
            Row(
                f"free motor, {edge} .. {high} rad/s: mean error up / down [p95]",
                f"{found[0]:.0f} / {found[1]:.0f} [{p95[0]:.0f} / {p95[1]:.0f}] microsteps",
                f"arm: {expected[0]:g} / {expected[1]:g}",
                "within a factor of 2",
                near,
            )
        )
    held, lost = ([pull_out(way, seed=seed) for seed in range(ARMS)] for way in (1.0, 2.0))
    speeds = [speed for speed in lost if speed is not None]
    made.append(
        Row(
            f"J1 at 20 % and 3 rad/s^2, asked for 1 rad/s: {ARMS} arms",
            f"{sum(one is not None for one in held)} lose synchronism",
            "arm: runs",
            "0",
            held == [None] * ARMS,
        )
    )
    made.append(
        Row(
            "the same, asked for 2 rad/s",
            f"{len(speeds)} lose it, at {min(speeds):.0f} .. {max(speeds):.0f}, "
            f"mean {statistics.mean(speeds):.0f} rad/s of the motor",
            "arm: at about 45",
            "all of them, mean 40 .. 50",
            len(speeds) == ARMS and 40.0 < statistics.mean(speeds) < 50.0,
        )
    )
    for name, (how, expected) in PULL_OUTS.items():
        lost = [pull_out(joint=name, seed=seed, **how) for seed in range(ARMS)]
        speeds = [speed for speed in lost if speed is not None]
        mean = statistics.mean(speeds)
        made.append(
            Row(
                f"{name} at {how.get('percent', 20)} % and {how['acceleration']:g} per s^2",
                f"{len(speeds)} of {ARMS} arms lose synchronism, at {min(speeds):.0f} .. "
                f"{max(speeds):.0f}, mean {mean:.0f} rad/s of the motor",
                f"arm: at {expected:g}",
                "all of them, mean within 10 %",
                len(speeds) == ARMS and abs(mean / expected - 1.0) < 0.1,
            )
        )
    for parameters in load_parameters().joints:
        homings = [home(parameters, seed) for seed in range(ARMS)]
        longest = max(time for times, _ in homings for time in times)
        furthest = max(abs(error) for _, error in homings)
        made.append(
            Row(
                f"{parameters.name}: contact until homing turns back; home, distance from the stop",
                f"at most {longest * 1e3:.0f} ms, {furthest * 1e3:.2g} m{parameters.unit}",
                f"{ARMS} arms",
                "150 ms",
                longest < 0.15,
            )
        )
    return made
