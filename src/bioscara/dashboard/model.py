"""The arm as a browser draws it: its links with their meshes, and its joints."""

from __future__ import annotations

from pathlib import Path

import msgspec

from bioscara.hardware import Urdf
from bioscara.hardware.urdf_joints import Origin, UrdfJoint, joints_of, origin_of
from bioscara.model import ArmParameters
from bioscara.model.urdf import DESCRIPTION, URDF, urdf_of

BASE, TOOL = "base_link", "tool"
"""Links whose frames are the frame of the scene and the pose of the tool."""
_MESHES = DESCRIPTION / "meshes" / "visual"

Place = tuple[float, float, float, float, float, float]


class Visual(msgspec.Struct, frozen=True):
    """A mesh of a link.

    Attributes:
        mesh: Name of its file.
        color: Red, green and blue, 0 to 1.
        origin: Its pose in the link: x, y, z [m], roll, pitch, yaw [rad].
    """

    mesh: str
    color: tuple[float, float, float]
    origin: Place


class ModelLink(msgspec.Struct, frozen=True):
    """A rigid part of the arm.

    Attributes:
        name: Its name.
        visuals: Its meshes; none for a mere frame.
    """

    name: str
    visuals: tuple[Visual, ...]


class ModelMimic(msgspec.Struct, frozen=True):
    """The joint that another one follows.

    Attributes:
        joint: Its name.
        multiplier: Ratio of the follower's position to the joint's.
        offset: Position of the follower when the joint is at zero [rad or m].
    """

    joint: str
    multiplier: float
    offset: float


class ModelJoint(msgspec.Struct, frozen=True):
    """A joint, or a fixed connection, of two links.

    Attributes:
        name: Its name.
        type: ``revolute``, ``prismatic`` or ``fixed``.
        parent: Link that carries it.
        child: Link that it carries.
        origin: Its pose in the parent at position zero: x, y, z [m], roll, pitch, yaw [rad].
        axis: Axis of rotation, or direction of translation.
        lower: Lowest position [rad or m].
        upper: Highest position [rad or m].
        mimic: The joint that it follows, or null.
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Place
    axis: tuple[float, float, float]
    lower: float
    upper: float
    mimic: ModelMimic | None


class ArmModel(msgspec.Struct, frozen=True):
    """The arm as a tree of links.

    Attributes:
        base: Link whose frame is the frame of the scene and of poses.
        tool: Link whose frame is the pose of the gripper's tool.
        links: The links.
        joints: The joints, parents before children.
    """

    base: str
    tool: str
    links: tuple[ModelLink, ...]
    joints: tuple[ModelJoint, ...]


def model_of(parameters: ArmParameters) -> ArmModel:
    """Return the model of an arm.

    Raises:
        ConfigurationError: Its meshes would be others than those of the package.
    """
    urdf = Urdf(urdf_of(parameters), URDF.name)
    _, joints = joints_of(urdf)
    links = tuple(
        ModelLink(
            urdf.attribute(tag, "name"),
            tuple(
                Visual(
                    Path(urdf.attribute(mesh, "filename")).name,
                    _color(urdf.attribute(color, "rgba")),
                    _place(origin_of(visual)),
                )
                for visual in tag.findall("visual")
                if (mesh := visual.find("geometry/mesh")) is not None
                and (color := visual.find("material/color")) is not None
            ),
        )
        for tag in urdf.root.findall("link")
    )
    return ArmModel(BASE, TOOL, links, tuple(map(_joint, joints)))


def meshes() -> dict[str, bytes]:
    """Return the meshes of the package as binary STL [m], by the names of their files."""
    return {path.name: path.read_bytes() for path in sorted(_MESHES.glob("*.stl"))}


def _joint(joint: UrdfJoint) -> ModelJoint:
    mimic = None if joint.mimic is None else ModelMimic(*joint.mimic)
    return ModelJoint(
        joint.name,
        joint.kind,
        joint.parent,
        joint.child,
        _place(joint.origin),
        joint.axis,
        joint.lower,
        joint.upper,
        mimic,
    )


def _place(origin: Origin) -> Place:
    return (*origin.xyz, *origin.rpy)


def _color(text: str) -> tuple[float, float, float]:
    red, green, blue, _ = map(float, text.split())
    return red, green, blue
