"""The simulated arm as an object, and its determinism."""

from __future__ import annotations

import struct

import pytest

from bioscara.bus import Transaction
from bioscara.drivers import Joint
from bioscara.errors import (
    BusTimeoutError,
    InvalidArgumentError,
    NoAcknowledgeError,
)
from bioscara.protocol import Register
from bioscara.sim import FirmwareBus, SimulatedArm
from firmware.host import Host
from simulated import ARM, copied, simulated_bus

PING = Transaction(0x11, b"\x0f", 2)
HELLO = b"\xc0\x01"
JOINTS = ("j1", "j2", "j3", "j4")


def test_the_same_seed_gives_the_same_bytes() -> None:
    def story(seed: int) -> list[object]:
        bus = FirmwareBus(SimulatedArm(seed=seed))
        requests = [Transaction(0x11, b"\x10\x14\x14\x00\x00", 1), Transaction(0x11, b"\x18", 5)]
        answers: list[object] = []
        for _ in range(200):
            answers += bus.transfer(requests)
            bus.arm.run(0.003)
        return answers

    assert story(5) == story(5)
    assert story(5) != story(6)


def test_a_joint_at_rest_is_simulated_as_if_each_of_its_steps_were_computed() -> None:
    def story(*, looks: bool) -> list[object]:
        arm = SimulatedArm(seed=1, positions={"j1": -2.0, "j2": 0.2, "j3": 1.0, "j4": -1.0})
        hosts = [Host(name, arm) for name in JOINTS]
        states: list[object] = []

        def passes() -> None:
            # After each look at its position a joint is computed again.
            for _ in range(6000 if looks else 0):
                arm.run(51.2e-6)
                for name in JOINTS:
                    arm.position(name)
            arm.run(0.0 if looks else 6000 * 51.2e-6)
            states.extend((arm.position(name), arm.load_angle(name)) for name in JOINTS)

        for force in (0.3, 5.0, 0.0):
            arm.push("j1", force)
            passes()
        assert abs(arm.position("j1") + 2.0) > 0.1
        for host in hosts:
            host.enable(30)
        passes()
        for host in hosts:
            host.write(Register.SETRPM, 10.0)
        passes()
        arm.push("j3", 1.0)
        arm.slip_belt("j4", 0.01)
        arm.set_friction("j2", 0.1)
        passes()
        arm.set_supply(False)
        passes()
        arm.add_obstacle("j2", arm.position("j2") - 1e-3)
        passes()
        return states

    assert story(looks=False) == story(looks=True)


def test_no_device_answers_elsewhere_or_without_power() -> None:
    arm = SimulatedArm()
    bus = FirmwareBus(arm)
    arm.set_power("j2", False)
    answers = bus.transfer([PING, Transaction(0x12, b"\x0f", 2), Transaction(0x40, b"", 1)])
    assert answers[0] == b"O\x0c"
    assert all(isinstance(answer, NoAcknowledgeError) for answer in answers[1:])


def test_a_clock_held_low_too_long_is_a_timeout() -> None:
    arm = SimulatedArm()
    arm.set_stretch(0.05)
    (answer,) = FirmwareBus(arm).transfer([PING])
    assert isinstance(answer, BusTimeoutError)


def test_a_belt_that_slips_moves_the_joint_and_not_its_encoder() -> None:
    arm = SimulatedArm(positions={"j1": -2.0})
    bus, angle = FirmwareBus(arm), Transaction(0x11, b"\x18", 5)
    before = bus.transfer([angle])[0]
    arm.slip_belt("j1", 0.05)
    assert arm.position("j1") == pytest.approx(-1.95, abs=1e-3)
    after = bus.transfer([angle])[0]
    assert isinstance(before, bytes)
    assert isinstance(after, bytes)
    # Up to a count of noise.
    degrees = [struct.unpack("<f", answer[:4])[0] for answer in (before, after)]
    assert degrees[1] == pytest.approx(degrees[0], abs=0.02)


def test_invalid_arguments_are_refused() -> None:
    arm = SimulatedArm()
    for wish in (
        lambda: arm.position("j5"),
        lambda: arm.run(float("nan")),
        lambda: arm.run(-1.0),
        lambda: arm.set_position("j1", float("inf")),
        lambda: SimulatedArm(frequency=1e6),
        lambda: SimulatedArm(seed=-1),
    ):
        with pytest.raises(InvalidArgumentError):
            wish()


@pytest.mark.parametrize("v1", [False, True])
def test_a_copy_goes_on_as_its_original_and_apart_from_it(v1: bool) -> None:
    first = simulated_bus(seed=3, v1=v1, homed=True).arm
    second = copied(first)
    ends = []
    for arm in (first, second):
        before = second.position("j1")
        joint = Joint(FirmwareBus(arm), arm.clock, ARM.joints[0])
        joint.init()
        joint.enable()
        microstep = joint.feedback.transmission.microsteps_to_displacement(1)
        joint.move_steps(round(-0.05 * joint.get_position() / microstep))
        assert (second.position("j1") == before) is (arm is first)
        ends.append((arm.now(), arm.position("j1"), arm.field("j1"), joint.get_position()))
    assert ends[0] == ends[1]
