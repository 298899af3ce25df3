"""The environment with ROS 2 from PyPI, and our interface packages built in it."""

from __future__ import annotations

import fcntl
import hashlib
import os
import platform
import shutil
import subprocess
from pathlib import Path
from typing import NoReturn

import pytest

ROOT = Path(__file__).parents[1]
CACHE = ROOT / ".cache" / "ros-interfaces"


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
    if shutil.which("g++") is None:
        absent("no C++ compiler: on Debian and Ubuntu, apt install g++")
    return python


def absent(what: str) -> NoReturn:
    """Skip a test for a missing part of this computer; fail where it must have that, as in CI."""
    if os.environ.get("CI") and platform.machine() == "x86_64":
        pytest.fail(f"not to be skipped in CI: {what}")
    pytest.skip(what)


def built_interfaces(python: Path) -> Path:
    """Build the interface packages, once for the same inputs, by whichever process comes first.

    Args:
        python: Python of an environment with the ROS wheels.

    Returns:
        A folder with the packages, for PYTHONPATH.
    """
    versions = subprocess.run(
        [python, "-c", "import importlib.metadata as m, sys\n"
         "print(m.version('ros-rclpy'), sys.implementation.cache_tag)"],
        check=True, capture_output=True, env=ros_environment(),
    ).stdout  # fmt: skip
    digest = hashlib.sha256(versions)
    inputs = [ROOT / "interfaces/generate.py", *(ROOT / "interfaces/definitions").glob("*/*/*")]
    for path in sorted(inputs):
        digest.update(f"{path.relative_to(ROOT)}\n".encode() + path.read_bytes())
    folder = CACHE / digest.hexdigest()[:16]
    CACHE.mkdir(parents=True, exist_ok=True)
    with (CACHE / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            begun = folder.with_suffix(".begun")
            shutil.rmtree(begun, ignore_errors=True)
            subprocess.run(
                [python, ROOT / "interfaces/generate.py", begun],
                check=True, env=ros_environment(),
            )  # fmt: skip
            begun.rename(folder)
    return folder
