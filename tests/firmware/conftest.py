"""The images that the emulator runs are built once, as `make firmware` builds them."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def images() -> None:
    if shutil.which("arm-none-eabi-g++") is None:
        pytest.skip("no arm-none-eabi-g++: on Debian and Ubuntu, apt install gcc-arm-none-eabi")
    built = subprocess.run(
        ["make", "--no-print-directory", "-C", str(ROOT / "firmware" / "joint")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout + built.stderr
