"""Values of a robot as values of messages, and back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from bioscara.api.failures import error_of, failure_of
from bioscara.api.messages import (
    BodyList,
    BoxZone,
    CylinderZone,
    FaultList,
    FaultValue,
    GripperValue,
    SceneValue,
    TrajectoryValue,
    WorkspaceState,
    WorldSample,
)
from bioscara.control.controllers.gripper_messages import GripperResult
from bioscara.control.faults.kinds import ArmFault, FaultKind
from bioscara.control.faults.warning import ArmWarning
from bioscara.hardware.interfaces import Quality
from bioscara.hardware.link_frames import Transform
from bioscara.model import ArmParameters
from bioscara.physics.bodies import BodyBox, BodyPose, BodyShape
from bioscara.planning import Trajectory
from bioscara.planning.arrays import Array
from bioscara.planning.collision.arm_bodies import GRIPPER
from bioscara.planning.collision.scene import Box, Scene
from bioscara.robot.workspace.workspace import Workspace

QUALITIES = tuple(Quality)
"""Qualities in the order of their numbers in messages."""

_BASE = "base_link"
"""Link whose frame is that of poses."""
_PART = 500
"""Number of points of a trajectory in one message: of six joints in JSON these are up to 200 kB."""


def trajectory_value(trajectory: Trajectory) -> TrajectoryValue:
    """Return a trajectory as a value."""
    return trajectory_part(trajectory, slice(None))


def trajectory_parts(trajectory: Trajectory) -> Iterator[TrajectoryValue]:
    """Yield a trajectory in parts that fit into a message each."""
    for begin in range(0, len(trajectory.times), _PART):
        yield trajectory_part(trajectory, slice(begin, begin + _PART))


Columns = tuple[tuple[str, ...], Array, Array, Array | None, Array | None]
"""Names of the joints, times, positions, velocities and accelerations of points."""


def columns_of(trajectory: Trajectory, points: slice) -> Columns:
    """Return some points of a trajectory as columns; there may be none."""
    velocities, accelerations = trajectory.velocities, trajectory.accelerations
    return (
        tuple(trajectory.joint_names),
        trajectory.times[points],
        trajectory.positions[points],
        None if velocities is None else velocities[points],
        None if accelerations is None else accelerations[points],
    )


def columns_value(columns: Columns) -> TrajectoryValue:
    """Return points as a value."""
    names, times, *rows = columns
    positions, velocities, accelerations = [
        None if row is None else tuple(map(tuple, row.tolist())) for row in rows
    ]
    return TrajectoryValue(names, tuple(times.tolist()), positions or (), velocities, accelerations)


def trajectory_part(trajectory: Trajectory, points: slice) -> TrajectoryValue:
    """Return some points of a trajectory as a value."""
    return columns_value(columns_of(trajectory, points))


def joined_parts(first: TrajectoryValue, second: TrajectoryValue) -> TrajectoryValue:
    """Return the points of two parts of a trajectory."""
    velocities = first.velocities and second.velocities and first.velocities + second.velocities
    more = first.accelerations and second.accelerations
    accelerations = more and (first.accelerations or ()) + (second.accelerations or ())
    return TrajectoryValue(
        first.joint_names,
        first.times + second.times,
        first.positions + second.positions,
        velocities,
        accelerations,
    )


def trajectory_of(value: TrajectoryValue) -> Trajectory:
    """Return the trajectory of a value.

    Raises:
        TrajectoryError: A size does not fit, a value is not finite, or times do not increase.
    """
    return Trajectory(
        value.joint_names, value.times, value.positions, value.velocities, value.accelerations
    )


def workspace_of(parameters: ArmParameters, state: WorkspaceState) -> Workspace:
    """Return the workspace of an arm, as its owner has it.

    Raises:
        ConfigurationError, InvalidArgumentError: The values contradict each other.
    """
    workspace = Workspace.of(parameters, reduced_speed=state.reduced_speed)
    scene = replace(scene_of(state.scene), widths=workspace.scene.widths)
    workspace = workspace.with_table(state.table).with_scene(scene).with_tool(state.tool.name)
    if state.load is not None:
        workspace = workspace.with_load(state.load)
    return workspace.with_widths(*state.widths)


def workspace_value(space: Workspace, revision: int) -> WorkspaceState:
    """Return a workspace as a value."""
    return WorkspaceState(
        revision=revision,
        scene=scene_value(space.scene),
        table=space.table,
        tool=space.tool,
        reduced_speed=space.reduced_speed,
        load=space.load,
        widths=space.widths,
        unconfirmed=space.unconfirmed_words(),
    )


def scene_value(scene: Scene) -> SceneValue:
    """Return a scene as a value; its widths are the owner's to know."""
    zones = [BoxZone(each) if isinstance(each, Box) else CylinderZone(each) for each in scene.zones]
    mounted = None if scene.mounted == GRIPPER else scene.mounted
    return SceneValue(tuple(zones), scene.table_height, scene.margin, mounted)


def scene_of(value: SceneValue) -> Scene:
    """Return the scene of a value.

    Raises:
        ConfigurationError: Two zones have the same name, or a value is invalid.
    """
    mounted = GRIPPER if value.mounted is None else value.mounted
    zones = tuple(each.zone for each in value.zones)
    return Scene(zones, value.table_height, value.margin, mounted)


def fault_value(fault: ArmFault) -> FaultValue:
    """Return a fault as a value."""
    return FaultValue(
        fault.kind.name,
        fault.source,
        str(fault),
        failure_of(fault.cause),
        fault.time,
        None if fault.evidence is None else fault.evidence.name,
    )


def fault_of(value: FaultValue) -> ArmFault:
    """Return the fault of a value; its evidence is a name at the owner."""
    return ArmFault(
        FaultKind[value.fault],
        value.source,
        error_of(value.cause),
        value.time,
        None if value.evidence is None else Path(value.evidence),
    )


def warnings_of(value: FaultList) -> tuple[ArmWarning, ...]:
    """Return the warnings of an arm with their times."""
    return tuple(map(ArmWarning, value.warnings, value.warned))


def gripper_value(result: GripperResult) -> GripperValue:
    """Return how a motion of the jaws ended as a value."""
    position, velocity, reached, stalled, quality = result
    return GripperValue(position, velocity, reached, stalled, QUALITIES.index(quality))


def gripper_of(value: GripperValue) -> GripperResult:
    """Return how a motion of the jaws ended."""
    return GripperResult(
        value.position,
        value.velocity,
        value.reached_goal,
        value.stalled,
        QUALITIES[value.quality],
    )


def placed(bodies: BodyList, sample: WorldSample) -> tuple[BodyPose, ...]:
    """Return where all bodies are by a sample, in the order of their list."""
    moved = {pose.name: pose for pose in sample.poses}
    return tuple([moved.get(pose.name, pose) for pose in bodies.poses])


def body_frame(name: str) -> str:
    """Return the name of a body's frame among those of the arm's links."""
    return f"body/{name}"


def body_transform(pose: BodyPose) -> Transform:
    """Return where a body is as the transform of its frame."""
    place, turn = (pose.x, pose.y, pose.z), (pose.qx, pose.qy, pose.qz, pose.qw)
    return Transform(_BASE, body_frame(pose.name), place, turn)


def shown_boxes(shapes: Iterable[BodyShape]) -> list[tuple[BodyShape, int, BodyBox]]:
    """Return the boxes of bodies, each with its body and its number in that.

    The jaws are left out: the robot description shows them.
    """
    return [
        (shape, number, box)
        for shape in shapes
        if shape.kind != "jaw"
        for number, box in enumerate(shape.boxes)
    ]
