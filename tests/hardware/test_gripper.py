"""The gripper's servo as a component: it publishes the width that it is commanded."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from bioscara.drivers import Gripper, Pwm, Quality
from bioscara.errors import GripperError, ModeSwitchError
from bioscara.hardware import GripperHardware, LifecycleState
from bioscara.model import load_parameters
from bioscara.sim import SimulatedArm, SimulatedServo

PARAMETERS = load_parameters().gripper
PERIOD = 0.01


@pytest.fixture
def servo() -> Iterator[SimulatedServo]:
    with SimulatedServo(PARAMETERS.outputs[0]) as made:
        yield made


@pytest.fixture
def gripper(servo: SimulatedServo, tmp_path: Path) -> GripperHardware:
    clock = SimulatedArm().clock
    driver = Gripper(Pwm(PARAMETERS.outputs, clock, servo.root), PARAMETERS, tmp_path / "width")
    return GripperHardware("bioscara_gripper_128", "gripper", driver, clock)


def cycle(gripper: GripperHardware, width: float | None = None) -> tuple[float, float]:
    gripper.read(0.0, PERIOD)
    if width is not None:
        gripper.commands["gripper/position"].value = width
    gripper.write(0.0, PERIOD)
    return gripper.states["gripper/position"].value, gripper.states["gripper/velocity"].value


def claim(gripper: GripperHardware) -> None:
    gripper.prepare_command_mode_switch(["gripper/position"], [])
    gripper.perform_command_mode_switch(["gripper/position"], [])


def test_activation_enables_at_the_last_width_and_moves_nothing(
    gripper: GripperHardware, servo: SimulatedServo
) -> None:
    gripper.configure()
    assert servo.pulse() is None
    gripper.activate()
    assert servo.pulse() == pytest.approx(0.0015 + (0.08 - 0.058) * 3333.3 * 5.5555556e-6)
    assert cycle(gripper) == (pytest.approx(0.08), 0.0)
    claim(gripper)
    before = servo.pulse()
    cycle(gripper)
    assert servo.pulse() == before
    cycle(gripper, 0.05)
    gripper.deactivate()
    assert servo.pulse() is None
    gripper.activate()
    assert gripper.commands["gripper/position"].value == pytest.approx(0.05)


def test_the_state_is_the_commanded_width_and_marked_as_assumed(gripper: GripperHardware) -> None:
    state = gripper.states["gripper/position"]
    assert state.quality is Quality.UNKNOWN
    gripper.set_state(LifecycleState.ACTIVE)
    claim(gripper)
    cycle(gripper, 0.06)
    assert cycle(gripper) == (pytest.approx(0.06), pytest.approx(-0.02 / PERIOD))
    assert cycle(gripper) == (pytest.approx(0.06), 0.0)
    assert state.quality is Quality.ASSUMED
    gripper.deactivate()
    assert state.quality is Quality.UNKNOWN


def test_a_width_is_bounded_and_sent_only_when_it_changed(
    gripper: GripperHardware, servo: SimulatedServo
) -> None:
    gripper.set_state(LifecycleState.ACTIVE)
    cycle(gripper, 0.05)  # No controller claimed it.
    assert cycle(gripper)[0] == pytest.approx(0.08)
    claim(gripper)
    cycle(gripper, 5.0)
    assert servo.pulse() == pytest.approx(PARAMETERS.pulse_upper, abs=1e-7)
    assert cycle(gripper)[0] == pytest.approx(PARAMETERS.upper)
    written = next(servo.root.glob("*/*/duty_cycle"))
    before = written.stat().st_mtime_ns
    for _ in range(5):
        cycle(gripper, 5.0)
    assert written.stat().st_mtime_ns == before


def test_an_error_releases_the_servo(gripper: GripperHardware, servo: SimulatedServo) -> None:
    gripper.set_state(LifecycleState.ACTIVE)
    gripper.fail()
    assert servo.pulse() is None
    assert gripper.state is LifecycleState.UNCONFIGURED
    gripper.set_state(LifecycleState.ACTIVE)
    gripper.shutdown()
    assert servo.pulse() is None
    assert gripper.state is LifecycleState.FINALIZED


def test_an_error_releases_the_servo_also_where_its_width_cannot_be_stored(
    gripper: GripperHardware, servo: SimulatedServo, tmp_path: Path
) -> None:
    gripper.set_state(LifecycleState.ACTIVE)
    (tmp_path / "width.new").mkdir()
    gripper.fail()
    assert servo.pulse() is None
    assert gripper.state is LifecycleState.UNCONFIGURED
    gripper.set_state(LifecycleState.ACTIVE)
    with pytest.raises(GripperError, match="width cannot be kept"):
        gripper.shutdown()
    assert servo.pulse() is None
    assert gripper.state is LifecycleState.FINALIZED


def test_a_width_that_cannot_be_sent_is_abandoned_and_reported(
    gripper: GripperHardware, servo: SimulatedServo
) -> None:
    gripper.set_state(LifecycleState.ACTIVE)
    claim(gripper)
    cycle(gripper, 0.06)
    pulse, command = servo.pulse(), gripper.commands["gripper/position"]
    duty = next(servo.root.glob("*/*/duty_cycle"))
    duty.rename(duty.with_name("gone"))
    duty.mkdir()
    cycle(gripper, 0.05)
    assert isinstance(command.problem, GripperError)
    assert gripper.problems == [command.problem]
    assert command.value == pytest.approx(0.06)
    duty.rmdir()
    duty.with_name("gone").rename(duty)
    assert servo.pulse() == pulse
    assert gripper.state is LifecycleState.ACTIVE
    assert cycle(gripper) == (pytest.approx(0.06), 0.0)
    assert gripper.problems == []


def test_a_cycle_sends_a_width_and_stores_none(
    gripper: GripperHardware, servo: SimulatedServo, tmp_path: Path
) -> None:
    gripper.set_state(LifecycleState.ACTIVE)
    claim(gripper)
    (tmp_path / "width.new").mkdir()
    cycle(gripper, 0.06)
    assert gripper.problems == []
    assert not (tmp_path / "width").exists()
    with pytest.raises(GripperError, match="width cannot be kept"):
        gripper.keep()
    (tmp_path / "width.new").rmdir()
    gripper.keep()
    assert json.loads((tmp_path / "width").read_text())["width"] == pytest.approx(0.06)
    gripper.keep(5.0)
    assert json.loads((tmp_path / "width").read_text())["width"] == pytest.approx(0.112, abs=1e-5)
    assert cycle(gripper)[0] == pytest.approx(0.06)


def test_after_an_error_it_continues_from_the_width_sent_last(
    gripper: GripperHardware, servo: SimulatedServo
) -> None:
    gripper.set_state(LifecycleState.ACTIVE)
    claim(gripper)
    cycle(gripper, 0.06)
    pulse = servo.pulse()
    gripper.fail()
    gripper.set_state(LifecycleState.ACTIVE)
    assert servo.pulse() == pulse


def test_without_an_output_it_is_not_configured(
    gripper: GripperHardware, servo: SimulatedServo
) -> None:
    (servo.root / "pwmchip0" / "device").unlink()
    with pytest.raises(GripperError, match="no PWM chip"):
        gripper.configure()
    assert gripper.state is LifecycleState.UNCONFIGURED


def test_an_unknown_interface_is_refused(gripper: GripperHardware) -> None:
    with pytest.raises(ModeSwitchError, match=r"did you mean gripper/position\?"):
        gripper.prepare_command_mode_switch(["gripper/positon"], [])
