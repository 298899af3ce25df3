"""Parameter files of ROS in their own arrangement."""

from __future__ import annotations

import pytest

from bioscara.control.controllers.homing_controller import HomingSequenceParameters
from bioscara.errors import ConfigurationError

HOME = {"interfaces": ["home"]}


def test_the_joints_of_homing_stand_below_their_interfaces() -> None:
    joints = {"joints": {"j2": HOME, "j1": HOME}}
    values = {"command_interfaces": joints, "state_interfaces": joints}
    assert HomingSequenceParameters.read("homing", values).joints == ("j2", "j1")


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"command_interfaces": {"joints": {"j1": {"interfaces": ["position"]}}}}, "not .home."),
        ({"command_interfaces": {"joints": ["j1"]}}, "give joints: NAME"),
        ({"command_interfaces": "j1"}, "give joints: NAME"),
        ({"command_interfaces": {"joints": {"j1": HOME}, "gpios": {}}}, "give joints: NAME"),
        (
            {
                "command_interfaces": {"joints": {"j1": HOME}},
                "state_interfaces": {"joints": {"j2": HOME}},
            },
            "other joints",
        ),
    ],
)
def test_other_interfaces_than_those_of_homing_are_named(
    values: dict[str, object], text: str
) -> None:
    with pytest.raises(ConfigurationError, match=text):
        HomingSequenceParameters.read("homing", values)
