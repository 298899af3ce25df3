"""The robot description without ROS: its meshes are named relative to it."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from bioscara.model import ArmParameters
from bioscara.model.parts import MASSES
from bioscara.model.urdf import mesh_file, urdf_of

_OF_MUJOCO = '<mujoco><compiler strippath="false" fusestatic="false"/></mujoco>'
"""Else MuJoCo drops the frames of fixed links, and before version 4 the folders of meshes."""


def portable_urdf(parameters: ArmParameters) -> tuple[str, dict[str, bytes]]:
    """Return the description of an arm, and its meshes by the names that it has for them.

    The tags of ros2_control are left out: they name components of ROS.

    Raises:
        ConfigurationError: As :func:`bioscara.model.urdf.urdf_of`.
    """
    root = ET.fromstring(urdf_of(parameters))  # noqa: S314  comes with the package
    for tag in root.findall("ros2_control"):
        root.remove(tag)
    root.insert(0, ET.Comment(f" {MASSES} "))
    root.append(ET.fromstring(_OF_MUJOCO))  # noqa: S314  is above
    meshes = {}
    for mesh in root.iter("mesh"):
        path = mesh_file(mesh.attrib["filename"])
        name = "/".join(path.parts[-3:])
        mesh.attrib["filename"] = name
        meshes[name] = path.read_bytes()
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n", meshes
