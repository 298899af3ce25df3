"""Two programs at one arm: the lease, and a stop by the program without it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bioscara import LeaseError, MotionCancelledError
from bioscara.api import messages as m
from bioscara.remote import RemoteRobot
from bioscara.server.serve import Served
from served import NAME, arm_served, events_since, eventually


@pytest.fixture(scope="module")
def arm() -> Iterator[Served]:
    with arm_served() as served:
        yield served


def test_the_second_program_can_read_and_not_command(arm: Served) -> None:
    with RemoteRobot(NAME) as first, RemoteRobot(NAME) as second:
        first.enable()
        assert second.is_enabled
        with pytest.raises(LeaseError, match="commands the arm") as refused:
            second.move_relative(z=-0.01)
        assert refused.value.holder
        first.release_lease()
        second.move_relative(z=-0.01)


def test_a_stop_of_another_program_ends_the_motion_and_the_lease(arm: Served) -> None:
    with RemoteRobot(NAME) as first, RemoteRobot(NAME) as second:
        motion = first.move_relative(z=-0.1, velocity_scaling=0.02, wait=False)
        second.stop()
        with pytest.raises(MotionCancelledError):
            motion.result(timeout=20.0)
        goals = arm.owner.goals.last
        for call in (first.enable, first.disable, lambda: first.jog(lambda: None)):
            with pytest.raises(LeaseError, match=r"stopped all motion.* acquire_lease"):
                call()
        assert arm.owner.goals.last == goals
        first.acquire_lease()
        first.move_relative(z=-0.01)


def test_a_program_cancels_its_own_motions_alone(arm: Served) -> None:
    with RemoteRobot(NAME) as first, RemoteRobot(NAME) as second:
        motion = first.move_relative(z=-0.01, velocity_scaling=0.05, wait=False)
        second.cancel()
        motion.result(timeout=20.0)
        motion = first.move_relative(z=0.01, velocity_scaling=0.05, wait=False)
        first.cancel()
        with pytest.raises(MotionCancelledError):
            motion.result(timeout=20.0)


def test_a_pause_is_lifted_by_its_program_or_by_the_one_that_commands(arm: Served) -> None:
    with RemoteRobot(NAME) as first, RemoteRobot(NAME) as second:
        motion = first.move_relative(z=-0.05, velocity_scaling=0.5, wait=False)
        second.pause()
        second.resume()
        second.pause()
        first.resume()
        motion.result(timeout=20.0)
        first.pause()
        with pytest.raises(LeaseError, match="only the holder of the lease") as refused:
            second.resume()
        assert refused.value.holder
        first.resume()


def test_without_a_commander_a_program_that_resumes_takes_the_lease(arm: Served) -> None:
    with RemoteRobot(NAME) as first:
        first.pause()
    with RemoteRobot(NAME) as second:
        second.resume()
        second.move_relative(z=-0.01, timeout=20.0)


def test_a_takeover_stops_the_other_program(arm: Served) -> None:
    with RemoteRobot(NAME) as first, RemoteRobot(NAME) as second:
        motion = first.move_relative(z=-0.1, velocity_scaling=0.02, wait=False)
        second.acquire_lease(force=True)
        with pytest.raises(MotionCancelledError):
            motion.result(timeout=20.0)
        with pytest.raises(LeaseError, match="took the lease over"):
            first.disable()
        with pytest.raises(LeaseError, match="commands the arm"):
            first.acquire_lease()
        second.disable()


def test_leaving_stops_what_the_program_began(arm: Served) -> None:
    with RemoteRobot(NAME) as first:
        first.enable()
        motion = first.move_relative(z=-0.1, velocity_scaling=0.02, wait=False)
    assert motion.done
    assert not arm.robot.is_moving
    assert arm.robot.is_enabled


def test_the_warnings_of_a_motion_are_its_callers(arm: Served) -> None:
    with RemoteRobot(NAME) as first, RemoteRobot(NAME) as second:
        first.pause()
        motion = first.move_relative(z=-0.01, wait=False)
        assert "begins paused" in first.warnings[-1]
        assert not any("begins paused" in warning for warning in second.warnings)
        arm.robot.runner.arm.warn("the table is warm")
        assert "the table is warm" in first.warnings[-1]
        # Another one sees the end of the last cycle.
        eventually(lambda: any("the table is warm" in each for each in second.warnings))
        eventually(lambda: warned(arm)[-1].text.endswith("warm"))
        assert [(event.client != "") for event in warned(arm)[-2:]] == [True, False]
        first.resume()
        motion.result(timeout=20.0)


def warned(arm: Served) -> list[m.Event]:
    """Return the events of warnings."""
    return [event for event in events_since(arm, 0) if event.what == "warning"]
