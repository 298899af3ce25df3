"""The packages of ``ros/`` as they are found after their installation, without ROS."""

from __future__ import annotations

import contextlib
import io
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

ROOT = Path(__file__).parents[2]
PACKAGES = ROOT / "ros"
INTERFACES = "bioscara_interfaces"
"""The package that is compiled: with colcon only."""
NAMES = sorted(
    path.parent.name for path in PACKAGES.glob("*/package.xml") if path.parent.name != INTERFACES
)
MOVEIT = PACKAGES / "bioscara_arm_gripper_128_moveit_config"
GRIPPER = {"gripper_description_package": "bioscara_gripper_descriptions"}
"""Argument of the scene with a gripper."""


def installed() -> dict[str, dict[str, Path]]:
    """Return the files and folders that each package installs, from its CMake file.

    Returns:
        Sources by their place, by the name of the package.
    """
    found: dict[str, dict[str, Path]] = {}
    for name in NAMES:
        text = (PACKAGES / name / "CMakeLists.txt").read_text()
        places = found[name] = {}
        for kind, listed, goal in re.findall(r"install\((\w+) (.+?) DESTINATION (\S+)\)", text):
            below = goal.replace("${PROJECT_NAME}", name)
            for word in listed.split():
                source = PACKAGES / name / word
                flat = kind == "DIRECTORY" and word.endswith("/")
                places[below if flat else f"{below}/{source.name}"] = source
    return found


def make_prefix(folder: Path) -> Path:
    """Link everything that the packages install into a folder, as an installation has it."""
    for name, places in installed().items():
        marker = folder / "share/ament_index/resource_index/packages" / name
        marker.parent.mkdir(parents=True, exist_ok=True)
        marker.touch()
        places[f"share/{name}/package.xml"] = PACKAGES / name / "package.xml"
        for place, source in places.items():
            # Files: ROS does not follow links of folders.
            files = source.rglob("*.*") if source.is_dir() else [source]
            for path in files:
                goal = folder / place / path.relative_to(source)
                goal.parent.mkdir(parents=True, exist_ok=True)
                goal.symlink_to(path)
    return folder


def expand(path: Path, /, **arguments: str) -> ET.Element:
    """Return an expanded xacro file; xacro must not complain, as ROS launch files fail then."""
    import xacro  # noqa: PLC0415  the tests of files alone do not need it

    with contextlib.redirect_stderr(io.StringIO()) as complaint:
        document = xacro.process_file(str(path), mappings=arguments)
    assert complaint.getvalue() == ""
    return ET.fromstring(document.toxml())


def scene(prefix: Path, /, **arguments: str) -> ET.Element:
    """Return the expanded description of the arm with its gripper."""
    path = prefix / "share/scene_descriptions/urdf/scene.xacro"
    return expand(path, **(GRIPPER | arguments))


def load(path: Path) -> Any:
    """Return the content of a YAML file."""
    return yaml.safe_load(path.read_text())


def flat(parameters: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return parameters by their full names, with dots between the levels, as rcl reads them."""
    values: dict[str, Any] = {}
    for key, value in parameters.items():
        name = f"{above}{key}"
        values |= flat(value, f"{name}.") if isinstance(value, dict) else {name: value}
    return values


def parameters_of(node: str, *files: Path) -> dict[str, Any]:
    """Return the parameters that files have for a node; later files win."""
    values: dict[str, Any] = {}
    for path in files:
        values |= flat(load(path).get(node, {}).get("ros__parameters", {}))
    return values
