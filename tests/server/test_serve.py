"""The end of a served arm."""

from __future__ import annotations

import pytest

from bioscara import HardwareError, Robot
from bioscara.server.serve import ServeSettings, serving
from served import eventually


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_the_service_ends_with_an_error_when_its_loop_has_ended() -> None:
    def broken(_: object) -> None:
        raise RuntimeError("a defect")

    robot = Robot.simulated()
    settings = ServeSettings("broken", "sim", real_time_factor=50.0)

    def serve_until_it_breaks() -> None:
        with serving(robot, settings):
            robot.enable()
            robot.runner.observers = (*robot.runner.observers, broken)
            eventually(lambda: not robot.runner.arm.session.connected)

    with pytest.raises(HardwareError, match="the control loop of broken has ended"):
        serve_until_it_breaks()
    assert not robot.is_enabled
