"""Random calls, faults and interruptions of a robot: conditions that always hold."""

from __future__ import annotations

import math
import os
import random
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.bus import Bus, FaultyBus, Transaction, When
from bioscara.control.faults.supervisor import FaultState
from bioscara.drivers import Gripper, Pwm, Quality
from bioscara.errors import BioscaraError
from bioscara.kinematics import Pose
from bioscara.model import load_parameters
from bioscara.planning.motions.jog import JointVelocity
from bioscara.protocol import Register, ResetCause
from bioscara.report import CycleRecord
from bioscara.sim import FirmwareBus, SimulatedArm, SimulatedServo
from simulated import NEAR

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
TRACKED = (Register.TRACK, Register.TRACKLOAD)
BY_ADDRESS = {joint.address: joint for joint in ARM.joints}
CENTRE = (-0.5, 0.3, 0.5, 0.5)
FIRST = int(os.environ.get("BIOSCARA_FUZZ_FIRST", "0"))
SEEDS = range(FIRST, FIRST + int(os.environ.get("BIOSCARA_FUZZ_SEEDS", "2")))
CALLS = 6
STANDING = 0.02
"""Share of the highest speed below which a joint counts as standing."""
STOPPED_WITHIN = 1.0
"""Time in which a call that was asked to end has brought the arm to rest [s]."""
V1_HOMES_ON = 10.0 + max(
    (joint.upper - joint.lower) / abs(joint.homing.velocity) for joint in ARM.joints
)
"""Additional time that a joint of version 1 may take to end a homing whose bus is lost [s]: it goes
on to its end stop, whether it is polled or not."""
NEAR_ENOUGH = {"rad": 0.05, "m": 0.008}


class Tap(Bus):
    """Passes everything on, judges setpoints, and may interrupt between two transfers."""

    def __init__(self, bus: Bus, arm: SimulatedArm) -> None:
        self._bus, self._arm = bus, arm
        self.before: Callable[[], None] = lambda: None
        self.last: dict[int, tuple[float, float]] = {}
        self.complaints: list[str] = []

    def transfer(self, transactions: Sequence[Transaction]):  # type: ignore[no-untyped-def]
        self.before()
        for transaction in transactions:
            self._judge(transaction)
        return self._bus.transfer(transactions)

    def close(self) -> None:
        self._bus.close()

    def _judge(self, transaction: Transaction) -> None:
        joint, frame, now = BY_ADDRESS[transaction.address], transaction.write, self._arm.now()
        code = frame[0]
        if code in (*TRACKED, Register.MOVETOANGLE):
            (degrees,) = struct.unpack_from("<f", frame, 1)
            position = math.radians(degrees) / joint.reduction
            before = self.last.get(joint.address)
            self.last[joint.address] = now, position
            if before is None:
                return
            elapsed = min(now - before[0], 0.1)
            if now - before[0] < 0.1:
                limit = joint.max_velocity * (elapsed + 0.011) * 1.02 + 1e-4
                if abs(position - before[1]) > limit:
                    self.complaints.append(
                        f"{joint.name} at {now:.3f}: step of {position - before[1]:.4f} in "
                        f"{elapsed:.4f} s"
                    )
            if code in TRACKED:
                (rpm,) = struct.unpack_from("<h", frame, 5)
                speed = rpm * 0.1 * math.pi / 30.0 / joint.reduction
                if abs(speed) > joint.max_velocity * 1.02:
                    self.complaints.append(f"{joint.name} at {now:.3f}: speed {speed:.3f}")
        elif code != Register.STATE:
            self.last.pop(joint.address, None)


class Fuzz:
    """A robot, the events that can happen to it, and the conditions that must hold."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.random = random.Random(seed)
        self.v1 = self.random.random() < 0.5
        fed = self.random.random() < 0.5
        self.arm = SimulatedArm(seed=seed, positions=NEAR, v1=self.v1, controllers_fed=fed)
        self.faulty = FaultyBus(FirmwareBus(self.arm), seed=seed, clock=self.arm.clock)
        self.tap = Tap(self.faulty, self.arm)
        self.servo = SimulatedServo(ARM.gripper.outputs[0])
        gripper = Gripper(
            Pwm(ARM.gripper.outputs, self.arm.clock, self.servo.root),
            ARM.gripper,
            self.servo.root / "width",
        )
        self.robot = Robot(
            self.tap,
            self.arm.clock,
            ARM,
            "fuzz",
            gripper=gripper,
            evidence=folder,
            reduced_speed=self.random.random() >= 0.5,
        )
        self.log: list[str] = []
        self.asked = math.inf
        self.home_in_doubt = False

    # Calls.

    def call(self) -> None:
        choose, uniform, robot = self.random.choice, self.random.uniform, self.robot
        near = [uniform(-1.0, 1.0), uniform(0.25, 0.33), uniform(0.0, 1.0), uniform(-1.0, 1.0)]
        timeout = choose((None, None, None, 0.05, 0.5, -1.0, math.nan))
        name, what = choose(
            (
                ("home", lambda: robot.home(on_cycle=self.observe, timeout=timeout)),
                ("home", lambda: robot.home(on_cycle=self.observe)),
                ("move", lambda: robot.move_joints(near, on_cycle=self.observe, timeout=timeout)),
                ("move", lambda: robot.move_joints(near, on_cycle=self.observe)),
                (
                    "move",
                    lambda: robot.move_joints(near, velocity_scaling=0.3, on_cycle=self.observe),
                ),
                ("move_to", lambda: robot.move_to(Pose(0.45, uniform(-0.2, 0.2), 0.25))),
                (
                    "jog",
                    lambda: robot.jog(self.velocities(), on_cycle=self.observe, timeout=timeout),
                ),
                ("grip", lambda: robot.gripper.move(uniform(0.038, 0.13))),
                ("let go", robot.gripper.disable),
                ("enable", robot.enable),
                ("disable", robot.disable),
                ("acknowledge", robot.acknowledge),
                ("recover", robot.recover),
                ("state", lambda: robot.state),
                ("pose", lambda: robot.pose),
            )
        )
        self.strike = self.random.randrange(1, choose((5, 50, 300)))
        self.blow_name, self.blow = self.blows()
        if self.random.random() < 0.3:
            joint = choose(NAMES)
            self.log.append(f"{self.arm.now():.3f} restart {joint}")
            self.reset(joint)
            if choose((True, False)):
                self.attempt("  acknowledge", lambda: (robot.state, robot.acknowledge()))
                self.attempt("  recover", robot.recover)
        instant = self.arm.now() + uniform(0.0, 2.0)
        if self.blow_name == "interrupt in transfer":
            self.tap.before = lambda: self.interrupt(instant)
        if self.random.random() < 0.3 and self.blow_name != "interrupt":
            self.log.append(f"{self.arm.now():.3f} struck by {self.blow_name} at once")
            self.strike = 0
            self.blow()
        self.attempt(f"{name} timeout={timeout} ({self.blow_name} at {self.strike})", what)
        self.tap.before = lambda: None
        self.home_in_doubt |= self.v1 and name == "home" and self.blow_name == "estop"
        took, self.asked = self.arm.now() - self.asked, math.inf
        assert took < STOPPED_WITHIN, f"it took {took} s to end when it was asked to"
        if self.v1 and name == "home" and self.blow_name.startswith(("no ack", "bus")):
            self.arm.run(V1_HOMES_ON)

    def attempt(self, name: str, what: Callable[[], object]) -> BaseException | None:
        self.log.append(f"{self.arm.now():.3f} {name}")
        try:
            what()
        except KeyboardInterrupt as error:
            self.log.append("    KeyboardInterrupt")
            return error
        except BioscaraError as error:
            self.log.append(f"    {type(error).__name__}: {error}")
            return error
        return None

    def velocities(self) -> Callable[[], JointVelocity | None]:
        uniform = self.random.uniform
        values = JointVelocity(*(uniform(-0.3, 0.3) * (0.1 if i == 1 else 1) for i in range(4)))
        left = self.random.randrange(1, 100)

        def next_one() -> JointVelocity | None:
            nonlocal left
            left -= 1
            return values if left > 0 else None

        return next_one

    def observe(self, _: CycleRecord) -> None:
        self.strike -= 1
        if self.strike == 0:
            self.log.append(f"  {self.arm.now():.3f} struck by {self.blow_name}")
            if self.blow_name in {"stop", "interrupt"}:
                self.asked = self.arm.now()
            self.blow()
        elif self.strike < 0 and self.random.random() < 0.02:
            self.robot.speed_override = self.random.choice((0.05, 0.3, 1.0))

    def interrupt(self, instant: float) -> None:
        if self.arm.now() >= instant:
            self.tap.before = lambda: None
            self.log.append(f"  {self.arm.now():.3f} interrupted in a transfer")
            raise KeyboardInterrupt

    def blows(self) -> tuple[str, Callable[[], object]]:
        joint = self.random.choice(NAMES)
        address = ARM.joints[NAMES.index(joint)].address
        return self.random.choice(
            (
                ("nothing", lambda: None),
                ("nothing", lambda: None),
                ("stop", self.robot.stop),
                ("stop", self.robot.stop),
                ("interrupt", self._raise),
                ("interrupt in transfer", lambda: None),
                (f"reset {joint}", lambda: self.reset(joint)),
                (f"off {joint}", lambda: self.power(joint, on=False)),
                (f"no ack {joint}", lambda: self.faulty.off(When(address=address))),
                ("bus off", self.faulty.off),
                ("bus gone", lambda: self.faulty.unavailable(self.random.choice((1, 3, 40)))),
                ("estop", lambda: self.arm.set_supply(False)),
                (f"hot {joint}", lambda: self.arm.overheat(joint)),
                ("late", lambda: self.arm.run(self.random.choice((0.02, 0.2, 0.7)))),
                ("speed 0.1", lambda: setattr(self.robot, "speed_override", 0.1)),
            )
        )

    def _raise(self) -> None:
        raise KeyboardInterrupt

    def reset(self, joint: str) -> None:
        self.arm.reset(joint, ResetCause.BROWN_OUT)

    def power(self, joint: str, *, on: bool) -> None:
        self.arm.set_power(joint, on)

    def heal(self) -> None:
        self.home_in_doubt = False
        self.faulty.clear()
        self.arm.set_supply(True)
        for name in NAMES:
            if self.v1:
                # An original joint that holds the clock needs it.
                self.arm.set_power(name, False)
            self.arm.set_power(name, True)
            self.arm.overheat(name, False)
        self.robot.speed_override = 1.0
        self.arm.run(1.0)

    # Conditions that must hold.

    def stands(self, why: str) -> None:
        self.arm.run(0.6)
        before = [self.arm.position(name) for name in NAMES]
        self.arm.run(0.3)
        for joint, was in zip(ARM.joints, before, strict=True):
            moved = abs(self.arm.position(joint.name) - was) / 0.3
            if self.arm.has_torque(joint.name):
                assert moved < STANDING * joint.max_velocity, f"{joint.name} moves: {why}"

    def knows(self) -> None:
        """Check that reading the state moves nothing, and that the reported state is true."""
        robot = self.robot
        before = [self.arm.position(name) for name in NAMES]
        for _ in range(4):
            self.arm.run(0.07)
            self.attempt("look", lambda: robot.state)
        self.stands("after looking")
        for joint, was in zip(ARM.joints, before, strict=True):
            if self.arm.has_torque(joint.name):
                way = abs(self.arm.position(joint.name) - was)
                assert way < NEAR_ENOUGH[joint.unit], f"{joint.name} moved while looked at"
        self.attempt("look", lambda: robot.state)
        stack = robot.runner.arm.stack
        assert stack is not None
        state = stack.broadcaster.states
        if state is None:
            return
        for joint, told, quality in zip(ARM.joints, state.positions, state.qualities, strict=True):
            # An original joint whose motor lost its supply while it homed is wrong about its home.
            # It has no torque until it starts again, which makes it forget that home.
            lost = self.home_in_doubt and not self.arm.has_torque(joint.name)
            if quality is Quality.FRESH and not lost:
                true = self.arm.position(joint.name)
                assert abs(told - true) < NEAR_ENOUGH[joint.unit], (
                    f"{joint.name} is told at {told}, fresh; it is at {true}"
                )

    def way_back(self) -> None:
        """Recover the robot, as a person would."""
        robot = self.robot
        self.heal()
        for _ in range(4):
            if robot.faults:
                robot.acknowledge()
                robot.recover()
            error = self.attempt("enable", robot.enable)
            if error is None:
                error = self.attempt("home", robot.home)
            if error is None:
                error = self.attempt("move", lambda: robot.move_joints(CENTRE))
            if error is None:
                break
        else:
            raise AssertionError(f"no way back: {error}")
        for joint, place in zip(ARM.joints, CENTRE, strict=True):
            assert abs(self.arm.position(joint.name) - place) < NEAR_ENOUGH[joint.unit]


@pytest.mark.parametrize("seed", SEEDS)
def test_random_calls_and_failures(seed: int, tmp_path: Path) -> None:
    fuzz = Fuzz(seed, tmp_path / "evidence")
    robot = fuzz.robot
    try:
        with robot:
            if fuzz.random.random() < 0.8:
                robot.home()
                robot.move_joints(CENTRE)
            for _ in range(CALLS):
                fuzz.call()
                fuzz.stands("after a call")
                fuzz.knows()
                assert not fuzz.tap.complaints, fuzz.tap.complaints
                if fuzz.random.random() < 0.4:
                    fuzz.way_back()
            if fuzz.random.random() < 0.5:
                fuzz.way_back()
                assert robot.runner.arm.stack is not None
                assert robot.runner.arm.stack.supervisor.state is FaultState.CLEAR
                assert not fuzz.tap.complaints, fuzz.tap.complaints
            else:
                fuzz.heal()
                fuzz.log.append("left as it is")
            problems = robot.shutdown()
            fuzz.log += problems
            assert problems == []
        fuzz.arm.run(0.5)
        assert [name for name in NAMES if fuzz.arm.has_torque(name)] == []
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise AssertionError("interrupted\n" + "\n".join(fuzz.log)) from error
        error.add_note(f"v1={fuzz.v1}\n" + "\n".join(fuzz.log))
        raise
