"""Robot descriptions for tests, made from the shipped one."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

from bioscara.model.urdf import URDF

LEFT = {name: f"left_{name}" for name in ("j1", "j2", "j3", "j4", "bioscara_arm")}
"""Names of an arm with a prefix, by those of the shipped one."""


def renamed(names: Mapping[str, str], *components: str) -> str:
    """Return the shipped description with other names.

    Args:
        names: New names of joints and components.
        components: Shipped names of those that it keeps; none for all.
    """
    root = ET.parse(URDF).getroot()
    for tag in root.findall("ros2_control"):
        if components and tag.attrib["name"] not in components:
            root.remove(tag)
    for element in root.iter():
        if element.tag in ("joint", "ros2_control"):
            element.attrib["name"] = names.get(element.attrib["name"], element.attrib["name"])
    return ET.tostring(root, encoding="unicode")
