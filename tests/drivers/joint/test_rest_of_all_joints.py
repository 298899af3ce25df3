"""The commands that need rest, in each state of all joints."""

from __future__ import annotations

import pytest

from drivers.joint.test_rest import COMMANDS, KINDS, STATES, require_rest_first
from entries import entry
from simulated import NAMES

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("name", NAMES)
def test_each_command_that_needs_rest_waits_for_it_on_all_joints(kind: str, name: str) -> None:
    for state in STATES:
        for command in COMMANDS:
            with entry(f"{state.__name__}, {command.__name__}"):
                require_rest_first(kind, name, state, command)
