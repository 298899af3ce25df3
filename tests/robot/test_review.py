"""What a second review found: each test fails until it is repaired."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import CodeType, FrameType

import pytest

from bioscara.bus import FaultyBus, When
from bioscara.drivers import Gripper, Pwm
from bioscara.errors import BioscaraError
from bioscara.model import load_parameters
from bioscara.robot import Robot
from bioscara.robot.gripper import RobotGripper
from bioscara.robot.running import Motion
from bioscara.sim import FirmwareBus, SimulatedArm, SimulatedServo

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
NEAR = {"j1": -3.0, "j2": 0.33, "j3": 2.58, "j4": 2.9}
START = (-2.0, 0.30, 2.0, 2.0)


class Scene:
    """A robot, and the simulated arm and bus behind it."""

    def __init__(self, folder: Path, *, v1: bool = False) -> None:
        self.arm = SimulatedArm(seed=2, positions=NEAR, v1=v1)
        self.bus = FaultyBus(FirmwareBus(self.arm), seed=1, clock=self.arm.clock)
        self.robot = Robot(self.bus, self.arm.clock, ARM, "scene", evidence=folder)

    def energised(self) -> list[str]:
        self.arm.run(1.0)
        return [name for name in NAMES if self.arm.has_torque(name)]


def test_leaving_tells_of_joints_that_stay_energised(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    robot = scene.robot.__enter__()
    robot.home()
    scene.bus.off()
    with pytest.raises(BioscaraError, match="j1 may be energised"):
        robot.__exit__(None, None, None)
    assert scene.energised() == list(NAMES)


def interrupted_after(code: CodeType, text: str, call: Callable[[], object]) -> None:
    """Let a KeyboardInterrupt come in on the line after the one with ``text`` was carried out."""
    source = Path(code.co_filename).read_text(encoding="utf-8").splitlines()
    begin = code.co_firstlineno
    after = next(line for line, t in enumerate(source[begin:], begin + 1) if text in t)
    passed = False

    def watch(frame: FrameType, event: str, _: object) -> Callable[..., object] | None:
        nonlocal passed
        if frame.f_code is not code:
            return None
        if event == "line":
            if passed and frame.f_lineno != after:
                sys.settrace(None)
                raise KeyboardInterrupt
            passed = passed or frame.f_lineno == after
        return watch

    sys.settrace(watch)
    try:
        with pytest.raises(KeyboardInterrupt):
            call()
    finally:
        sys.settrace(None)


def look(scene: Scene, seconds: float) -> dict[str, float]:
    """Look at the arm for a while, and return how far each joint moved by that."""
    before = {name: scene.arm.position(name) for name in NAMES}
    for _ in range(round(seconds / 0.03)):
        scene.arm.run(0.03)
        with suppress(BioscaraError):
            _ = scene.robot.state
    return {name: abs(scene.arm.position(name) - before[name]) for name in NAMES}


def test_looking_does_not_move_an_arm_whose_motion_was_interrupted(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    with scene.robot as robot:
        robot.home()
        robot.move_joints(START)
        interrupted_after(
            Motion.follow.__code__, "send_goal(", lambda: robot.move_joints((-1.0, 0.3, 1.0, 1.0))
        )
        moved = look(scene, 5.0)
    assert max(moved.values()) < 0.01


def test_looking_does_not_move_an_arm_whose_homing_was_interrupted(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    with scene.robot as robot:
        interrupted_after(Robot.home.__wrapped__.__code__, "send_goal(", robot.home)  # type: ignore[attr-defined]
        moved = look(scene, 3.0)
    assert max(moved.values()) < 0.001


def test_looking_moves_no_jaws_whose_motion_was_interrupted(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    servo = SimulatedServo(ARM.gripper.outputs[0])
    jaws = Gripper(
        Pwm(ARM.gripper.outputs, scene.arm.clock, servo.root), ARM.gripper, servo.root / "width"
    )
    robot = Robot(scene.bus, scene.arm.clock, ARM, "scene", gripper=jaws, evidence=tmp_path)
    scene.robot = robot
    with robot:
        robot.gripper.move(0.05)
        before = robot.gripper.width
        move = RobotGripper.move.__wrapped__.__code__  # type: ignore[attr-defined]
        interrupted_after(move, "send_goal(", lambda: robot.gripper.move(0.1))
        look(scene, 1.0)
        assert robot.gripper.width == before


def test_the_state_after_a_recovery_that_failed_tells_the_fault(tmp_path: Path) -> None:
    scene = Scene(tmp_path)
    with scene.robot as robot:
        robot.home()
        scene.bus.off(When(address=0x12))
        with pytest.raises(BioscaraError):
            robot.move_joints(START)
        robot.acknowledge()
        with pytest.raises(BioscaraError):
            robot.recover()
        scene.arm.run(0.1)
        try:
            assert all(math.isnan(position) for position in robot.state.positions)
        except BioscaraError as error:
            assert "j2" in str(error)  # noqa: PT017  either is an answer; a name of ours is none
