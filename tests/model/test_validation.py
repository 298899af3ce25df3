"""Groups of values: every scalar is strict, and every group is checked whenever it is made."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import FrozenInstanceError, replace
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter

# Their groups are checked, too.
import bioscara.control.manager.registry
import bioscara.planning.files.scene_file
import bioscara.robot.workspace.teach_file  # noqa: F401
from bioscara.errors import ConfigurationError
from bioscara.model import load_parameters
from bioscara.model.loading import EXISTING_ARMS
from bioscara.model.validation import Checked

TEXT = EXISTING_ARMS.read_text()
JOINT = load_parameters().joints[0]


def groups(kind: type[Checked]) -> Iterator[type[Checked]]:
    for each in kind.__subclasses__():
        if each.__module__.startswith("bioscara."):
            yield each
            yield from groups(each)


def scalars(schema: Any) -> Iterator[dict[str, Any]]:
    if isinstance(schema, dict):
        if schema.get("type") in ("int", "float", "bool", "str"):
            yield schema
        for key, value in schema.items():
            if key not in ("metadata", "serialization"):
                yield from scalars(value)
    elif isinstance(schema, list | tuple):
        for each in schema:
            yield from scalars(each)


@pytest.mark.parametrize("group", [*groups(Checked)], ids=lambda group: group.__name__)
def test_no_scalar_of_any_group_is_converted(group: type[Checked]) -> None:
    schema = TypeAdapter(list[group]).core_schema  # type: ignore[valid-type]
    assert "fields" in str(schema)
    assert all(each.get("strict") for each in scalars(schema))


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
