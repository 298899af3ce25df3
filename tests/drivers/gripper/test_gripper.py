"""Gripper and PWM against a folder that follows the kernel's rules."""

from __future__ import annotations

import errno
import json
import logging
import math
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from bioscara.drivers import Gripper, Pwm, calibrate
from bioscara.errors import GripperError, InvalidArgumentError, LimitError
from bioscara.model import PwmOutput, load_parameters
from drivers.gripper.sysfs import Kernel

PARAMETERS = load_parameters().gripper
PERIOD_NS = 20_000_000


@pytest.fixture
def kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Kernel:
    return Kernel(tmp_path / "class" / "pwm", monkeypatch)


@pytest.fixture
def channel(kernel: Kernel) -> Path:
    kernel.add_chip(0, "fan.pwm")
    return kernel.add_chip(3, "fe20c000.pwm") / "pwm0"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "state" / "gripper.json"


def pwm(kernel: Kernel) -> Pwm:
    return Pwm(PARAMETERS.outputs, kernel, kernel.root)


def gripper(kernel: Kernel, file: Path) -> Gripper:
    return Gripper(pwm(kernel), PARAMETERS, file)


@pytest.fixture
def hand(kernel: Kernel, channel: Path, file: Path) -> Gripper:
    """An enabled gripper."""
    made = gripper(kernel, file)
    made.enable()
    return made


def pulse_us(width: float) -> float:
    """Return the pulse of the original driver, bounded to widths that the servo reaches."""
    bounded = min(max(width, 0.04), 0.112)
    return 1500 + 3333.3 * (bounded - 0.058) * 500 / 90


def test_the_chip_is_found_by_its_device(kernel: Kernel, channel: Path) -> None:
    output = pwm(kernel)
    output.start(0.02, 0.0015)
    assert kernel.value(channel, "period") == PERIOD_NS
    assert kernel.value(channel, "duty_cycle") == 1_500_000
    assert kernel.value(channel, "enable") == 1
    assert Kernel.LATE <= kernel.time < Kernel.LATE + 0.05
    assert kernel.writes == [
        ("export", 0),
        ("period", PERIOD_NS),
        ("duty_cycle", 1_500_000),
        ("enable", 1),
    ]
    output.set_pulse(0.001)
    assert kernel.value(channel, "duty_cycle") == 1_000_000
    output.stop()
    assert kernel.value(channel, "enable") == 0
    assert output.pulse() is None


def test_the_channel_of_a_raspberry_pi_5(kernel: Kernel) -> None:
    chip = kernel.add_chip(2, "1f00098000.pwm")
    pwm(kernel).start(0.02, 0.001)
    assert kernel.value(chip / "pwm2", "enable") == 1


def test_a_channel_with_a_longer_pulse_and_period_is_taken_over(
    kernel: Kernel, channel: Path
) -> None:
    kernel.make_channel(channel, period=50_000_000, duty_cycle=40_000_000, enable=0)
    pwm(kernel).start(0.02, 0.0015)
    assert kernel.value(channel, "period") == PERIOD_NS
    assert kernel.value(channel, "duty_cycle") == 1_500_000


def test_a_running_channel_is_taken_over_without_a_missing_pulse(
    kernel: Kernel, channel: Path
) -> None:
    kernel.make_channel(channel, period=50_000_000, duty_cycle=40_000_000, enable=1)
    pwm(kernel).start(0.02, 0.0015)
    assert kernel.value(channel, "period") == PERIOD_NS
    assert 0 not in [value for name, value in kernel.writes if name in ("duty_cycle", "enable")]


@pytest.mark.parametrize(
    ("prepare", "complaint"),
    [
        (lambda _: None, r"no PWM chip of the devices fe20c000\.pwm.*dtoverlay=pwm-2chan"),
        (lambda k: k.add_chip(0, "fan.pwm"), r"found: fan\.pwm.*dtoverlay=pwm-2chan"),
        (
            lambda k: k.add_chip(0, "fe20c000.pwm", channels=0),
            r"pwmchip0 has no channel 0.*dtoverlay=pwm-2chan",
        ),
    ],
)
def test_a_missing_output_names_path_and_remedy(
    kernel: Kernel, prepare: Callable[[Kernel], object], complaint: str
) -> None:
    prepare(kernel)
    with pytest.raises(GripperError, match=complaint) as caught:
        pwm(kernel).start(0.02, 0.0015)
    assert str(kernel.root) in str(caught.value)


@pytest.mark.parametrize("last", ["period", "duty_cycle", "enable"])
def test_the_rights_of_each_file_are_waited_for(kernel: Kernel, channel: Path, last: str) -> None:
    kernel.granted = {last: 0.3}
    pwm(kernel).start(0.02, 0.0015)
    assert kernel.value(channel, "enable") == 1
    assert kernel.time == pytest.approx(kernel.LATE + 0.3, abs=0.02)


@pytest.mark.parametrize("never", ["period", "duty_cycle", "enable"])
def test_a_file_whose_rights_never_come_is_named(kernel: Kernel, channel: Path, never: str) -> None:
    kernel.granted = {never: 10.0}
    with pytest.raises(GripperError, match=rf"pwm0/{never} cannot be written within 2 s; run as"):
        pwm(kernel).start(0.02, 0.0015)
    assert kernel.writes == [("export", 0)]


def test_a_folder_that_never_appears(kernel: Kernel, channel: Path) -> None:
    kernel.LATE = 10.0
    with pytest.raises(GripperError, match=r"pwmchip3/pwm0 did not appear within 2 s"):
        pwm(kernel).start(0.02, 0.0015)
    assert 2.0 <= kernel.time < 2.1


@pytest.mark.parametrize(
    ("number", "remedy"),
    [
        (errno.EACCES, "udev"),
        (errno.EPERM, "udev"),
        (errno.EBUSY, "something else in this computer uses it"),
        (errno.ENOENT, r"enable\(\) the gripper again"),
        (errno.EIO, "dmesg"),
    ],
)
def test_a_refused_write_names_path_and_remedy(
    kernel: Kernel, channel: Path, number: int, remedy: str
) -> None:
    kernel.refuse["period"] = OSError(number, os.strerror(number))
    match = rf"pwm0/period: writing 20000000 failed \({os.strerror(number)}\).*{remedy}"
    with pytest.raises(GripperError, match=match) as caught:
        pwm(kernel).start(0.02, 0.0015)
    assert "dtoverlay" not in str(caught.value)
    assert kernel.value(channel, "enable") == 0


def test_a_channel_used_by_the_kernel_is_distinguished_from_a_missing_one(
    kernel: Kernel, channel: Path
) -> None:
    kernel.refuse["export"] = OSError(errno.EBUSY, os.strerror(errno.EBUSY))
    with pytest.raises(GripperError, match="something else in this computer uses it"):
        pwm(kernel).start(0.02, 0.0015)


def test_a_channel_that_was_taken_away_can_be_started_again(kernel: Kernel, channel: Path) -> None:
    output = pwm(kernel)
    output.start(0.02, 0.0015)
    shutil.rmtree(channel)
    with pytest.raises(GripperError, match=r"enable\(\) the gripper again"):
        output.set_pulse(0.001)
    output.start(0.02, 0.001)
    assert kernel.value(channel, "duty_cycle") == 1_000_000


def test_set_pulse_needs_a_started_output(kernel: Kernel) -> None:
    with pytest.raises(GripperError, match="start"):
        pwm(kernel).set_pulse(0.001)


@pytest.mark.parametrize("width", [0.04, 0.058, 0.08, 0.1, 0.112, 0.12, 0.0, -1.0, 0.5])
def test_widths_become_the_pulses_of_the_original(
    hand: Gripper, kernel: Kernel, channel: Path, width: float
) -> None:
    commanded = hand.set_width(width)
    expected = pulse_us(width)
    assert kernel.value(channel, "duty_cycle") == pytest.approx(expected * 1000, abs=1)
    assert commanded == pytest.approx(0.058 + (expected - 1500) * 90 / 500 / 3333.3, abs=1e-9)
    assert hand.state.width == commanded
    assert hand.state.assumed


@pytest.mark.parametrize("width", [math.nan, math.inf, -math.inf])
def test_a_width_that_is_not_finite_is_refused(hand: Gripper, kernel: Kernel, width: float) -> None:
    before = list(kernel.writes)
    with pytest.raises(InvalidArgumentError, match="not a finite number"):
        hand.set_width(width)
    with pytest.raises(InvalidArgumentError, match="not a finite number"):
        hand.set_servo_angle(width)
    assert kernel.writes == before


def test_only_an_enabled_gripper_moves(kernel: Kernel, channel: Path, file: Path) -> None:
    hand = gripper(kernel, file)
    with pytest.raises(GripperError, match="enable"):
        hand.set_width(0.05)
    hand.disable()
    hand.enable()
    hand.disable()
    assert kernel.value(channel, "enable") == 0
    with pytest.raises(GripperError, match="enable"):
        hand.set_width(0.05)


def test_the_last_width_is_stored(kernel: Kernel, channel: Path, file: Path) -> None:
    first = gripper(kernel, file)
    assert first.state.width == pytest.approx(PARAMETERS.initial)
    first.enable()
    first.set_width(0.1)
    first.disable()
    second = gripper(kernel, file)
    second.enable()
    assert second.state.width == pytest.approx(0.1)
    assert kernel.value(channel, "duty_cycle") == pytest.approx(pulse_us(0.1) * 1000, abs=1)
    assert [entry.name for entry in file.parent.iterdir()] == ["gripper.json"]


def test_a_host_that_dies_leaves_the_width(kernel: Kernel, channel: Path, file: Path) -> None:
    first = gripper(kernel, file)
    first.enable()
    first.set_width(0.1)
    file.write_text(json.dumps({"width": 0.05}))
    kernel.writes.clear()
    second = gripper(kernel, file)
    second.enable()
    # The pulse that is still output takes precedence over the file.
    assert second.state.width == pytest.approx(0.1, abs=1e-6)
    assert [name for name, _ in kernel.writes] == ["duty_cycle"]


def test_the_same_width_is_not_written_again(hand: Gripper, kernel: Kernel, file: Path) -> None:
    hand.set_width(0.1)
    kernel.writes.clear()
    stamp = file.stat().st_mtime_ns
    hand.set_width(0.1)
    assert kernel.writes == []
    assert file.stat().st_mtime_ns == stamp


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00\xff\xfe",
        b"{",
        b"[]",
        b"7",
        b'{"width": "wide"}',
        b'{"width": NaN}',
        b'{"width": 0.5}',
        b'{"width": true}',
        b'{"breadth": 0.1}',
    ],
)
def test_a_corrupt_state_file_gives_the_default_width(
    kernel: Kernel, file: Path, content: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    file.parent.mkdir()
    file.write_bytes(content)
    with caplog.at_level(logging.WARNING):
        hand = gripper(kernel, file)
    assert hand.state.width == pytest.approx(PARAMETERS.initial)
    assert str(file) in caplog.text


def test_a_state_file_that_cannot_be_written(kernel: Kernel, channel: Path, tmp_path: Path) -> None:
    hand = gripper(kernel, tmp_path / "taken")
    (tmp_path / "taken.new").mkdir()
    hand.enable()
    before = kernel.value(channel, "duty_cycle")
    with pytest.raises(GripperError, match=r"taken: the gripper's width cannot be kept"):
        hand.set_width(0.1)
    assert kernel.value(channel, "duty_cycle") == before
    with pytest.raises(GripperError):
        hand.disable()
    assert kernel.value(channel, "enable") == 0


@pytest.mark.parametrize("width", [30.0, 40, 85.0, 1.0])
def test_a_width_in_millimetres_is_refused_and_nothing_moves(
    hand: Gripper, kernel: Kernel, channel: Path, width: float
) -> None:
    hand.set_width(0.05)
    before = kernel.value(channel, "duty_cycle")
    with pytest.raises(LimitError, match=f"in metres: {width:g} mm are {width / 1e3:g}"):
        hand.set_width(width)
    assert kernel.value(channel, "duty_cycle") == before
    assert hand.state.width == pytest.approx(0.05)
    assert hand.set_width(0.12) == PARAMETERS.upper  # The largest width of the original driver.


def test_calibration_angles_are_bounded(hand: Gripper, kernel: Kernel, channel: Path) -> None:
    assert hand.set_servo_angle(500.0) == pytest.approx(180.0)
    assert kernel.value(channel, "duty_cycle") == 2_500_000
    assert hand.set_servo_angle(-45.0) == pytest.approx(-45.0)
    assert kernel.value(channel, "duty_cycle") == 1_250_000


@given(st.floats(500.0, 6000.0), st.floats(0.03, 0.1), st.floats(0.03, 0.07), st.floats(0.08, 0.12))
def test_calibration_finds_the_line_it_was_measured_on(
    slope: float, zero: float, near: float, far: float
) -> None:
    points = [(slope * (width - zero), width) for width in (near, far)]
    found = calibrate(PARAMETERS, points[0], points[1])
    assert found.deg_per_m == pytest.approx(slope, rel=1e-6)
    assert found.zero_width == pytest.approx(zero, abs=1e-9)
    smallest, largest = found.reach
    assert found.lower == max(PARAMETERS.lower, smallest)
    assert found.upper == min(PARAMETERS.upper, largest)
    assert found.lower <= found.initial <= found.upper
    again = replace(
        found, deg_per_m=3333.3, zero_width=0.058, lower=0.04, upper=0.112, initial=0.08
    )
    assert again == PARAMETERS


def test_the_gripper_reaches_both_of_its_limits(
    hand: Gripper, kernel: Kernel, channel: Path
) -> None:
    for width in (PARAMETERS.lower, PARAMETERS.upper):
        assert hand.set_width(width) == pytest.approx(width, abs=1e-12)
        sent = kernel.value(channel, "duty_cycle") * 1e-9
        assert PARAMETERS.width_at(sent) == pytest.approx(width, abs=1e-7)


def test_a_pulse_beyond_the_limits_is_ended_at_them(
    hand: Gripper, kernel: Kernel, channel: Path, file: Path
) -> None:
    (channel / "duty_cycle").write_text("2648000")
    again = gripper(kernel, file)
    again.enable()
    assert again.state.width == PARAMETERS.upper
    assert kernel.value(channel, "duty_cycle") == pytest.approx(2_500_000, abs=100)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ((10.0, 0.05), (10.0, 0.06)),
        ((10.0, 0.05), (20.0, 0.05)),
        ((math.nan, 0.05), (20.0, 0.06)),
        ((10.0, 0.05), (20.0, math.inf)),
        ((0.0, 0.5), (1000.0, 0.6)),
    ],
)
def test_calibration_refuses_points_without_a_line(
    first: tuple[float, float], second: tuple[float, float]
) -> None:
    with pytest.raises(InvalidArgumentError, match="calibration"):
        calibrate(PARAMETERS, first, second)


def test_outputs_are_tried_in_order(kernel: Kernel) -> None:
    kernel.add_chip(0, "second.pwm")
    chip = kernel.add_chip(1, "first.pwm")
    output = Pwm(
        (PwmOutput(device="first.pwm", channel=1), PwmOutput(device="second.pwm", channel=0)),
        kernel,
        kernel.root,
    )
    output.start(0.02, 0.001)
    assert kernel.value(chip / "pwm1", "enable") == 1
