"""Groups of values: no value is converted, and every group is checked whenever it is made."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from pathlib import Path
from typing import Any, Literal

import pytest

from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters
from bioscara.model.loading import EXISTING_ARMS
from bioscara.model.validation import ProblemsError, parsed
from bioscara.model.yaml_file import YamlFile

TEXT = EXISTING_ARMS.read_text()
JOINT = load_parameters().joints[0]


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        *((float, value) for value in ("1", True, None, [1.0])),
        *((int, value) for value in ("1", True, 1.5, 1.0)),
        *((bool, value) for value in (1, "true", None)),
        *((str, value) for value in (1, True, None, b"j1")),
        *((tuple[str, ...], value) for value in ("ab", {"a": 1}, ["a", 1])),
        (tuple[float, float], [1.0, "2"]),
        (dict[str, float], {1: 1.0}),
        (Literal["in", "out"], "up"),
    ],
)
def test_nothing_is_converted_to_another_type(kind: Any, value: object) -> None:
    with pytest.raises(ProblemsError):
        parsed(kind, value)


def test_a_value_is_of_the_plain_type_for_a_number_that_remembers_how_it_was_written() -> None:
    numbers = YamlFile("address: 0x11\nupper: 3\n", "arm.yaml").values
    assert [type(parsed(kind, numbers[name])) for kind, name in
            ((int, "address"), (float, "upper"))] == [int, float]  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"reduction": 0.0}, "JointParameters: reduction: it must not be zero"),
        ({"max_velocity": float("nan")}, "max_velocity: nan is outside 1e-06 .. 9.8 rad/s"),
        ({"homing": replace(JOINT.homing, velocity=-2.0)}, "homing.velocity: -2 is outside -1"),
        ({"address": "17"}, "address: '17' is not a whole number"),
        ({"adress": 17}, "adress is not a known parameter; did you mean address?"),
        ({"name": "j7"}, "JointParameters: name: "),
    ],
)
def test_a_group_cannot_be_made_with_a_wrong_value(changes: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        type(JOINT)(**vars(JOINT) | changes)
    assert complaint in str(caught.value)
    with pytest.raises(FrozenInstanceError):
        JOINT.reduction = 0.0  # type: ignore[misc]


def test_errors_of_one_file_are_named_together_with_their_lines(tmp_path: Path) -> None:
    wrong = {
        "drive_current_percent: 20": "drive_current_percent: 200",
        "forearm: 0.285": "forarm: 0.285",
        "allow_stalling: false": "allow_stalling: 0",
    }
    text = TEXT
    for old, new in wrong.items():
        text = text.replace(old, new, 1)
    file = tmp_path / "arm.yaml"
    file.write_text(text)
    with pytest.raises(ConfigurationError) as caught:
        load_parameters(file)
    parts = str(caught.value).split("; also ")
    assert [part.split("arm.yaml, line ")[1].split(":")[0] for part in parts] == [
        str(text[: text.index(new)].count("\n") + 1) for new in wrong.values()
    ]


def test_a_message_has_five_errors_at_most(tmp_path: Path) -> None:
    file = tmp_path / "arm.yaml"
    many = "\n".join(f"x{number}: 1" for number in range(20))
    file.write_text(f"{TEXT}\n{many}\n")
    with pytest.raises(ConfigurationError) as caught:
        load_parameters(file)
    assert str(caught.value).count("is not a known parameter") == 5
