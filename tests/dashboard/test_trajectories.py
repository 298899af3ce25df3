"""Trajectories from files, compared with the limits of the arm."""

from __future__ import annotations

import pytest

from bioscara import Robot
from bioscara.api.values import workspace_value
from bioscara.dashboard.trajectories import checked_trajectory
from bioscara.errors import TrajectoryError
from bioscara.model.loading import load_parameters

PARAMETERS = load_parameters()


def csv(duration: float, end: float = 0.2, joint: str = "j1") -> bytes:
    """Return a motion of one joint from 0.1 rad, at rest at both ends."""
    header = f"time,{joint}_position,{joint}_velocity\n"
    return f"{header}0,0.1,0\n{duration},{end},0\n".encode()


def test_peaks_stand_beside_their_limits() -> None:
    found = checked_trajectory("a.csv", csv(2.0), PARAMETERS, fit=False)
    (peak,) = found.peaks
    assert (found.points, found.duration, found.stretched) == (2, 2.0, 1.0)
    assert found.problem is None
    assert peak.joint == "j1"
    assert peak.velocity == pytest.approx(1.5 * 0.1 / 2.0)
    assert peak.acceleration == pytest.approx(6.0 * 0.1 / 4.0)
    assert peak.velocity_limit == PARAMETERS.joints[0].max_velocity


def test_one_that_is_too_fast_can_be_looked_at_and_fitted() -> None:
    found = checked_trajectory("a.csv", csv(0.05), PARAMETERS, fit=False)
    assert found.problem is not None
    assert "j1 at" in found.problem
    assert "exceeds the limit" in found.problem
    fitted = checked_trajectory("a.csv", csv(0.05), PARAMETERS, fit=True)
    assert fitted.problem is None
    assert fitted.stretched > 1.0
    assert fitted.duration == pytest.approx(0.05 * fitted.stretched)


def test_a_position_outside_the_limits_cannot_be_fitted() -> None:
    found = checked_trajectory("a.csv", csv(60.0, 9.0), PARAMETERS, fit=False)
    assert found.problem is not None
    assert "outside" in found.problem
    with pytest.raises(TrajectoryError, match="outside"):
        checked_trajectory("a.csv", csv(60.0, 9.0), PARAMETERS, fit=True)


def test_what_the_arm_makes_of_it_has_all_joints_of_which_the_others_hold() -> None:
    here = [0.3, 0.2, 0.8, -0.5]
    with Robot.simulated(PARAMETERS) as robot:
        workspace = workspace_value(robot.runner.arm.workspace, 1)
    found = checked_trajectory("a.csv", csv(2.0), PARAMETERS, workspace, here, fit=False)
    assert found.planned is not None
    assert found.planned.joint_names == ("j1", "j2", "j3", "j4")
    for position in found.planned.positions:
        assert position[1:] == pytest.approx(here[1:], abs=1e-9)
    assert found.planned.times[-1] > found.duration
    for joints in ((), (0.3, 0.2, None, -0.5)):
        found = checked_trajectory("a.csv", csv(2.0), PARAMETERS, workspace, joints, fit=False)
        assert (found.planned, found.problem) == (None, None)


def test_one_of_another_arm_is_refused_with_a_proposal() -> None:
    with pytest.raises(TrajectoryError, match=r"a\.csv: no joint 'j01'; the arm has j1, .*j1"):
        checked_trajectory("a.csv", csv(2.0, joint="j01"), PARAMETERS, fit=False)


def test_a_name_from_outside_is_shown_without_control_characters_and_short() -> None:
    with pytest.raises(TrajectoryError) as error:
        checked_trajectory("\x1b[2J\n" + 500 * "a" + ".csv", b"x\n", PARAMETERS, fit=False)
    assert "\x1b" not in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300
