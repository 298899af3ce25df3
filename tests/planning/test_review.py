"""Defects that a review proved; each test fails until its defect is gone."""

from pathlib import Path

import numpy as np
import pytest

from bioscara.cli import main
from bioscara.errors import BioscaraError, ZoneError
from bioscara.kinematics import Joints
from bioscara.model import load_parameters
from bioscara.planning.point_to_point import point_to_point
from bioscara.planning.tool_speed import peak_tool_speed
from bioscara.planning.trajectory import Trajectory
from bioscara.planning.zones import Box, Cylinder, Scene
from bioscara.robot import Robot
from bioscara.robot.planner import Planner
from bioscara.robot.tools import fingers

PARAMETERS = load_parameters()
LIMITS = PARAMETERS.joints
NAMES = tuple(limit.name for limit in LIMITS)
HERE = Joints(0.0, 0.2, 1.0, 0.0)
FINGERS = fingers(PARAMETERS)
PLANNER = Planner(PARAMETERS, lambda: HERE)
ARM = PLANNER.kinematics
TOOL = ARM.forward(HERE)


# --- zones -----------------------------------------------------------------------------------


def test_small_moves_do_not_lead_the_gripper_into_the_base():
    """Each move may come 0.4 mm nearer than the one before it: 36 of them end inside."""
    here = [(0.0, 0.0, 2.28, -3.0)]
    planner = Planner(PARAMETERS, lambda: here[0])

    def clearance() -> float:
        return float(Scene().clearance(planner.kinematics, [here[0]])[0])

    assert clearance() > 0.01
    with pytest.raises(ZoneError):
        planner.joints((0.0, 0.0, 2.32, -3.0))  # the same way in one go
    for _ in range(100):
        for step in (0.01, 0.005, 0.002, 0.001, 0.0005, 0.0003):
            goal = (0.0, 0.0, here[0][2] + step, -3.0)
            try:
                planner.joints(goal)
            except ZoneError:
                continue
            here[0] = goal
            break
        else:
            break
        if clearance() < 0.0:
            break
    assert clearance() > 0.005 - 4e-4


def test_from_a_goal_that_was_free_the_arm_can_leave_again():
    """It rests a hair beside the goal, where every plan is refused at its start."""
    start = (0.4297746953080669, 0.2, 1.095035170767486, 0.17580086493352587)
    goal = (-0.023961089524598078, 0.2, 0.9301880158531971, 0.19255204471056064)
    place = (0.5973388428514501, 0.024934661973487482)
    with Robot.simulated(PARAMETERS) as robot:
        robot.home()
        robot.move_joints(start)
        thin = Scene((Cylinder("post", *place, 0.01, -1.0, 1.0),))
        room = float(thin.clearance(robot.kinematics, [goal])[0])
        radius = 0.01 + room - thin.margin - 1e-6
        robot.plan.scene = Scene((Cylinder("post", *place, radius, -1.0, 1.0),))
        robot.move_joints(goal)
        robot.move_joints(start)


def test_a_robot_follows_a_trajectory_for_some_of_the_joints():
    """follow(): "For some or all of the joints; the others hold"."""
    with Robot.simulated(PARAMETERS) as robot:
        robot.home()
        robot.move_joints((0.0, 0.2, 1.2, 0.0))
        start = robot.state.positions[0]
        robot.follow(Trajectory(["j1"], [0.0, 2.0], [[start], [0.1]], [[0.0], [0.0]]))
        assert robot.state.positions[0] == pytest.approx(0.1, abs=1e-3)


def test_links_of_a_zone_may_be_a_list():
    zone = Box("b", (0.5, 0.5, 0.0), (0.6, 0.6, 0.1), links=["gripper"])  # type: ignore[arg-type]
    Scene((zone,)).check(ARM, PLANNER.joints(HERE).trajectory)


# --- limits ----------------------------------------------------------------------------------


@pytest.mark.parametrize("wait", [4e3, 4e4, 1e5])
def test_the_tool_is_slow_also_in_a_long_trajectory(wait):
    """The arm waits, moves for half a second and waits: looked at 50000 times, all in all."""
    motion = point_to_point(NAMES, HERE, (0.2, 0.2, 1.3, 0.5), LIMITS)
    rest = np.zeros(4)
    long = Trajectory(
        NAMES,
        np.concatenate(([0.0], wait / 2.0 + motion.times, [wait])),
        np.vstack((HERE, motion.positions, motion.positions[-1])),
        np.vstack((rest, motion.velocities, rest)),
    )
    slowed = PLANNER.trajectory(long, HERE).trajectory
    middle = Trajectory(
        NAMES,
        slowed.times[1:-1] - slowed.times[1],
        slowed.positions[1:-1],
        slowed.velocities[1:-1],
    )
    assert peak_tool_speed(middle, ARM, HERE) <= 0.25 * (1.0 + 1e-5)


def test_a_line_that_keeps_to_its_speed_has_no_note_of_stretching():
    rng = np.random.default_rng(3)
    for _ in range(60):
        here = Joints(*(rng.uniform(0.8 * limit.lower, 0.8 * limit.upper) for limit in LIMITS))
        planner = Planner(PARAMETERS, lambda here=here: here)
        tool = planner.kinematics.forward(here)
        try:
            plan = planner.linear(
                tool._replace(x=tool.x + rng.normal() * 0.1, y=tool.y + rng.normal() * 0.1)
            )
        except BioscaraError:
            continue
        assert not [note for note in plan.notes if "1.00 times" in note]


def test_a_plan_tells_what_is_unusual_about_a_trajectory():
    """check() returns these sentences; Planner.trajectory() drops them."""
    steps = Trajectory(NAMES, [0.0, 5.0], [HERE, HERE._replace(j1=0.3)])
    assert any("jerks" in note for note in PLANNER.trajectory(steps, HERE).notes)


# --- command line ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        ["--joints", "0", "0.1", "0", "0", "--speed", "2"],
        ["--joints", "0", "0.1", "0", "0", "--speed", "nan"],
        ["--name", "center", "--linear"],
        ["--pose", "0.4", "0.1", "0.1", "0", "--via", "0.3", "0.1", "0.1", "--linear"],
        ["--name", "needled"],
        ["--name", "beyond"],
    ],
    ids=" ".join,
)
def test_a_target_that_cannot_be_is_refused_before_the_arm_is_homed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, words
):
    """It ends with status 2, "refused before anything moved"; the arm has been homed by then."""
    monkeypatch.chdir(tmp_path)
    Path("poses.yaml").write_text(
        "schema: 1\ntools: {needle: {x: 0.05, y: 0.0, z: -0.2, yaw: 0.0, mass: 0.1}}\nposes:\n"
        "  needled: {pose: {x: 0.5, y: 0.3, z: 0.03, yaw: 1.1}, tool: needle}\n"
        "  beyond: {joints: {j1: 9, j2: 0.1, j3: 0, j4: 0}}\n...\n"
    )
    assert main(["move", *words], paced=False) == 2
    assert "homing" not in capsys.readouterr().out
