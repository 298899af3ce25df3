"""The parameter file: the arm's values, and the errors of a wrong file."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from itertools import pairwise, product
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import given, settings, strategies as st
from ruamel.yaml import YAML

from bioscara.errors import ConfigurationError
from bioscara.model import ArmParameters, load_parameters, loading
from entries import entry
from unusable_values import SHARE

TEXT = Path(loading.__file__).with_name("parameters.yaml").read_text()


class Leaf(NamedTuple):
    """A value of the section ``controllers``: its names, its line, its group's line."""

    path: tuple[str, ...]
    value: object
    line: int
    above: int

    @property
    def name(self) -> str:
        """Name of the value in errors."""
        return ".".join(self.path)

    def written(self, replacement: str) -> str:
        """Return the file with this entry, key and value, replaced."""
        lines = TEXT.splitlines(keepends=True)
        old = lines[self.line - 1]
        lines[self.line - 1], count = re.subn(
            rf"\b{self.path[-1]}: [^ ,}}\n]+", replacement, old, count=1
        )
        assert count == 1
        return "".join(lines)

    def read(self, arm: ArmParameters) -> object:
        """Return the value that the arm has there."""
        found: Any = arm
        for name in self.path:
            found = (
                found.joints[int(name[1]) - 1]
                if name[0] == "j" and name[1:].isdigit()
                else (getattr(found, name))
            )
        return found


def leaves(node: Any, path: tuple[str, ...], above: int) -> Iterator[Leaf]:
    for key, value in node.items():
        line = node.lc.key(key)[0] + 1
        if isinstance(value, dict):
            yield from leaves(value, (*path, key), line)
        else:
            yield Leaf((*path, key), value, line, above)


EVERY = list(leaves(YAML(typ="rt").load(TEXT), (), 1))
LEAVES = [leaf for leaf in EVERY if leaf.path[0] == "controllers"]


def each_with(leaves: list[Leaf], values: list[str]) -> list[tuple[Leaf, str]]:
    """Return each leaf with some of the values, another for each; laws try all."""
    return [
        (leaf, value)
        for (row, leaf), (column, value) in product(enumerate(leaves), enumerate(values))
        if (row + column) % min(SHARE, len(values)) == 0
    ]


def load(tmp_path: Path, text: str) -> ArmParameters:
    file = tmp_path / "arm.yaml"
    file.write_text(text)
    return load_parameters(file)


def outcome(folder: Path, text: str) -> ArmParameters | str:
    """Return the arm, or the text of the error."""
    try:
        return load(folder, text)
    except ConfigurationError as error:
        return str(error)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("arms")


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


def test_every_value_has_a_comment_with_unit_and_source() -> None:
    lines = TEXT.splitlines()
    bare = [
        line
        for above, line in pairwise(["", *lines])
        if re.match(r" *\w+: *[^ #]", line)
        and not line.strip().startswith("unit:")
        and "#" not in line
        and not above.startswith("#")
    ]
    assert bare == []


def test_a_copy_of_the_file_is_the_same_arm(tmp_path: Path) -> None:
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
        ("    unit: m\n", "    unit: mm\n", "unit: 'mm' is not a valid name; it must be m"),
        ("    reduction: 35.0", "    reduction: 2020-13-45", "month must be in 1..12"),
        ("    reduction: 35.0", f"    reduction: {'9' * 5000}", "Exceeds the limit (4300 digits)"),
        ("    unit: rad", "    unit: m", "joints.j1.unit: 'm' is not a valid name; it must be rad"),
        ("    lower: -3.04647", "    lower: -174.55", "-174.55 is outside -12.5664 .. 12.5664 rad"),
        ("    upper: 2.62672", "    upper: 150.5", "150.5 is outside -12.5664 .. 12.5664 rad"),
        ("    upper: 0.338", "    upper: 338", "joints.j2.upper: 338 is outside -2 .. 2 m"),
        # The largest setpoint of the frame, 3276 rpm of the motor, and the driver's limit, 365
        # rad/s^2.
        ("  upper_arm: 0.329476", "  upper_arm: 0.1", "upper_arm: 0.1 is outside 0.16 .. 2 m"),
        ("    max_velocity: 1.0", "    max_velocity: 57.3", "57.3 is outside 1e-06 .. 9.8 rad/s"),
        ("    max_velocity: 0.02", "    max_velocity: 30", "30 is outside 1e-06 .. 0.218361 m/s"),
        (
            "    max_acceleration: 30.0",
            "    max_acceleration: 34.0",
            "joints.j4.max_acceleration: 34 is outside 1e-06 .. 30.4167 rad/s^2",
        ),
        (
            "      acceleration: 0.1 ",
            "      acceleration: 30.1 ",
            "joints.j4.homing.acceleration: 30.1 is outside 1e-06 .. 30 rad/s^2",
        ),
        ("velocity: -0.03", "velocity: -1.1", "homing.velocity: -1.1 is outside -1 .. 1 rad/s"),
        ("homing_order: [j2, j1, j4, j3]", "homing_order: [j2, j1, j4]", "each of j1, j2, j3, j4"),
        ("  initial: 0.08", "  initial: 0.2", "gripper.initial: 0.2 is outside 0.04 .. 0.112 m"),
        (
            "  upper: 0.112 ",
            "  upper: 0.12 ",
            "gripper.upper: 0.12 m is out of the servo's reach: with deg_per_m 3333.3 and "
            "zero_width 0.058, pulses of 0.5 .. 2.5 ms give 0.003999 .. 0.112 m",
        ),
        ("  lower: 0.04 ", "  lower: 0.003 ", "gripper.lower: 0.003 m is out of the servo's reach"),
        ("channel: 2}", "chanel: 2}", "did you mean channel?"),
        (
            "version_2: 100 ",
            "version_2: 10 ",
            "update_rate.version_2: 10 is outside 20 .. 10000 Hz",
        ),
        ("address: 0x12", "address: 18", "18 is 0x18 as the original reads it, and 0x12 as a dec"),
        ("version_2: 100 ", "version_2: 99.5 ", "99.5 is not a whole number"),
        ("version_1: 50 ", "version_3: 50 ", "did you mean version_"),
        ("goal_time: 2.0", "goal_time: -1.0", "constraints.goal_time: -1 is outside 0 .. 3600 s"),
        ("on_cancel_share: 1.0", "on_cancel_share: 2", "2 is outside 0.01 .. 1"),
        ("on_cancel_share: 1.0", "on_cancel_share: 0", "0 is outside 0.01 .. 1"),
        ("j2: {trajectory: 0.0, ", "j2: {trajectory: 5.0, ", "5 is outside 0 .. 0.3396 m"),
        ("j2: {trajectory: 0.0, ", "j2: 5 #", "constraints.j2 must be a mapping"),
        ("timeout: 300.0", "timeout: .inf", "homing_controller.timeout: inf is outside"),
        ("travel_share: 1.15", "travel_share: 0.9", "0.9 is outside 1 .. 2"),
        ("deceleration_share: 1.0", "deceleration_share: 1.5", "1.5 is outside 0.01 .. 1"),
        ("allow_stalling: false", "allow_stalling: no", "'no' is neither true nor false"),
        ("goal_tolerance: 0.001", "goal_tolerance: 0", "0 is outside 1e-05 .. 0.1 m"),
        ("max_velocity: 0.07               # m/s", "max_velocity: 0 # m/s", "0 is outside 0.001"),
        ("  hold_controller:", "  hold_controler:", "did you mean hold_controller?"),
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


def test_a_missing_key_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"joints\.j3\.max_velocity is missing"):
        load(tmp_path, TEXT.replace("    max_velocity: 5.0", "    # none"))


@pytest.mark.parametrize("text", ["", "[1, 2]", "joints: {j1: 3", "a: 1\na: 2\n", "\x00", "7"])
def test_a_file_without_parameters_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"arm\.yaml"):
        load(tmp_path, text)


def test_a_control_character_is_refused_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"arm\.yaml, line 2: special characters"):
        load(tmp_path, "a: 1\nb: \x07\n")


@pytest.mark.parametrize("text", ["# a\n > # b\n", "a: # b\n    c \x85\nd: 1\n"])
def test_comments_where_the_parser_gives_up_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigurationError, match=r"arm\.yaml"):
        load(tmp_path, text)


def test_a_binary_or_missing_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "arm.yaml"
    with pytest.raises(ConfigurationError, match="No such file"):
        load_parameters(file)
    file.write_bytes(b"\xff\xfe\x00joints")
    with pytest.raises(ConfigurationError, match="not a text file"):
        load_parameters(file)


def test_existing_controllers() -> None:
    said = load_parameters().controllers
    assert (said.update_rate.version_1, said.update_rate.version_2) == (50, 100)
    assert all(leaf.read(load_parameters()) == leaf.value for leaf in LEAVES)


def test_no_value_is_infinite_or_of_another_kind(tmp_path: Path) -> None:
    single = [leaf for leaf in EVERY if not isinstance(leaf.value, list)]
    for leaf, value in each_with(single, [".nan", "{}", "null"]):
        with (
            entry(f"{leaf.name}: {value}"),
            pytest.raises(ConfigurationError, match=rf"arm\.yaml, line {leaf.line}: {leaf.name}: "),
        ):
            load(tmp_path, leaf.written(f"{leaf.path[-1]}: {value}"))


def test_a_wrong_value_of_a_controller_is_named_with_its_line(tmp_path: Path) -> None:
    for leaf, value in each_with(LEAVES, [".nan", "-0.001", "1e9", "many"]):
        with entry(f"{leaf.name}: {value}"):
            with pytest.raises(ConfigurationError) as caught:
                load(tmp_path, leaf.written(f"{leaf.path[-1]}: {value}"))
            assert f"arm.yaml, line {leaf.line}: {leaf.name}: " in str(caught.value)


def test_numbers_and_flags_of_controllers_are_not_taken_for_one_another(tmp_path: Path) -> None:
    for leaf in LEAVES:
        other = "1.0" if isinstance(leaf.value, bool) else "true"
        with (
            entry(leaf.name),
            pytest.raises(ConfigurationError, match=rf"arm\.yaml, line {leaf.line}: {leaf.name}: "),
        ):
            load(tmp_path, leaf.written(f"{leaf.path[-1]}: {other}"))


def test_a_misspelt_value_of_a_controller_gets_a_suggestion(tmp_path: Path) -> None:
    for leaf in LEAVES:
        key = leaf.path[-1]
        with entry(leaf.name):
            with pytest.raises(ConfigurationError) as caught:
                load(tmp_path, leaf.written(f"{key}x: {leaf.value}"))
            assert f"arm.yaml, line {leaf.line}: {leaf.name}x is not a known" in str(caught.value)
            assert f"did you mean {key}?" in str(caught.value)


def test_a_missing_value_of_a_controller_is_named(tmp_path: Path) -> None:
    for leaf in LEAVES:
        text = leaf.written("").replace("{, ", "{").replace(", }", "}")
        # A group with one value is empty without it.
        whole = ".".join(leaf.path[:-1])
        with entry(leaf.name):
            with pytest.raises(ConfigurationError) as caught:
                load(tmp_path, text)
            assert str(caught.value).split("arm.yaml, ")[1] in {
                f"line {leaf.above}: {leaf.name} is missing",
                f"line {leaf.above}: {whole} must be a mapping of names to values",
            }


@settings(max_examples=40)
@given(st.sampled_from(LEAVES), st.floats() | st.integers(0, 100) | st.booleans())
def test_a_value_of_a_controller_is_taken_as_it_is_or_refused_with_its_line(
    folder: Path, leaf: Leaf, value: float
) -> None:
    written = str(value).lower().replace("inf", ".inf").replace("nan", ".nan")
    arm = outcome(folder, leaf.written(f"{leaf.path[-1]}: {written}"))
    if isinstance(arm, str):
        assert f"arm.yaml, line {leaf.line}: {leaf.name}: " in arm
        return
    assert isinstance(value, bool) == isinstance(leaf.value, bool)
    for each in LEAVES:
        assert each.read(arm) == (value if each is leaf else each.value)
