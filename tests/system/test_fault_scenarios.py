"""Rows of the fault table: inject, then reaction, time and report, through the whole host stack."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from bioscara import Robot
from bioscara.bus import Direction, FaultyBus, Transaction, When
from bioscara.drivers import Joint, Setpoint, track
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    JointFaultError,
    JointLostError,
    JointResetError,
    NotEnabledError,
    NotSupportedError,
    StalledError,
    WrongJointError,
)
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, point_to_point
from bioscara.protocol import WRITE, Fault, Register, ResetCause
from bioscara.report import CycleRecord
from bioscara.sim import FirmwareBus, SimulatedArm
from simulated import simulated_robot

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
PERIOD = 0.01
SILENCE = 0.06


class Scene:
    """A homed arm that follows a trajectory until a fault strikes at a given time."""

    def __init__(self) -> None:
        self.arm, self.bus, self.robot = simulated_robot(seed=3, homed=True)
        self.records: list[CycleRecord] = []
        self.struck = math.inf

    def __enter__(self) -> Scene:
        self.robot.__enter__()
        self.robot.enable()
        return self

    def __exit__(self, *exc: object) -> None:
        self.robot.bus.close()

    def joint(self, name: str) -> Joint:
        return next(joint for joint in self.robot.joints if joint.name == name)

    def trajectory(self) -> Trajectory:
        start = [-2.5, 0.30, 2.2, 2.5]
        goal = [-1.5, 0.25, 0.8, 1.0]
        return point_to_point(NAMES, start, goal, ARM.joints)

    def follow(self, fault: Callable[[], object] = lambda: None, at: float = 0.8) -> None:
        def observe(record: CycleRecord) -> None:
            self.records.append(record)
            if record.trajectory_time >= at and self.struck == math.inf:
                self.struck = self.arm.now()
                fault()

        self.robot.follow(self.trajectory(), approach=True, on_cycle=observe)

    def all_at_rest(self) -> bool:
        return all(abs(self.arm.velocity(name)) < 0.02 for name in NAMES)

    def worst_error(self) -> float:
        errors = (
            abs(joint.position - joint.reference)
            for record in self.records
            for joint in record.joints
        )
        return max(filter(math.isfinite, errors))

    def time_until_rest(self, name: str) -> float:
        """Seconds from the fault; lets time pass."""
        while abs(self.arm.velocity(name)) > 0.02:
            self.arm.run(0.001)
            assert self.arm.now() - self.struck < 3.0, f"{name} does not come to rest"
        return self.arm.now() - self.struck


def test_bus1_one_missing_acknowledge_stops_nothing() -> None:
    with Scene() as scene:
        scene.follow(lambda: scene.bus.off(When(address=0x13, count=1)))
        assert scene.arm.position("j3") == pytest.approx(0.8, abs=5e-3)
        assert sum(record.retries for record in scene.records) >= 1


def test_bus2_a_joint_that_cannot_be_reached_stops_itself_and_the_others_stop_on_their_path() -> (
    None
):
    with Scene() as scene:
        with pytest.raises(CommunicationError, match="j3"):
            scene.follow(lambda: scene.bus.off(When(address=0x13)))
        noticed = scene.arm.now() - scene.struck
        limits = {joint.name: joint for joint in ARM.joints}
        slowest = limits["j1"].max_velocity / limits["j1"].max_acceleration
        assert noticed < 4 * PERIOD + slowest + 0.2
        assert scene.time_until_rest("j3") < SILENCE + 1.0
        scene.arm.run(0.5)  # The belts swing out.
        assert scene.all_at_rest()
        scene.bus.clear()
        scene.arm.run(0.1)
        with pytest.raises(BioscaraError):
            _raise(track([scene.joint("j3")], [Setpoint(scene.arm.position("j3"))])[0])
        assert scene.joint("j3").get_fault().fault == Fault.SETPOINT_LOST.name


def _raise(outcome: object) -> None:
    if isinstance(outcome, BioscaraError):
        raise outcome


@pytest.mark.parametrize("direction", [Direction.OUT, Direction.BACK])
def test_bus3_flipped_bits_are_noticed_repeated_and_never_executed(direction: Direction) -> None:
    with Scene() as scene:
        scene.follow(lambda: scene.bus.flip(direction, When(probability=0.02)), at=0.0)
        for name, goal in zip(NAMES, (-1.5, 0.25, 0.8, 1.0), strict=True):
            assert scene.arm.position(name) == pytest.approx(goal, abs=5e-3)
        assert sum(record.retries for record in scene.records) > 3
        assert scene.worst_error() < 0.05


def test_bus4_the_answer_of_another_joint_is_not_believed() -> None:
    with Scene() as scene:
        with pytest.raises(CommunicationError):
            scene.follow(lambda: scene.bus.swap(0x13, 0x14))
        assert scene.time_until_rest("j3") < 1.0
        assert scene.time_until_rest("j4") < 1.0


@pytest.mark.parametrize("stretch", [0.0002, 0.05])
def test_bus6_short_stretches_are_lived_with_and_long_ones_stop_the_arm(stretch: float) -> None:
    with Scene() as scene:
        if stretch < 0.001:
            scene.follow(lambda: scene.arm.set_stretch(stretch))
            assert scene.arm.position("j1") == pytest.approx(-1.5, abs=5e-3)
            return
        with pytest.raises(BioscaraError):
            scene.follow(lambda: scene.arm.set_stretch(stretch))
        assert scene.all_at_rest()


def test_bus7_an_adapter_that_is_gone_leaves_joints_that_stop_by_themselves() -> None:
    with Scene() as scene:
        with pytest.raises(CommunicationError, match="adapter is gone"):
            scene.follow(lambda: scene.bus.unavailable(10_000))
        for name in NAMES:
            assert scene.time_until_rest(name) < SILENCE + 1.0


def test_bus8_late_copies_of_frames_are_not_executed() -> None:
    with Scene() as scene:
        scene.follow(lambda: scene.bus.replay(6, When(probability=0.02)))
        assert scene.arm.position("j1") == pytest.approx(-1.5, abs=5e-3)
        assert scene.worst_error() < 0.05


def test_fw1_a_joint_that_restarts_is_named_stops_the_others_and_is_not_taken_for_homed() -> None:
    with Scene() as scene:
        with pytest.raises((JointResetError, JointLostError, CommunicationError)) as caught:
            scene.follow(lambda: scene.arm.reset("j3", ResetCause.BROWN_OUT))
        assert "j3" in str(caught.value)
        assert scene.time_until_rest("j1") < 1.0
        joint = scene.joint("j3")
        joint.init()
        assert not joint.is_homed()
        assert joint.hello is not None
        assert joint.hello.reset_cause is ResetCause.PIN
        assert not scene.arm.has_torque("j3")


def test_fw2_a_hung_joint_is_reset_by_its_watchdog_and_has_no_torque() -> None:
    with Scene() as scene:
        with pytest.raises(BioscaraError):
            scene.follow(lambda: scene.arm.hang("j4"))
        scene.arm.run(0.3)
        assert not scene.arm.has_torque("j4")
        joint = scene.joint("j4")
        joint.init()
        assert joint.hello is not None
        assert joint.hello.reset_cause is ResetCause.WATCHDOG
        assert not joint.is_homed()


def test_fw4_a_host_that_falls_silent_leaves_an_arm_at_rest() -> None:
    with Scene() as scene:

        class KilledError(Exception):
            pass

        def die() -> None:
            scene.bus.off()
            raise KilledError

        with pytest.raises(KilledError):
            scene.follow(die)
        for name in NAMES:
            assert scene.time_until_rest(name) < SILENCE + 1.0
        scene.bus.clear()
        scene.arm.run(1.0)
        again = Robot(scene.bus, scene.arm.clock, ARM, "after a restart")
        before = [scene.arm.field(name) for name in NAMES]
        with again:
            for joint in again.joints:
                assert joint.is_homed()
                assert joint.get_fault().fault == Fault.SETPOINT_LOST.name
                with pytest.raises((NotEnabledError, JointFaultError)):
                    joint.set_position(scene.arm.position(joint.name))
        assert [scene.arm.field(name) for name in NAMES] == before


def test_fw5_a_joint_with_another_number_is_refused_at_the_start() -> None:
    arm = SimulatedArm()
    bus = FaultyBus(FirmwareBus(arm), seed=1)
    bus.swap(0x11, 0x12)
    with pytest.raises((WrongJointError, NotSupportedError, CommunicationError)):
        Robot(bus, arm.clock, ARM, "swapped").__enter__()


def test_mec1_a_collision_stops_the_joint_at_once_and_the_others_after_it() -> None:
    with Scene() as scene:
        with pytest.raises((StalledError, JointFaultError)) as caught:
            scene.follow(lambda: scene.arm.add_obstacle("j1", scene.arm.position("j1") + 0.05))
        assert "j1" in str(caught.value)
        assert scene.time_until_rest("j1") < 1.0
        assert scene.all_at_rest()
        report = scene.joint("j1").get_fault()
        assert report.fault == Fault.STALL.name
        assert scene.joint("j1").is_homed()
        believed = scene.joint("j1").read_state().position
        assert believed == pytest.approx(scene.arm.position("j1"), abs=0.02)


@pytest.mark.parametrize("fault", ["jump", "corrupt", "freeze"])
def test_mec6_an_encoder_that_lies_stops_the_joint_and_costs_its_home(fault: str) -> None:
    def strike(scene: Scene) -> None:
        if fault == "jump":
            scene.arm.jump_encoder("j1", 0.25)
        elif fault == "corrupt":
            scene.arm.corrupt_encoder("j1")
        else:
            scene.arm.freeze_encoder("j1")

    with Scene() as scene:
        with pytest.raises((JointFaultError, StalledError, NotEnabledError, BioscaraError)):
            scene.follow(lambda: strike(scene))
        assert scene.time_until_rest("j1") < 1.5
        joint = scene.joint("j1")
        assert joint.get_fault().fault == Fault.ENCODER.name
        assert not joint.is_homed()


def test_mec7_a_coil_that_was_reversed_later_is_found_by_the_check() -> None:
    arm = SimulatedArm(positions={"j1": 0.0})
    joint = Joint(FirmwareBus(arm), arm.clock, ARM.joints[0])
    joint.init()
    joint.enable()
    arm.reverse_coil("j1")
    with pytest.raises(JointFaultError, match=Fault.ORIENTATION.name):
        joint.check_orientation()
    assert abs(arm.position("j1")) < math.radians(7.2) / 35
    assert not arm.has_torque("j1")


def test_a_motion_command_of_an_unarmed_host_is_refused_in_an_armed_session() -> None:
    with Scene() as scene:
        before = scene.arm.field("j1")
        session = scene.joint("j1").session
        assert session.version == 2
        frame = WRITE[Register.MOVESTEPS].encode_v1((5000,))
        scene.bus.transfer([Transaction(0x11, frame, 1)])
        scene.arm.run(0.1)
        assert abs(scene.arm.field("j1") - before) < 3
