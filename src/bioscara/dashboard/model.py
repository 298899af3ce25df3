"""The arm as a browser draws it: its links with their meshes, and its joints."""

from __future__ import annotations

from pathlib import Path

import msgspec

from bioscara.hardware import Urdf
from bioscara.hardware.urdf_joints import Place, UrdfJoint, origin_of, tree_of
from bioscara.model import ArmParameters
from bioscara.model.urdf import URDF, mesh_file, urdf_of
from bioscara.physics.bodies import COLOURS

BASE, TOOL = "base_link", "tool"
"""Links whose frames are the frame of the scene and the pose of the tool."""


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


class ArmModel(msgspec.Struct, frozen=True):
    """The arm as a tree of links.

    Attributes:
        base: Link whose frame is the frame of the scene and of poses.
        tool: Link whose frame is the pose of the gripper's tool.
        links: The links.
        joints: The joints, parents before children.
        body_colors: Red, green and blue, 0 to 1, of the kinds of bodies around a simulated arm.
    """

    base: str
    tool: str
    links: tuple[ModelLink, ...]
    joints: tuple[UrdfJoint, ...]
    body_colors: dict[str, tuple[float, float, float]]


def model_of(parameters: ArmParameters) -> ArmModel:
    """Return the model of an arm.

    Raises:
        ConfigurationError: Its meshes would be others than those of the package.
    """
    urdf = Urdf(urdf_of(parameters), URDF.name)
    links = tuple(
        ModelLink(
            urdf.attribute(tag, "name"),
            tuple(
                Visual(
                    Path(urdf.attribute(mesh, "filename")).name,
                    _color(urdf.attribute(color, "rgba")),
                    origin_of(urdf, visual),
                )
                for visual in tag.findall("visual")
                if (mesh := visual.find("geometry/mesh")) is not None
                and (color := visual.find("material/color")) is not None
            ),
        )
        for tag in urdf.root.findall("link")
    )
    colors = {kind: color[:3] for kind, color in COLOURS.items()}
    return ArmModel(BASE, TOOL, links, tree_of(urdf), colors)


def meshes() -> dict[str, bytes]:
    """Return the meshes that are seen, as binary STL [m], by the names of their files."""
    urdf = Urdf(URDF.read_text(encoding="utf-8"), URDF.name)
    tags = urdf.root.iterfind("link/visual/geometry/mesh")
    files = map(mesh_file, sorted(urdf.attribute(tag, "filename") for tag in tags))
    return {path.name: path.read_bytes() for path in files}


def _color(text: str) -> tuple[float, float, float]:
    red, green, blue, _ = map(float, text.split())
    return red, green, blue
