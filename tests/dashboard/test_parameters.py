"""The table of the parameters, and changes of the overlay."""

from __future__ import annotations

import pytest

from bioscara.dashboard.parameters import drafted, parameter_rows
from bioscara.errors import ConfigurationError, InvalidArgumentError

OVERLAY = "# mine\njoints:\n  j1:\n    upper: 3.0 # narrower\n"


def test_each_value_of_the_file_has_a_row_with_a_meaning() -> None:
    rows = {row.name: row for row in parameter_rows(OVERLAY)}
    assert len(rows) > 100
    assert all(row.text and "[" not in row.text for row in rows.values())
    upper = rows["joints.j1.upper"]
    assert (upper.value, upper.unit, upper.source) == (3.0, "rad", "overlay")
    assert upper.default > 3.0  # type: ignore[operator]
    assert rows["joints.j2.max_acceleration"].unit == "m/s^2"
    assert rows["joints.j2.max_acceleration"].source == "default"
    assert rows["joints.j1.homing.current_percent"].unit == "%"
    constraints = "controllers.joint_trajectory_controller.constraints"
    assert rows[f"{constraints}.j2.goal"].unit == "m"
    assert rows["joints.j1.address"].fixed


def test_a_change_keeps_the_comments_of_the_overlay() -> None:
    text, diff = drafted(OVERLAY, {"joints.j1.lower": -2, "gripper.initial": 0.05})
    assert text.startswith("# mine\njoints:\n  j1:\n    upper: 3.0 # narrower\n    lower: -2\n")
    assert [(each.name, each.after, each.unit) for each in diff] == [
        ("joints.j1.lower", -2.0, "rad"),
        ("gripper.initial", 0.05, "m"),
    ]
    assert drafted("# mine", {"gripper.initial": 0.05})[0] == "# mine\ngripper:\n  initial: 0.05\n"


def test_null_removes_a_value_and_what_it_leaves_empty() -> None:
    text, diff = drafted(OVERLAY + "gripper:\n  initial: 0.05\n", {"joints.j1.upper": None})
    assert text == "# mine\ngripper:\n  initial: 0.05\n"
    assert [each.name for each in diff] == ["joints.j1.upper"]
    assert drafted(OVERLAY, {"joints.j1.upper": None})[0] == ""
    assert drafted(OVERLAY, {"joints.j3.upper": None}) == (OVERLAY, ())


@pytest.mark.parametrize(
    ("name", "value", "error", "text"),
    [
        ("joints.j1.uper", 1, InvalidArgumentError, "did you mean joints.j1.upper"),
        ("joints", {}, InvalidArgumentError, "no parameter 'joints'"),
        ("joints.j1.lower", -99, ConfigurationError, r"joints\.j1\.lower: -99 is outside"),
        ("joints.j1.lower", "a\n", ConfigurationError, "is not a number"),
        ("joints.j1.lower", {"a": [1]}, ConfigurationError, "a mapping of 1 is not a number"),
        ("joints.j1.address", 32, ConfigurationError, "cannot be overlaid"),
    ],
)
def test_what_cannot_be_changed_is_refused_by_name(
    name: str, value: object, error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        drafted("", {name: value})  # type: ignore[dict-item]
