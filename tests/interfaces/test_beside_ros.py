"""Our interface packages never take the place of those of a ROS installation."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

INTERFACES = Path(__file__).parents[2] / "interfaces"


@pytest.fixture
def generate() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate", INTERFACES / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _package(folder: Path, origin: str) -> None:
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text(f"ORIGIN = {origin!r}\n")


def _imported(*path: Path) -> str:
    return subprocess.run(
        [sys.executable, "-c",
         f"import sys\nsys.path[:0] = {[str(p) for p in path[:1]]}\n"
         "import bioscara_ros_fallback\n"
         f"sys.path += {[str(p) for p in path[1:]]}\n"
         "import control_msgs\nprint(control_msgs.ORIGIN)"],
        check=True, capture_output=True, text=True,
    ).stdout.strip()  # fmt: skip


def test_a_package_is_ours_only_where_nothing_else_has_it(tmp_path: Path) -> None:
    site, ros = tmp_path / "site", tmp_path / "ros"
    shutil.copytree(INTERFACES / "python", site)
    _package(site / "bioscara_ros_fallback" / "control_msgs", "ours")
    _package(ros / "control_msgs", "ROS")
    assert _imported(site) == "ours"
    assert _imported(site, ros) == "ROS"


@pytest.mark.parametrize("package", ["rclpy", "control_msgs", "bioscara_interfaces"])
def test_beside_an_active_installation_nothing_is_built(
    generate: ModuleType, tmp_path: Path, package: str
) -> None:
    index = tmp_path / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    environ = {"AMENT_PREFIX_PATH": f"/nowhere:{tmp_path}"}
    generate.refuse_beside_ros(environ)
    (index / package).touch()
    with pytest.raises(
        generate.BuildError, match=f"{tmp_path} is a ROS installation with {package}"
    ):
        generate.refuse_beside_ros(environ)


def test_without_the_wheels_the_build_says_what_to_install(
    generate: ModuleType, tmp_path: Path
) -> None:
    if importlib.util.find_spec("rosidl_parser"):
        pytest.skip("the ROS wheels are installed in this environment")
    with pytest.raises(generate.BuildError, match="pip install ros-rclpy"):
        generate.build_all(tmp_path)


def test_each_package_has_definitions(generate: ModuleType) -> None:
    folders = {path.name for path in generate.DEFINITIONS.iterdir()}
    assert folders == set(generate.PACKAGES)
