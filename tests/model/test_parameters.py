"""The parameter file: what the arm is, and what a wrong file is answered."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters, loading

TEXT = Path(loading.__file__).with_name("parameters.yaml").read_text()


def load(tmp_path: Path, text: str) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(text)
    load_parameters(file)


def line_of(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


def test_existing_arm() -> None:
    arm = load_parameters()
    assert [joint.name for joint in arm.joints] == ["j1", "j2", "j3", "j4"]
    assert [joint.number for joint in arm.joints] == [1, 2, 3, 4]
    assert [joint.address for joint in arm.joints] == [0x11, 0x12, 0x13, 0x14]
    assert [joint.unit for joint in arm.joints] == ["rad", "m", "rad", "rad"]
    assert arm.joints[1].reduction == pytest.approx(-2 * math.pi / 0.004, rel=1e-15)
    assert arm.homing_order == ("j2", "j1", "j4", "j3")
    # The end stop that homing touches: J1 the lower one, the others the upper one.
    assert [joint.home_position for joint in arm.joints] == [-3.04647, 0.338, 2.62672, 3.01069]


def test_a_file_of_ones_own_is_the_same_arm(tmp_path: Path) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(TEXT)
    assert load_parameters(file) == load_parameters()


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("    reduction: 35.0", "    reducton: 35.0", "joints.j1.reducton"),
        ("    reduction: 35.0", "    reduction: 0", "must not be zero"),
        ("    reduction: 35.0", "    reduction: .nan", "joints.j1.reduction: nan is outside"),
        ("    reduction: 35.0", "    reduction: many", "'many' is not a number"),
        ("    reduction: 35.0", "    reduction: true", "True is not a number"),
        ("    upper: 0.338", "    upper: -0.4", "-0.4 must be above -0.0016"),
        ("    address: 0x12", "    address: 0x11", "already the address of j1"),
        ("    address: 0x12", "    address: 18.5", "not a whole number"),
        ("    stall_threshold: 12", "    stall_threshold: 256", "256 is outside 0 .. 255"),
        ("      velocity: -0.03", "      velocity: -0.9", "300.803 rpm of the motor"),
        ("      velocity: -0.03", "      velocity: 0", "must not be zero"),
        ("      current_percent: 30 ", "      current_percent: 130 ", "130 is outside 1 .. 100 %"),
        ("    unit: m\n", "    unit: mm\n", "it is one of rad, m"),
        ("homing_order: [j2, j1, j4, j3]", "homing_order: [j2, j1, j4]", "each of j1, j2, j3, j4"),
        ("  initial: 0.08", "  initial: 0.2", "gripper.initial: 0.2 is outside 0.04 .. 0.12 m"),
        ("channel: 2}", "chanel: 2}", "did you mean channel?"),
        ("  j4:", "  j5:", "joints.j5 is not a known parameter; known here: j1, j2"),
    ],
)
def test_a_wrong_value_is_named_with_its_line(
    tmp_path: Path, old: str, new: str, complaint: str
) -> None:
    assert TEXT.count(old) >= 1
    with pytest.raises(ConfigurationError) as caught:
        load(tmp_path, TEXT.replace(old, new, 1))
    assert complaint in str(caught.value)
    assert f"arm.yaml, line {line_of(TEXT, old)}: " in str(caught.value)


def test_a_misspelt_key_gets_a_proposal(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"did you mean max_velocity\?"):
        load(tmp_path, TEXT.replace("max_velocity: 5.0", "max_velocty: 5.0"))


def test_a_missing_key_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"joints\.j3\.max_velocity is missing"):
        load(tmp_path, TEXT.replace("    max_velocity: 5.0", "    # none"))


@pytest.mark.parametrize("text", ["", "[1, 2]", "joints: {j1: 3", "a: 1\na: 2\n", "\x00", "7"])
def test_what_is_no_parameter_file_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"arm\.yaml"):
        load(tmp_path, text)


def test_a_binary_or_missing_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "arm.yaml"
    with pytest.raises(ConfigurationError, match="No such file"):
        load_parameters(file)
    file.write_bytes(b"\xff\xfe\x00joints")
    with pytest.raises(ConfigurationError, match="not a text file"):
        load_parameters(file)
