"""Start-up: importing the package and asking for help."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

from benchmarks.measure import Row, at_most, medians


def process(*arguments: str) -> Callable[[], object]:
    """Return a function that runs a Python program to its end."""
    return lambda: subprocess.run(
        [sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL
    )


def rows() -> list[Row]:
    """Measure whole processes."""
    programs = (
        process("-c", "pass"),
        process("-c", "import numpy"),
        process("-c", "import bioscara"),
        process("-m", "bioscara", "--help"),
    )
    for program in programs:
        program()  # the first start reads from disk
    empty, numpy, bioscara, shown = medians(*programs, rounds=15)
    return [
        at_most("`import bioscara`", bioscara - empty, 0.5, numpy - empty, "`import numpy`"),
        at_most("`bioscara --help`, the whole process", shown, 4, empty, "an empty Python"),
    ]
