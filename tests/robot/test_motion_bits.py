"""Plans are the same to the bit with every processor: tools/motion_bits.py prints their sums."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "tools/motion_bits.py"
COUNT = 3

FEATURES = """
from numpy._core import _multiarray_umath as numpy
print(*(name for name in numpy.__cpu_dispatch__ if numpy.__cpu_features__[name]))
"""


def run(*words: str, **environment: str) -> str:
    """Return the output of a program."""
    inherited = {name: value for name, value in os.environ.items() if "OPENBLAS" not in name}
    return subprocess.run(
        [sys.executable, *words],
        env=inherited | environment,
        capture_output=True,
        check=True,
        text=True,
    ).stdout


@pytest.fixture(scope="module")
def plans() -> str:
    """The plans of this computer."""
    found = run(str(PROGRAM), str(COUNT))
    assert len(found.splitlines()) == 6 * COUNT
    return found


@pytest.mark.parametrize("kernel", ["Prescott", "Haswell"])
def test_the_kernel_of_the_linear_algebra_changes_no_bit(plans: str, kernel: str) -> None:
    assert run(str(PROGRAM), str(COUNT), OPENBLAS_CORETYPE=kernel) == plans


def test_the_vector_unit_changes_no_bit(plans: str) -> None:
    features = run("-c", FEATURES).strip()
    if not features:
        pytest.skip("NumPy uses nothing of this processor that older ones do not have")
    assert run(str(PROGRAM), str(COUNT), NPY_DISABLE_CPU_FEATURES=features) == plans
