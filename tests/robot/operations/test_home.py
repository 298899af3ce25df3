"""Homing with another sensitivity and current: frames that reach the joints, and refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bioscara.errors import InvalidArgumentError, MotionCancelledError
from bioscara.protocol import Register
from bioscara.report import CycleRecord
from bioscara.robot import Robot
from simulated import ARM, NAMES, Tap, simulated_bus

CONFIGURED = {j.name: (j.homing.threshold, j.homing.current_percent) for j in ARM.joints}
OWNERS = {joint.address: joint.name for joint in ARM.joints}


def robot_and_tap(tmp_path: Path, *, v1: bool = False) -> tuple[Robot, Tap]:
    arm, bus = simulated_bus(seed=2, v1=v1)
    tap = Tap(bus)
    return Robot(tap, arm.clock, ARM, "simulated", evidence=tmp_path), tap


def sent(tap: Tap) -> dict[str, tuple[int, int]]:
    """Return sensitivity and current of the last HOME of each joint."""
    return {
        OWNERS[frame.address]: (frame.write[3], frame.write[4])
        for call in tap.calls
        for frame in call
        if frame.write[0] == Register.HOME
    }


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({}, CONFIGURED),
        ({"sensitivity": 41}, {name: (41, CONFIGURED[name][1]) for name in NAMES}),
        (
            {"sensitivity": {"j2": 45}, "current": {"j2": 31, "j4": 11}},
            {**CONFIGURED, "j2": (45, 31), "j4": (CONFIGURED["j4"][0], 11)},
        ),
    ],
    ids=["configured", "common", "per joint"],
)
def test_each_joint_gets_its_value(
    tmp_path: Path, v1: bool, values: dict[str, Any], expected: dict[str, tuple[int, int]]
) -> None:
    robot, tap = robot_and_tap(tmp_path, v1=v1)
    with robot:
        robot.home(**values)
        assert robot.is_homed
        assert sent(tap) == expected


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_values_are_for_one_homing_also_if_it_is_stopped(tmp_path: Path, v1: bool) -> None:
    robot, tap = robot_and_tap(tmp_path, v1=v1)

    def stop_at_j1(_: CycleRecord) -> None:
        if "j1" in sent(tap):
            robot.stop()

    with robot:
        with pytest.raises(MotionCancelledError):
            robot.home(sensitivity=41, current=31, on_cycle=stop_at_j1)
        assert sent(tap) == {"j2": (41, 31), "j1": (41, 31)}
        robot.home()
        assert sent(tap) == {**CONFIGURED, "j2": (41, 31)}


@pytest.mark.parametrize("wanted", ["sensitivity", "current"])
@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        (0, r"^j1 homing {}: 0 .* is outside 1 \.\. "),
        (256, r"^j1 homing {}: 256 .* is outside 1 \.\. "),
        ({"j3": -1}, r"^j3 homing {}: -1 .* is outside 1 \.\. "),
        ({"j3": 2.5}, r"^j3 homing {} is 2\.5, which is not a whole number"),
        ({"j3": float("nan")}, r"^j3 homing {} is nan"),
        ({"j3": None}, r"^j3 homing {} is None; give a number"),
        ({"j3": True}, r"^j3 homing {} is True; give a number"),
        ("20", r"^j1 homing {} is '20'; give a number"),
        ([20, 20, 20, 20], r"^j1 homing {} is \[20, .*\]; give a number"),
        ({"j5": 20}, r"^{}: there is no joint 'j5'; "),
        ({3: 20}, r"^{}: there is no joint 3; did you mean j3\?"),
    ],
)
def test_unusable_values_are_refused_before_anything_is_sent(
    tmp_path: Path, wanted: str, value: object, complaint: str
) -> None:
    robot, tap = robot_and_tap(tmp_path)
    with robot:
        calls = len(tap.calls)
        with pytest.raises(InvalidArgumentError, match=complaint.format(wanted)):
            robot.home(**{wanted: value})  # type: ignore[arg-type]
        assert len(tap.calls) == calls
        assert not robot.is_enabled
