"""Loads of joints that follow setpoints: true, in turns where the bus is slow, never invented."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import NamedTuple

import pytest

from bioscara import Robot
from bioscara.bus import Bus, Transaction
from bioscara.drivers import JointSample
from bioscara.errors import CommunicationError
from bioscara.protocol import Capability, Register, crc8
from bioscara.sim import FirmwareBus, SimulatedArm
from simulated import ARM, NAMES, NEAR

AT = (-2.5, 0.30, 2.0, 2.0)
EXCHANGE, LOAD = 183 / 100e3 + 105e-6, 9 / 100e3
"""Of a setpoint at 100 kHz, and the addition of the load to its answer [s]."""


class Tap(Bus):
    """A bus of a simulated arm that keeps the codes of each call."""

    def __init__(self, arm: SimulatedArm) -> None:
        self.bus, self.calls = FirmwareBus(arm), list[list[int]]()

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        self.calls.append([each.write[0] for each in transactions])
        return self.bus.transfer(transactions)

    def close(self) -> None:
        self.bus.close()


class Older(Tap):
    """Joints of a build without the capability LOAD: their answers to HELLO do not have it."""

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        answers = super().transfer(transactions)
        for index, (sent, answer) in enumerate(zip(transactions, answers, strict=True)):
            if sent.write[0] == Register.HELLO and isinstance(answer, bytes) and len(answer) == 13:
                body = bytearray(answer[:-1])
                body[9] &= ~Capability.LOAD
                check = crc8(body, crc8((sent.address << 1 | 1,)))
                answers[index] = bytes((*body, check))
        return answers


class World(NamedTuple):
    """A homed arm that holds its position."""

    arm: SimulatedArm
    tap: Tap
    robot: Robot

    def cycles(self, count: int) -> list[tuple[JointSample, ...]]:
        """Run the loop; returns the samples of each cycle."""
        stack, samples = self.robot.runner.arm.stack, []
        stack.loop.restart()
        self.tap.calls.clear()
        for _ in range(count):
            stack.loop.step()
            samples.append(tuple(axis.sample for axis in stack.hardware.axes))
        return samples


@contextmanager
def homed(
    frequency: float = 100e3,
    rate: int | None = None,
    kind: type[Tap] = Tap,
    *,
    v1: Collection[str] = (),
) -> Iterator[World]:
    arm = SimulatedArm(v1=v1, positions=NEAR, frequency=frequency)
    tap = kind(arm)
    with Robot(tap, arm.clock, ARM, "loads", rate=rate) as robot:
        robot.home()
        robot.move_joints(AT)
        yield World(arm, tap, robot)


def loads(samples: Sequence[JointSample]) -> list[float | None]:
    return [sample.load_percent for sample in samples]


@pytest.mark.parametrize(("joint", "most"), [("j1", 3.0), ("j3", -1.9), ("j4", -0.9)])
def test_the_load_rises_with_the_force_on_a_joint_and_on_no_other(joint: str, most: float) -> None:
    """By the angle to which the field turns the rotor's magnets; friction takes part of it up."""
    with homed() as world:
        index, found = NAMES.index(joint), list[float]()
        world.cycles(50)
        before, angle = loads(world.cycles(1)[-1]), world.arm.load_angle(joint)
        for step in range(9):
            world.arm.push(joint, most * step / 8)
            seen = [loads(samples) for samples in world.cycles(60)]
            assert all(load is not None and 0 <= load <= 255 for each in seen for load in each)
            for number, (was, now) in enumerate(zip(before, seen[-1], strict=True)):
                if number == index:
                    found.append(now or 0.0)
                else:
                    assert now == pytest.approx(was, abs=2)
        # Where friction holds the rotor, by a percent of noise.
        assert all(low <= high + 1.0 for low, high in pairwise(found)), found
        assert found[-1] > found[0] + 15.0
        limit = 512.0 + 32.0 * ARM.joints[index].stall_threshold
        turned = 100.0 * abs(world.arm.load_angle(joint) - angle) / limit
        assert found[-1] - found[0] == pytest.approx(turned, abs=2.0)
        assert world.robot.faults == ()


@pytest.mark.parametrize(
    ("frequency", "rate", "each", "bus"),
    [
        (100e3, None, 2, 4 * EXCHANGE + 2 * LOAD),
        (100e3, 80, 4, 4 * EXCHANGE + 4 * LOAD),
        (100e3, 107, 1, 4 * EXCHANGE + LOAD),
        (100e3, 109, 0, 4 * EXCHANGE),
        (400e3, None, 4, None),
    ],
)
def test_as_many_joints_report_in_each_cycle_as_the_bus_has_time_for(
    frequency: float, rate: int | None, each: int, bus: float | None
) -> None:
    with homed(frequency, rate) as world:
        world.cycles(4)
        seen = world.cycles(12)
        asked = [call for call in world.tap.calls if Register.STATE not in call]
        assert [call.count(Register.TRACKLOAD) for call in asked] == [each] * 12
        for joint in range(4):
            at = [call[joint] == Register.TRACKLOAD for call in asked]
            assert sum(at) == 3 * each
        known = {load is not None for samples in seen for load in loads(samples)}
        assert known == {each > 0}
        if bus is not None:
            assert world.robot.runner.arm.stack.hardware.bus_time == pytest.approx(bus, rel=1e-3)
        assert world.robot.bus_share <= (0.8 if each > 1 else 0.85)
        assert world.robot.faults == ()


def test_between_its_turns_a_joint_keeps_the_load_that_it_reported() -> None:
    with homed() as world:
        world.cycles(10)
        world.arm.push("j1", 1.5)
        seen = [loads(samples) for samples in world.cycles(20)]
        for (before, now), call in zip(pairwise(seen), world.tap.calls[1:], strict=True):
            kept = [index for index, code in enumerate(call) if code == Register.TRACK]
            assert len(kept) == 2
            assert [now[index] for index in kept] == [before[index] for index in kept]
        assert seen[-1][0] is not None
        assert seen[-1][0] > 8.0


def test_a_disabled_joint_has_no_load() -> None:
    with homed() as world:
        assert any(loads(world.cycles(2)[-1]))
        world.robot.disable()
        assert loads(world.cycles(2)[-1]) == [0.0] * 4
        world.robot.enable()
        assert None not in loads(world.cycles(2)[-1])


def test_a_joint_of_another_build_is_not_asked_and_its_load_is_unknown() -> None:
    with homed(kind=Older) as world:
        assert all(load is None for each in world.cycles(8) for load in loads(each))
        assert all(set(call) == {Register.TRACK} for call in world.tap.calls)
        world.robot.move_joints([value - 0.02 for value in AT])
        assert world.robot.faults == ()


def test_original_joints_beside_ours_have_an_unknown_load() -> None:
    with homed(v1=("j2", "j4")) as world:
        for samples in world.cycles(8):
            assert [load is None for load in loads(samples)] == [False, True, False, True]
