"""The images of the joints, built once however many test processes want them."""

from __future__ import annotations

import fcntl
import shutil
import subprocess
from pathlib import Path

import pytest

FIRMWARE = Path(__file__).parents[2] / "firmware"


@pytest.fixture(scope="session")
def images() -> str:
    """Build the images as ``make firmware`` does; return the output of the build."""
    if shutil.which("make") is None or shutil.which("arm-none-eabi-g++") is None:
        pytest.skip(
            "make and arm-none-eabi-g++ build the images (Debian: gcc-arm-none-eabi, "
            "libnewlib-arm-none-eabi, libstdc++-arm-none-eabi-newlib)"
        )
    (FIRMWARE / "build").mkdir(exist_ok=True)
    # One process builds; the others wait, and then find the images up to date.
    with (FIRMWARE / "build" / "tests.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        built = subprocess.run(
            ["make", "--no-print-directory", "-C", str(FIRMWARE / "joint")],
            check=False,
            capture_output=True,
            text=True,
            timeout=110,
        )
    assert built.returncode == 0, built.stdout + built.stderr
    return built.stdout
