"""The bench of a simulated arm: each fault acts, is listed while it lasts, and ends."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from bioscara.bus import Transaction
from bioscara.errors import (
    BusStuckError,
    CommunicationError,
    InvalidArgumentError,
    LimitError,
    NoAcknowledgeError,
)
from bioscara.protocol import Register
from bioscara.sim import BenchBus, SimulatedArm
from bioscara.sim.bench import FAULTS
from simulated import NEAR

PING = Transaction(0x11, bytes((Register.PING,)), 1)


@pytest.fixture
def bus() -> BenchBus:
    return BenchBus(SimulatedArm(seed=1, positions=NEAR), seed=1)


def listed(bus: BenchBus) -> list[tuple[str, str, float]]:
    """Return the faults that last: fault, joint and value."""
    return [tuple(each[:3]) for each in bus.bench.faults]  # type: ignore[misc]


def share_lost(bus: BenchBus, count: int = 2000) -> float:
    """Return the share of exchanges that fail or return something else."""
    (good,) = BenchBus(bus.arm).transfer([PING])
    return sum(bus.transfer([PING]) != [good] for _ in range(count)) / count


def test_a_lost_bus_loses_the_share_that_is_wanted(bus: BenchBus) -> None:
    assert share_lost(bus, 200) == 0.0
    for share in (0.05, 0.5):
        bus.bench.apply("bus_loss", value=share)
        assert share_lost(bus) == pytest.approx(share, abs=0.04)
        assert listed(bus) == [("bus_loss", "", share)]
    bus.bench.apply("bus_loss", value=0.0)
    assert share_lost(bus, 200) == 0.0
    assert listed(bus) == []


def test_flipped_bits_hit_each_bit_of_both_directions(bus: BenchBus) -> None:
    bus.bench.apply("bus_flips", value=0.01)
    # 7 bits of the address, 8 of the register, 8 of the answer.
    assert share_lost(bus) == pytest.approx(1.0 - 0.99**23, abs=0.04)
    bus.bench.apply("bus_flips", value=0.0)
    assert share_lost(bus, 200) == 0.0


def test_a_stuck_bus_carries_nothing_until_it_is_released(bus: BenchBus) -> None:
    bus.bench.apply("bus_stuck")
    (result,) = bus.transfer([PING])
    assert isinstance(result, BusStuckError)
    bus.bench.apply("bus_stuck", value=0.0)
    assert isinstance(bus.transfer([PING])[0], bytes)


def test_a_brown_out_ends_automatically_and_the_arm_reports_it(bus: BenchBus) -> None:
    said: list[str] = []
    bus.bench.changed = said.append
    bus.bench.apply("brown_out", value=0.5)
    bus.arm.run(0.45)
    assert isinstance(bus.transfer([PING])[0], NoAcknowledgeError)
    assert listed(bus) == [("brown_out", "", 0.5)]
    bus.arm.run(0.1)
    # The joints have booted by the first exchange after it.
    assert isinstance(bus.transfer([PING])[0], bytes)
    assert listed(bus) == []
    assert said == ["brown_out is over"]


def test_a_brown_out_does_not_bring_a_supply_back_that_is_off(bus: BenchBus) -> None:
    bus.bench.apply("brown_out", value=0.5)
    bus.bench.apply("supply", value=0.0)
    bus.bench.apply("brown_out", value=0.2)
    bus.arm.run(1.0)
    assert isinstance(bus.transfer([PING])[0], NoAcknowledgeError)
    assert listed(bus) == [("supply", "", 0.0)]
    bus.bench.apply("supply", value=1.0)
    bus.arm.run(0.1)
    assert isinstance(bus.transfer([PING])[0], bytes)
    assert listed(bus) == []


def test_a_joint_that_is_unplugged_stays_off_when_the_supply_is_back(bus: BenchBus) -> None:
    bus.bench.apply("power", "j1")
    bus.bench.apply("hang", "j2")
    bus.bench.apply("supply")
    bus.bench.apply("supply", value=1.0)
    bus.arm.run(0.1)
    assert listed(bus) == [("power", "j1", 0.0)]
    others = [PING._replace(address=address) for address in (0x12, 0x13, 0x14)]
    first, *rest = bus.transfer([PING, *others])
    assert isinstance(first, NoAcknowledgeError)
    assert all(isinstance(answer, bytes) for answer in rest)


def test_only_the_motors_of_controllers_that_are_fed_lose_their_power() -> None:
    bus = BenchBus(SimulatedArm(seed=1, positions=NEAR, controllers_fed=True), seed=1)
    bus.bench.apply("hang", "j2")
    bus.bench.apply("supply")
    assert isinstance(bus.transfer([PING])[0], bytes)
    assert listed(bus) == [("hang", "j2", 1.0), ("supply", "", 0.0)]


def test_a_motor_supply_of_its_own_is_refused_with_the_remedy(bus: BenchBus) -> None:
    with pytest.raises(InvalidArgumentError, match=r"motor_power'; supply .* controllers_fed=True"):
        bus.bench.apply("motor_power", value=0.0)


def test_our_firmware_does_not_hang_for_long(bus: BenchBus) -> None:
    bus.bench.apply("hang", "j2")
    assert listed(bus) == [("hang", "j2", 1.0)]
    bus.bench.step(bus.arm.now() + 0.3)
    assert listed(bus) == []
    original = BenchBus(SimulatedArm(seed=1, v1=True), seed=1)
    original.bench.apply("hang", "j2")
    original.bench.step(original.arm.now() + 10.0)
    assert listed(original) == [("hang", "j2", 1.0)]
    original.bench.apply("reset", "j2")
    assert listed(original) == []


def test_impossible_faults_are_refused_and_change_nothing(bus: BenchBus) -> None:
    with pytest.raises(InvalidArgumentError, match="did you mean bus_flips"):
        bus.bench.apply("bus_flip")
    with pytest.raises(InvalidArgumentError, match="no joint 'j5'"):
        bus.bench.apply("reset", "j5")
    for fault, value in (("bus_flips", 0.02), ("bus_loss", 1.5), ("brown_out", 0.0), ("hang", 2.0)):
        with pytest.raises(LimitError, match=f"value of {fault}"):
            bus.bench.apply(fault, "j1", value)
    with pytest.raises(InvalidArgumentError):
        bus.bench.apply("push", "j1", math.nan)
    assert listed(bus) == []


LASTING = [name for name in FAULTS if name not in {"clear", "clear_obstacles", "reset"}]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(LASTING),
            st.sampled_from(["j1", "j2"]),
            st.sampled_from([0.0, 0.01, 1.0]),
        ),
        max_size=12,
    )
)
def test_clear_ends_all_and_the_bus_is_good_again(acts: list[tuple[str, str, float]]) -> None:
    bus = BenchBus(SimulatedArm(seed=1, positions=NEAR), seed=1)
    for fault, joint, value in acts:
        try:
            bus.bench.apply(fault, joint, value)
        except LimitError:
            continue
        kinds = [(each.fault, each.joint) for each in bus.bench.faults if each.fault != "obstacle"]
        assert len(kinds) == len(set(kinds))
    bus.bench.apply("clear")
    assert listed(bus) == []
    bus.arm.run(0.5)
    assert not isinstance(bus.transfer([PING])[0], CommunicationError)
