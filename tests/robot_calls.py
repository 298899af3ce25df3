"""Every call of the robot, its planner and their values, with usable arguments."""

from __future__ import annotations

import asyncio
import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bioscara import Robot
from bioscara.kinematics import Joints, Pose
from bioscara.model import load_parameters
from bioscara.planning import Motion, ToolLimits, Trajectory, Waypoint, approach, retract
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.planning.world import World
from bioscara.robot.tasks import Unfold
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.grids import Grid
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.poses import NamedPose, TeachTable
from bioscara.robot.workspace.tools import FINGERS, Tool
from unusable_values import Parts

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
HALF = (0.3, 0.2, 0.8, -0.5)
Base = dict[str, Any]


def jogging(robot: Any) -> Callable[..., object]:
    def jog(velocity: object) -> None:
        left = [velocity, velocity]
        robot.jog(lambda: left.pop() if left else None)

    return jog


def first_state(robot: Any) -> Callable[..., object]:
    async def first(period: object) -> None:
        states = robot.states(period)
        await anext(states)
        await states.aclose()

    return lambda period: asyncio.run(first(period))


def setting(robot: Any, name: str) -> Callable[..., object]:
    return lambda value: setattr(robot, name, value)


WATCHED: Base = {"on_cycle": id, "timeout": 60.0, "wait": True}
SCALED: Base = {"velocity_scaling": 1.0, "acceleration_scaling": 1.0}
BY: Base = {"x": 0.0, "y": 0.0, "z": 0.02, "yaw": 0.0}
MOVED: Base = {**SCALED, **WATCHED}
TABLE: Base = {
    "joint_names": NAMES,
    "times": [0.0, 1.0],
    "positions": [list(HALF), list(HALF)],
    "velocities": [[0.0] * 4] * 2,
    "accelerations": [[0.0] * 4] * 2,
}
REST = Trajectory(**TABLE)
SHAPE = Prism.between((-0.06, -0.04, -0.01), (0.06, 0.04, 0.004))
PLATE = Load("plate", SHAPE)
FAR, BESIDE = Pose(2.0, 0.0, 0.1), Pose(0.0, 2.0, 0.1)
BENCH = Frame("bench", Pose(0.3, 0.1, 0.02, 0.5))
GRID = Grid(BENCH, 8, 12, 0.009, 0.009)


def calls(robot: Any) -> dict[str, tuple[Callable[..., object], Base]]:
    """Return every call, with usable arguments that cause no large motion."""
    plan, here = robot.plan, robot.plan.kinematics.forward(HALF)
    there = here._replace(z=here.z + 0.001)
    via = here._replace(x=here.x + 0.001, z=here.z + 0.0005)
    waypoint = Waypoint(there)
    return {
        "Robot.home": (robot.home, {"joints": ["j4"], "sensitivity": 30, "current": 15, **WATCHED}),
        "Robot.move_joints": (robot.move_joints, {"positions": HALF, **MOVED}),
        "Robot.execute": (robot.execute, {"plan": plan.move_joints(HALF), **WATCHED}),
        "Robot.follow": (robot.follow, {"trajectory": REST, "approach": True, **WATCHED}),
        "Robot.move_to": (robot.move_to, {"pose": there, "frame": None, **MOVED}),
        "Robot.move_linear": (robot.move_linear, {"pose": there, "frame": None, **MOVED}),
        "Robot.move_relative": (robot.move_relative, {**BY, **MOVED}),
        "Robot.move_circular": (
            robot.move_circular,
            {"via": via, "pose": there, "frame": None, **MOVED},
        ),
        "Robot.move_named": (robot.move_named, {"name": "center", **MOVED}),
        "Robot.unfold": (robot.unfold, MOVED),
        "Robot.rest": (robot.rest, {"seconds": 0.3, **WATCHED}),
        "Robot.do": (robot.do, {"task": Unfold(), **WATCHED}),
        "Robot.move_sequence": (robot.move_sequence, {"waypoints": [waypoint], **MOVED}),
        "Robot.jog": (robot.jog, {"velocities": lambda: None, **WATCHED}),
        "jog(JointVelocity)": (jogging(robot), {"velocity": JointVelocity(0.01)}),
        "jog(ToolVelocity)": (jogging(robot), {"velocity": ToolVelocity(0.001)}),
        # Of a robot that is not connected: one that is watched moves in real time from then on.
        "Robot.watch": (Robot.simulated().watch, {"priority": None, "real_time_factor": 1.0}),
        # Of another arm, as one that fails moves no more.
        "Robot.simulate_fault": (
            Robot.simulated().simulate_fault,
            {"fault": "push", "joint": "j1", "value": 0.0},
        ),
        "Robot.states": (first_state(robot), {"period": 1e-3}),
        "Robot.speed_override": (setting(robot, "speed_override"), {"value": 1.0}),
        "Robot.reduced_speed": (setting(robot, "reduced_speed"), {"value": True}),
        "Robot.scene": (setting(robot, "scene"), {"value": Scene()}),
        "Robot.table": (setting(robot, "table"), {"value": robot.table}),
        "Robot.teach": (robot.teach, {"name": "gate", "overwrite": True}),
        "Robot.tool": (setting(robot, "tool"), {"value": FINGERS}),
        "RobotGripper.move": (robot.gripper.move, {"width": 0.06, **WATCHED}),
        "RobotGripper.open": (robot.gripper.open, WATCHED),
        "RobotGripper.close": (robot.gripper.close, WATCHED),
        "RobotGripper.grasp": (
            robot.gripper.grasp,
            {"load": PLATE, "width": 0.08, "squeeze": 0.003, **WATCHED},
        ),
        "RobotGripper.release": (robot.gripper.release, {"opening": 0.01, **WATCHED}),
        "Robot.attach": (robot.attach, {"load": PLATE}),
        "attach(Load)": (
            lambda **values: robot.attach(Load(**values)),
            {"name": "plate", "shape": SHAPE, "mass": 0.1, "touches": (), "max_speed": 0.1},
        ),
        "attach(Prism)": (
            lambda **values: robot.attach(Load("plate", Prism(**values))),
            dataclasses.asdict(SHAPE),
        ),
        "Robot.frame": (robot.frame, {"name": "bench"}),
        "Frame": (Frame, {"name": "bench", "pose_frame_in_base": here}),
        "Frame.from_points": (
            Frame.from_points,
            {"name": "bench", "origin": Pose(0.0, 0.0, 0.1), "on_x": FAR, "on_plane": BESIDE},
        ),
        "Frame.from_points, two": (
            Frame.from_points,
            {"name": "bench", "origin": Pose(0.0, 0.0, 0.1), "on_x": FAR},
        ),
        "Frame.pose": (BENCH.pose, BY),
        "Frame.compose": (BENCH.compose, {"pose": here}),
        "Grid": (
            Grid,
            {
                "frame": BENCH,
                "rows": 8,
                "columns": 12,
                "row_pitch": 0.009,
                "column_pitch": 0.009,
                "yaw": 0.1,
            },
        ),
        "Grid.from_corners": (
            Grid.from_corners,
            {
                "name": "rack",
                "rows": 8,
                "columns": 12,
                "first": Pose(0.0, 0.0, 0.0),
                "row_end": Pose(0.1, 0.0, 0.0),
                "column_end": Pose(0.0, -0.1, 0.0),
            },
        ),
        "Grid.pose": (GRID.pose, {"row": 1, "column": 2, "z": 0.1}),
        "Grid[]": (GRID.__getitem__, {"name": "A1"}),
        "TeachTable.frame": (robot.table.frame, {"name": "bench"}),
        "TeachTable.with_frame": (robot.table.with_frame, {"frame": BENCH}),
        "Planner.move_joints": (plan.move_joints, {"positions": HALF, **SCALED}),
        "Planner.move_to": (plan.move_to, {"pose": there, "frame": None, **SCALED}),
        "Planner.move_named": (plan.move_named, {"name": "center", **SCALED}),
        "Planner.unfold": (plan.unfold, SCALED),
        "Planner.check_width": (plan.check_width, {"width": 0.06}),
        "Planner.move_linear": (plan.move_linear, {"pose": there, "frame": None, **SCALED}),
        "Planner.move_relative": (plan.move_relative, {**BY, **SCALED}),
        "Planner.move_circular": (
            plan.move_circular,
            {"via": via, "pose": there, "frame": None, **SCALED},
        ),
        "Planner.arc_of": (plan.arc_of, {"via": via, "pose": there, "frame": None}),
        "Planner.pose_of": (plan.pose_of, {"target": there, "frame": None, "via": False}),
        "Planner.move_sequence": (plan.move_sequence, {"waypoints": [waypoint], **SCALED}),
        "waypoint": (lambda waypoint: plan.move_sequence([waypoint]), {"waypoint": waypoint}),
        "waypoint with via": (
            lambda waypoint: plan.move_sequence([waypoint]),
            {"waypoint": Waypoint(there, Motion.CIRC, via=via)},
        ),
        "Planner.check_trajectory": (
            plan.check_trajectory,
            {"trajectory": REST, "elsewhere": HALF, "planned": False},
        ),
        "Planner.jog": (plan.jog, {"start": HALF, "elbow": 0.5}),
        "Scara.solve": (plan.kinematics.solve, {"pose": there, "near": HALF}),
        "Scara.inverse": (plan.kinematics.inverse, {"pose": there}),
        "approach": (
            approach,
            {"target": here, "away": there, "motion": Motion.PTP, "velocity_scaling": 1.0},
        ),
        "retract": (retract, {"target": here, "away": there, "velocity_scaling": 1.0}),
        "Pose.compose": (here.compose, {"other": here}),
        "compose of a pose": (lambda pose: Pose(*pose).compose(here), {"pose": Parts(here)}),
        "inverse of a pose": (lambda pose: Pose(*pose).inverse(), {"pose": Parts(here)}),
        "Trajectory": (Trajectory, TABLE),
        "Trajectory(cubics)": (
            lambda cubics: Trajectory(
                NAMES, [0.0, 1.0], [HALF, HALF], [[0.0] * 4] * 2, cubics=cubics
            ),
            {"cubics": [[[0.0, 0.0]] * 4]},
        ),
        "Trajectory.sample": (REST.sample, {"time": 0.5}),
        "Trajectory.sample_many": (REST.sample_many, {"times": [0.5]}),
        "ToolLimits": (
            ToolLimits,
            {"speed": 0.2, "acceleration": 1.0, "yaw_speed": 1.0, "yaw_acceleration": math.inf},
        ),
        "Box": (
            lambda **values: plan_with(robot, Scene((Box(**values),))),
            {
                "name": "box",
                "lower": (1.0, 1.0, 1.0),
                "upper": (2.0, 2.0, 2.0),
                "yaw": 0.1,
                "keep_in": False,
                "links": ("forearm",),
            },
        ),
        "Cylinder": (
            lambda **values: plan_with(robot, Scene((Cylinder(**values),))),
            {
                "name": "tube",
                "x": 2.0,
                "y": 2.0,
                "radius": 0.1,
                "low": 0.0,
                "high": 1.0,
                "keep_in": False,
                "links": (),
            },
        ),
        "Scene": (
            lambda **values: plan_with(robot, Scene(**values)),
            {
                "zones": (Box("box", (1.0, 1.0, 1.0), (2.0, 2.0, 2.0)),),
                "table_height": -0.5,
                "margin": 0.005,
            },
        ),
        "Tool": (Tool, {"name": "needle", "pose_tool_in_flange": here, "mass": 0.1}),
        "NamedPose": (
            NamedPose,
            {
                "name": "plate",
                "joints": Joints(*HALF),
                "pose_tool_in_base": here,
                "tool": FINGERS,
                "calibration": "",
            },
        ),
        "TeachTable": (
            TeachTable,
            {
                "fingers": robot.tool,
                "tools": (Tool("needle", here, 0.1),),
                "poses": (NamedPose("plate", Joints(*HALF)),),
                "frames": (BENCH,),
            },
        ),
        "TeachTable.tool": (robot.table.tool, {"name": FINGERS}),
        "TeachTable.pose": (robot.table.pose, {"name": "center"}),
        "TeachTable.with_tool": (
            robot.table.with_tool,
            {"tool": Tool("needle", here, 0.1), "overwrite": False},
        ),
        "TeachTable.with_pose": (
            robot.table.with_pose,
            {"pose": NamedPose("plate", Joints(*HALF)), "overwrite": False},
        ),
        "TeachTable.without_pose": (robot.table.without_pose, {"name": "plate"}),
        "Robot.simulated": (
            Robot.simulated,
            {
                "parameters": ARM,
                "v1": False,
                "homed": False,
                "seed": 1,
                "rate": 100,
                "evidence": Path("faults"),
                "reduced_speed": True,
                "pace_homing": False,
                "pace_motion": False,
                "controllers_fed": False,
                "world": World(),
            },
        ),
        "Robot.on_bus": (
            Robot.on_bus,
            {
                "name": "linux:1",
                "parameters": ARM,
                "rate": 100,
                "evidence": Path("faults"),
                "reduced_speed": True,
            },
        ),
        "Robot.connect": (
            Robot.connect,
            {
                "name": "linux:1",
                "parameters": ARM,
                "rate": 100,
                "evidence": Path("faults"),
                "reduced_speed": True,
                "timeout": 0.0,
                "token": None,
                "ca_file": None,
                "fingerprint": None,
            },
        ),
    }


def plan_with(robot: Any, scene: Scene) -> None:
    """Use a scene, so that damage by a value would be seen."""
    robot.scene = scene
    try:
        robot.plan.move_joints(HALF)
    finally:
        robot.scene = Scene()
