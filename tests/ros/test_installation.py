"""The packages as pip installs them, the same as CMake does; the programs that come with them.

A build with colcon and ament is not part of the tests: neither is among their tools.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from bioscara import __version__
from ros.share import INTERFACES, NAMES, PACKAGES, installed

PROJECT = tomllib.loads((PACKAGES / "pyproject.toml").read_text())
SHARED = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["shared-data"]
SHIM = PACKAGES / "bioscara_ros/scripts/controller_manager_node"
EXPECTED = {
    "bioscara_arm_bringup", "bioscara_arm_description", "bioscara_arm_gripper_128_moveit_config",
    "bioscara_gripper_bringup", "bioscara_gripper_descriptions", "bioscara_ros", "scene_bringup",
    "scene_descriptions",
}  # fmt: skip


def files_below(folder: Path) -> set[str]:
    """Return the files of a folder but compiled ones."""
    found = (path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc")
    return {path.relative_to(folder).as_posix() for path in found}


def test_the_packages_have_the_names_of_the_original_and_none_hides_another() -> None:
    assert set(NAMES) == EXPECTED
    for name in NAMES:
        root = ET.parse(PACKAGES / name / "package.xml").getroot()
        assert root.findtext("name") == name
        assert root.findtext("version") == __version__ == PROJECT["project"]["version"]
        assert root.findtext("export/build_type") == root.findtext("buildtool_depend")
        assert f"project({name} NONE)" in (PACKAGES / name / "CMakeLists.txt").read_text()


def test_our_interfaces_have_a_package_for_colcon_with_the_same_definitions() -> None:
    definitions = PACKAGES.parent / "interfaces/definitions" / INTERFACES
    files = {path.relative_to(definitions): path.read_text() for path in definitions.glob("*/*")}
    package = PACKAGES / INTERFACES
    assert {path.relative_to(package): path.read_text() for path in package.glob("*/*")} == files
    root = ET.parse(package / "package.xml").getroot()
    assert root.findtext("version") == __version__
    assert root.findtext("member_of_group") == "rosidl_interface_packages"
    used = {
        word.partition("/")[0]
        for text in files.values()
        for line in text.splitlines()
        if "/" in (word := line.split("#")[0].partition(" ")[0])
    }
    declared = {tag.text for tag in root.findall("depend")}
    assert used == declared - {"action_msgs"}
    cmake = (package / "CMakeLists.txt").read_text()
    for name in used:
        assert f"find_package({name} REQUIRED)" in cmake
    assert f"DEPENDENCIES {' '.join(sorted(used))})" in cmake


def test_pip_and_cmake_install_the_same_files(tmp_path: Path) -> None:
    """Everything in a package is installed, at the same place by both."""
    by_cmake: set[str] = set()
    for name, places in installed().items():
        by_cmake |= {f"share/{name}/package.xml"}
        for place, source in places.items():
            below = {f"{place}/{file}" for file in files_below(source)}
            by_cmake |= below if source.is_dir() else {place}
    sources = {
        f"{name}/{file}" for name in NAMES for file in files_below(PACKAGES / name)
        if file != "CMakeLists.txt"
    }  # fmt: skip
    assert len(by_cmake) == len(sources)
    by_pip: set[str] = set()
    for source, place in SHARED.items():
        path = PACKAGES / source
        by_pip |= {f"{place}/{file}" for file in files_below(path)} if path.is_dir() else {place}
    markers = {f"share/ament_index/resource_index/packages/{name}" for name in NAMES}
    assert by_pip == by_cmake | markers


def test_pip_installs_the_packages_where_ros_finds_them(tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="pip install hatchling: builds the distribution")
    copy = shutil.copytree(PACKAGES, tmp_path / "ros")
    prefix = tmp_path / "prefix"
    subprocess.run(
        [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet",
         "--no-deps", "--no-build-isolation", "--no-compile", "--ignore-installed",
         "--prefix", str(prefix), str(copy)],
        check=True, timeout=60, env=os.environ | {"PIP_NO_INDEX": "1"},
    )  # fmt: skip
    marked = prefix / "share/ament_index/resource_index/packages"
    assert {path.name for path in marked.iterdir()} == EXPECTED
    assert all(path.stat().st_size == 0 for path in marked.iterdir())
    for name in NAMES:
        assert (prefix / "share" / name / "package.xml").is_file()
    for program in ("bioscara_ros/controller_manager_node",
                    "bioscara_arm_bringup/publisher_joint_trajectory_controller",
                    "scene_bringup/gazebo_joints"):  # fmt: skip
        assert (prefix / "lib" / program).stat().st_mode & 0o111


@pytest.mark.parametrize("where", ["beside", "on the path"])
def test_the_node_is_the_command_bioscara_ros(where: str, tmp_path: Path) -> None:
    """That of the same installation, else the one on the PATH; it gets all words."""
    shim = tmp_path / "prefix/lib/bioscara_ros/controller_manager_node"
    shim.parent.mkdir(parents=True)
    shutil.copy(SHIM, shim)
    folder = tmp_path / ("prefix/bin" if where == "beside" else "elsewhere")
    folder.mkdir()
    program = folder / "bioscara"
    program.write_text('#!/bin/sh\nprintf "%s\\n" "$$" "$@"\n')
    program.chmod(0o755)
    words = ["--bus", "sim", "--ros-args", "--params-file", "a b.yaml"]
    path = f"{folder}:{os.environ['PATH']}" if where == "on the path" else "/usr/bin:/bin"
    with subprocess.Popen(
        [shim, *words], env={"PATH": path}, stdout=subprocess.PIPE, text=True
    ) as process:
        said, _ = process.communicate(timeout=20)
    pid, *given = said.splitlines()
    assert given == ["ros", *words]
    # The same process, so that signals reach it.
    assert int(pid) == process.pid


def test_without_the_command_the_node_says_what_to_install(tmp_path: Path) -> None:
    shim = tmp_path / "lib/bioscara_ros/controller_manager_node"
    shim.parent.mkdir(parents=True)
    shutil.copy(SHIM, shim)
    tools = tmp_path / "tools"
    tools.mkdir()
    (tools / "dirname").symlink_to(shutil.which("dirname") or "/usr/bin/dirname")
    done = subprocess.run(
        ["/bin/sh", shim], env={"PATH": str(tools)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 127
    assert "pip install bioscara into an environment" in done.stderr
