"""Hardware components whose states clients set."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bioscara.control.loop.loop import CycleReport
from bioscara.errors import (
    InvalidArgumentError,
    SwitchError,
)
from client_controllers import (
    POSITION_JTC,
    Site,
    parameter_file,
    site,
)
from served import eventually


@pytest.fixture
def left() -> Iterator[Site]:
    with site() as made:
        yield made


def test_hardware_is_energised_by_request_alone(left: Site) -> None:
    controllers = left.robot.controllers
    assert controllers.set_hardware_state("bioscara_arm", "inactive") == "inactive"
    assert not left.robot.is_enabled
    left.load(POSITION_JTC, **parameter_file()[POSITION_JTC])
    with pytest.raises(SwitchError, match="bioscara_arm is inactive"):
        controllers.switch([POSITION_JTC])
    assert not left.robot.is_enabled
    assert controllers.set_hardware_state("bioscara_arm", "unconfigured") == "unconfigured"
    assert controllers.set_hardware_state("bioscara_arm", "active") == "active"
    assert left.robot.is_enabled
    controllers.switch([POSITION_JTC])
    goal = left.follow(POSITION_JTC, (0.6, 0.0, 0.0, 0.0), time=3.0)
    left.moving()
    left.passed(0.5)
    # Its controllers are left first, and the arm comes to rest before its motors are off.
    speeds: list[float] = []

    def observe(_: CycleReport) -> None:
        if left.served.robot.is_enabled:
            speeds.append(left.speed)

    runner = left.served.robot.runner
    runner.observers = (*runner.observers, observe)
    assert controllers.set_hardware_state("bioscara_arm", "inactive") == "inactive"
    assert left.ended(goal).status == "aborted"
    # The belts may still swing.
    assert speeds[-1] < 0.3 * max(speeds)
    assert not left.robot.is_enabled
    assert left.states()[POSITION_JTC] == "inactive"
    for component, state in (("bioscara_leg", "active"), ("bioscara_arm", "asleep")):
        with pytest.raises((SwitchError, InvalidArgumentError), match="there is no"):
            controllers.set_hardware_state(component, state)


def test_a_latched_fault_keeps_the_hardware_from_being_energised(left: Site) -> None:
    left.plant.reset("j2")
    eventually(lambda: left.robot.faults)
    eventually(lambda: not left.robot.is_moving)
    with pytest.raises(Exception, match="stopped by a fault"):
        left.robot.controllers.set_hardware_state("bioscara_arm", "active")
    left.load(POSITION_JTC, **parameter_file()[POSITION_JTC])
    with pytest.raises(Exception, match="stopped by a fault"):
        left.robot.controllers.switch([POSITION_JTC])
