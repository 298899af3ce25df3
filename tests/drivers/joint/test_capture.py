"""Position errors captured by a joint of the compiled firmware, and its diagnosis."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bioscara.bus import Bus, Direction, FaultyBus, Transaction, When
from bioscara.drivers import Capture, ExceptionReport, Joint
from bioscara.errors import (
    CommunicationError,
    CorruptFrameError,
    IncorrectStateError,
    NotSupportedError,
)
from bioscara.protocol import Answer, Capability, Register, crc8
from bioscara.protocol.registers import BLOCK_SAMPLES, CAPTURE_SAMPLES
from simulated import World, greeted, ready

MICROSTEP = math.tau / 51200.0
PERIOD = 1024
"""Electrical period [microsteps]: the origins of field and encoder are multiples of it apart."""
BLOCKS = -(-CAPTURE_SAMPLES // BLOCK_SAMPLES)
STEPS_PER_TICK = 20
BLOCK = When(first=Register.CAPTUREBLOCK)


def capture_a_move(world: World, joint: Joint) -> tuple[Capture, NDArray[np.float64]]:
    """Move the joint by 0.1 rad, and return its capture and the true load angle in that time.

    Of the true load angle there are STEPS_PER_TICK rows, one for each phase of the control tick.
    """
    start = joint.get_position()
    direction = math.copysign(1.0, -start)
    joint.start_capture()
    truth: list[float] = []
    for tick in range(CAPTURE_SAMPLES + 1):
        if tick % 20 == 0:
            share = min(1.0, (tick + 20) / 200)
            smooth, rate = share * share * (3 - 2 * share), 6 * share * (1 - share) / 0.2
            joint.track(start + direction * 0.1 * smooth, direction * 0.1 * rate)
        for _ in range(STEPS_PER_TICK):
            truth.append(world.arm.load_angle(joint.name))
            world.arm.run(1e-3 / STEPS_PER_TICK)
    phases = np.array(truth).reshape(-1, STEPS_PER_TICK).T
    return joint.read_capture(), phases


def test_a_captured_move_is_the_true_load_angle_within_the_encoders_noise() -> None:
    world, joint = ready("j3", frequency=None)
    captured, phases = capture_a_move(world, joint)
    assert captured.period == 1e-3
    assert captured.errors.shape == (CAPTURE_SAMPLES,)
    errors = captured.errors / MICROSTEP
    assert np.all(np.abs(errors) < 512.0)
    # The encoder's own error hardly changes from tick to tick.
    changes = np.diff(errors)
    true = (np.diff(phase[shift:][:CAPTURE_SAMPLES]) for phase in phases for shift in (0, 1))
    off = min(float(np.abs(each - changes).max()) for each in true)
    largest = float(np.abs(changes).max())
    assert largest > 50.0
    assert off < 8.0
    # ... and is 0.75 degrees of the motor at most, at its zero and now.
    difference = errors - phases[0][:CAPTURE_SAMPLES]
    apart = difference - PERIOD * np.round(difference.mean() / PERIOD)
    assert np.abs(apart).max() < 2 * 0.75 / 360.0 * 51200.0 + largest


@pytest.mark.parametrize(
    "disturb",
    [
        lambda bus: bus.flip(Direction.BACK, replace(BLOCK, probability=0.1)),
        lambda bus: bus.flip(Direction.BACK, replace(BLOCK, probability=0.1), bits=3),
        lambda bus: bus.flip(Direction.OUT, replace(BLOCK, probability=0.1)),
        lambda bus: bus.lose(Direction.OUT, replace(BLOCK, probability=0.1)),
        lambda bus: bus.lose(Direction.BACK, replace(BLOCK, probability=0.1)),
        lambda bus: bus.repeat(1, replace(BLOCK, probability=0.5)),
        lambda bus: bus.garbage(replace(BLOCK, probability=0.1)),
    ],
    ids=["one bit back", "three bits back", "a bit out", "lost out", "lost back", "twice", "noise"],
)
def test_a_disturbed_bus_changes_no_block(disturb: Callable[[FaultyBus], Any]) -> None:
    world, joint = ready("j3", frequency=None)
    captured, _ = capture_a_move(world, joint)
    world.tap.calls.clear()
    disturb(world.bus)
    again = joint.read_capture()
    world.bus.clear()
    assert np.array_equal(again.errors, captured.errors)
    if joint.session.retries:
        assert world.tap.count(Register.CAPTUREBLOCK) >= BLOCKS


def test_a_block_that_never_arrives_whole_is_an_error() -> None:
    world, joint = ready("j3", frequency=None)
    joint.start_capture()
    world.bus.flip(Direction.BACK, BLOCK)
    with pytest.raises(CorruptFrameError, match=r"j3 \(0x13\), CAPTUREBLOCK"):
        joint.read_capture()


def test_a_capture_is_waited_for_and_replaced_by_the_next_one() -> None:
    world, joint = ready("j4")
    begun = world.arm.now()
    joint.start_capture()
    first = joint.read_capture()
    assert 0.256 < world.arm.now() - begun < 0.32
    joint.disable()
    joint.start_capture()
    second = joint.read_capture()
    assert np.any(first.errors)
    assert not np.any(second.errors)  # A motor without current has no field.


def test_a_capture_that_was_not_begun_is_refused() -> None:
    _, joint = greeted("j4")
    with pytest.raises(IncorrectStateError, match=r"j4: 256 of 256 .*start_capture\(\) first"):
        joint.read_capture()


def test_a_simulated_joint_has_neither_an_image_nor_an_exception_nor_a_warning() -> None:
    joint = World().ready("j4")[0]
    assert joint.get_image() == 0
    assert joint.get_exception() is None
    assert not joint.get_warnings()


def test_firmware_that_has_all_of_the_diagnosis_but_warnings_is_named() -> None:
    class Older(Bus):
        """Reads a register that no firmware has in place of WARNINGS."""

        def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
            return world.bus.transfer([older(each) for each in transactions])

        def close(self) -> None:
            world.bus.close()

    def older(asked: Transaction) -> Transaction:
        if asked.write[:1] != bytes((Register.WARNINGS,)):
            return asked
        frame = bytes((Register.WARNINGS ^ 1, asked.write[1]))
        return asked._replace(write=frame + bytes((crc8((asked.address << 1, *frame)),)))

    world = World()
    joint = Joint(Older(), world.arm.clock, world.joints[3].parameters)
    joint.init()
    assert joint.get_exception() is None
    with pytest.raises(NotSupportedError, match=r"j4: its firmware has no get_warnings; flash"):
        joint.get_warnings()


@pytest.mark.parametrize("v1", [False, True])
def test_firmware_without_diagnosis_is_named(v1: bool) -> None:
    _, joint = greeted("j4", v1=v1)
    if joint.hello is not None:
        less = joint.hello.capabilities & ~Capability.DIAGNOSIS
        joint.session.hello = replace(joint.hello, capabilities=less)
    operations = (
        joint.get_image,
        joint.get_exception,
        joint.get_warnings,
        joint.start_capture,
        joint.read_capture,
    )
    for operation in operations:
        with pytest.raises(NotSupportedError, match=f"j4: .*{operation.__name__}.*firmware"):
            operation()


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((3, 0x0800_1234, 0x8200, 1), "HardFault at 0x08001234 (CFSR 0x00008200)"),
        ((2, 0, 0, 1), "NMI at an unknown address (CFSR 0x00000000)"),
        ((66, 0x0800_0100, 0, 2), "interrupt 50 at 0x08000100 (CFSR 0x00000000)"),
        ((0, 0x0800_0100, 0, 2), "exception 0 at 0x08000100 (CFSR 0x00000000)"),
    ],
)
def test_an_exception_in_words(values: tuple[float, ...], text: str) -> None:
    report = ExceptionReport.from_answer(Answer(values, 0))
    assert str(report) == text
