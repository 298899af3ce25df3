"""An overlay: values of one arm over those of the complete file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from ruamel.yaml import YAML

from bioscara.errors import ConfigurationError
from bioscara.model import ArmParameters, load_parameters, loading
from bioscara.model.overlay import FIXED, changes
from entries import entry

ARM = load_parameters()
TEXT = Path(loading.__file__).with_name("parameters.yaml").read_text()


def leaves(node: Any, *path: str) -> list[tuple[tuple[str, ...], Any]]:
    if not isinstance(node, dict):
        return [(path, node)]
    return [leaf for key, value in node.items() for leaf in leaves(value, *path, key)]


LEAVES = leaves(YAML(typ="safe").load(TEXT))
NUMBERS = [(path, value) for path, value in LEAVES if type(value) in (int, float)]
NAMES = st.sets(st.sampled_from([path for path, _ in LEAVES]))


def written(path: tuple[str, ...], value: object) -> str:
    """Return a file with one value, on the line of its depth."""
    return "".join(f"{'  ' * depth}{key}:\n" for depth, key in enumerate(path))[:-1] + f" {value}\n"


def load(folder: Path, text: str) -> ArmParameters:
    file = folder / "mine.yaml"
    file.write_text(text)
    return load_parameters(overlay=file)


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(ConfigurationError) as caught:
        load(folder, text)
    return str(caught.value).replace(f"{folder}/", "")


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "{}", "joints: {}", TEXT])
def test_an_overlay_that_changes_nothing_is_the_same_arm(tmp_path: Path, text: str) -> None:
    assert load(tmp_path, text) == ARM


@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(names=NAMES)
def test_any_part_of_the_file_is_the_same_arm(tmp_path: Path, names: set[tuple[str, ...]]) -> None:
    whole: dict[str, Any] = {}
    for path, value in LEAVES:
        if path in names:
            group = whole
            for key in path[:-1]:
                group = group.setdefault(key, {})
            group[path[-1]] = value
    with (tmp_path / "mine.yaml").open("w") as file:
        YAML().dump(whole, file)
    arm = load_parameters(overlay=tmp_path / "mine.yaml")
    assert arm == ARM
    assert changes(ARM, arm) == ()


@pytest.mark.parametrize("share", [1.003, 1.5])
@pytest.mark.parametrize(("path", "value"), NUMBERS, ids=lambda each: str(each)[:60])
def test_a_changed_value_is_the_only_change_or_is_named_with_its_line(
    tmp_path: Path, path: tuple[str, ...], value: float, share: float
) -> None:
    changed = type(value)(value * share)
    try:
        arm = load(tmp_path, written(path, repr(changed)))
    except ConfigurationError as error:
        assert f"mine.yaml, line {len(path)}" in str(error)  # noqa: PT017  either outcome is right
        assert ".".join(path) in str(error)  # noqa: PT017
        assert changed != value
    else:
        found = [(each.name, each.before, each.after) for each in changes(ARM, arm)]
        assert found == ([(".".join(path), value, changed)] if changed != value else [])


@pytest.mark.parametrize("value", [".nan", "{}", "null"])
def test_an_unusable_value_is_named_with_its_line(tmp_path: Path, value: str) -> None:
    for path, _ in LEAVES:
        start = f"mine.yaml, line {len(path)}: {'.'.join(path)}"
        with entry(".".join(path)):
            assert refusal(tmp_path, written(path, value)).startswith(start)


def test_an_unknown_name_is_suggested_with_its_line(tmp_path: Path) -> None:
    for path, _ in LEAVES:
        misspelt = path[-1][:-1] + "_" if len(path[-1]) > 2 else "j9"
        start = ".".join((*path[:-1], misspelt))
        with entry(start):
            text = refusal(tmp_path, written((*path[:-1], misspelt), 1))
            assert text.startswith(
                f"mine.yaml, line {len(path)}: {start} is not a known parameter; "
            )
            assert "did you mean" in text or misspelt == "j9"


@pytest.mark.parametrize(
    ("text", "one", "other"),
    [
        (
            "joints:\n  j2:\n    lower: 0.4\n",
            r"^parameters\.yaml, line \d+: joints\.j2\.upper: 0\.338 must be above 0\.4 ",
            r"\(joints\.j2\.lower: mine\.yaml, line 3\)$",
        ),
        (
            "joints:\n  j2:\n    upper: -0.4\n",
            r"^mine\.yaml, line 3: joints\.j2\.upper: -0\.4 must be above -0\.0016 ",
            r"\(joints\.j2\.lower: parameters\.yaml, line \d+\)$",
        ),
        (
            "joints:\n  j1:\n    reduction: 300.0\n",
            r"^parameters\.yaml, line \d+: joints\.j1\.max_acceleration: 2 is outside ",
            r"\(joints\.j1\.reduction: mine\.yaml, line 3\)$",
        ),
        (
            "joints: {j2: {lower: 0.336}}\n",
            r"constraints\.j2\.goal: 0\.005 is outside 0 \.\. 0\.002 m ",
            r"\(joints\.j2\.lower: mine\.yaml, line 1; joints\.j2\.upper: parameters\.yaml, ",
        ),
        (
            "gripper:\n  zero_width: 0.03\n",
            r"^parameters\.yaml, line \d+: gripper\.upper: 0\.112 m is out of the servo's reach",
            r"gripper\.zero_width: mine\.yaml, line 2;",
        ),
    ],
)
def test_contradictions_name_both_values(tmp_path: Path, text: str, one: str, other: str) -> None:
    if "goal" in one:
        text += "controllers: {joint_trajectory_controller: {constraints: {j2: {goal: 0.005}}}}\n"
    message = refusal(tmp_path, text)
    assert re.search(one, message), message
    assert re.search(other, message), message


@pytest.mark.parametrize("path", FIXED, ids=".".join)
def test_fixed_values_are_refused_with_the_reason(tmp_path: Path, path: tuple[str, ...]) -> None:
    value = {"homing_order": "[j1, j2, j3, j4]", "address": 0x21}.get(path[-1], 0.3)
    text = refusal(tmp_path, written(path, value))
    assert text == (
        f"mine.yaml, line {len(path)}: {'.'.join(path)} cannot be overlaid: {FIXED[path]}"
    )


@pytest.mark.parametrize("joint", ARM.joints, ids=lambda joint: joint.name)
def test_the_end_stop_of_homing_is_fixed(tmp_path: Path, joint: Any) -> None:
    path = "joints", joint.name, "homing", "velocity"
    text = refusal(tmp_path, written(path, -joint.homing.velocity))
    assert re.match(r"mine\.yaml, line 4: joints\.j\d\.homing\.velocity: the sign cannot", text)
    faster = load(tmp_path, written(path, 1.1 * joint.homing.velocity))
    assert [each.name for each in changes(ARM, faster)] == [".".join(path)]


def test_a_list_replaces_the_list(tmp_path: Path) -> None:
    arm = load(tmp_path, "gripper: {outputs: [{device: a.pwm, channel: 1}]}")
    assert [output.device for output in arm.gripper.outputs] == ["a.pwm"]
    text = refusal(tmp_path, "gripper:\n  outputs:\n    - {device: a.pwm}\n")
    assert text == "mine.yaml, line 3: gripper.outputs[0].channel is missing"


def test_an_overlay_lies_over_any_complete_file(tmp_path: Path) -> None:
    file, mine = tmp_path / "arm.yaml", tmp_path / "mine.yaml"
    file.write_text(TEXT.replace("reduction: 35.0", "reduction: 36.0"))
    mine.write_text("joints: {j3: {reduction: 25.0}}")
    arm = load_parameters(file, overlay=str(mine))
    assert (arm.joints[0].reduction, arm.joints[2].reduction) == (36.0, 25.0)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("- 5", "mine.yaml, line 1: the content must be a mapping"),
        ("joints:\n", "mine.yaml, line 1: joints must be a mapping"),
        ("joints: {j1: 5}", "mine.yaml, line 1: joints.j1 must be a mapping"),
        ("a: [", "mine.yaml, line 1: "),
        ("a: &a {b: *a}", "mine.yaml, line 1: "),
        ("3: 4", "mine.yaml, line 1: [3] is not a known parameter"),
    ],
)
def test_a_file_that_is_no_overlay_is_refused(tmp_path: Path, text: str, complaint: str) -> None:
    assert refusal(tmp_path, text).startswith(complaint)


def test_a_missing_overlay_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"mine\.yaml: No such file"):
        load_parameters(overlay=tmp_path / "mine.yaml")
