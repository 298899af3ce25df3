"""Start-up: importing the package and asking for help."""

from __future__ import annotations

import statistics
import subprocess
import sys

from benchmarks.measure import Row, seconds

REPEAT = 9


def _process(*arguments: str) -> float:
    def run() -> None:
        subprocess.run([sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL)

    run()  # the first start reads from disk
    return seconds(run, repeat=REPEAT)


def rows() -> list[Row]:
    """Measure whole processes, medians, each against an empty one in the same run."""
    empty = _process("-c", "pass")
    numpy = _process("-c", "import numpy")
    bioscara = _process("-c", "import bioscara")
    # Interleaved so that a busy machine slows both alike.
    extra = statistics.median(
        _process("-m", "bioscara", "--help") - _process("-c", "pass") for _ in range(3)
    )
    ratio = (bioscara - empty) / (numpy - empty)
    return [
        Row(
            "`import bioscara`",
            f"{ratio:.2f} times `import numpy`",
            f"numpy {1e3 * (numpy - empty):.0f} ms",
            "at most 1.5 times",
            ratio <= 1.5,
        ),
        Row(
            "`bioscara --help`",
            f"{1e3 * extra:.0f} ms more than an empty Python",
            f"empty Python {1e3 * empty:.0f} ms",
            "at most 300 ms more",
            extra <= 0.3,
        ),
    ]
