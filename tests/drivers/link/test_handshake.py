"""The first exchange with a joint: detection of its version, under any fault of the frames."""

from __future__ import annotations

import gc
import os
import random
import weakref
from contextlib import suppress
from copy import copy

import pytest

from bioscara.bus import Direction, FaultyBus, Transaction, When
from bioscara.drivers import Joint
from bioscara.errors import (
    BioscaraError,
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    CorruptFrameError,
    NoAcknowledgeError,
    WrongJointError,
)
from bioscara.protocol import MAGIC, READ, TRAILER, Flags, Register
from bioscara.sim import FirmwareBus, SimulatedArm
from simulated import ARM, NEAR, Tap, World, clock_is_held

SEEDS = range(int(os.environ.get("BIOSCARA_FAULT_SEEDS", "24")))
ADDRESSES = tuple(joint.address for joint in ARM.joints)
HELLO = READ[Register.HELLO]
ONE_BYTE = Transaction(0x11, HELLO.encode_v2(0x11, 0), 1)
BARE = Transaction(0x11, bytes((Register.PING,)), 0)
"""Asks for an acknowledge only, and for no answer."""
WHOLE = ONE_BYTE._replace(read=HELLO.answer_size + TRAILER)


def disturb(bus: FaultyBus, chance: random.Random) -> None:
    """Put one fault in force that strikes now and then, or always."""
    first = chance.choice((None, None, None, Register.HELLO))
    probability = chance.choice((0.05, 0.2, 0.5, 0.9, 1.0))
    count = chance.choice((None, None, 1, 3, 10))
    when = When(first=first, probability=probability, count=count)
    direction = chance.choice(tuple(Direction))
    faults = (
        lambda: bus.flip(direction, when, bits=chance.randint(1, 6)),
        lambda: bus.flip(direction, when),
        lambda: bus.lose(direction, when),
        lambda: bus.off(when),
        lambda: bus.stuck(when, recognised=False),
        lambda: bus.garbage(when),
        lambda: bus.truncate(chance.randint(0, 3), when),
        lambda: bus.repeat(chance.randint(1, 3), when),
        lambda: bus.replay(chance.randint(1, 20), when),
        lambda: bus.delay(chance.randint(1, 5), when),
        lambda: bus.swap(*chance.sample(ADDRESSES, 2), when),  # type: ignore[call-arg]  # two of them
    )
    chance.choice(faults)()


@pytest.mark.parametrize("seed", SEEDS)
def test_bus_faults_never_make_a_version_2_joint_version_1(seed: int) -> None:
    chance = random.Random(seed)
    for scene in range(10):
        arm = SimulatedArm(seed=seed, frequency=None)
        bus = FaultyBus(FirmwareBus(arm), seed * 1000 + scene, arm.clock)
        joints = [Joint(bus, arm.clock, parameters) for parameters in ARM.joints]
        for _ in range(chance.randint(1, 3)):
            disturb(bus, chance)
        for joint in joints * 2:
            with suppress(BioscaraError):
                joint.init()
            assert joint.version != 1, f"seed {seed}, scene {scene}: {joint.name}"
        bus.clear()
        for joint in joints:
            joint.init()
            assert joint.version == 2


@pytest.mark.parametrize("seed", SEEDS)
def test_a_version_1_joint_is_never_taken_for_version_2(seed: int) -> None:
    chance = random.Random(seed)
    arm = SimulatedArm(seed=seed, frequency=None, v1=True)
    bus = FaultyBus(FirmwareBus(arm), seed, arm.clock)
    joints = [Joint(bus, arm.clock, parameters) for parameters in ARM.joints]
    disturb(bus, chance)
    for joint in joints:
        with suppress(BioscaraError):
            joint.init()
        assert joint.version != 2
    bus.clear()
    if clock_is_held(arm):
        for name in NEAR:
            arm.reset(name)
        arm.run(1.0)
    for joint in joints:
        joint.init()
        assert joint.version == 1


def test_three_corrupted_requests_do_not_switch_the_check_bytes_off() -> None:
    world = World()
    # Bits of the register: the joint refuses it as unknown, in the words of version 1.
    world.bus.flip(Direction.OUT, When(first=Register.HELLO, count=3), bit=8)
    world.joints[0].init()
    assert world.joints[0].version == 2


def test_an_address_of_version_2_stays_version_2_on_its_bus() -> None:
    world = World()
    world.joints[0].init()
    world.bus.flip(Direction.OUT, When(first=Register.HELLO), bit=8)
    for joint in (world.joints[0], world.joint(ARM.joints[0])):
        with pytest.raises(CorruptFrameError, match="answered as version 2 before on this bus"):
            joint.init()
        assert joint.version == 0
    world.bus.clear()
    again = world.joint(ARM.joints[0])
    again.init()
    assert again.version == 2


def test_versions_are_remembered_per_bus() -> None:
    World().joints[0].init()
    old = World(v1=True)
    old.joints[0].init()
    assert old.joints[0].version == 1


def test_one_byte_is_read_twice_before_the_rest() -> None:
    world = World()
    world.joints[0].init()
    assert world.tap.calls[:4] == [[BARE], [ONE_BYTE], [ONE_BYTE], [WHOLE]]
    assert world.tap.count(Register.HELLO) == 3


def test_one_byte_is_enough_where_version_2_answered_before() -> None:
    world = World()
    world.joints[0].init()
    world.tap.calls.clear()
    world.joints[0].init()
    assert world.tap.calls[:2] == [[ONE_BYTE], [WHOLE]]


def test_never_more_is_read_from_a_version_1_joint_than_it_answers() -> None:
    world = World(v1=True)
    world.bus.flip(Direction.BACK, When(first=Register.HELLO, probability=0.2))
    for joint in world.joints:
        with suppress(CommunicationError):
            joint.init()
    world.bus.clear()
    for joint in world.joints:
        joint.init()
    sent = [transaction for call in world.tap.calls for transaction in call]
    assert {t.read for t in sent if t.write[0] == Register.HELLO} == {1}
    for transaction in sent:
        if transaction.write[0] != Register.HELLO:
            assert len(transaction.write) == 1, "no version 2 frame"
            assert transaction.read in (0, READ[Register(transaction.write[0])].answer_size)


def test_a_version_1_joint_gets_time_to_drop_an_unknown_register() -> None:
    times: list[tuple[float, int]] = []

    class Timed(Tap):
        def transfer(self, transactions):  # type: ignore[no-untyped-def]
            times.extend((arm.now(), t.write[0]) for t in transactions)
            return super().transfer(transactions)

    arm = SimulatedArm(v1=True)
    Joint(Timed(FirmwareBus(arm)), arm.clock, ARM.joints[0]).init()
    hellos = [index for index, (_, register) in enumerate(times) if register == Register.HELLO]
    assert hellos
    for index in hellos:
        assert times[index + 1][0] - times[index][0] >= 25e-3


class Scripted(Tap):
    """A joint that answers HELLO, and the first PING, as a test sets, else as version 1 does."""

    def __init__(self, answers: list[bytes | CommunicationError], pong: bytes) -> None:
        super().__init__(FirmwareBus())
        # Copies: an error that was raised refers to its test by its traceback.
        self.answers, self.pongs = [copy(each) for each in answers], [pong]

    def transfer(self, transactions):  # type: ignore[no-untyped-def]
        self.calls.append(list(transactions))
        if not transactions[0].read:
            return [b""]
        if transactions[0].write[0] == Register.HELLO:
            return [self.answers.pop(0) if self.answers else b"\x0c"]
        return [self.pongs.pop() if self.pongs else b"O\x0c"]


@pytest.mark.parametrize(
    ("answers", "pong", "error", "words"),
    [
        ([b"\x8c"], b"O\x0c", CorruptFrameError, "answered 8c, which is neither version's"),
        ([b"\x0c"] * 11 + [b"\x1c"], b"O\x0c", CorruptFrameError, "answered 1c, which"),
        ([b"\x8c"] * 99, b"O\x0c", CorruptFrameError, "8c, which is neither version's"),
        ([], b"N\x0c", CorruptFrameError, "PING"),
        ([], b"O\x2c", CorruptFrameError, "PING"),
        ([bytes((MAGIC & 0xFF,))] + [bytes(13)] * 9, b"O\x0c", CorruptFrameError, "neither"),
        ([NoAcknowledgeError("absent", 0x11)] * 9, b"O\x0c", NoAcknowledgeError, "absent"),
        ([b""] * 9, b"O\x0c", CorruptFrameError, "neither"),
        ([BusUnavailableError("gone")] * 9, b"O\x0c", BusUnavailableError, "gone"),
    ],
)
def test_only_intact_version_1_answers_identify_version_1(
    answers: list[bytes | CommunicationError],
    pong: bytes,
    error: type[CommunicationError],
    words: str,
) -> None:
    bus = Scripted(answers, pong)
    joint = Joint(bus, SimulatedArm().clock, ARM.joints[0])
    with pytest.raises(error, match=words):
        joint.init()
    assert joint.version == 0


def test_a_lost_answer_does_not_prevent_identifying_version_1() -> None:
    world = World(v1=True)
    world.bus.lose(Direction.BACK, When(address=0x11, count=2))
    world.joints[0].init()
    assert world.joints[0].version == 1


@pytest.mark.parametrize("address", [0x11, 0x12])
def test_swapped_joints_are_found_by_the_address_they_answer_to(address: int) -> None:
    world = World()
    world.bus.swap(0x11, 0x12)
    with pytest.raises(WrongJointError, match=f"is the joint of {0x23 - address:#04x}"):
        world.joints[address - 0x11].init()
    # Refused in one byte each: nothing longer is read before the magic was seen.
    sent = [t for call in world.tap.calls for t in call]
    assert [t.read for t in sent if t.read > 1] == [WHOLE.read]
    assert not world.joints[0].session.flags & Flags.ARMED


@pytest.mark.parametrize("recognised", [True, False])
def test_a_bus_that_failed_is_forgotten_with_its_last_user(recognised: bool) -> None:
    world = World(frequency=None)
    (joint,) = world.ready("j1")
    world.bus.stuck(recognised=recognised)
    with pytest.raises(BusStuckError if recognised else BusTimeoutError):
        joint.get_position()
    bus = weakref.ref(world.bus)
    del world, joint
    gc.collect()
    assert bus() is None
