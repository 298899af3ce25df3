"""The first fault names the cause, in every activity of the arm, also of a lasting cause."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import example, given, settings, strategies as st

from bioscara import Robot
from bioscara.bus import FaultyBus, Transaction, When
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import (
    BioscaraError,
    BusStuckError,
    BusTimeoutError,
    CommunicationError,
    HardwareError,
    NoAcknowledgeError,
)
from bioscara.planning.motions.jog import JointVelocity
from bioscara.protocol import SILENCE
from bioscara.report import CycleRecord
from bioscara.sim import SimulatedArm
from laws import examples
from simulated import NAMES, clock_is_held, home_error, simulated_robot

START, GOAL = (-2.5, 0.30, 2.2, 2.5), (-1.5, 0.25, 0.8, 1.0)
TIMEOUT = 0.010
"""That of an adapter in the kernel [s]."""

Disturb = Callable[[SimulatedArm, FaultyBus], object]

STUCK: dict[str, Disturb] = {
    "a line is held": lambda _, bus: bus.stuck(),
    "all time out": lambda _, bus: bus.stuck(recognised=False),
    "all time out, slowly": lambda _, bus: bus.stuck(recognised=False, timeout=TIMEOUT),
    "the line falls within a call": lambda _, bus: bus.stuck(When(after=3), recognised=False),
}
POWER: dict[str, Disturb] = {
    "no supply": lambda arm, _: arm.set_supply(False),
    "no acknowledge": lambda _, bus: bus.off(),
}
JOINT: dict[str, Disturb] = {
    "one is unplugged": lambda _, bus: bus.off(When(address=0x13)),
    "one has no power": lambda arm, _: arm.set_power("j3", False),
    "one is slow": lambda _, bus: bus.slow(0.05, When(address=0x13), timeout=TIMEOUT),
    "one times out": lambda _, bus: bus.stuck(When(address=0x13), recognised=False),
}
GONE: dict[str, Disturb] = {"no adapter": lambda _, bus: bus.unavailable(10**6)}
KINDS = {
    FaultKind.BUS_STUCK: STUCK,
    FaultKind.POWER_LOST: POWER,
    FaultKind.JOINT_LOST: JOINT,
    FaultKind.BUS_FAILED: GONE,
}
DISTURBANCES = [(kind, name) for kind, row in KINDS.items() for name in row]
PHASES = ("moving", "jogging", "holding", "disabled", "enabling", "homing")


class Scene:
    """A homed arm that does something until a disturbance strikes."""

    def __init__(self, folder: Path, *, v1: bool, homed: bool, fed: bool) -> None:
        self.arm, self.bus, self.robot = simulated_robot(
            folder, seed=3, v1=v1, frequency=400e3, homed=homed, controllers_fed=fed
        )
        self.strike: Callable[[], object] = lambda: None
        self.cycles = 0

    def observe(self, _: CycleRecord) -> None:
        self.cycles -= 1
        if self.cycles == 0:
            self.strike()

    def cycle(self, count: int) -> None:
        """Run cycles of an arm that does nothing."""
        for _ in range(count):
            self.arm.run(2.5 * self.robot.period)
            with suppress(BioscaraError):
                _ = self.robot.state

    def do(self, phase: str, moment: float, strike: Callable[[], object]) -> None:
        """Let the disturbance strike in a phase, at a share of it, and see it through."""
        robot, self.strike = self.robot, strike
        with suppress(BioscaraError):
            if phase == "homing":
                self.cycles = 1 + int(150 * moment)
                robot.home(on_cycle=self.observe)
            elif phase == "moving":
                robot.move_joints(START)
                self.cycles = 1 + int(0.8 / robot.period * moment)
                robot.move_joints(GOAL, on_cycle=self.observe)
            elif phase == "jogging":
                robot.move_joints(START)
                self.cycles = 1 + int(0.8 / robot.period * moment)
                # A disturbance that is bridged does not end it.
                velocity = JointVelocity(0.2, 0.0, -0.2, 0.2)
                robot.jog(lambda: velocity, timeout=2.0, on_cycle=self.observe)
            elif phase == "enabling":
                robot.disable()
                strike()
                robot.enable()
            else:
                if phase == "disabled":
                    robot.disable()
                self.cycle(1 + int(10 * moment))
                strike()
        self.cycle(20)


@contextmanager
def connected(*, v1: bool, homed: bool = True, fed: bool = False) -> Iterator[Scene]:
    with TemporaryDirectory() as folder:
        scene = Scene(Path(folder), v1=v1, homed=homed, fed=fed)
        scene.robot.open()
        try:
            yield scene
        finally:
            scene.bus.clear()
            scene.arm.set_supply(True)
            for name in NAMES:
                if clock_is_held(scene.arm):
                    scene.arm.set_power(name, False)
                scene.arm.set_power(name, True)
            scene.arm.run(2.0)
            scene.robot.close()


def kinds(robot: Robot) -> list[tuple[FaultKind, str]]:
    return [(fault.kind, fault.source) for fault in robot.faults]


def require_right(robot: Robot, expected: FaultKind) -> None:
    """Check the first fault, its remedy, and that the others follow from it."""
    found = kinds(robot)
    assert found
    assert found[0][0] is expected, found
    first = str(robot.faults[0])
    assert expected.action in first
    if expected is FaultKind.BUS_STUCK:
        assert len(found) == 1, found
        stuck = robot.faults[0].cause
        assert isinstance(stuck, BusStuckError)
        assert stuck.transactions >= 4
        assert 0.0 <= stuck.duration < 0.5
        assert re.search(r"the first, with j[1-4] \(0x1[1-4]\), \d+ ms ago", first)
    elif expected is FaultKind.JOINT_LOST:
        assert {source for _, source in found} == {"j3"}, found
    else:
        assert FaultKind.BUS_STUCK not in {kind for kind, _ in found}
    assert len(found) == len(set(found))


@settings(max_examples=examples(24))
@given(
    case=st.sampled_from(DISTURBANCES),
    phase=st.sampled_from(PHASES),
    moment=st.floats(0.0, 1.0),
    v1=st.booleans(),
)
@example(case=(FaultKind.BUS_STUCK, "all time out"), phase="homing", moment=0.4, v1=False)
@example(case=(FaultKind.BUS_STUCK, "all time out, slowly"), phase="moving", moment=0.9, v1=False)
@example(case=(FaultKind.BUS_STUCK, "all time out, slowly"), phase="homing", moment=0.5, v1=True)
@example(case=(FaultKind.JOINT_LOST, "one is slow"), phase="moving", moment=0.6, v1=True)
@example(case=(FaultKind.POWER_LOST, "no supply"), phase="homing", moment=0.4, v1=False)
@example(case=(FaultKind.JOINT_LOST, "one is unplugged"), phase="enabling", moment=0.0, v1=True)
def test_the_first_fault_names_what_happened(
    case: tuple[FaultKind, str], phase: str, moment: float, v1: bool
) -> None:
    expected, name = case
    with connected(v1=v1, homed=phase != "homing") as scene:
        if phase != "homing":
            scene.robot.enable()
        scene.do(phase, moment, lambda: KINDS[expected][name](scene.arm, scene.bus))
        late = (FaultKind.OVERRUN, "loop")
        if name == "one is slow" and v1 and late in kinds(scene.robot):
            # Its two frames, each with its repetition, take longer than the joints wait.
            assert set(kinds(scene.robot)) == {late, (FaultKind.JOINT_LOST, "j3")}
            return
        require_right(scene.robot, expected)


@settings(max_examples=examples(12))
@given(
    name=st.sampled_from(list(STUCK)),
    phase=st.sampled_from(PHASES),
    moment=st.floats(0.0, 1.0),
    duration=st.floats(0.0, 0.3),
    v1=st.booleans(),
)
@example(name="all time out", phase="moving", moment=0.8, duration=0.2, v1=False)
@example(name="a line is held", phase="holding", moment=0.5, duration=0.25, v1=True)
def test_bus5_after_a_stuck_bus_the_arm_moves_again_and_knows_its_positions(
    name: str, phase: str, moment: float, duration: float, v1: bool
) -> None:
    with connected(v1=v1, homed=phase != "homing") as scene:
        robot, arm = scene.robot, scene.arm
        if phase != "homing":
            robot.enable()
        ends: list[float] = []

        def strike() -> None:
            STUCK[name](arm, scene.bus)
            ends.append(arm.now() + duration)

        free_later(scene.bus, arm, ends)
        scene.do(phase, moment, strike)
        scene.bus.clear()
        arm.run(1.0)
        assert all(abs(arm.velocity(joint)) < 0.02 for joint in NAMES)
        before = [arm.position(joint) for joint in NAMES]
        if robot.faults:
            # The line was held for less than the host bridges; then a joint may have stopped.
            if duration > 0.14:
                require_right(robot, FaultKind.BUS_STUCK)
            robot.acknowledge()
            robot.recover()
        assert robot.faults == ()
        if phase != "homing":
            robot.enable()
            tolerance = [home_error(joint, v1=v1) for joint in NAMES]
            for believed, real, allowed in zip(
                robot.state.positions, before, tolerance, strict=True
            ):
                assert abs(believed - real) < allowed + 2e-3
            robot.move_joints(GOAL)
            for joint, goal in zip(NAMES, GOAL, strict=True):
                assert arm.position(joint) == pytest.approx(goal, abs=0.02)


def free_later(bus: FaultyBus, arm: SimulatedArm, ends: list[float]) -> None:
    """Let the disturbances of a bus end once the arm's clock has passed the last of ``ends``."""
    transfer = bus.transfer

    def carry(transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        if ends and arm.now() >= ends[-1]:
            bus.clear()
            ends.clear()
        return transfer(transactions)

    bus.transfer = carry  # type: ignore[method-assign]


@pytest.mark.parametrize("name", list(STUCK))
@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_bus5_a_stuck_bus_is_found_within_two_cycles_and_all_joints_stop(
    name: str, v1: bool
) -> None:
    with connected(v1=v1) as scene:
        robot, arm = scene.robot, scene.arm
        robot.enable()
        struck: list[float] = []

        def strike() -> None:
            struck.append(arm.now())
            STUCK[name](arm, scene.bus)

        robot.move_joints(START)
        scene.cycles, scene.strike = 40, strike
        with pytest.raises(BusStuckError):
            robot.move_joints(GOAL, on_cycle=scene.observe)
        (fault,) = robot.faults
        # From the end of the cycle in which it struck to the begin of the one that found it.
        assert fault.time - struck[0] < (3 if "within a call" in name else 2) * robot.period
        assert robot.is_enabled
        if not v1:
            arm.run(SILENCE + 0.5)
            assert all(abs(arm.velocity(joint)) < 0.02 for joint in NAMES)
            assert all(arm.has_torque(joint) for joint in NAMES)


def test_bus5_an_original_joint_that_holds_the_clock_is_a_stuck_bus_until_its_power_is_cycled() -> (
    None
):
    with connected(v1=True) as scene:
        robot = scene.robot
        robot.enable()
        # It answers one byte to this, and holds the clock where more is read.
        scene.bus.transfer((Transaction(0x13, b"\x7f", 5),))
        assert clock_is_held(scene.arm)
        scene.cycle(10)
        require_right(robot, FaultKind.BUS_STUCK)
        remedy = "j1, j2, j3, j4 may be moving; switch the arm's power off, then on; free the line"
        assert remedy in str(robot.faults[0])
        robot.acknowledge()
        with pytest.raises(BusStuckError, match=remedy):
            robot.recover()
        scene.arm.set_power("j3", False)
        scene.arm.run(0.1)
        with pytest.raises(NoAcknowledgeError, match="without j3 the bus works again"):
            robot.recover()
        scene.arm.set_power("j3", True)
        scene.arm.run(1.0)
        robot.recover()
        assert robot.faults == ()
        robot.enable()
        assert [axis.homed for axis in robot.runner.arm.session.hardware.axes] == [
            True,
            True,
            False,
            True,
        ]


def test_bus5_an_original_joint_that_restarts_and_holds_the_clock_is_the_first_fault() -> None:
    with connected(v1=True) as scene:
        robot, arm = scene.robot, scene.arm
        robot.enable()
        robot.move_joints(START)
        # It acknowledges again before the next cycle, and is asked too early.
        scene.cycles, scene.strike = 25, lambda: arm.reset("j4")
        with pytest.raises(BusStuckError, match="may be moving; switch the arm's power off"):
            robot.move_joints(GOAL, on_cycle=scene.observe)
        require_right(robot, FaultKind.BUS_STUCK)


def test_bus5_the_joint_whose_restart_freed_the_line_is_named() -> None:
    with connected(v1=False) as scene:
        robot = scene.robot
        robot.enable()
        held = scene.bus.stuck()
        scene.cycle(5)
        require_right(robot, FaultKind.BUS_STUCK)
        robot.acknowledge()
        held.cancel()
        scene.arm.reset("j2")
        scene.arm.run(0.1)
        robot.recover()
        assert any("until j2 restarted" in warning for warning in robot.warnings)


@pytest.mark.parametrize("recognised", [True, False])
def test_bus5_a_stuck_bus_prevents_connecting_and_says_how_to_free_it(
    tmp_path: Path, recognised: bool
) -> None:
    _, bus, robot = simulated_robot(tmp_path)
    held = bus.stuck(recognised=recognised)
    with pytest.raises(BusStuckError, match="free the line: switch the joints off and on"):
        robot.open()
    held.cancel()


def test_one_slow_joint_does_not_make_connecting_blame_the_bus(tmp_path: Path) -> None:
    _, bus, robot = simulated_robot(tmp_path)
    bus.slow(0.05, When(address=0x11))
    with pytest.raises(BusTimeoutError):
        robot.open()


def test_bus5_joints_that_cannot_be_disabled_are_named_once_with_the_stuck_bus() -> None:
    with connected(v1=False) as scene:
        scene.robot.enable()
        scene.bus.stuck()
        with pytest.raises(HardwareError) as caught:
            scene.robot.disable()
        assert str(caught.value).startswith(
            "j1, j2, j3, j4 may be moving or energised: the bus is stuck"
        )
        assert str(caught.value).count("j2") == 1


@pytest.mark.parametrize("phase", PHASES)
def test_usr1_motors_alone_without_supply_are_named_in_every_phase(phase: str) -> None:
    with connected(v1=False, homed=phase != "homing", fed=True) as scene:
        if phase != "homing":
            scene.robot.enable()
        scene.do(phase, 0.4, lambda: scene.arm.set_supply(False))
        if phase == "disabled":
            assert scene.robot.faults == ()
            with pytest.raises(BioscaraError, match="DRIVER"):
                scene.robot.enable()
        require_right(scene.robot, FaultKind.POWER_LOST)
