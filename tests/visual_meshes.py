"""The meshes that are seen of a link, by the description."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from bioscara.model.urdf import URDF, mesh_file


def visual_meshes(link: str) -> list[Path]:
    """Return the files of the meshes that are seen of a link."""
    meshes = ET.parse(URDF).getroot().findall(f"link[@name='{link}']/visual/geometry/mesh")
    return [mesh_file(mesh.attrib["filename"]) for mesh in meshes]
