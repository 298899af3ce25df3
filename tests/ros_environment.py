"""The environment with ROS 2 from PyPI and our interface packages, which ``make ros2`` makes."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import NoReturn

import pytest

ROOT = Path(__file__).parents[1]


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
    kept = {name: value for name, value in os.environ.items() if name not in dropped}
    own = {"ROS_DOMAIN_ID": str(os.getpid() % 100), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    return {**kept, **own, **more}


def ros_python() -> Path:
    """Return the Python of that environment, or skip the test."""
    named = os.environ.get("BIOSCARA_ROS2_PYTHON")
    python = Path(named) if named else ROOT / ".venv-ros2" / "bin" / "python"
    if not python.exists():
        absent("no environment with ROS 2 from PyPI: `make ros2` makes it, on x86-64")
    return python


def absent(what: str) -> NoReturn:
    """Skip a test for a missing part of this computer; fail where it must have that, as in CI."""
    if os.environ.get("CI") and platform.machine() == "x86_64":
        pytest.fail(f"not to be skipped in CI: {what}")
    pytest.skip(what)
