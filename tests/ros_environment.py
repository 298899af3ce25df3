"""The environment with ROS 2 from PyPI and our interface packages, which ``make ros2`` makes.

It is that of another Python where the variable ``BIOSCARA_ROS2`` names its folder.
Where that has no ``ros2 launch``, an installed ROS whose setup.bash was sourced is used instead.
"""

from __future__ import annotations

import os
import platform
import shutil
from pathlib import Path
from typing import NoReturn

import pytest

ROOT = Path(__file__).parents[1]
VENV = ROOT / os.environ.get("BIOSCARA_ROS2", ".venv-ros2")
# Read now: tests set the variable, too.
_SOURCED = "AMENT_PREFIX_PATH" in os.environ and not (VENV / "bin/ros2").exists()


def ros_environment(**more: str) -> dict[str, str]:
    """Return the environment for a program of that environment, alone on this computer.

    The ROS wheels leave variables to each process that Python starts, which are wrong in another
    environment.
    """
    dropped = {
        "LD_LIBRARY_PATH",
        "PYTHONPATH",
        "AMENT_PREFIX_PATH",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
    }
    if _SOURCED:
        dropped = set()
    kept = {name: value for name, value in os.environ.items() if name not in dropped}
    own = {"ROS_DOMAIN_ID": str(os.getpid() % 100), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    return {**kept, **own, **more}


def ros_python() -> Path:
    """Return the Python of that environment, or skip the test."""
    installed = shutil.which("python3") if _SOURCED else None
    python = Path(installed or VENV / "bin" / "python")
    if not python.exists():
        absent("the tests with ROS 2: `make ros2` makes their environment, on x86-64")
    return python


def ros_launch(prefix: Path) -> dict[str, str]:
    """Return the variables for the programs of ROS, ``ros2`` among them, or skip the test.

    Args:
        prefix: Where further packages are.
    """
    if _SOURCED:
        own = os.environ["AMENT_PREFIX_PATH"]
    elif (VENV / "bin/ros2").exists():
        own = str(VENV)
    else:
        absent(
            "what starts launch files: source the setup.bash of an installed ROS 2, or give "
            "make ROS2_WHEELS=FOLDER with wheels of launch, launch_ros, ros2cli and "
            "controller_manager"
        )
    path = f"{VENV / 'bin'}{os.pathsep}{os.environ['PATH']}"
    return {"PATH": path, "AMENT_PREFIX_PATH": f"{prefix}:{own}"}


ABSENT = "not run, as this computer does not have it: "
"""Beginning of the reason for which such a test is skipped."""


def absent(what: str) -> NoReturn:
    """Skip a test for a missing part of this computer; fail where it must have that, as in CI.

    Args:
        what: The untested part, and how to have it; the run ends with each of these sentences.
    """
    if os.environ.get("CI") and platform.machine() == "x86_64":
        pytest.fail(f"not to be skipped in CI: {what}")
    pytest.skip(f"{ABSENT}{what}")
